"""Two concentric arcs that penetrate each other: an interface without bodies, with the exact limit of its forces.

All slave points penetrate by the same depth, so that springs press with the same pressure everywhere. On a mesh of
straight segments forces differ from that by the square of their length, whatever the rule by which a formulation
measures gaps. Springs that depend on how the surface bends differ on every mesh.

Whole circles are closed chains, a disc in a hole or a hole around a disc.

Rule for the next editor: the master reaches beyond the slave at either end, so that nothing overhangs.
"""

from dataclasses import dataclass
from math import radians
from typing import Self

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface, Surface

GRADE = 0.15  # Angles of the master are graded by so much, so that nodes do not meet nodes of the slave.
WHOLE = 360.0  # Degrees
SEGMENTS = (3, 4)  # Numbers of segments of slave and master on the coarsest mesh, at refine = 1.


@dataclass(frozen=True, slots=True)
class Arcs:
    """Two concentric arcs."""

    radius: float = 4.0  # The radius of the master, a length.
    depth: float = 0.1  # The penetration d > 0, a length.
    convex_slave: bool = True  # True if the slave's body lies inside its arc, else around it.
    slave: tuple[float, float] = (10.0, 80.0)  # The angles at which each begins and ends, in degrees.
    master: tuple[float, float] = (0.0, 90.0)
    penalty: float = 10.0  # The distributed stiffness ε̂.

    @property
    def slave_radius(self) -> float:
        """The radius of the slave: a convex one reaches out over the master, a concave one in."""
        return self.radius + (self.depth if self.convex_slave else -self.depth)

    @property
    def pressure(self) -> float:
        """The pressure ε̂ d on the slave, force per length."""
        return self.penalty * self.depth

    @property
    def length(self) -> float:
        """The length of the slave's arc."""
        return self.slave_radius * radians(self.slave[1] - self.slave[0])

    def case(self, refine: int = 1, name: str = "") -> Case:
        """Return the arcs as meshes of straight segments, the nodes on the arcs; the slave's segments are all alike.

        The numbers of whole circles begin anywhere.
        """
        shares = np.linspace(0, 1, SEGMENTS[0] * refine + 1), np.linspace(0, 1, SEGMENTS[1] * refine + 1)
        slave = _directions(self.slave, shares[0])
        master = _directions(self.master, shares[1] + GRADE * shares[1] * (1 - shares[1]))
        if self.convex_slave:  # The body is on the left: counter-clockwise around it.
            master = master[::-1]
        else:
            slave = slave[::-1]
        interface = Interface.from_chains(self.radius * slave, self.radius * master)
        if self.slave[1] - self.slave[0] == WHOLE:
            seams = np.random.default_rng(refine).integers(1, min(len(slave), len(master)) - 1, 2)
            slave, master = (
                np.roll(side[:-1], seam, axis=0) for side, seam in zip((slave, master), seams, strict=True)
            )
            number, n_slave = np.arange(len(slave) + len(master)), len(slave)
            surfaces = (Surface(np.column_stack([each, np.roll(each, -1)])) for each in np.split(number, [n_slave]))
            interface = Interface(self.radius * np.vstack([slave, master]), *surfaces)
        z = np.concatenate([self.slave_radius * slave, self.radius * master]).reshape(-1)
        names = "radius", "depth", "convex_slave", "slave", "master"
        facts = {name: np.array(getattr(self, name), dtype=np.float64) for name in names}
        return Case(interface, z, self.penalty, facts, name=name)

    @classmethod
    def from_case(cls, case: Case) -> Self:
        """Return the arcs that a case was made of by `case`, on whatever mesh."""
        slave, master = (tuple(case.parameters[side].tolist()) for side in ("slave", "master"))
        radius, depth, convex = map(case.parameter, ("radius", "depth", "convex_slave"))
        return cls(radius, depth, bool(convex), slave, master, case.penalty)


def _directions(degrees: tuple[float, float], shares: FloatArray) -> FloatArray:
    angles = np.radians(degrees[0] + (degrees[1] - degrees[0]) * shares)
    return np.column_stack([np.cos(angles), np.sin(angles)])
