"""A formulation in another process, with the methods of a plugin, and the subject that makes it.

Rule: it answers as the same plugin does in this process, but for a process that dies or hangs. A formulation whose
process ended is the same one in the next process.
"""

from __future__ import annotations

import weakref
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, compressed_matrix
from contactverif.contract.errors import ContractError, MisuseError, PluginError
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Interface
from contactverif.contract.pairing import Pairing
from contactverif.contract.subject import FAST_PARTS, OPTIONAL_PARTS, Call, Prefetching, Subject
from contactverif.contract.traits import Traits
from contactverif.isolation.box import Box
from contactverif.isolation.host import Host, answer_of, host_of
from contactverif.isolation.limits import Limits
from contactverif.isolation.mapped_code import list_libraries
from contactverif.isolation.messages import Answer
from contactverif.isolation.process import Question
from contactverif.isolation.remote_engine import RemoteEngineSubject

_COMPRESSED = ("csr", "csc")
_MOST_SECONDS = 1e9


class RemoteSubject(Subject):
    """A formulation that lives in a process of its own. It can be pickled."""

    def __init__(self, make: RemoteFactory) -> None:
        super().__init__(make.name, make)
        self._remote = make

    @property
    def host(self) -> Host:
        """The host in this process of the judge."""
        return self._remote.host

    @property
    def box(self) -> Box | None:
        """The box of its process; None if there is none."""
        return self._remote.limits.box

    def restart(self) -> Subject:
        """Return the same formulation in a second process."""
        return RemoteSubject(replace(self._remote, second=True))


def count_ends(subject: Subject) -> int:
    """Return how often the process of a formulation has ended before it was told to; 0 if it has none of its own."""
    return subject.host.n_ended if isinstance(subject, RemoteSubject | RemoteEngineSubject) else 0


def code_files(subject: Subject) -> list[Path]:
    """Return the files whose compiled code the process of a formulation has loaded; none if it has none of its own."""
    return subject.host.code_files if isinstance(subject, RemoteSubject | RemoteEngineSubject) else []


def note_code_files(subject: Subject, files: list[Path]) -> None:
    """Keep what the process of a formulation has loaded that belongs to another process of the judge."""
    if isinstance(subject, RemoteSubject | RemoteEngineSubject):
        subject.host.code_files_there = files


def places(subjects: Iterable[Subject]) -> dict[str, str]:
    """Return {attribute of the report: value}: where formulations lived, what was open to them, and their libraries."""
    facts: dict[str, set[str]] = {"isolation": set(), "opened": set(), "libraries": set()}
    for subject in subjects:
        remote = isinstance(subject, RemoteSubject | RemoteEngineSubject)
        box = subject.box if isinstance(subject, RemoteSubject | RemoteEngineSubject) else None
        facts["libraries"] |= set(list_libraries(code_files(subject)))
        inside = "process" if remote else "inline"
        facts["isolation"].add(inside if box is None else box.kind)
        facts["opened"] |= set(box.opened) if box is not None else set()
    return {name: "; ".join(sorted(values)) for name, values in facts.items() if values}


@dataclass(frozen=True)
class RemoteFactory:
    """A factory ``make(*, penalty)`` of a formulation that a program, `command`, has loaded by its name."""

    command: tuple[str, ...]
    name: str
    limits: Limits
    traits: Traits
    provides: frozenset[str]  # The optional methods that the plugin has.
    second: bool = False

    @property
    def host(self) -> Host:
        """The host in this process of the judge."""
        return host_of(self.command, self.name, self.limits, second=self.second)

    def __call__(self, *, penalty: float) -> RemoteFormulation:
        """Return the formulation with a penalty."""
        return RemoteFormulation(self, penalty)


