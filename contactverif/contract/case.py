"""One thing to judge: an interface, a state, a penalty. To and from plain arrays, so that it outlives its maker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif.contract.arrays import FloatArray, freeze
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface, Surface

_PREFIX = "parameter_"


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """What a property judges a formulation on.

    Attributes
    ----------
    interface : Interface
        The two meshes in their reference configuration.
    z : FloatArray, shape (n_unknowns,)
        Current positions, a length each, flat: slave nodes first. Behind them the multipliers, if any.
    penalty : float
        Distributed stiffness ε̂ > 0, force per length per length of penetration. A nodal formulation is given
        ε̂ × the mean slave segment.
    parameters : Mapping[str, FloatArray]
        What else the property that made the case needs to know, arrays of floats by name.
    seed : int
        Of anything random that the property does with the case (directions of a derivative).
    name : str
        Of a case that has one ("C", "C′"), else empty.
    n_multipliers : int
        How many of the entries of z are multipliers. A case that is drawn or stored has none; those of a
        formulation are put behind its positions when it is asked.
    """

    interface: Interface
    z: FloatArray
    penalty: float = 1.0
    parameters: Mapping[str, FloatArray] = field(default_factory=dict)
    seed: int = 0
    name: str = ""
    n_multipliers: int = 0

    def __post_init__(self) -> None:
        raw = np.asarray(self.z)
        if raw.dtype.kind not in "fiu":
            raise MisuseError("z", f"dtype {raw.dtype}", "real numbers")
        z = freeze(raw, np.float64)
        if z.shape != (self.interface.n_unknowns + self.n_multipliers,):
            needed = (
                f"({self.interface.n_unknowns + self.n_multipliers},): n_nodes × dim, flat, then multipliers if any"
            )
            raise MisuseError("z", f"shape {z.shape}", needed)
        if not np.isfinite(z).all():
            raise MisuseError("z", "NaN or infinity", "finite positions")
        penalty = np.asarray(self.penalty)
        if penalty.shape != () or penalty.dtype.kind not in "fiu" or not 0 < penalty < np.inf:
            raise MisuseError("penalty", f"{self.penalty!r}", "a finite number > 0")
        seed = np.asarray(self.seed)
        if seed.shape != () or seed.dtype.kind not in "iu" or not 0 <= seed < 2**63:
            raise MisuseError("seed", f"{self.seed!r}", "an integer from 0 to 2^63 − 1")
        object.__setattr__(self, "z", z)
        object.__setattr__(self, "penalty", float(self.penalty))
        object.__setattr__(self, "seed", int(self.seed))
        parameters = {name: freeze(values, np.float64) for name, values in self.parameters.items()}
        object.__setattr__(self, "parameters", parameters)

    @property
    def positions(self) -> FloatArray:
        """Current positions (n_nodes, dim)."""
        return self.z[: self.interface.n_unknowns].reshape(self.interface.nodes.shape)

    @property
    def multipliers(self) -> FloatArray:
        """The multipliers (n_multipliers,), which stand behind the positions."""
        return self.z[self.interface.n_unknowns :]

    def with_multipliers(self, multipliers: FloatArray) -> Case:
        """Return the case with multipliers (n_multipliers,) behind its positions, in place of any that it has."""
        positions = self.z[: self.interface.n_unknowns]
        return replace(self, z=np.concatenate([positions, multipliers]), n_multipliers=len(multipliers))

    @property
    def largest_coordinate(self) -> float:
        """X: the largest coordinate, of the state and the reference."""
        return float(max(np.abs(self.positions).max(), np.abs(self.interface.nodes).max()))

    @property
    def shortest_segment(self) -> float:
        """ℓ: the shortest current segment, both sides."""
        interface = self.interface
        return float(min(surface.lengths(self.positions).min() for surface in (interface.slave, interface.master)))

    @property
    def slave_length(self) -> float:
        """L: the current length of the slave surface."""
        return float(self.interface.slave.lengths(self.positions).sum())

    @property
    def diameter(self) -> float:
        """D: the diagonal of the box around the current state."""
        return float(np.linalg.norm(np.ptp(self.positions, axis=0)))

    @property
    def n_segments(self) -> int:
        """N: segments of both sides."""
        return len(self.interface.slave) + len(self.interface.master)

    def parameter(self, name: str) -> float:
        """A parameter that is one number."""
        return float(self.parameters[name])

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """All of the case as named arrays."""
        interface = self.interface
        arrays: dict[str, ArrayLike] = {
            "nodes": interface.nodes,
            "slave_segments": interface.slave.segments,
            "master_segments": interface.master.segments,
            "z": self.z,
            "penalty": self.penalty,
            "seed": self.seed,
            "name": self.name,
        }
        arrays |= {_PREFIX + name: values for name, values in self.parameters.items()}
        return {name: np.asarray(values) for name, values in arrays.items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, ArrayLike]) -> Case:
        """The case that `to_arrays` took apart."""
        interface = Interface(
            np.asarray(arrays["nodes"], dtype=np.float64),
            Surface(np.asarray(arrays["slave_segments"])),
            Surface(np.asarray(arrays["master_segments"])),
        )
        parameters = {
            name.removeprefix(_PREFIX): np.asarray(values, dtype=np.float64)
            for name, values in arrays.items()
            if name.startswith(_PREFIX)
        }
        return cls(
            interface,
            np.asarray(arrays["z"], dtype=np.float64),
            float(np.asarray(arrays["penalty"])),
            parameters,
            int(np.asarray(arrays["seed"])),
            str(np.asarray(arrays["name"])),
        )
