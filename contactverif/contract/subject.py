"""A formulation as the harness sees it: `Subject`, as it was loaded, and `CheckedFormulation`, every answer checked.

Rule: the harness calls a plugin through a `CheckedFormulation` only, except to time it. A part that a plugin leaves out
is filled in here; a part that breaks the contract raises a `ContractError` here.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Sequence
from contextlib import AbstractContextManager, suppress
from contextvars import copy_context
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

import numpy as np

from contactverif.contract.arrays import Array, FloatArray, compressed_matrix, dense, freeze, sparse_of_scipy
from contactverif.contract.case import OWN_PENALTY, Case
from contactverif.contract.engine import Engine, EngineAnswer, EngineTraits, SceneArrays
from contactverif.contract.errors import (
    ContractError,
    MisuseError,
    NonFiniteError,
    PluginError,
    describe_error,
    name_line,
    one_line,
    place_of_error,
)
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import PLANE, Interface, find_depth
from contactverif.contract.traits import Abilities, PatchPromises, Promises, Rules, Traits

_Value = TypeVar("_Value")


class lazy(Generic[_Value]):
    """A `functools.cached_property` without a lock.

    Python 3.11 holds one lock for all objects of the class while a value is computed. A case that needs an answer of a
    plugin for it would keep all others from going on, see `contactverif.isolation.lockstep`.
    """

    def __init__(self, compute: Callable[[Any], _Value]) -> None:
        self._compute, self.__doc__ = compute, compute.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type | None = None) -> _Value:
        value = instance.__dict__[self._name] = self._compute(instance)
        return value


OPTIONAL_PARTS = ("pair", "tangent", "contact_points")
FAST_PARTS = ("residual_and_tangent",)  # These repeat other parts in less time, so none is missing without them.
MULTIPLIERS_AN_UNKNOWN = 100  # No formulation has so many; the judge has to find room for all of them.
POINTS_A_SEGMENT = 1000  # No formulation has so many; the judge looks at each of them in exact numbers.
_TOO_DEEP = "the slave lies deeper than the formulation looks (trait `reach`)"
TOO_DEEP = f"not asked: {_TOO_DEEP}"  # The reason of a case in which a formulation meets such a state.
_BELOW_REACH = 1 - 2.0**-20  # So no rounding of a depth decides whether a formulation sees it.
STATED_PARTS = frozenset({"tangent"})  # A trait says that they are there. To leave out another part breaks no promise.
Call = tuple[str, Interface, Pairing | None, Array]  # A method and its arguments: meshes, pairing and state.


@dataclass(frozen=True, slots=True, eq=False)
class FirstAnswers:
    """The answers to the first questions, at one state."""

    case: Case  # The state, with its multipliers if there are any.
    residual: FloatArray  # (n,) with n = n_unknowns + n_multipliers
    tangent: FloatArray | None  # (n, n); None if it was not asked.


class Prefetching(ABC):
    """A plugin to which questions are better put together, because each way to it and back costs time.

    Its ``residual`` takes any batch of states; without a pairing it pairs anew at each of them.
    """

    @abstractmethod
    def prefetch(self, calls: Sequence[Call]) -> AbstractContextManager[None]:
        """Open a block in which exactly these methods are called, in this order."""


@runtime_checkable
class Restartable(Protocol):
    """A subject that can be started a second time under other conditions, such as another seed of hashes."""

    def restart(self) -> Subject:
        """Return the same formulation, started once more, beside this one."""


class Subject:
    """A formulation as it was loaded: its name, its factory and its traits.

    `load_formulation` returns one for a name of the command line. A class or function of one's own becomes one by
    ``Subject("mine", make)``.

    Parameters
    ----------
    name : str
        The name as on the command line, with options.
    make : Callable[..., Any]
        The factory: ``make(penalty=…)`` returns the formulation.

    Attributes
    ----------
    traits : Traits
        The promises of the formulation.
    provides : frozenset[str]
        The optional parts that the plugin has, among "pair", "tangent", "contact_points" and "residual_and_tangent".
    counts_multipliers : bool
        The plugin has a method ``n_multipliers``.
    first_answers : FirstAnswers | None
        The first answers of the plugin in a process, once a run has asked for them.

    Raises
    ------
    PluginError
        If the factory raises an exception.
    ContractError
        If the factory returns an object without ``residual``, whose ``traits`` are no `Traits`, or that has
        ``residual_and_tangent`` but no ``tangent``.

    Examples
    --------
    >>> from contactverif import load_formulation, load_scene, solve
    >>> subject = load_formulation("vts-ppt")
    >>> scene = load_scene("c-prime")
    >>> trace = solve(scene, subject.for_case(scene.case()))
    >>> trace.converged
    True
    """

    def __init__(self, name: str, make: Callable[..., Any]) -> None:
        self.name = name_line(name)
        self._make = make
        self.first_answers: FirstAnswers | None = None
        if flaw := _flaw_of_factory(make):
            raise ContractError(f"make: {flaw}")
        plugin = _call_plugin("make", make, penalty=1.0)
        if not callable(getattr(plugin, "residual", None)):
            names = [name for name in _call_plugin("residual", dir, plugin) if type(name) is str and name != "residual"]
            near = get_close_matches("residual", names, n=1)
            hint = f"; the nearest name is `{name_line(near[0])}`" if near else ""
            raise ContractError(f"make: returned a {type(plugin).__name__} without a `residual`{hint}")
        traits = _call_plugin("traits", getattr, plugin, "traits", Traits())
        if not isinstance(traits, Traits):
            raise ContractError(f"traits: found a {type(traits).__name__}; needed contactverif.contract.traits.Traits")
        rules = traits.rules
        if rules.law is not None and (rules.enforcement, rules.penalty) != ("penalty", "distributed"):
            law = f"{rules.law!r} with penalty {rules.penalty!r} and enforcement {rules.enforcement!r}"
            raise ContractError(f"Traits.rules: found law {law}; needed penalty 'distributed', enforcement 'penalty'")
        self.traits: Traits = traits
        self.provides = frozenset(
            part for part in OPTIONAL_PARTS + FAST_PARTS if callable(_call_plugin(part, getattr, plugin, part, None))
        )
        self.counts_multipliers = _call_plugin("n_multipliers", getattr, plugin, "n_multipliers", None) is not None
        if "residual_and_tangent" in self.provides and "tangent" not in self.provides:
            raise ContractError("residual_and_tangent: the plugin has no `tangent`; needed both")

    def penalty(self, case: Case) -> float:
        """Return the penalty of a case in the unit that the formulation takes.

        It is ε̂ itself; for a nodal formulation ε̂ × the mean length of the slave segments in the reference, and in space
        ε̂ × the slave's area over the number of its nodes. A law of its own has a penalty that the case says.
        """
        if OWN_PENALTY in case.parameters:
            return case.parameter(OWN_PENALTY)
        return self._convert(case.interface, case.penalty)

    def _convert(self, interface: Interface, penalty: float) -> float:
        if self.traits.rules.penalty != "nodal":
            return penalty
        measures = interface.slave.measures(interface.nodes)
        if interface.dim == PLANE:
            return penalty * float(measures.mean())
        return penalty * float(measures.sum()) / interface.n_slave_nodes

    def for_interface(self, interface: Interface, penalty: float) -> CheckedFormulation:
        """Return the formulation with a distributed penalty ε̂ on the meshes of an interface."""
        return self.with_penalty(self._convert(interface, penalty))

    def for_case(self, case: Case) -> CheckedFormulation:
        """Return the formulation with the penalty of a case."""
        return self.with_penalty(self.penalty(case))

    def with_penalty(self, penalty: float) -> CheckedFormulation:
        """Return the formulation with a penalty in the unit that it takes, see `penalty`."""
        return CheckedFormulation(_call_plugin("make", self._make, penalty=penalty), self.traits, self.provides)


class CheckedFormulation:
    """A formulation of which every answer is checked before anybody uses it.

    `Subject.for_case` and `Subject.with_penalty` make one. Its methods are those of `Formulation`.

    Attributes
    ----------
    plugin : Any
        The plugin itself, to time it: nothing that it answers is checked.
    provides : frozenset[str]
        The optional parts that the plugin has, among "pair", "tangent", "contact_points" and "residual_and_tangent".
    copy_matrix : Callable[[str, Any], Any]
        The function that checks and copies a sparse tangent; its first argument is the name of the method.

    Raises
    ------
    PluginError
        If the plugin raises an exception, in any method.
    ContractError
        If an answer has the wrong kind, shape or dtype, or a pairing holds what it must not.
    NonFiniteError
        If an answer contains NaN or infinity.
    MisuseError
        If z has another length than there are positions and multipliers.
    """

    def __init__(self, plugin: Any, traits: Traits, provides: frozenset[str]) -> None:
        self.plugin = plugin
        self._traits = traits
        self.provides = provides
        self.copy_matrix = copy_entries
        self._prefetching = plugin if isinstance(plugin, Prefetching) else None
        self._counts: dict[int, tuple[Interface, int]] = {}  # It holds the interfaces, so that no id is used again.

    def n_multipliers(self, interface: Interface) -> int:
        """Return the number of multipliers behind the positions in z; 0 if the plugin does not mention any.

        The plugin is called once for each interface: one that counts differently later breaks its own shapes.
        """
        if id(interface) not in self._counts:
            self._counts[id(interface)] = interface, self._count_multipliers(interface)
        return self._counts[id(interface)][1]

    def _count_multipliers(self, interface: Interface) -> int:
        abilities, enforcement = self._traits.abilities, self._traits.rules.enforcement
        if interface.dim not in abilities.dimensions:
            needed = f"{' or '.join(map(str, abilities.dimensions))}, which the formulation takes"
            raise MisuseError("interface", f"nodes with {interface.dim} coordinates", needed)
        for side in (interface.slave, interface.master):  # A kernel may read past the corners of a face.
            if interface.dim != PLANE and (corners := side.faces.shape[1]) not in abilities.faces:
                needed = f"{' or '.join(map(str, abilities.faces))}, which the formulation takes"
                raise MisuseError("interface", f"faces with {corners} corners", needed)
        method = _call_plugin("n_multipliers", getattr, self.plugin, "n_multipliers", None)
        count = 0 if method is None else _call_plugin("n_multipliers", method, interface)
        if not isinstance(count, int | np.integer) or isinstance(count, bool) or count < 0:
            raise ContractError(f"n_multipliers: returned {count!r}; needed an integer ≥ 0")
        if count > (most := MULTIPLIERS_AN_UNKNOWN * interface.n_unknowns):
            raise ContractError(f"n_multipliers: returned {int(count)}; needed at most {most} on this interface")
        if bool(count) is not (enforcement == "multiplier"):
            needed = '"multiplier"' if count else "n_multipliers(interface) ≥ 1"
            trait = f"{int(count)} of them, with the trait enforcement {enforcement!r}"
            raise ContractError(f"n_multipliers: {trait}; needed {needed}")
        return int(count)

    def pair(self, interface: Interface, z: FloatArray) -> Pairing | None:
        """Return the pairing at one state z (n_unknowns,); None if the plugin has no ``pair``, or one with a handle.

        Without a pairing the other methods take one of each state that they are asked at, handle included.
        """
        pairing = self.own_pairing(interface, z)
        return None if pairing is None or pairing.opaque else pairing

    def decides_anew(self, pairing: Pairing | None) -> bool:
        """Return whether the plugin gets a new pairing at each state, since the one that it was asked with is None."""
        return pairing is None and "pair" in self.provides

    def own_pairing(self, interface: Interface, z: FloatArray) -> Pairing | None:
        """Return the pairing at one state z (n_unknowns,), with a handle if it has one; None without ``pair``."""
        self._check_size(interface, z)
        self._check_depth(interface, z)
        if "pair" not in self.provides:
            return None
        answer = _call_plugin("pair", self.plugin.pair, interface, freeze(z, np.float64))
        pairing = answer if isinstance(answer, Pairing) else _call_plugin("pair", Pairing, answer)
        pairing.check_bounds(interface)
        return pairing

    def _check_depth(self, interface: Interface, *states: Array) -> None:
        if (reach := self._traits.abilities.reach) is None:
            return
        positions = (z[: interface.n_unknowns].real.reshape(interface.nodes.shape) for z in states)
        if any(find_depth(interface, each) > _BELOW_REACH * reach for each in positions):
            raise PluginError(_TOO_DEEP, "not asked")

    def _pairing_at(self, interface: Interface, pairing: Pairing | None, z: Array) -> Pairing | None:
        return self.own_pairing(interface, z.real) if self.decides_anew(pairing) else pairing

    def _ask(self, verb: str, interface: Interface, pairing: Pairing | None, z: FloatArray) -> Any:
        self._check_size(interface, z)
        pairing = self._pairing_at(interface, pairing, z)
        return _call_plugin(verb, getattr(self.plugin, verb), interface, pairing, freeze(z, np.float64))

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        """Return the forces (..., n_unknowns) at z (..., n_unknowns); a loop calls a plugin that is not batched."""
        self._check_size(interface, z)
        batched = self._traits.abilities.batched and not self.decides_anew(pairing)
        if z.ndim > 1 and self._prefetching is None and not batched:
            forces = np.empty_like(z)
            for index in np.ndindex(z.shape[:-1]):
                forces[index] = self.residual(interface, pairing, z[index])
            return forces
        if z.ndim == 1:
            pairing = self._pairing_at(interface, pairing, z)
        elif self.decides_anew(pairing):  # The plugin's process takes the pairings.
            self._check_depth(interface, *z.reshape(-1, z.shape[-1]))
        forces = _call_plugin("residual", self.plugin.residual, interface, pairing, freeze(z, z.dtype.type))
        return _check_forces("residual", forces, z)

    def tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> Any:
        """Return the tangent (n_unknowns, n_unknowns) at z (n_unknowns,), dense or a csr, csc or coo array of scipy."""
        return self._check_tangent("tangent", self._ask("tangent", interface, pairing, z), z.size)

    def residual_and_tangent(
        self, interface: Interface, pairing: Pairing | None, z: FloatArray
    ) -> tuple[FloatArray, Any]:
        """Return residual (n_unknowns,) and tangent, as `tangent` does, at z (n_unknowns,); one call where possible."""
        if "residual_and_tangent" not in self.provides:
            return self.residual(interface, pairing, z), self.tangent(interface, pairing, z)
        answer = self._ask(verb := "residual_and_tangent", interface, pairing, z)
        if not isinstance(answer, tuple) or len(answer) != 2:
            kind = f"a tuple of {len(answer)}" if isinstance(answer, tuple) else f"a {type(answer).__name__}"
            raise ContractError(f"{verb}: returned {kind}; needed a tuple (residual, tangent)")
        return _check_forces(f"{verb}[0]", answer[0], z), self._check_tangent(f"{verb}[1]", answer[1], z.size)

    def contact_points(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> ContactPoints:
        """Return the contact points at one state z (n_unknowns,)."""
        points = self._ask("contact_points", interface, pairing, z)
        if not isinstance(points, ContactPoints):
            raise ContractError(f"contact_points: returned a {type(points).__name__}; needed ContactPoints")
        counts = np.array([len(interface.slave), len(interface.master)])
        if len(points.gap) > (most := POINTS_A_SEGMENT * int(counts.sum())):
            raise ContractError(f"contact_points: {len(points.gap)} of them; needed at most {most} on this interface")
        for role, name in enumerate(("slave_segment", "master_segment")):
            numbers = getattr(points, name)
            limits = counts[role ^ points.on_master]  # A second pass exchanges the roles.
            outliers = np.flatnonzero((numbers < -1) | (numbers >= limits))
            if len(outliers):
                first = outliers[0]
                raise ContractError(f"contact_points: {name} {numbers[first]}; needed −1 to {limits[first] - 1}")
        return points

    def answers(self, calls: Sequence[Call]) -> list[Any]:
        """Return the answers of methods that are called one after another; `pair` is none of them.

        Some plugins answer them faster than one by one, see `Prefetching`.
        """
        if self._prefetching is None:
            return [getattr(self, verb)(*arguments) for verb, *arguments in calls]
        paired = []
        for verb, interface, pairing, z in calls:
            self._check_size(interface, z)
            paired.append((verb, interface, self._pairing_at(interface, pairing, z) if z.ndim == 1 else pairing, z))
        with self._prefetching.prefetch(paired):
            return [getattr(self, verb)(*arguments) for verb, *arguments in paired]

    def _check_tangent(self, verb: str, tangent: Any, size: int) -> Any:
        if not (isinstance(tangent, np.ndarray) or sparse_of_scipy().issparse(tangent)):
            raise ContractError(f"{verb}: returned a {type(tangent).__name__}; needed an array or scipy.sparse")
        if tangent.shape != (size, size):
            raise ContractError(f"{verb}: returned shape {tangent.shape}; needed {(size, size)}")
        if tangent.dtype != np.float64:
            raise ContractError(f"{verb}: returned dtype {tangent.dtype}; needed float64")
        tangent = np.array(tangent) if isinstance(tangent, np.ndarray) else self.copy_matrix(verb, tangent)
        _check_finite(verb, tangent if isinstance(tangent, np.ndarray) else tangent.data)
        return tangent

    def _check_size(self, interface: Interface, z: Array) -> None:
        count = self.n_multipliers(interface)
        if z.shape[-1:] != (interface.n_unknowns + count,):
            needed = f"{interface.n_unknowns} positions and {count} multipliers"
            raise MisuseError("z", f"shape {z.shape}", f"(..., {interface.n_unknowns + count}), {needed}")


def _flaw_of_factory(make: Callable[..., Any]) -> str:
    """Return why a factory does not take the penalty; empty if it does, or if its signature cannot be told."""
    try:
        parameters = inspect.signature(make)
        name = name_line(getattr(make, "__name__", "make"))
        try:
            parameters.bind(penalty=1.0)
        except TypeError as error:
            return f"found {name}{one_line(str(parameters))} ({one_line(str(error))}); needed {name}(*, penalty)"
    except KeyboardInterrupt:
        raise
    except BaseException:  # A stranger's signature may raise anything; the call will say what is wrong.
        return ""
    return ""


def _call_plugin(method: str, function: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Return the answer of a plugin; whatever it raises becomes a PluginError that names the method."""
    try:
        # A plugin may change how numpy treats errors; that is a variable of its context, and ends with it.
        return copy_context().run(function, *arguments, **options)
    except (KeyboardInterrupt, ContractError):
        raise
    except BaseException as error:
        cause = "memory" if isinstance(error, MemoryError) else "exit" if isinstance(error, SystemExit) else "exception"
        raise PluginError(f"{method}: {describe_error(error)}{place_of_error(error)}", cause) from error


