"""The host of one formulation: the process that it lives in, and what the judge has sent there.

Rules: a question waits in a queue until its answer is needed, so that a pairing and the forces on it take one round
trip. What the judge has sent stays there until it is pushed out. A process that ended is started anew at the next
question.
"""

from collections import Counter, OrderedDict
from collections.abc import Mapping
from math import inf
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import psutil

from contactverif.contract.arrays import Array
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError, one_line
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.isolation import wire
from contactverif.isolation.box import ATTEMPTS
from contactverif.isolation.limits import Limits
from contactverif.isolation.lockstep import wait_in_lockstep
from contactverif.isolation.process import PINNING, NoBoxError, PluginProcess, Question, end_marked

# A process starts in about a second. After so many ends the formulation is not asked any more, or after so many if it
# has never returned forces or a solution.
_MOST_ENDS, _MOST_ENDS_AT_FIRST = 60, 3
# The calls without an answer after which a formulation is not asked any more, in all of its processes, and why. One of
# a method that never answered, and an import, count for as many, since they take five times as long.
_AT_IMPORT, _AT_FIRST = 100, 10
_MOST_HANGS = {
    _AT_IMPORT: "no answer came while it was imported",
    _AT_FIRST: "no answer came to the first call of a method",
    2: "no answer came twice",
}
_LEAST_MEMORY = 1 << 30  # Bytes. With less, processes that were not asked for long make room for a new one.
_SHELF = 256  # The number of interfaces, and of pairings of the judge, that a process keeps for further questions.
_LARGE = 1 << 16  # Bytes. A pairing of the judge with more is sent anew for each question, and not kept here.
_FORGET = 64  # The number of what can be forgotten before the process is told.
_TOGETHER = 1 << 16  # Bytes. So much fits into a socket, so the judge never waits to send while the process does, too.
# Questions go together if those of the last message took at most this share of their limit of time, or this share for
# each of them. So the few of one case stay within the limit, and the many in lockstep are asked again if they do not.
_QUICK, _QUICK_EACH = 1 / 32, 1 / (2 * wire.MOST_QUESTIONS)


