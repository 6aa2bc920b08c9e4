"""A formulation as the harness sees it: `Subject`, as it was loaded, and `CheckedFormulation`, every answer checked.

Rules for the next editor: nobody in the house calls a plugin except through a `CheckedFormulation`. (The exception is
whoever times a plugin; see `CheckedFormulation.plugin`.) A part that a plugin leaves out is filled in here: no pairing,
a loop instead of a batch. A part that breaks the contract raises a `ContractError` here. To judge is left to the
properties.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, freeze
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError
from contactverif.contract.foreign_text import describe_error, name_line
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits

OPTIONAL_PARTS = ("pair", "tangent", "contact_points")
FAST_PARTS = ("residual_and_tangent",)  # These repeat other parts in less time. They are optional.
MULTIPLIERS_AN_UNKNOWN = 100  # No formulation has so many; the judge has to find room for all of them.
POINTS_A_SEGMENT = 1000  # No formulation has so many; the judge looks at each of them in exact numbers.
COMPRESSED = ("data", "indices", "indptr")  # The arrays of a csr or csc matrix of scipy.
Call = tuple[str, Interface, Pairing | None, Array]  # A method and its arguments: meshes, pairing and state.
_ENTRIES = (np.float64, np.int32, np.int64)
STATED_PARTS = frozenset({"tangent"})  # A trait says that they are there; whoever leaves out another breaks no promise.


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
    name : str
        The name as on the command line, with options.
    traits : Traits
        The promises of the formulation.
    provides : frozenset[str]
        The optional parts that the plugin has, among "pair", "tangent", "contact_points" and "residual_and_tangent".
    counts_multipliers : bool
        The plugin has a method ``n_multipliers``.

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
        plugin = _call_plugin("make", make, penalty=1.0)
        if not callable(getattr(plugin, "residual", None)):
            raise ContractError(f"make: returned a {type(plugin).__name__} without a `residual`")
        traits = _call_plugin("traits", getattr, plugin, "traits", Traits())
        if not isinstance(traits, Traits):
            raise ContractError(f"traits: found a {type(traits).__name__}; needed contactverif.contract.traits.Traits")
        self.traits: Traits = traits
        self.provides = frozenset(
            part for part in OPTIONAL_PARTS + FAST_PARTS if callable(_call_plugin(part, getattr, plugin, part, None))
        )
        self.counts_multipliers = _call_plugin("n_multipliers", getattr, plugin, "n_multipliers", None) is not None
        if "residual_and_tangent" in self.provides and "tangent" not in self.provides:
            raise ContractError("residual_and_tangent: the plugin has no `tangent`; needed both")

    @classmethod
    def of_parts(cls, name: str, make: Callable[..., Any], traits: Traits, provides: frozenset[str]) -> Subject:
        """Return a formulation of which somebody else has asked what it promises and which optional parts it has."""
        subject = object.__new__(cls)
        subject.name, subject._make, subject.traits = name, make, traits
        subject.provides = provides & frozenset(OPTIONAL_PARTS + FAST_PARTS)
        subject.counts_multipliers = "n_multipliers" in provides
        return subject

    @property
    def n_ended(self) -> int:
        """The number of times that the process of the plugin has ended; 0 if it has none of its own."""
        return int(getattr(self._make, "n_ended", 0))

    def in_second_process(self) -> Subject | None:
        """Return the same formulation in another process than this one's; None if it has no process of its own."""
        make = getattr(self._make, "second_factory", None)
        return None if make is None else Subject.of_parts(self.name, make, self.traits, self._parts)

    def run_there(self, verb: str, function: str, words: bytes) -> bytes | None:
        """Call a function of the harness in this formulation's process; return None if it has none of its own.

        Parameters
        ----------
        verb : str
            The word for the call in messages.
        function : str
            The function, ``"module:function"``. It gets the formulation as it is there, and the words.
        words : bytes
            What it has to know.

        Returns
        -------
        bytes | None
            What it returned. The plugin may have changed it, as it likes.

        Raises
        ------
        ContractError
            If the plugin made an error, or its process ended.
        """
        run = getattr(self._make, "run", None)
        return None if run is None else run(verb, function, words)

    @property
    def _parts(self) -> frozenset[str]:
        return self.provides | ({"n_multipliers"} if self.counts_multipliers else frozenset())

    def penalty(self, case: Case) -> float:
        """Return the penalty of a case in the unit that the formulation takes.

        Parameters
        ----------
        case : Case
            The case with the distributed stiffness ε̂.

        Returns
        -------
        float
            The stiffness ε̂ itself; for a nodal formulation ε̂ × the mean length of the slave segments in the reference.
        """
        return self._convert(case.interface, case.penalty)

    def _convert(self, interface: Interface, penalty: float) -> float:
        if self.traits.penalty != "nodal":
            return penalty
        return penalty * float(interface.slave.lengths(interface.nodes).mean())

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
        The plugin itself, for whoever times it: nothing that it answers is checked.
    provides : frozenset[str]
        The optional parts that the plugin has, among "pair", "tangent", "contact_points" and "residual_and_tangent".
    passes_on : bool
        A csr or csc matrix is returned as the plugin made it, for another process that looks into it. False by default.

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
        # A plugin in a process of its own gets a whole batch, and the loop is there; new pairings are made there, too.
        self._remote = getattr(plugin, "loops", False) is True
        self.passes_on = False
        self._counts_there = self._remote and traits.enforcement != "multiplier"
        self._counts: dict[int, tuple[Interface, int]] = {}  # It holds the interfaces, so that no id is used again.

    def n_multipliers(self, interface: Interface) -> int:
        """Return the number of multipliers behind the positions in z; 0 if the plugin does not mention any.

        The plugin is called once for each interface: one that counts differently later breaks its own shapes. In a
        process of its own, one that promises none is called with the first question, and fails there if it has any.
        """
        if self._counts_there:
            return 0
        if id(interface) not in self._counts:
            self._counts[id(interface)] = interface, self._count_multipliers(interface)
        return self._counts[id(interface)][1]

    def _count_multipliers(self, interface: Interface) -> int:
        count = self._call_n_multipliers(interface)
        if (count > 0) is not (self._traits.enforcement == "multiplier"):
            needed = '"multiplier"' if count else "n_multipliers(interface) ≥ 1"
            trait = f"{count} of them, with the trait enforcement {self._traits.enforcement!r}"
            raise ContractError(f"n_multipliers: {trait}; needed {needed}")
        return count

    def _call_n_multipliers(self, interface: Interface) -> int:
        count = _call_plugin("n_multipliers", getattr, self.plugin, "n_multipliers", None)
        if count is None:
            return 0
        number = _call_plugin("n_multipliers", count, interface)
        if not isinstance(number, int | np.integer) or isinstance(number, bool) or number < 0:
            raise ContractError(f"n_multipliers: returned {number!r}; needed an integer ≥ 0")
        if number > (most := MULTIPLIERS_AN_UNKNOWN * interface.n_unknowns):
            raise ContractError(f"n_multipliers: returned {int(number)}; needed at most {most} on this interface")
        return int(number)

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
        if "pair" not in self.provides:
            return None
        self._check_size(interface, z)
        answer = _call_plugin("pair", self.plugin.pair, interface, freeze(z, np.float64))
        pairing = answer if isinstance(answer, Pairing) else _call_plugin("pair", Pairing, answer)
        pairing.check_bounds(interface)
        return pairing

    def _pairing_at(self, interface: Interface, pairing: Pairing | None, z: Array) -> Pairing | None:
        return self.own_pairing(interface, z.real) if self.decides_anew(pairing) and not self._remote else pairing

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        """Return the forces (..., n_unknowns) at z (..., n_unknowns); a loop calls a plugin that is not batched."""
        self._check_size(interface, z)
        if z.ndim == 1 or self._remote or (self._traits.batched and not self.decides_anew(pairing)):
            return self._residual(interface, pairing, z)
        forces = np.empty_like(z)
        for index in np.ndindex(z.shape[:-1]):
            forces[index] = self._residual(interface, pairing, z[index])
        return forces

    def _residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        pairing = self._pairing_at(interface, pairing, z)
        forces = _call_plugin("residual", self.plugin.residual, interface, pairing, freeze(z, z.dtype.type))
        return _check_forces("residual", forces, z)

    def tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> Any:
        """Return the tangent (n_unknowns, n_unknowns) at z (n_unknowns,), an array or a coo array of scipy.sparse."""
        self._check_size(interface, z)
        pairing = self._pairing_at(interface, pairing, z)
        tangent = _call_plugin("tangent", self.plugin.tangent, interface, pairing, freeze(z, np.float64))
        return self._check_tangent("tangent", tangent, z.size)

    def residual_and_tangent(
        self, interface: Interface, pairing: Pairing | None, z: FloatArray
    ) -> tuple[FloatArray, Any]:
        """Return residual (n_unknowns,) and tangent, as `tangent` does, at z (n_unknowns,); one call where possible."""
        if "residual_and_tangent" not in self.provides:
            return self.residual(interface, pairing, z), self.tangent(interface, pairing, z)
        self._check_size(interface, z)
        pairing = self._pairing_at(interface, pairing, z)
        verb = "residual_and_tangent"
        answer = _call_plugin(verb, self.plugin.residual_and_tangent, interface, pairing, freeze(z, np.float64))
        if not isinstance(answer, tuple) or len(answer) != 2:
            kind = f"a tuple of {len(answer)}" if isinstance(answer, tuple) else f"a {type(answer).__name__}"
            raise ContractError(f"{verb}: returned {kind}; needed a tuple (residual, tangent)")
        return _check_forces(f"{verb}[0]", answer[0], z), self._check_tangent(f"{verb}[1]", answer[1], z.size)

    def contact_points(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> ContactPoints:
        """Return the contact points at one state z (n_unknowns,)."""
        self._check_size(interface, z)
        pairing = self._pairing_at(interface, pairing, z)
        points = _call_plugin("contact_points", self.plugin.contact_points, interface, pairing, freeze(z, np.float64))
        if not isinstance(points, ContactPoints):
            raise ContractError(f"contact_points: returned a {type(points).__name__}; needed ContactPoints")
        counts = np.array([len(interface.slave), len(interface.master)])
        if len(points.gap) > (most := POINTS_A_SEGMENT * int(counts.sum())):
            raise ContractError(f"contact_points: {len(points.gap)} of them; needed at most {most} on this interface")
        for name, role in (("slave_segment", 0), ("master_segment", 1)):
            numbers, limits = (
                getattr(points, name),
                counts[role ^ points.on_master],
            )  # A second pass exchanges the roles.
            outliers = np.flatnonzero((numbers < -1) | (numbers >= limits))
            if len(outliers):
                first = outliers[0]
                raise ContractError(f"contact_points: {name} {numbers[first]}; needed −1 to {limits[first] - 1}")
        return points

    def answers(self, calls: Sequence[Call]) -> list[Any]:
        """Return the answers of methods that are called one after another; `pair` is none of them.

        A plugin in a process of its own gets all calls in one message. So whoever knows its questions asks them here.
        """
        if not self._remote:
            return [getattr(self, verb)(*arguments) for verb, *arguments in calls]
        for _, interface, _, z in calls:
            self._check_size(interface, z)
        with self.plugin.foresee(calls):
            return [getattr(self, verb)(*arguments) for verb, *arguments in calls]

    def _check_tangent(self, verb: str, tangent: Any, size: int) -> Any:
        """Return a copy of the tangent (size, size), dense or a coo array, or raise an error that begins with the verb.

        What came from another process is a copy already.
        """
        _check_matrix(verb, tangent, size)
        if self.passes_on and compressed_parts(tangent):
            return tangent
        if not self._remote or getattr(tangent, "format", "") in ("csr", "csc"):
            tangent = np.array(tangent) if isinstance(tangent, np.ndarray) else _copy_entries(verb, tangent)
        entries = tangent if isinstance(tangent, np.ndarray) else tangent.data
        if not np.isfinite(entries).all():
            raise NonFiniteError(f"{verb}: {_describe_non_finite(entries)}")
        return tangent

    def _check_size(self, interface: Interface, z: Array) -> None:
        """Check that z has the positions and the multipliers of the formulation, no more and no less."""
        count = self.n_multipliers(interface)
        if z.shape[-1:] != (interface.n_unknowns + count,):
            needed = f"{interface.n_unknowns} positions and {count} multipliers"
            raise MisuseError("z", f"shape {z.shape}", f"(..., {interface.n_unknowns + count}), {needed}")


def _call_plugin(method: str, function: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Return the answer of a plugin; whatever it raises becomes a PluginError that names the method."""
    try:
        with np.errstate():  # A plugin may change how numpy treats errors; that ends here.
            return function(*arguments, **options)
    except (KeyboardInterrupt, ContractError):
        raise
    except BaseException as error:
        cause = "memory" if isinstance(error, MemoryError) else "exit" if isinstance(error, SystemExit) else "exception"
        raise PluginError(f"{method}: {describe_error(error)}", cause) from error


def _check_forces(verb: str, forces: Any, z: Array) -> Array:
    """Return a copy of the forces in the shape and dtype of z, or raise an error that begins with the verb."""
    if not isinstance(forces, np.ndarray):
        raise ContractError(f"{verb}: returned a {type(forces).__name__}; needed an array of shape {z.shape}")
    copy: Array = np.array(forces)  # The plugin may reuse its array; and a subclass may have other rules.
    if copy.shape != z.shape:
        raise ContractError(f"{verb}: returned shape {copy.shape}; needed {z.shape}, that of z")
    if copy.dtype != z.dtype:
        raise ContractError(f"{verb}: returned dtype {copy.dtype}; needed {z.dtype}, that of z")
    if not np.isfinite(copy).all():
        raise NonFiniteError(f"{verb}: {_describe_non_finite(copy)}")
    return copy


def _check_matrix(verb: str, tangent: Any, size: int) -> None:
    """Check that a tangent is a matrix (size, size) of floats, dense or sparse."""
    if not (isinstance(tangent, np.ndarray) or sparse.issparse(tangent)):
        raise ContractError(f"{verb}: returned a {type(tangent).__name__}; needed an array or scipy.sparse")
    if tangent.shape != (size, size):
        raise ContractError(f"{verb}: returned shape {tangent.shape}; needed {(size, size)}")
    if tangent.dtype != np.float64:
        raise ContractError(f"{verb}: returned dtype {tangent.dtype}; needed float64")


def compressed_parts(matrix: Any) -> dict[str, Array]:
    """Return the arrays of a csr or csc matrix as a plugin made it; none for another matrix, or if one is unusual."""
    names = COMPRESSED if getattr(matrix, "format", "") in ("csr", "csc") else ()
    parts = {name: getattr(matrix, name) for name in names}
    usual = all(type(part) is np.ndarray and part.dtype in _ENTRIES for part in parts.values())
    return parts if usual else {}


def _copy_entries(verb: str, tangent: Any) -> Any:
    """Return a copy of a sparse matrix as a coo array. Numbers of rows and columns are checked, as scipy does not.

    A plugin that fills the arrays of a compressed matrix itself may number a row or a column that is not there. scipy
    would read or write outside of its arrays.
    """
    try:
        if tangent.format in ("csr", "csc", "bsr"):
            tangent.check_format(full_check=True)
        return sparse.coo_array(tangent, copy=True)  # It checks the numbers of entries in the other formats.
    except (IndexError, TypeError, ValueError) as error:
        raise ContractError(f"{verb}: returned a broken {tangent.format} matrix: {error}") from error


def _describe_non_finite(values: Array) -> str:
    bad = np.flatnonzero(~np.isfinite(values).reshape(-1))
    return f"{values.reshape(-1)[bad[0]]} in {len(bad)} of {values.size} entries"