def _check_forces(verb: str, forces: Any, z: Array) -> Array:
    """Return a copy of the forces in the shape and dtype of z, or raise an error that begins with the verb."""
    if not isinstance(forces, np.ndarray):
        raise ContractError(f"{verb}: returned a {type(forces).__name__}; needed an array of shape {z.shape}")
    copy: Array = np.array(forces)  # The plugin may reuse its array; and a subclass may have other rules.
    if copy.shape != z.shape:
        raise ContractError(f"{verb}: returned shape {copy.shape}; needed {z.shape}, that of z")
    if copy.dtype != z.dtype:
        raise ContractError(f"{verb}: returned dtype {copy.dtype}; needed {z.dtype}, that of z")
    _check_finite(verb, copy)
    return copy


def _check_finite(verb: str, values: Array) -> None:
    if not np.isfinite(values).all():
        bad = np.flatnonzero(~np.isfinite(values).reshape(-1))
        raise NonFiniteError(f"{verb}: {values.reshape(-1)[bad[0]]} in {len(bad)} of {values.size} entries")


def copy_entries(verb: str, tangent: Any) -> Any:
    """Return a copy of a sparse matrix, csr or csc as it is, else coo. Numbers of rows and columns are checked.

    A plugin that fills the arrays of a compressed matrix itself may number a row or a column that is not there. scipy
    would read or write outside of its arrays.
    """
    kind, size = tangent.format, tangent.shape[0]
    try:
        if kind == "bsr":
            tangent.check_format(full_check=True)
        if kind not in ("csr", "csc"):
            return sparse_of_scipy().coo_array(tangent, copy=True)  # It checks the numbers of rows and columns.
        # What follows takes a third of the time of scipy's full check.
        data, indices, indptr = (np.array(part) for part in (tangent.data, tangent.indices, tangent.indptr))
        is_usual = data.ndim == indices.ndim == indptr.ndim == 1 and indices.dtype == indptr.dtype in (
            np.int32,
            np.int64,
        )
        if is_usual and len(indptr) == size + 1 and indptr[0] == 0 and indptr[-1] == len(indices) == len(data):
            matrix = compressed_matrix(kind, size, data, indices, indptr)
        else:  # scipy makes what is usual of these arrays, or says what does not fit.
            matrix = getattr(sparse_of_scipy(), f"{kind}_array")((data, indices, indptr), shape=tangent.shape)
        if (matrix.indptr[1:] < matrix.indptr[:-1]).any():  # A difference might overflow.
            raise ValueError("indptr must be a non-decreasing sequence")
        if not 0 <= matrix.indices.min(initial=0) <= matrix.indices.max(initial=0) < size:
            raise ValueError(f"indices must be < {size} and ≥ 0")
        return matrix
    except (IndexError, TypeError, ValueError) as error:
        raise ContractError(f"{verb}: returned a broken {kind} matrix: {error}") from error


