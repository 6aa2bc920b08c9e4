"""The contract that a plugin fulfils, and the signs and words of the whole house.

Signs: `gap` is negative in penetration; `pressure` ≥ 0; `normal` points out of the master body; the residual is
internal minus external force, so a slave node in contact is pushed along +normal by `-residual`.

An entry point of the group `contactverif.formulations` is a factory `make(*, penalty, **options) -> Formulation`; the
harness chooses the penalty of each case. All but `residual` may be missing; what is missing is reported as
"not provided" and nothing is promised for it. A `ResidualOnly` is the least a plugin is.

Multipliers: a formulation that has some says how many in `n_multipliers(interface)`; they stand behind the positions in
z, and their rows behind the forces in the residual: −area · g where active, area · λ where not. λ ≥ 0 is a pressure
(trait `penalty` "distributed") or a nodal force ("nodal"). What the factory is given as penalty is then the scale c of
the decision λ − c g ≥ 0 and must change no solution.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray, freeze
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.interface import Interface


class Pairing(Mapping[str, NDArray[Any]]):
    """Who touches whom: a flat mapping from names to read-only int64 or bool arrays, and nothing else.

    Every real number (ξ, normal, area of competence) is computed from the positions, so that on a frozen pairing the
    residual is a smooth function and a finite difference shows a forgotten term.

    Raises
    ------
    ContractError
        If a value is no array of integers or booleans, or a name is no string.
    """

    __slots__ = ("_arrays",)

    def __init__(self, arrays: Mapping[str, Any]) -> None:
        if not isinstance(arrays, Mapping):
            raise ContractError(f"pair: returned a {type(arrays).__name__}; needed a mapping from names to arrays")
        checked: dict[str, NDArray[Any]] = {}
        for name, values in arrays.items():
            if not isinstance(name, str):
                raise ContractError(f"pair: the name {name!r} is a {type(name).__name__}; needed a string")
            if not isinstance(values, np.ndarray) or values.dtype not in (np.int64, np.bool_):
                found = f"dtype {values.dtype}" if isinstance(values, np.ndarray) else f"a {type(values).__name__}"
                raise ContractError(f"pair: {name!r} is {found}; needed an array of int64 or bool")
            checked[name] = freeze(values, values.dtype.type)
        self._arrays = checked

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pairing) and self.same_as(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"Pairing({', '.join(f'{name}{values.shape}' for name, values in self._arrays.items())})"

    def check_bounds(self, interface: Interface) -> None:
        """Integers number something: a segment, a node, an unknown, an entry of a pattern, or nothing (−1).

        Raises
        ------
        ContractError
            If a value is below −1 or above the sizes of the problem.
        """
        pattern = max((values.size for values in self._arrays.values()), default=0)
        most = max(interface.n_unknowns, pattern)
        for name, values in self._arrays.items():
            if values.dtype == np.int64 and values.size and not -1 <= values.min() <= values.max() <= most:
                outlier = values.min() if values.min() < -1 else values.max()
                raise ContractError(f"pair: {name!r} holds {outlier}; needed integers from −1 to {most}")

    def same_as(self, other: Pairing) -> bool:
        """Whether names, shapes and all values agree."""
        return self._arrays.keys() == other._arrays.keys() and all(
            np.array_equal(values, other._arrays[name]) for name, values in self._arrays.items()
        )


_WORDS: dict[str, tuple[object, ...]] = {
    "passes_flat_patch": (True, False, None),
    "covers_overhang": (True, False, None),
    "tangent": ("exact", "approximate", None),
    "symmetric": (True, False, None),
    "conserves_force": (True, False, None),
    "conserves_moment": (True, False, None),
    "continuity": ("C0", "C1", None),
    "area": ("reference", "current", None),
    "penalty": ("nodal", "distributed", None),
    "enforcement": ("penalty", "multiplier", "barrier"),
    "independent_multipliers": (True, False, None),
    "batched": (True, False),
    "takes_complex": (True, False),
}


@dataclass(frozen=True, slots=True)
class Traits:
    """What a formulation promises. None promises nothing; False says "does not" and names a witness.

    Attributes
    ----------
    passes_flat_patch : bool | None
        Transmits a uniform pressure exactly across any flat interface that it covers; one by penalty the
        pressure ε̂ |g|, so a law that is not linear promises nothing here.
    covers_overhang : bool | None
        Does so too where the slave overhangs the master inside a slave segment.
    tangent : Literal['exact', 'approximate'] | None
        "exact" is the derivative of the residual on a frozen pairing; "approximate" is not.
    symmetric : bool | None
        The tangent is symmetric.
    conserves_force, conserves_moment : bool | None
        Slave and master forces balance at any tilt and curvature.
    continuity : Literal['C0', 'C1'] | None
        How smooth the forces are while a node slides over the vertices of a master that no line along the
        normal meets twice, "C0" or "C1".
    area : Literal['reference', 'current'] | None
        The configuration in which areas of competence are measured; they add up to the slave's length, so that
        a uniform penetration gives the total force ε̂ |g| × that. None where springs act twice (two-pass).
    penalty : Literal['nodal', 'distributed'] | None
        "nodal" (force per length) or "distributed" (force per length per length of penetration); of a
        multiplier, whether it is a nodal force or a pressure.
    enforcement : Literal['penalty', 'multiplier', 'barrier']
        How contact is enforced.
    independent_multipliers : bool | None
        The constraints are independent on any mesh, so that the multipliers are unique.
    dimensions : tuple[int, ...]
        Numbers of coordinates that it can do.
    batched : bool
        `residual` takes a batch of states, z (..., n_unknowns).
    takes_complex : bool
        `residual` takes complex positions, so that a complex step works.
    witnesses : Mapping[str, str]
        {property id: name of a case} for each promise "does not"; the case always runs. The beginning of an id
        stands for all below it: "patch" is the witness of "patch.flat.solve" too. A property that solves bodies
        takes the scene of that name ("c-prime", or with options "c-prime:penalty=1e4").
    source : str
        Where the formulation is published.

    Raises
    ------
    ContractError
        For a word that is none of these, such as a misspelt promise.
    """

    passes_flat_patch: bool | None = None
    covers_overhang: bool | None = None
    tangent: Literal["exact", "approximate"] | None = None
    symmetric: bool | None = None
    conserves_force: bool | None = None
    conserves_moment: bool | None = None
    continuity: Literal["C0", "C1"] | None = None
    area: Literal["reference", "current"] | None = None
    penalty: Literal["nodal", "distributed"] | None = None
    enforcement: Literal["penalty", "multiplier", "barrier"] = "penalty"
    independent_multipliers: bool | None = None
    dimensions: tuple[int, ...] = (2,)
    batched: bool = False
    takes_complex: bool = False
    witnesses: Mapping[str, str] = field(default_factory=dict)
    source: str = ""

    def witness(self, property_id: str) -> str | None:
        """The name of the case that shows that the property fails, None where there is none."""
        parts = property_id.split(".")
        for n in range(len(parts), 0, -1):
            if (name := self.witnesses.get(".".join(parts[:n]))) is not None:
                return name
        return None

    def __post_init__(self) -> None:
        for name, words in _WORDS.items():
            if getattr(self, name) not in words:
                found, needed = repr(getattr(self, name)), ", ".join(map(repr, words))
                raise ContractError(f"Traits.{name}: found {found}; needed one of {needed}")
        if not isinstance(self.witnesses, Mapping):
            raise ContractError(
                f"Traits.witnesses: found a {type(self.witnesses).__name__}; needed {{property id: name of a case}}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class ContactPoints:
    """Where a formulation looks for contact and what it finds there; NaN (−1 for integers) where meaningless.

    Attributes
    ----------
    slave_segment : IntArray, shape (n_points,)
        The slave segment that carries the point.
    c : FloatArray, shape (n_points,)
        Where on it, −1 at its first node, +1 at its second.
    master_segment : IntArray, shape (n_points,)
        The segment that it is measured against.
    xi : FloatArray, shape (n_points,)
        Foot on the master segment, 0 at its first node, 1 at its second, unclipped.
    position, normal : FloatArray, shape (n_points, dim)
        A length; a unit vector out of the master body.
    gap : FloatArray, shape (n_points,)
        A length, negative in penetration.
    pressure : FloatArray, shape (n_points,)
        Force per length of the interface, ≥ 0 (a nodal method: the force).
    weight : FloatArray, shape (n_points,)
        A length, the area of competence (a nodal method: 1).
    active : BoolArray, shape (n_points,)
        In contact.
    area_from, area_to : FloatArray, shape (n_points,)
        The ends of the area of competence on the slave segment, as `c`.
    """

    slave_segment: IntArray
    c: FloatArray
    master_segment: IntArray
    xi: FloatArray
    position: FloatArray
    normal: FloatArray
    gap: FloatArray
    pressure: FloatArray
    weight: FloatArray
    active: BoolArray
    area_from: FloatArray
    area_to: FloatArray

    def __post_init__(self) -> None:
        dtypes = {"slave_segment": np.int64, "master_segment": np.int64, "active": np.bool_}
        n_points = len(np.atleast_1d(np.asarray(self.slave_segment)))
        for entry in fields(self):
            raw, dtype = np.asarray(getattr(self, entry.name)), dtypes.get(entry.name, np.float64)
            if raw.size and not np.can_cast(raw.dtype, dtype, casting="safe"):  # or 0.7 becomes segment 0
                raise MisuseError(f"ContactPoints.{entry.name}", f"dtype {raw.dtype}", np.dtype(dtype).name)
            values: NDArray[Any] = freeze(raw, dtype)
            wanted = 2 if entry.name in ("position", "normal") else 1
            if values.ndim != wanted or len(values) != n_points:
                raise MisuseError(
                    f"ContactPoints.{entry.name}",
                    f"shape {values.shape}",
                    f"({n_points}, dim)" if wanted == 2 else f"({n_points},)",
                )
            object.__setattr__(self, entry.name, values)


class ResidualOnly(Protocol):
    """The least a plugin is."""

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array, /) -> Array:
        """Nodal forces (..., n_unknowns), internal minus external, at the positions z (..., n_unknowns).

        Behind them, where there are multipliers, the constraint rows; z and the answer are of one shape. `pairing` is
        what `pair` returned, None where the plugin has no `pair`. The leading axes are a batch of states, used only
        where `traits.batched`.
        """
        ...


class Formulation(ResidualOnly, Protocol):
    """The whole contract of a penalty formulation; one with multipliers has `n_multipliers(interface) -> int` too."""

    @property
    def traits(self) -> Traits:
        """What is promised."""
        ...

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing | Mapping[str, NDArray[Any]]:
        """Who touches whom at the positions z (n_unknowns,): integers and booleans only."""
        ...

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> Any:
        """Derivative (n_unknowns, n_unknowns) of the residual on a frozen pairing, dense or scipy.sparse."""
        ...

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """The points of contact at the positions z (n_unknowns,)."""
        ...
