"""The host of one formulation: the process that it lives in, and what the judge has sent there.

Rules: a question waits in a queue until its answer is needed, so that a pairing and the forces on it take one round
trip. What the judge has sent stays there until it is pushed out. A process that ended is started anew at the next
question.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from time import monotonic
from typing import Any

import psutil

from contactverif.contract.arrays import Array
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError
from contactverif.contract.foreign_text import one_line
from contactverif.contract.interface import Interface
from contactverif.contract.pairing import Pairing
from contactverif.isolation.limits import Limits
from contactverif.isolation.messages import (
    Answer,
    Ask,
    Failure,
    Forget,
    Load,
    Loaded,
    Make,
    Reply,
    Request,
    ShareInterface,
    SharePairing,
    encode,
)
from contactverif.isolation.one_core import JUDGE
from contactverif.isolation.packed import PackedArray
from contactverif.isolation.process import PluginProcess, Question, end_marked

_MOST_ENDS = 60  # A process starts in about a second. After so many ends the formulation is not asked any more.
_MOST_HANGS = 5  # After so many calls without an answer neither.
_LEAST_MEMORY = 1 << 30  # Bytes. With less, processes that were not asked for long make room for a new one.
_SHELF = 256  # The number of interfaces and pairings that a process keeps for further questions.
_FORGET = 64  # The number of what can be forgotten before the process is told.
_QUEUE = 16  # The number of questions that wait.
_TOGETHER = 1 << 16  # Bytes. So much fits into a socket, so the judge never waits to send while the process does, too.


class Host:
    """The process of one formulation, started when it is needed, and again when it has ended."""

    def __init__(self, command: tuple[str, ...], name: str, limits: Limits, *, second: bool) -> None:
        self._command, self._name, self._limits, self._second = command, name, limits, second
        self._process: PluginProcess | None = None
        self._shelf: OrderedDict[int, tuple[Any, int]] = OrderedDict()
        self._queue: list[Request] = []
        self._questions: list[Question] = []
        self._forgotten: list[int] = []
        self._number = 0
        self._last_words = b""
        self.opaque: bool | None = None  # Pairings have a handle, which stays there; None until the first one is known.
        self.n_ended = self.n_hangs = 0  # Ends before it was told to, and those of them because no answer came.
        self.n_started = 0
        self.last_question = 0.0  # By the clock of `time.monotonic`.

    def load(self) -> Reply:
        """Start the process anew, load the formulation, and return what that gave."""
        self.end()
        if self.n_ended >= _MOST_ENDS or self.n_hangs >= _MOST_HANGS:
            words = f"no answer came {self.n_hangs} times" if self.n_hangs >= _MOST_HANGS else ""
            raise PluginError(words or f"its process ended {self.n_ended} times", "not asked")
        _make_room(self._name)
        self._process = PluginProcess(self._command, self._limits, second=self._second)
        self.n_started += 1
        for store in (self._shelf, self._queue, self._questions, self._forgotten):
            store.clear()
        question = self._put("import", Load(self._next_number(), self._name))
        self.flush()
        return raise_failure(question.result, loading=True)

    def make(self, penalty: float) -> tuple[int, int]:
        """Make a formulation there, and return its number and the number of the process."""
        if self._process is None and not isinstance(self.load(), Loaded):
            raise PluginError("import: it loaded before, and does not any more", "channel")
        self._queue.append(Make(self._next_number(), penalty))
        return self._number, self.n_started

    def _next_number(self) -> int:
        self._number += 1
        return self._number

    def _put(self, verb: str, request: Load | Ask) -> Question:
        self._queue.append(request)
        self._questions.append(Question(request.question, verb))
        return self._questions[-1]

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
        pairing: Pairing | None,
        z: Array | None,
        *,
        timed: bool = False,
    ) -> Question:
        """Put a question into the queue and return it. `timed`: its call is timed, a short one when it is repeated."""
        if len(self._questions) >= _QUEUE:
            self.flush()
        of_interface = self._share(interface)
        of_pairing = None if pairing is None else self._share(pairing)
        packed = None if z is None else PackedArray.pack(z)
        return self._put(verb, Ask(self._next_number(), verb, formulation, of_interface, of_pairing, packed, timed))

    def keep(self, item: Interface | Pairing, number: int) -> None:
        """Note that the process keeps something under a number."""
        self._shelf[id(item)] = item, number
        if len(self._shelf) > _SHELF:
            _, (_, oldest) = self._shelf.popitem(last=False)
            self._forgotten.append(oldest)

    def _share(self, item: Interface | Pairing) -> int:
        """Return the number of something there, after a request to keep it if it is not there."""
        if id(item) in self._shelf:
            self._shelf.move_to_end(id(item))
            return self._shelf[id(item)][1]
        if isinstance(item, Pairing):
            arrays = {name: PackedArray.pack(array) for name, array in item.items()}  # This may ask, so it comes first.
            self._queue.append(SharePairing(self._next_number(), arrays))
        else:
            meshes = item.nodes, item.slave.segments, item.master.segments
            self._queue.append(ShareInterface(self._next_number(), *map(PackedArray.pack, meshes)))
        self.keep(item, self._number)
        return self._number

    def flush(self) -> None:
        """Send what waits in the queue, and give each question its answer."""
        self.last_question = monotonic()
        requests, questions = self._queue, self._questions
        self._queue, self._questions = [], []
        if len(self._forgotten) > _FORGET:
            requests.append(Forget(self._forgotten))  # At the end, for a question that waits may need it.
            self._forgotten = []
        if self._process is None:
            for question in questions:
                question.answer = PluginError(f"{questions[0].verb}: its process has ended", "channel")
            return
        try:
            _exchange(self._process, requests, questions)
        except PluginError as error:
            for question in questions:
                question.answer = error if question.answer is None else question.answer
            self.n_ended += 1
            self.n_hangs += error.cause == "hang"
            self.read_last_words()
            self._process = None

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


def _exchange(process: PluginProcess, requests: list[Request], questions: list[Question]) -> None:
    """Send requests and receive the answers: all together if they are small, else each answer before the next."""
    frame = encode(requests)
    if len(frame) <= _TOGETHER:
        process.ask(frame, questions)
        return
    unanswered = iter(questions)
    for request in requests:
        process.ask(encode([request]), [next(unanswered)] if isinstance(request, Ask | Load) else [])


def answer_of(question: Question) -> Answer:
    """Return the answer to a question, or raise the ContractError that came instead of it."""
    answer = question.answer if isinstance(question.answer, Answer) else raise_failure(question.result)
    if not isinstance(answer, Answer):
        raise PluginError(f"{question.verb}: a {type(answer).__name__} where an answer was needed", "channel")
    return answer


def raise_failure(reply: Reply | PluginError, *, loading: bool = False) -> Reply:
    """Return a reply, or raise the error that it tells of. Only while it loads may a plugin blame the user."""
    if isinstance(reply, PluginError):
        raise PluginError(str(reply), reply.cause, ended=reply.ended)
    if not isinstance(reply, Failure):
        return reply
    words = [one_line(text) for text in reply.words[:3]] or ["no words"]
    match reply.kind:
        case "misuse" if loading and len(words) == 3:
            raise MisuseError(*words)
        case "plugin":
            raise PluginError(words[0], reply.cause if reply.cause in ("memory", "exit") else "exception")
        case "not finite":
            raise NonFiniteError(words[0])
    raise ContractError(words[0])


_HOSTS: dict[tuple[tuple[str, ...], str, Limits, bool], Host] = {}
_foreign_words: dict[str, bytes] = {}


def host_of(command: tuple[str, ...], name: str, limits: Limits, *, second: bool = False) -> Host:
    """Return the host of a formulation in this process of the judge."""
    key = command, name, limits, second
    if key not in _HOSTS:
        _HOSTS[key] = Host(command, name, limits, second=second)
    return _HOSTS[key]


def _make_room(name: str) -> None:
    """End the processes that were not asked for the longest time, until there is memory for another one.

    Each takes some hundred megabytes, and a run may have dozens. One that is asked again starts again. Those of the
    formulation of that name stay, since the case that is judged may hold a pairing there.
    """
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


def end_all() -> dict[str, bytes]:
    """End the processes of all plugins, and return the last words that those of each name printed."""
    for host in _HOSTS.values():
        host.end()
    JUDGE.let_go()
    if _HOSTS:
        end_marked()
    printed = last_words() | _foreign_words
    _HOSTS.clear()
    _foreign_words.clear()
    return printed
