"""The host of one formulation: the process that it lives in, and what the judge has sent there.

Rules for the next editor: a question waits in a queue until its answer is needed, so that a pairing and the forces on
it take one way there and back. What the judge has sent stays there until it is pushed out. A process that ended is
started anew at the next question.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from time import monotonic
from typing import Any

import psutil

from contactverif.contract.arrays import Array
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError
from contactverif.contract.foreign_text import one_line
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
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
    Run,
    Share,
    SharePairing,
    Words,
    encode,
    pack_array,
)
from contactverif.isolation.one_core import JUDGE
from contactverif.isolation.process import PluginProcess, end_marked

_MOST_ENDS = 60  # A process starts in about a second. After so many ends the formulation is not asked any more.
_MOST_HANGS = 5  # After so many calls without an answer neither.
_LEAST_MEMORY = 1 << 30  # Bytes. With less, processes that were not asked for long make room for a new one.
_SHELF = 256  # The number of interfaces and pairings that a process keeps for further questions.
_FORGET = 64  # The number of what can be forgotten before the process is told.
_QUEUE = 16  # The number of questions that wait.
_TOGETHER = 1 << 16  # Bytes. So much fits into a socket, so the judge never waits to send while the process does, too.


class Question:
    """A question that was asked, and its answer once it is there."""

    __slots__ = ("answer", "verb")

    def __init__(self, verb: str) -> None:
        self.verb = verb
        self.answer: Reply | PluginError | None = None

    def result(self) -> Answer:
        """Return the answer.

        Raises
        ------
        ContractError
            If the plugin made an error, or its process ended.
        """
        match self.answer:
            case Answer() as answer:
                return answer
            case PluginError() as error:
                raise PluginError(str(error), error.cause, ended=error.ended)
            case Failure() as failure:
                raise_failure(failure)
        raise PluginError(f"{self.verb}: a {type(self.answer).__name__} where an answer was needed", "channel")


class Host:
    """The process of one formulation, started when it is needed, and again when it has ended.

    Parameters
    ----------
    loader : str
        The function that loads a formulation of a name there, as ``"module:function"``.
    name : str
        The name of the formulation.
    limits : Limits
        The limits of the process.
    second : bool
        The process differs from the first one in its hash seed and its number of threads.

    Attributes
    ----------
    methods : frozenset[str]
        The optional methods that the formulation has, once it is loaded.
    n_ended, n_hangs : int
        The number of times that the process ended before it was told to, and of those because no answer came.
    n_started : int
        The number of times that it was started.
    opaque : bool | None
        Pairings have a handle, which stays in the process; None until the first one is known.
    last_question : float
        The time of the last question, by the clock of `time.monotonic`.
    """

    def __init__(self, loader: str, name: str, limits: Limits, *, second: bool) -> None:
        self._load = Load(loader, name)
        self._limits, self._second = limits, second
        self._process: PluginProcess | None = None
        self._shelf: OrderedDict[int, tuple[Any, int]] = OrderedDict()
        self._queue: list[Request] = []
        self._questions: list[Question] = []
        self._forgotten: list[int] = []
        self._number = 0
        self.methods: frozenset[str] = frozenset()
        self.opaque: bool | None = None
        self.n_ended = self.n_hangs = self.n_started = 0
        self._last_words = b""
        self.last_question = 0.0

    def load(self) -> Reply:
        """Start the process anew, and return what loading the formulation gave."""
        self.end()
        return self._start()

    def _start(self) -> Reply:
        """Start the process, load the formulation, and return what that gave."""
        if self.n_ended >= _MOST_ENDS or self.n_hangs >= _MOST_HANGS:
            words = f"no answer came {self.n_hangs} times" if self.n_hangs >= _MOST_HANGS else ""
            raise PluginError(words or f"its process ended {self.n_ended} times", "not asked")
        _make_room(self._load.name)
        self._process = PluginProcess(self._limits, second=self._second)
        self.n_started += 1
        for store in (self._shelf, self._queue, self._questions, self._forgotten):
            store.clear()
        question = Question("import")
        self._queue.append(self._load)
        self._questions.append(question)
        self.flush()
        if isinstance(question.answer, Failure):
            raise_failure(question.answer, loading=True)
        if isinstance(question.answer, PluginError):
            question.result()
        assert question.answer is not None
        assert not isinstance(question.answer, PluginError)
        if isinstance(question.answer, Loaded):
            self.methods = frozenset(question.answer.provides)
        return question.answer

    def make(self, penalty: float) -> tuple[int, int]:
        """Make a formulation there, and return its number and the number of the process."""
        if self._process is None:
            self._start_again()
        self._number += 1
        self._queue.append(Make(self._number, penalty))
        return self._number, self.n_started

    def _start_again(self) -> None:
        if not isinstance(self._start(), Loaded):
            raise PluginError("import: it loaded before, and does not any more", "channel")

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
        self, verb: str, formulation: int, interface: Interface, pairing: Pairing | None, z: Array | None
    ) -> tuple[Question, int]:
        """Put a question into the queue; return it, and the number under which the process keeps its answer.

        Only pairings are kept.
        """
        if len(self._questions) >= _QUEUE:
            self.flush()
        of_interface = self._share(interface)
        of_pairing = None if pairing is None else self._share(pairing)
        self._number += 1
        question = Question(verb)
        packed = None if z is None else pack_array(z)
        self._queue.append(Ask(verb, formulation, of_interface, of_pairing, packed, self._number))
        self._questions.append(question)
        return question, self._number

    def run(self, verb: str, function: str, words: bytes) -> bytes:
        """Call a function of the harness (``"module:function"``) there, and return its words.

        The function gets the formulation and `words`. The call has the time limit of one call, and `verb` names it.

        Raises
        ------
        ContractError
            If the plugin made an error, or its process ended.
        """
        if self._process is None:
            self._start_again()
        self.flush()
        question = Question(verb)
        self._queue.append(Run(function, words))
        self._questions.append(question)
        self.flush()
        if isinstance(question.answer, Words):
            return question.answer.words
        question.result()
        raise PluginError(f"{verb}: an answer to another question", "channel")

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
        arrays = dict(item) if isinstance(item, Pairing) else None  # This may ask, so it comes before the number.
        self._number += 1
        number = self._number
        if arrays is not None:
            self._queue.append(SharePairing(number, {name: pack_array(array) for name, array in arrays.items()}))
        else:
            assert isinstance(item, Interface)
            meshes = item.nodes, item.slave.segments, item.master.segments
            self._queue.append(Share(number, *map(pack_array, meshes)))
        self.keep(item, number)
        return number

    def flush(self) -> None:
        """Send what waits in the queue, and give each question its answer."""
        self.last_question = monotonic()
        requests, questions = self._queue, self._questions
        self._queue, self._questions = [], []
        if len(self._forgotten) > _FORGET:
            requests.append(Forget(self._forgotten))  # At the end, for a question that waits may need it.
            self._forgotten = []
        if self._process is None:
            ended = PluginError(f"{questions[0].verb}: its process has ended", "channel") if questions else None
            for question in questions:
                question.answer = ended
            return
        try:
            self._exchange(requests, questions)
        except PluginError as error:
            for question in questions:
                question.answer = error if question.answer is None else question.answer
            self.n_ended += 1
            self.n_hangs += error.cause == "hang"
            self.read_last_words()
            self._process = None

    def _exchange(self, requests: Sequence[Request], questions: Sequence[Question]) -> None:
        """Send requests and receive the answers: all together if they are small, else each answer before the next."""
        assert self._process is not None
        frame = encode(requests)
        if len(frame) <= _TOGETHER:
            self._answer(questions, self._process.ask(frame, [question.verb for question in questions]))
            return
        unanswered = iter(questions)
        for request in requests:
            waiting = [next(unanswered)] if isinstance(request, Ask | Load | Run) else []
            self._answer(waiting, self._process.ask(encode([request]), [question.verb for question in waiting]))

    @staticmethod
    def _answer(questions: Sequence[Question], replies: Sequence[Reply]) -> None:
        for question, reply in zip(questions, replies, strict=True):
            question.answer = reply

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


def raise_failure(failure: Failure, *, loading: bool = False) -> None:
    """Raise the error that a plugin's process has told of. Only while it loads may it blame the user."""
    words = [one_line(text) for text in failure.words[:3]] or ["no words"]
    if failure.kind == "misuse" and loading and len(words) == 3:
        raise MisuseError(*words)
    if failure.kind == "plugin":
        raise PluginError(words[0], failure.cause if failure.cause in ("memory", "exit") else "exception")
    if failure.kind == "not finite":
        raise NonFiniteError(words[0])
    raise ContractError(words[0])


_HOSTS: dict[tuple[str, str, Limits, bool], Host] = {}
_foreign_words: dict[str, bytes] = {}


def host_of(loader: str, name: str, limits: Limits, *, second: bool = False) -> Host:
    """Return the host of a formulation in this process of the judge."""
    key = loader, name, limits, second
    if key not in _HOSTS:
        _HOSTS[key] = Host(loader, name, limits, second=second)
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
