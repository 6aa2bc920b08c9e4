"""A formulation on trial: the plugin behind a counter where every answer is checked before it is used.

What a plugin may leave out is filled in here (no pairing, a loop instead of a batch), and what it breaks is raised as
a `ContractError`; judging is for the properties.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, freeze
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError
from contactverif.contract.formulation import ContactPoints, Pairing, Traits
from contactverif.contract.interface import Interface

OPTIONAL_PARTS = ("pair", "tangent", "contact_points")


class Subject:
    """A factory of formulations, and the traits of what it makes.

    Parameters
    ----------
    name : str
        As on the command line, with options.
    make : Callable[..., Any]
        `make(penalty=…)` gives the formulation.

    Raises
    ------
    PluginError, ContractError
        If the factory raises, or what it makes has no `residual`.
    """

    def __init__(self, name: str, make: Callable[..., Any]) -> None:
        self.name = name
        self._make = make
        plugin = _asked("make", make, penalty=1.0)
        if not callable(getattr(plugin, "residual", None)):
            raise ContractError(f"make: returned a {type(plugin).__name__} without a `residual`")
        traits = _asked("traits", getattr, plugin, "traits", Traits())
        if not isinstance(traits, Traits):
            raise ContractError(
                f"traits: found a {type(traits).__name__}; needed contactverif.contract.formulation.Traits"
            )
        self.traits: Traits = traits
        self.provides = frozenset(
            part for part in OPTIONAL_PARTS if callable(_asked(part, getattr, plugin, part, None))
        )

    def penalty(self, case: Case) -> float:
        """The penalty in this formulation's own kind: ε̂ as it is, or ε̂ × the mean slave segment if nodal."""
        if self.traits.penalty != "nodal":
            return case.penalty
        return case.penalty * float(case.interface.slave.lengths(case.interface.nodes).mean())

    def for_case(self, case: Case) -> CheckedFormulation:
        """The formulation with the penalty of the case."""
        return self.with_penalty(self.penalty(case))

    def with_penalty(self, penalty: float) -> CheckedFormulation:
        """The formulation with a penalty in its own kind."""
        return CheckedFormulation(_asked("make", self._make, penalty=penalty), self.traits, self.provides)