class RemoteFormulation(Prefetching):
    """A formulation with one penalty in another process. Nothing that it answers is checked but its kind."""

    def __init__(self, make: RemoteFactory, penalty: float) -> None:
        self._make, self._penalty, self.traits = make, penalty, make.traits
        counted = self.traits.rules.enforcement == "multiplier"  # Else its process checks that there are none.
        for part in (*OPTIONAL_PARTS, *FAST_PARTS, "n_multipliers"):
            if part not in make.provides or (part == "n_multipliers" and not counted):
                setattr(self, part, None)
        self.timed = False  # True: the process times each call, and a short one when it is repeated.
        self.counted = False  # True: the process counts the methods that run in each call.
        self._number, self._started = 0, -1
        self._last: Question | None = None
        self._prefetched: deque[tuple[Call, Question]] = deque()

    @cached_property
    def _host(self) -> Host:
        return self._make.host

    def _ask(self, verb: str, interface: Interface, pairing: Pairing | None, z: Array | None) -> Question:
        host = self._host
        if not host.is_alive(self._started):
            self._number, self._started = host.make(self._penalty)
            weakref.finalize(self, host.forget, self._number, self._started)
        number = pairing.number_in(host) if isinstance(pairing, RemotePairing) else None
        of_pairing = pairing if number is None else number
        self._last = host.ask(verb, self._number, interface, of_pairing, z, timed=self.timed, counted=self.counted)
        return self._last

    def _answer(
        self, verb: str, interface: Interface, pairing: Pairing | None = None, z: Array | None = None
    ) -> Answer:
        question = self._take_prefetched(verb, interface, pairing) or self._ask(verb, interface, pairing, z)
        if question.answer is None:
            self._host.flush()
        if isinstance(pairing, RemotePairing):
            pairing.check()
        if not (self.timed or self.counted):
            self._last = None  # It would keep the answer.
        return answer_of(question)

    @contextmanager
    def prefetch(self, calls: Sequence[Call]) -> Iterator[None]:
        """Open a block in which these methods are called, in this order: they go to the process in one message."""
        try:
            for verb, interface, pairing, z in calls:
                if verb in self._make.provides or verb == "residual":
                    self._prefetched.append(((verb, interface, pairing, z), self._ask(verb, interface, pairing, z)))
            yield
        finally:
            self._prefetched.clear()

    def _take_prefetched(self, verb: str, interface: Interface, pairing: Pairing | None) -> Question | None:
        """Return the question that was asked ahead, if this is the next one of those."""
        if not self._prefetched:
            return None
        (next_verb, of_interface, of_pairing, _), question = self._prefetched[0]
        if next_verb != verb or of_interface is not interface or of_pairing is not pairing:
            return None
        self._last = question
        return self._prefetched.popleft()[1]

    def seconds(self) -> float:
        """Return the seconds that the last call, which was `timed`, took there.

        They hold neither the round trip nor any check. A plugin may say what it likes, within reason.
        """
        answer = self._last_answer()
        if not 0 <= answer.seconds <= _MOST_SECONDS:
            assert self._last is not None
            raise PluginError(f"{self._last.verb}: times that cannot be", "channel")
        return answer.seconds

    def calls(self) -> int:
        """Return the number of methods that ran in the last call, which was `counted`."""
        return self._last_answer().calls

    def _last_answer(self) -> Answer:
        assert self._last is not None
        self._host.flush()
        return answer_of(self._last)

    def n_multipliers(self, interface: Interface) -> int:
        """Return the number of multipliers."""
        return self._answer("n_multipliers", interface).count

    def pair(self, interface: Interface, z: FloatArray) -> Pairing:
        """Return the pairing at one state z (n_unknowns,). It is asked for together with the next question."""
        question = self._ask("pair", interface, None, z)
        return RemotePairing(self._host, question, interface)

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        """Return the forces (..., n_unknowns) at z (..., n_unknowns)."""
        arrays = _unpack("residual", self._answer("residual", interface, pairing, z))
        return _pick(arrays, "residual", "residual")

    def tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> Any:
        """Return the tangent (n_unknowns, n_unknowns), an array or a matrix of scipy.sparse."""
        return _tangent(_unpack("tangent", self._answer("tangent", interface, pairing, z)), "tangent", z.size)

    def residual_and_tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> tuple[Any, Any]:
        """Return residual (n_unknowns,) and tangent."""
        verb = "residual_and_tangent"
        arrays = _unpack(verb, self._answer(verb, interface, pairing, z))
        return _pick(arrays, verb, "residual"), _tangent(arrays, verb, z.size)

    def contact_points(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> ContactPoints:
        """Return the contact points."""
        arrays = _unpack("contact_points", self._answer("contact_points", interface, pairing, z))
        try:
            return ContactPoints(**arrays)
        except (MisuseError, TypeError) as error:
            raise ContractError(f"contact_points: {error}") from None


class RemotePairing(Pairing):
    """A pairing that the process of a plugin keeps. It comes here, and is checked, when it is looked into.

    The process keeps it as long as this object is there, and nobody here keeps more of it than this object.
    """

    __slots__ = ("_content", "_host", "_interface", "_question", "_started")

    def __init__(self, host: Host, question: Question, interface: Interface) -> None:
        self._host, self._question, self._interface, self._started = host, question, interface, host.n_started
        self._content: dict[str, Array] | None = None

    def __del__(self) -> None:
        self._host.forget(self._question.number, self._started)

    def number_in(self, host: Host) -> int | None:
        """Return the number under which the process of a host keeps it now; None if it does not."""
        return self._question.number if host is self._host and host.is_alive(self._started) else None

    @property
    def _arrays(self) -> dict[str, Array]:  # type: ignore[override]
        """Return the arrays, which come here when they are wanted for the first time."""
        if self._content is None:
            if self._question.answer is None:
                self._host.flush()
            answer = answer_of(self._question)
            whole = Pairing(_unpack("pair", answer))
            whole.check_bounds(self._interface)
            self.check()
            self._content = dict(whole)
            answer.arrays.clear()  # They are copies by now.
        return self._content

    @property
    def opaque(self) -> bool:
        """Return whether pairings of the plugin have a handle, which stay in its process."""
        if self._host.opaque is None:
            _ = self._arrays
        return bool(self._host.opaque)

    @property
    def handle(self) -> None:
        """Return None: the object is in the plugin's process."""

    def check(self) -> None:
        """Raise the error of the plugin, if it made one when it paired."""
        answer = answer_of(self._question)
        if self._host.opaque is None:
            self._host.opaque = answer.handle
        elif self._host.opaque is not answer.handle:
            raise ContractError("pair: returned a handle in some states, and none in others")

    def check_bounds(self, interface: Interface) -> None:
        """Do nothing: the bounds are checked where the plugin is, and once more when the pairing is looked into."""


def _unpack(verb: str, answer: Answer) -> dict[str, Array]:
    try:
        return {name: array.unpack() for name, array in answer.arrays.items()}
    except ValueError as error:
        raise ContractError(f"{verb}: {error}") from None


def _pick(arrays: dict[str, Array], verb: str, name: str) -> Array:
    if name not in arrays:
        raise ContractError(f"{verb}: an answer without its {name}")
    return arrays[name]


def _tangent(arrays: dict[str, Array], verb: str, size: int) -> Any:
    """Return the tangent (size, size), dense or in the format in which it came, with nothing checked but coo."""
    if "dense" in arrays:
        return arrays["dense"]
    kind = next((kind for kind in _COMPRESSED if f"{kind} data" in arrays), "coo")
    if kind != "coo":
        parts = (_pick(arrays, verb, f"{kind} {name}") for name in ("data", "indices", "indptr"))
        return compressed_matrix(kind, size, *parts)
    data, row, col = (_pick(arrays, verb, name) for name in ("data", "row", "col"))
    try:
        return sparse.coo_array((data, (row, col)), shape=(size, size))
    except (ValueError, TypeError, IndexError) as error:
        raise ContractError(f"{verb}: returned a broken coo matrix: {error}") from None
