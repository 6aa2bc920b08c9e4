"""A formulation in another process, with the methods of a formulation.

Rule for the next editor: who asks does not notice where the formulation is, but for what cannot be told apart inline: a
process that dies or hangs. A formulation of a process that ended is the same one in the next process.
"""

from __future__ import annotations

import weakref
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.subject import COMPRESSED, Call
from contactverif.isolation.host import Host, Question, host_of
from contactverif.isolation.limits import Limits
from contactverif.isolation.messages import Answer, MessageError, unpack_array

_COMPRESSED = {"csr": sparse.csr_array, "csc": sparse.csc_array}


class RemoteFactory:
    """A factory ``make(*, penalty)`` of a formulation that lives in a process of its own. It can be pickled.

    Parameters
    ----------
    loader, name, limits, second : str, str, Limits or bool
        The arguments of `Host`.
    """

    def __init__(self, loader: str, name: str, limits: Limits, *, second: bool = False) -> None:
        self._key = loader, name, limits
        self._second = second

    @property
    def host(self) -> Host:
        """The host in this process of the judge."""
        return host_of(*self._key, second=self._second)

    @property
    def n_ended(self) -> int:
        """The number of times that the process ended before it was told to."""
        return self.host.n_ended

    @property
    def second_factory(self) -> RemoteFactory | None:
        """The factory of the same formulation in a second process."""
        return None if self._second else RemoteFactory(*self._key, second=True)

    def run(self, verb: str, function: str, words: bytes) -> bytes:
        """Call a function of the harness in the formulation's process, see `Host.run`."""
        return self.host.run(verb, function, words)

    def __call__(self, *, penalty: float) -> RemoteFormulation:
        """Return the formulation with a penalty."""
        return RemoteFormulation(self.host, penalty)


class RemoteFormulation:
    """A formulation with one penalty in another process. A checked formulation stands before it, which checks answers.

    Parameters
    ----------
    host : Host
        The host of the process.
    penalty : float
        The penalty.

    Attributes
    ----------
    loops : bool
        It takes a batch of states, also where the formulation itself does not.
    """

    loops = True

    def __init__(self, host: Host, penalty: float) -> None:
        self._host, self._penalty = host, penalty
        self._last: Question | None = None
        self._foreseen: deque[tuple[Call, Question]] = deque()
        self._make()

    def _make(self) -> None:
        self._number, self._started = self._host.make(self._penalty)
        weakref.finalize(self, self._host.forget, self._number, self._started)

    def _ask(self, verb: str, interface: Interface, pairing: Pairing | None, z: Array | None) -> tuple[Question, int]:
        if not self._host.is_alive(self._started):
            self._make()
        self._last, number = self._host.ask(verb, self._number, interface, pairing, z)
        return self._last, number

    def _answer(
        self, verb: str, interface: Interface, pairing: Pairing | None = None, z: Array | None = None
    ) -> Answer:
        question = self._take_foreseen(verb, interface, pairing) or self._ask(verb, interface, pairing, z)[0]
        if question.answer is None:
            self._host.flush()
        if isinstance(pairing, RemotePairing):
            pairing.check()
        return question.result()

    @contextmanager
    def foresee(self, calls: Sequence[Call]) -> Iterator[None]:
        """Open a block in which these methods are called, in this order: they go to the process in one message."""
        try:
            for verb, interface, pairing, z in calls:
                if verb in self._host.methods or verb == "residual":
                    self._foreseen.append(((verb, interface, pairing, z), self._ask(verb, interface, pairing, z)[0]))
            yield
        finally:
            self._foreseen.clear()

    def _take_foreseen(self, verb: str, interface: Interface, pairing: Pairing | None) -> Question | None:
        """Return the question that was asked ahead, if this is the next one of those."""
        if not self._foreseen:
            return None
        (foreseen, of_interface, of_pairing, _), question = self._foreseen[0]
        if foreseen != verb or of_interface is not interface or of_pairing is not pairing:
            return None
        self._foreseen.popleft()
        self._last = question
        return question

    @property
    def seconds(self) -> float:
        """The seconds that the last call took there, without the way and without any check."""
        assert self._last is not None
        self._host.flush()
        return self._last.result().seconds

    @property
    def n_multipliers(self) -> Callable[[Interface], int] | None:
        """The method that returns the number of multipliers, if the plugin has it."""
        return self._count if "n_multipliers" in self._host.methods else None

    def _count(self, interface: Interface) -> int:
        return self._answer("n_multipliers", interface).number

    def pair(self, interface: Interface, z: FloatArray) -> Pairing:
        """Return the pairing at one state z (n_unknowns,). It is asked for together with the next question."""
        question, number = self._ask("pair", interface, None, z)
        pairing = RemotePairing(self._host, question, interface)
        self._host.keep(pairing, number)
        return pairing

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
    """A pairing that the process of a plugin keeps. It comes here, and is checked, when somebody looks into it.

    Parameters
    ----------
    host : Host
        The host of the process.
    question : Question
        The question whose answer it is.
    interface : Interface
        The interface that it belongs to.
    """

    __slots__ = ("_content", "_host", "_interface", "_question")

    def __init__(self, host: Host, question: Question, interface: Interface) -> None:
        self._host, self._question, self._interface = host, question, interface
        self._content: dict[str, Array] | None = None

    @property
    def _arrays(self) -> dict[str, Array]:  # type: ignore[override]
        if self._content is None:
            if self._question.answer is None:
                self._host.flush()
            whole = Pairing(_unpack("pair", self._question.result()))
            whole.check_bounds(self._interface)
            self.check()
            self._content = dict(whole)
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
        answer = self._question.answer
        if not isinstance(answer, Answer):
            answer = self._question.result()
        if self._host.opaque is None:
            self._host.opaque = answer.opaque
        elif self._host.opaque is not answer.opaque:
            raise ContractError("pair: returned a handle in some states, and none in others")

    def check_bounds(self, interface: Interface) -> None:
        """Do nothing: the bounds are checked where the plugin is, and once more when somebody looks into it."""


def _unpack(verb: str, answer: Answer) -> dict[str, Array]:
    try:
        return {name: unpack_array(array) for name, array in answer.arrays.items()}
    except MessageError as error:
        raise ContractError(f"{verb}: {error}") from None


def _pick(arrays: dict[str, Array], verb: str, name: str) -> Array:
    if name not in arrays:
        raise ContractError(f"{verb}: an answer without its {name}")
    return arrays[name]


def _tangent(arrays: dict[str, Array], verb: str, size: int) -> Any:
    """Return the tangent (size, size): dense, or a matrix in the format in which it came, with no entry checked."""
    if "dense" in arrays:
        return arrays["dense"]
    kind = next((kind for kind in _COMPRESSED if f"{kind} data" in arrays), "coo")
    try:
        if kind == "coo":
            data, row, col = (_pick(arrays, verb, name) for name in ("data", "row", "col"))
            return sparse.coo_array((data, (row, col)), shape=(size, size))
        parts = tuple(_pick(arrays, verb, f"{kind} {name}") for name in COMPRESSED)
        return _COMPRESSED[kind](parts, shape=(size, size))
    except (ValueError, TypeError, IndexError) as error:
        raise ContractError(f"{verb}: returned a broken {kind} matrix: {error}") from None