class Host:
    """The process of one formulation, started when it is needed, and again when it has ended."""

    def __init__(self, command: tuple[str, ...], name: str, limits: Limits, *, second: bool) -> None:
        self._command, self._name, self._limits, self._second = command, name, limits, second
        self._key = command, name, limits
        self._process: PluginProcess | None = None
        self._shelf: OrderedDict[int, tuple[Any, int]] = OrderedDict()
        # One list, so that an interrupt leaves no request whose question is missing.
        self._queue: list[tuple[wire.Request | wire.Solve, Question | None]] = []
        self._forgotten: list[int] = []
        self._number = 0
        self._last_words = b""
        self._known_verbs: set[str] = set()  # The methods that this process was asked.
        self._first_seconds: dict[str, float] = {}  # The time that the first call of each method took in any process.
        self._is_quick = False  # All questions of the last message were answered quickly.
        self.opaque: bool | None = None  # Pairings have a handle, which stays there; None until the first one is known.
        self.n_ended = 0  # Ends before it was told to.
        self.n_started = 0
        self.code_files_there: list[Path] = []  # Those of its process in another process of the judge.
        self.last_question = 0.0  # By the clock of `time.monotonic`.
        self._loading: Question | None = None  # It is sent, and its answer was not waited for.
        self._load_began = 0.0  # By the same clock.

    def begin_load(self) -> None:
        """Start the process anew and let it load the formulation, until `load` waits for that."""
        self.end()
        reason = next((words for least, words in _MOST_HANGS.items() if _hangs[self._key] >= least), "")
        answered = self._first_seconds.keys() & {"residual", "residual_and_tangent", "solve"}
        if reason or self.n_ended >= (_MOST_ENDS if answered else _MOST_ENDS_AT_FIRST):
            raise PluginError(reason or f"its process ended {self.n_ended} times", "not asked")
        _make_room(self._name)
        self._process = PluginProcess(self._command, self._limits, second=self._second)
        self.n_started += 1
        for store in (self._shelf, self._queue, self._forgotten, self._known_verbs):
            store.clear()
        request = wire.Load(self._next_number(), self._name)
        self._loading, self._load_began = self._put("import", request), monotonic()
        self._process.send_ahead(wire.join([wire.encode(request)]))

    def load(self) -> wire.Reply:
        """Let the process load the formulation, after a new start unless it does so already; return what that gave."""
        n_ended = self.n_ended
        for _ in range(ATTEMPTS):
            if self._loading is None:
                self.begin_load()
            question, self._loading = self._loading, None
            self._flush_queue()
            if not isinstance(question and question.answer, NoBoxError):
                break
            self.n_ended = n_ended
        assert question is not None
        return raise_failure(question)

    def make(self, penalty: float) -> tuple[int, int]:
        """Make a formulation there, and return its number and the number of the process."""
        if self._process is None:
            wait_in_lockstep(lambda: False)  # A call in lockstep starts no process: all begin anew, one after another.
            if not isinstance(self.load(), wire.Loaded):
                raise PluginError("import: it loaded before, and does not any more", "channel")
        self._queue.append((wire.Make(self._next_number(), penalty), None))
        return self._number, self.n_started

    def _next_number(self) -> int:
        self._number += 1
        return self._number

    def _put(self, verb: str, request: wire.Load | wire.Ask | wire.Solve, size: int = 0) -> Question:
        question = Question(request.question, verb, size)
        self._queue.append((request, question))
        return question

    @property
    def code_files(self) -> list[Path]:
        """The files whose compiled code its process has loaded, or its process in another process of the judge."""
        return self.code_files_there if self._process is None else self._process.code_files

    @property
    def has_process(self) -> bool:
        """Return whether there is a process now."""
        return self._process is not None

    def is_alive(self, started: int) -> bool:
        """Return whether the process of this number is still the one that answers."""
        return self._process is not None and started == self.n_started

    def forget(self, number: int, started: int) -> None:
        """Forget what is kept under a number, if the process is still the same."""
        if self.is_alive(started):
            self._forgotten.append(number)

    def ask(
        self,
        verb: str,
        formulation: int,
        interface: Interface,
        pairing: Pairing | int | None,
        z: Array | None,
        *,
        timed: bool = False,
        counted: bool = False,
    ) -> Question:
        """Put a question into the queue and return it. `timed`: its call is timed, a short one when it is repeated.

        `counted`: the methods that run in it are counted. The pairing may be the number under which the process keeps
        one of its answers.
        """
        of_interface = self._share(interface)
        of_pairing = self._share(pairing) if isinstance(pairing, Pairing) else pairing
        packed = None if z is None else wire.PackedArray.pack(z)
        ask = wire.Ask(self._next_number(), verb, formulation, of_interface, of_pairing, packed, timed, counted)
        return self._put(verb, ask, 0 if z is None else z.size)

    def solve(self, arrays: Mapping[str, Array]) -> wire.Solved:
        """Let the engine solve a scene, after a new start where its process has ended."""
        if self._process is None:
            self.load()
        packed = {name: wire.PackedArray.pack(array) for name, array in arrays.items()}
        question = self._put("solve", wire.Solve(self._next_number(), packed), sum(map(np.size, arrays.values())))
        self.flush()
        reply = raise_failure(question)
        if not isinstance(reply, wire.Solved):
            raise PluginError("solve: another reply than a solution", "channel")
        return reply

    def _share(self, item: Interface | Pairing) -> int:
        """Return the number of something there, after a request to keep it if it is not there."""
        if id(item) in self._shelf:
            self._shelf.move_to_end(id(item))
            return self._shelf[id(item)][1]
        if isinstance(item, Pairing):
            # This may ask, so it comes first.
            arrays = {name: wire.PackedArray.pack(array) for name, array in item.items()}
            self._queue.append((wire.SharePairing(self._next_number(), arrays), None))
            if sum(len(array.data) for array in arrays.values()) > _LARGE:
                self._forgotten.append(self._number)
                return self._number
        else:
            meshes = item.nodes, item.slave.faces, item.master.faces
            self._queue.append((wire.ShareInterface(self._next_number(), *map(wire.PackedArray.pack, meshes)), None))
        self._shelf[id(item)] = item, self._number
        if len(self._shelf) > _SHELF:
            _, (_, oldest) = self._shelf.popitem(last=False)
            self._forgotten.append(oldest)
        return self._number

    def flush(self) -> None:
        """Give each question in the queue its answer."""
        if not wait_in_lockstep(self._has_answered):
            self._flush_queue()

    def _has_answered(self) -> bool:
        """Flush the queue of calls in lockstep; no end of the process counts, since each is asked again alone."""
        n_ended, n_hangs = self.n_ended, _hangs[self._key]
        try:
            return self._flush_queue()
        finally:
            self.n_ended, _hangs[self._key] = n_ended, n_hangs

    def _flush_queue(self) -> bool:
        """Send what waits in the queue, give each question its answer, and return whether the process has answered."""
        self.last_question = monotonic()
        waiting, self._queue = self._queue, []
        questions = [question for _, question in waiting if question is not None]
        if len(self._forgotten) > _FORGET:
            waiting.append((wire.Forget(self._forgotten), None))  # At the end, for a question that waits may need it.
            self._forgotten = []
        process = self._process
        is_answered = process is None and not questions
        failure = PluginError(f"{questions[0].verb if questions else ''}: its process has ended", "channel")
        try:
            if process is not None:
                self._exchange(process, waiting)
                is_answered = True
        except PluginError as error:
            failure = error
            self.n_ended += 1
            if error.cause == "hang":
                verb = next((question.verb for question in questions if question.answer is None), "")
                answered = verb in self._first_seconds
                _hangs[self._key] += _AT_IMPORT if verb == "import" else 1 if answered else _AT_FIRST
            self.read_last_words()
            self._process = None
        except BaseException:  # The process is ended, see `PluginProcess.ask`, and nobody is to blame.
            failure = PluginError("the question was interrupted", "not asked")
            self._process = None
            raise
        finally:
            for question in questions:
                question.answer = question.answer or failure
        return is_answered

    def _exchange(
        self, process: PluginProcess, waiting: list[tuple[wire.Request | wire.Solve, Question | None]]
    ) -> None:
        """Send requests and receive the answers: together what is small and quick, else one question after another.

        A first call may take longer, by as much as the same one took in an earlier process.
        """
        verbs = {question.verb for _, question in waiting if question is not None}
        most = wire.MOST_QUESTIONS if self._is_quick and verbs <= self._known_verbs else 1
        messages: list[tuple[list[bytes], list[Question]]] = [([], [])]
        size = 0
        for request, question in waiting:
            frame = wire.encode(request)
            frames, questions = messages[-1]
            is_full = question is not None and len(questions) >= most
            if frames and (is_full or size + len(frame) > _TOGETHER):
                frames, questions, size = [], [], 0
                messages.append((frames, questions))
            frames.append(frame)
            size += len(frame)
            questions += [question] if question is not None else []
        for frames, questions in messages:
            limit, start, verb = self._limits.seconds, monotonic(), questions[0].verb if questions else ""
            if verb not in self._known_verbs:
                limit = min(limit + self._first_seconds.get(verb, inf), self._limits.start_seconds)
            process.ask(wire.join(frames), questions, limit)
            seconds = monotonic() - (self._load_began if verb == "import" else start)
            if questions:
                self._is_quick = seconds <= max(_QUICK, _QUICK_EACH * len(questions)) * self._limits.seconds
                self._known_verbs.add(verb)
                self._first_seconds.setdefault(verb, seconds)

    def read_last_words(self) -> bytes:
        """Return the end of what the process has printed, or the one before it."""
        if self._process is not None:
            self._last_words = self._process.output.last or self._last_words
        return self._last_words

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.end()
            self.read_last_words()
            self._process = None
        self._loading = None


