"""Mutants that are right on straight surfaces: springs at Gauss points whose stiffness depends on what it must not.

Tangents are exact, action equals reaction, and nothing is reported: what is wrong shows in the forces alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from mutate import Mutant, says

import contactverif_mortar
import contactverif_nts
from contactverif import Interface, Pairing
from contactverif_nts.two_passes import two_pass

STEP = 1e-40
CONTINUITY = "continuity"
SYMMETRIC, MIRROR, RENUMBERING, REMOTE, SWAP = "symmetric", "mirror", "renumbering", "remote", "swap"
RESULTANT, DISTRIBUTION, BEND = "patch.tilted.resultant", "patch.tilted.nodal", "locality.bend"


@dataclass
class Look:
    """The state that a factor may look at: the positions, and of each point its slave and its master segment."""

    interface: Interface
    x: Any  # (n_nodes, 2), real or complex
    slave: Any  # (n_points,), segments
    master: Any

    def tangents(self, side: str, segments: Any) -> Any:
        """Return unit tangents (n, 2) of segments of one side."""
        ends = self.x[getattr(self.interface, side).segments[segments]]
        along = ends[:, 1] - ends[:, 0]
        return along / np.sqrt((along**2).sum(axis=1))[:, None]

    def turns(self, side: str, segments: Any, end: int) -> Any:
        """Return the sine of the turn to the previous (0) or the next (1) segment; 0 at a free end."""
        others = getattr(self.interface, side).neighbours[segments, end]
        here, there = self.tangents(side, segments), self.tangents(side, others)
        sine = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
        return np.where(others < 0, 0.0, sine if end else -sine)

    def lengths(self, side: str, segments: Any) -> Any:
        ends = self.x[getattr(self.interface, side).segments[segments]]
        return np.sqrt(((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1))


Factor = Callable[[Look], Any]


class FactoredSprings:
    """Springs at two Gauss points of each slave segment; each force is multiplied by a factor that should be 1."""

    def __init__(self, penalty: float, factor: Factor, **traits: Any) -> None:
        self.penalty, self.factor = penalty, factor
        self._inner = contactverif_nts.vts_g(penalty=penalty)
        self.traits = self._inner.traits.revise(takes_longdouble=False, **traits)

    def pair(self, interface: Any, z: Any) -> Any:
        return self._inner.pair(interface, z)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        states = z.reshape(-1, z.shape[-1])
        return np.array([self._residual(interface, pairing, state) for state in states]).reshape(z.shape)

    def _residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        active = pairing["active"]
        slave, master = pairing["segment"][active], pairing["master"][active]
        c = self._inner.c[pairing["slot"][active]][:, None]
        look = Look(interface, x, slave, master)
        (a, b), (m1, m2) = interface.slave.segments[slave].T, interface.master.segments[master].T
        t, length = look.tangents("master", master), look.lengths("master", master)
        arm = (1 - c) / 2 * (x[a] - x[m1]) + (1 + c) / 2 * (x[b] - x[m1])
        gap, xi = arm[:, 0] * t[:, 1] - arm[:, 1] * t[:, 0], ((arm * t).sum(axis=1) / length)[:, None]
        size = self.penalty * gap * look.lengths("slave", slave) / 2 * self.factor(look)
        force = size[:, None] * np.stack([t[:, 1], -t[:, 0]], axis=1)
        forces = np.zeros_like(x)
        for nodes, share in ((a, (1 - c) / 2), (b, (1 + c) / 2), (m1, xi - 1), (m2, -xi)):
            np.add.at(forces, nodes, share * force)
        return forces.reshape(-1)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        moved = z + 1j * STEP * np.eye(z.size)
        return self.residual(interface, pairing, moved).imag.T / STEP


def make_factored(name: str, caught_by: str, factor: Factor, **traits: Any) -> Mutant:
    return Mutant(name, caught_by, lambda *, penalty: FactoredSprings(penalty, factor, **traits))


def _cosine_of_tilt_squared(look: Look) -> Any:
    """Return cos² of the angle between the two segments: 1 where they are parallel."""
    return (look.tangents("slave", look.slave) * look.tangents("master", look.master)).sum(axis=1) ** 2


def _off_where_steep(error: float) -> Factor:
    """Return the factor 1 + `error` at tilts between 80° and 88°, else 1."""

    def factor(look: Look) -> Any:
        cosine = abs((look.tangents("slave", look.slave) * look.tangents("master", look.master)).sum(axis=1).real)
        return 1 + error * ((np.cos(np.radians(88)) < cosine) & (cosine < np.cos(np.radians(80))))

    return factor


def _soft_where_bent(look: Look) -> Any:
    """Return less than 1 where the neighbours of the master segment turn away from it."""
    turn = look.turns("master", look.master, 0) + look.turns("master", look.master, 1)
    return 1 / (1 + 3 * turn**2)


def _stiffer_towards_the_longer_neighbour(look: Look) -> Any:
    """Return more than 1 where the slave bends and its next segment is longer than the previous one, else less."""
    before, behind = (look.interface.slave.neighbours[look.slave, end] for end in (0, 1))
    longer = look.lengths("slave", behind) - look.lengths("slave", before)
    both = look.lengths("slave", behind) + look.lengths("slave", before)
    lopsided = np.where((before < 0) | (behind < 0), 0.0, longer / both)
    return 1 + (look.turns("slave", look.slave, 0) + look.turns("slave", look.slave, 1)) * lopsided / 2


def _stiffer_on_odd_segments(look: Look) -> Any:
    """Return more than 1 where a bent slave segment has an odd number."""
    return 1 + look.slave % 2 * (look.turns("slave", look.slave, 0) ** 2 + look.turns("slave", look.slave, 1) ** 2)


def _stiffer_on_short_segments(look: Look) -> Any:
    """Return more than 1 where the slave bends, by the mean length of all slave segments over its own."""
    everywhere = look.lengths("slave", np.arange(len(look.interface.slave))).mean()
    turn = look.turns("slave", look.slave, 0) ** 2 + look.turns("slave", look.slave, 1) ** 2
    return 1 + turn * everywhere / look.lengths("slave", look.slave) / 4


class OneAndAHalfPasses:
    """Two passes of NTS-AR, of which the first counts for one tenth more."""

    def __init__(self, *, penalty: float) -> None:
        self._both = two_pass(penalty=penalty, inner=contactverif_nts.nts_ar)
        self._first = contactverif_nts.nts_ar(penalty=penalty / 10)
        self.traits = self._both.traits

    def pair(self, interface: Any, z: Any) -> Any:
        first, both = self._first.pair(interface, z), self._both.pair(interface, z)
        return {**both, **{f"more {name}": values for name, values in first.items()}}

    def _pairings(self, pairing: Any) -> tuple[Any, Any]:
        first = {name.removeprefix("more "): values for name, values in pairing.items() if name.startswith("more ")}
        both = {name: values for name, values in pairing.items() if not name.startswith("more ")}
        return Pairing(first), Pairing(both)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        first, both = self._pairings(pairing)
        return self._first.residual(interface, first, z) + self._both.residual(interface, both, z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        first, both = self._pairings(pairing)
        tangents = self._first.tangent(interface, first, z), self._both.tangent(interface, both, z)
        return sum(tangent.toarray() for tangent in tangents)


class ForcesAlone:
    """The forces of NTS-AR, without a tangent, said to have a potential."""

    def __init__(self, *, penalty: float) -> None:
        inner = contactverif_nts.nts_ar(penalty=penalty)
        self.pair, self.residual = inner.pair, inner.residual
        self.traits = inner.traits.revise(tangent=None, symmetric=True)


MUTANTS = (
    make_factored("pressure that falls with the tilt", RESULTANT, _cosine_of_tilt_squared, integrates_linear_gap=None),
    make_factored("forces off by 1e-9 at tilts of 80° to 88°", RESULTANT, _off_where_steep(1e-9),
                  integrates_linear_gap=None),
    make_factored("forces off by 1 % at tilts of 80° to 88°", RESULTANT, _off_where_steep(0.01),
                  integrates_linear_gap=None),
    Mutant("quarter points said to integrate a linear gap", DISTRIBUTION,
           says(contactverif_nts.vts_me, integrates_linear_gap=True)),
    make_factored("springs softer where the master bends", BEND, _soft_where_bent, area=None),
    Mutant("current areas said to be symmetric", SYMMETRIC, says(contactverif_nts.nts_ar, symmetric=True)),
    Mutant("nodes on segments said to be symmetric and smooth", CONTINUITY,
           says(contactverif_nts.nts_ar, symmetric=True, continuity="C1")),
    Mutant("nodes on segments said to push continuously", CONTINUITY, says(contactverif_nts.nts, continuity="C0")),
    Mutant("cells said to be smooth", CONTINUITY, says(contactverif_mortar.sts, continuity="C1")),
    Mutant("forces without a potential said to have one", SYMMETRIC, ForcesAlone),
    make_factored("springs stiffer towards the longer neighbour", MIRROR, _stiffer_towards_the_longer_neighbour,
                  area=None),
    make_factored("springs stiffer on odd segments", RENUMBERING, _stiffer_on_odd_segments, area=None),
    make_factored("springs scaled by the mean segment of all bodies", REMOTE, _stiffer_on_short_segments, area=None),
    Mutant("first of two passes counts for more", SWAP, OneAndAHalfPasses),
)  # fmt: skip