class CheckedFormulation:
    """One formulation; the four verbs of the contract, every answer checked.

    Raises
    ------
    PluginError
        From any verb, if the plugin raises.
    ContractError
        If an answer is of the wrong kind, shape or dtype, or a pairing holds what it must not.
    NonFiniteError
        If an answer holds NaN or infinity.
    MisuseError
        If z has not as many numbers as there are positions and multipliers.
    """

    def __init__(self, plugin: Any, traits: Traits, provides: frozenset[str]) -> None:
        self.plugin = plugin  # itself, for who times it: nothing that it answers is checked
        self._traits = traits
        self.provides = provides
        self._counts: dict[int, tuple[Interface, int]] = {}  # the interface too, lest another gets its place

    def n_multipliers(self, interface: Interface) -> int:
        """How many multipliers stand behind the positions in z; 0 where the plugin does not mention any.

        Asked once an interface: a plugin that counts anew later breaks its own shapes.
        """
        if id(interface) not in self._counts:
            self._counts[id(interface)] = interface, self._counted(interface)
        return self._counts[id(interface)][1]

    def _counted(self, interface: Interface) -> int:
        count = self._count(interface)
        if (count > 0) is not (self._traits.enforcement == "multiplier"):
            needed = '"multiplier"' if count else "n_multipliers(interface) ≥ 1"
            found = f"{count} of them, with the trait enforcement {self._traits.enforcement!r}"
            raise ContractError(f"n_multipliers: {found}; needed {needed}")
        return count

    def _count(self, interface: Interface) -> int:
        count = _asked("n_multipliers", getattr, self.plugin, "n_multipliers", None)
        if count is None:
            return 0
        number = _asked("n_multipliers", count, interface)
        if not isinstance(number, int | np.integer) or isinstance(number, bool) or number < 0:
            raise ContractError(f"n_multipliers: returned {number!r}; needed an integer ≥ 0")
        return int(number)

    def pair(self, interface: Interface, z: FloatArray) -> Pairing | None:
        """The pairing at z (n_unknowns,), None where the plugin has none."""
        if "pair" not in self.provides:
            return None
        self._check_size(interface, z)
        answer = _asked("pair", self.plugin.pair, interface, freeze(z, np.float64))
        pairing = answer if isinstance(answer, Pairing) else _asked("pair", Pairing, answer)
        pairing.check_bounds(interface)
        return pairing

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        """Forces (..., n_unknowns) at z (..., n_unknowns); a loop where the plugin does one state at a time."""
        self._check_size(interface, z)
        if z.ndim == 1 or self._traits.batched:
            return self._residual(interface, pairing, z)
        forces = np.empty_like(z)
        for index in np.ndindex(z.shape[:-1]):
            forces[index] = self._residual(interface, pairing, z[index])
        return forces

    def _residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        forces = _asked("residual", self.plugin.residual, interface, pairing, freeze(z, z.dtype.type))
        if not isinstance(forces, np.ndarray):
            raise ContractError(f"residual: returned a {type(forces).__name__}; needed an array of shape {z.shape}")
        forces = np.array(forces)  # a copy, since the plugin may use its own again; and no subclass with its own rules
        if forces.shape != z.shape:
            raise ContractError(f"residual: returned shape {forces.shape}; needed {z.shape}, that of z")
        if forces.dtype != z.dtype:
            raise ContractError(f"residual: returned dtype {forces.dtype}; needed {z.dtype}, that of z")
        if not np.isfinite(forces).all():
            raise NonFiniteError(f"residual: {_first_bad(forces)}")
        return forces

    def tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> Any:
        """The tangent (n_unknowns, n_unknowns) at z (n_unknowns,), an array or a scipy.sparse coo array."""
        self._check_size(interface, z)
        tangent = _asked("tangent", self.plugin.tangent, interface, pairing, freeze(z, np.float64))
        if not (isinstance(tangent, np.ndarray) or sparse.issparse(tangent)):
            raise ContractError(f"tangent: returned a {type(tangent).__name__}; needed an array or scipy.sparse")
        if tangent.shape != (z.size, z.size):
            raise ContractError(f"tangent: returned shape {tangent.shape}; needed {(z.size, z.size)}")
        if tangent.dtype != np.float64:
            raise ContractError(f"tangent: returned dtype {tangent.dtype}; needed float64")
        tangent = np.array(tangent) if isinstance(tangent, np.ndarray) else tangent.tocoo(copy=True)
        entries = tangent if isinstance(tangent, np.ndarray) else tangent.data
        if not np.isfinite(entries).all():
            raise NonFiniteError(f"tangent: {_first_bad(entries)}")
        return tangent

    def contact_points(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> ContactPoints:
        """The points of contact at z (n_unknowns,)."""
        self._check_size(interface, z)
        points = _asked("contact_points", self.plugin.contact_points, interface, pairing, freeze(z, np.float64))
        if not isinstance(points, ContactPoints):
            raise ContractError(f"contact_points: returned a {type(points).__name__}; needed ContactPoints")
        for name, surface in (("slave_segment", interface.slave), ("master_segment", interface.master)):
            numbers = getattr(points, name)
            if numbers.size and not -1 <= numbers.min() <= numbers.max() < len(surface):
                outlier = numbers.min() if numbers.min() < -1 else numbers.max()
                raise ContractError(f"contact_points: {name} {outlier}; needed −1 to {len(surface) - 1}")
        return points

    def _check_size(self, interface: Interface, z: Array) -> None:
        """A plugin that has multipliers is never asked about a state without them, nor any other with too many."""
        count = self.n_multipliers(interface)
        if z.shape[-1:] != (interface.n_unknowns + count,):
            needed = f"{interface.n_unknowns} positions and {count} multipliers"
            raise MisuseError("z", f"shape {z.shape}", f"(..., {interface.n_unknowns + count}), {needed}")


def _asked(verb: str, function: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """What the plugin answers; whatever it raises becomes a PluginError that says where."""
    try:
        with np.errstate():  # what the plugin does to numpy's ways with errors ends here
            return function(*arguments, **options)
    except (KeyboardInterrupt, ContractError):
        raise
    except BaseException as error:
        raise PluginError(f"{verb}: {type(error).__name__}: {error}") from error


def _first_bad(values: Array) -> str:
    bad = np.flatnonzero(~np.isfinite(values).reshape(-1))
    return f"{values.reshape(-1)[bad[0]]} in {len(bad)} of {values.size} entries"