def answer_of(question: Question) -> wire.Answer:
    """Return the answer to a question, or raise the ContractError that came instead of it."""
    answer = question.answer
    if not isinstance(answer, wire.Answer):
        raise_failure(question)
        raise PluginError(f"{question.verb}: the reply of an engine", "channel")
    return answer


def raise_failure(question: Question) -> wire.Reply:
    """Return the reply to a question, or raise the ContractError that it tells of; a MisuseError is its cause."""
    reply = question.answer
    assert reply is not None
    if isinstance(reply, PluginError):
        raise PluginError(str(reply), reply.cause, ended=reply.ended)
    if not isinstance(reply, wire.Failure):
        return reply
    words = [one_line(text) for text in reply.words[:3]] or ["no words"]
    match reply.kind:
        case "misuse" if len(words) == 3:
            error = MisuseError(*words)
            raise ContractError(str(error)) from error
        case "plugin":
            raise PluginError(words[0], reply.cause if reply.cause in ("memory", "exit") else "exception")
        case "not finite":
            raise NonFiniteError(words[0])
    raise ContractError(words[0])


_HOSTS: dict[tuple[tuple[str, ...], str, Limits, bool], Host] = {}
_foreign_words: dict[str, bytes] = {}
# How often no answer came from each formulation, in all of its processes that this process of the judge knows of.
_hangs: Counter[tuple[tuple[str, ...], str, Limits]] = Counter()


def host_of(command: tuple[str, ...], name: str, limits: Limits, *, second: bool = False) -> Host:
    """Return the host of a formulation in this process of the judge."""
    key = command, name, limits, second
    if key not in _HOSTS:
        _HOSTS[key] = Host(command, name, limits, second=second)
    return _HOSTS[key]


def _make_room(name: str) -> None:
    """End the longest idle processes, for memory; not those of this formulation, whose pairings a case may hold."""
    others = [host for (_, other, _, _), host in _HOSTS.items() if other != name and host.has_process]
    for host in sorted(others, key=lambda host: host.last_question):
        if psutil.virtual_memory().available >= _LEAST_MEMORY:
            return
        host.end()


def last_words() -> dict[str, bytes]:
    """Return the end of what the processes of this process's hosts have printed, by the name of the formulation."""
    words = {name: host.read_last_words() for (_, name, _, _), host in _HOSTS.items()}
    return {name: printed for name, printed in words.items() if printed}


def note_last_words(words: Mapping[str, bytes]) -> None:
    """Keep what plugins have printed whose processes belong to another process of the judge."""
    _foreign_words.update(words)


def hangs() -> Counter[tuple[tuple[str, ...], str, Limits]]:
    """Return how often no answer came from each formulation, for other processes of the judge."""
    return _hangs


def note_hangs(known: Counter[tuple[tuple[str, ...], str, Limits]]) -> None:
    """Take over what another process of the judge knows of formulations that do not answer."""
    _hangs.update(known - _hangs)  # The larger one of both numbers.


def end_all() -> dict[str, bytes]:
    """End the processes of all plugins, and return the last words that those of each name printed."""
    for host in _HOSTS.values():
        host.end()
    PINNING.let_go()
    if _HOSTS:
        end_marked()
    printed = last_words() | _foreign_words
    _HOSTS.clear()
    _foreign_words.clear()
    _hangs.clear()
    return printed