def ask_first(subject: Subject, case: Case, parts: Collection[str]) -> FirstAnswers:
    """Ask a flat case, whose multipliers press, for its pairing, its residual and, if it is among `parts`, its tangent.

    A tangent that breaks the contract is None here; pairing and residual raise their `ContractError`.
    """
    formulation, interface = subject.for_case(case), case.interface
    pressure = case.penalty * case.parameter("penetration")
    state = case.with_multipliers(np.full(formulation.n_multipliers(interface), pressure))
    pairing = formulation.pair(interface, state.z)
    residual: FloatArray = formulation.residual(interface, pairing, state.z)
    tangent: FloatArray | None = None
    if "tangent" in parts:
        with suppress(ContractError):
            tangent = dense(formulation.tangent(interface, pairing, state.z))
    return FirstAnswers(state, residual, tangent)


ENGINE = "engine/"  # The names of engines begin so wherever those of formulations stand beside them.
SOLVE = "solve"  # The one part that an engine provides; a formulation provides others.


class EngineSubject(Subject):
    """An engine as it was loaded. It has no penalty of its own: each scene says its own.

    Its `traits` are its `engine_traits`, as far as formulations can state them. An engine without ``solve``, or with
    ``traits`` that are no `EngineTraits`, raises a `ContractError`.
    """

    def __init__(self, name: str, engine: Engine) -> None:
        self.name = name_line(name)
        self.engine = engine
        self.first_answers = None
        if not callable(getattr(engine, SOLVE, None)):
            raise ContractError(f"make: returned a {type(engine).__name__} without a `solve`")
        traits = getattr(engine, "traits", None)
        if not isinstance(traits, EngineTraits):
            needed = "contactverif.contract.engine.EngineTraits"
            raise ContractError(f"traits: found a {type(traits).__name__}; needed {needed}")
        self.engine_traits = traits
        promises = Promises(
            patch=PatchPromises(flat=traits.passes_flat_patch),
            converges=traits.converges,
            independent_multipliers=True if traits.enforcement == "multiplier" else None,
        )
        # A stiffness of its own is near to none that gives way.
        enforcement = "multiplier" if traits.enforcement == "own" else traits.enforcement
        abilities = Abilities(dimensions=traits.dimensions, faces=(3, 4))
        self.traits = Traits(promises, Rules(enforcement, "distributed", "current"), abilities=abilities)
        self.provides = frozenset({SOLVE})
        self.counts_multipliers = False

    def with_penalty(self, penalty: float) -> CheckedFormulation:
        """Raise a ContractError: nobody can ask an engine for forces."""
        raise ContractError("an engine gives displacements alone")

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Return the checked answer of the engine to a scene."""
        answer = _call_plugin(SOLVE, self.engine.solve, scene)
        if not isinstance(answer, EngineAnswer):
            raise ContractError(f"solve: returned a {type(answer).__name__}; needed an EngineAnswer")
        if flaw := answer.flaw(scene):
            raise ContractError(f"solve: {flaw}")
        if answer.converged and not np.isfinite(answer.displacements).all():
            raise NonFiniteError("solve: converged, with displacements that are not finite")
        return answer
