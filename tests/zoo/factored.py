"""Mutants that are right on straight surfaces: springs whose stiffness depends on what it must not.

Tangents are exact, action equals reaction, and `FactoredSprings` report nothing: what is wrong shows in the forces
alone.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import contactverif_mortar
import contactverif_nts
from contactverif import Pairing
from zoo.making import add, mutant

STEP = 1e-40
RESULTANT, ARC, KINKED = "patch.tilted.resultant", "accuracy.arc", "patch.kinked"
LEAST_TURN = 1e-6  # The sine of the angle between segments below which a surface counts as flat.


@dataclass
class Look:
    """The state that a factor may look at: the positions, and of each point its slave and its master segment."""

    interface: Any
    x: Any  # (n_nodes, 2), real or complex
    slave: Any  # (n_points,), segments
    master: Any

    def tangents(self, side, segments):
        """Return unit tangents (n, 2) of segments of one side."""
        ends = self.x[getattr(self.interface, side).segments[segments]]
        along = ends[:, 1] - ends[:, 0]
        return along / np.sqrt((along**2).sum(axis=1))[:, None]

    def both_tangents(self):
        return self.tangents("slave", self.slave), self.tangents("master", self.master)

    def turns(self, side, segments, end):
        """Return the sine of the turn to the previous (0) or the next (1) segment; 0 at a free end."""
        others = getattr(self.interface, side).neighbours[segments, end]
        here, there = self.tangents(side, segments), self.tangents(side, others)
        sine = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
        return np.where(others < 0, 0.0, sine if end else -sine)

    def slave_turns(self):
        """Return the turns of the slave segments to the previous and to the next one."""
        return self.turns("slave", self.slave, 0), self.turns("slave", self.slave, 1)

    def lengths(self, side, segments):
        ends = self.x[getattr(self.interface, side).segments[segments]]
        return np.sqrt(((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1))


class FactoredSprings:
    """Springs at two Gauss points of each slave segment; each force is multiplied by a factor that should be 1."""

    def __init__(self, penalty, factor, **traits):
        self.penalty, self.factor = penalty, factor
        self._inner = contactverif_nts.vts_g(penalty=penalty)
        self.traits = self._inner.traits.revise(takes_longdouble=False, **traits)

    def pair(self, interface, z):
        return self._inner.pair(interface, z)

    def residual(self, interface, pairing, z):
        states = z.reshape(-1, z.shape[-1])
        return np.array([self._residual(interface, pairing, state) for state in states]).reshape(z.shape)

    def _residual(self, interface, pairing, z):
        x, active = z.reshape(-1, 2), pairing["active"]
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

    def tangent(self, interface, pairing, z):
        moved = z + 1j * STEP * np.eye(z.size)
        return self.residual(interface, pairing, moved).imag.T / STEP


def _springs(name, caught_by, **traits):
    """Decorate `factor(look)`, and register springs with that factor and these traits."""

    def decorate(factor):
        add(name, caught_by, lambda *, penalty: FactoredSprings(penalty, factor, **traits))
        return factor

    return decorate


@_springs("pressure that falls with the tilt", RESULTANT, integrates_linear_gap=None)
def _(look):
    """Return cos² of the angle between the two segments: 1 where they are parallel."""
    slave, master = look.both_tangents()
    return (slave * master).sum(axis=1) ** 2


def _off_where_steep(error):
    """Return the factor 1 + `error` at tilts between 80° and 88°, else 1."""

    def factor(look):
        slave, master = look.both_tangents()
        cosine = abs((slave * master).sum(axis=1).real)
        return 1 + error * ((np.cos(np.radians(88)) < cosine) & (cosine < np.cos(np.radians(80))))

    return factor


_springs("forces off by 1e-9 at tilts of 80° to 88°", RESULTANT, integrates_linear_gap=None)(_off_where_steep(1e-9))
_springs("forces off by 1 % at tilts of 80° to 88°", RESULTANT, integrates_linear_gap=None)(_off_where_steep(0.01))


@_springs("springs softer where the master bends", "locality.bend", area=None)
def _(look):
    turn = look.turns("master", look.master, 0) + look.turns("master", look.master, 1)
    return 1 / (1 + 3 * turn**2)


@_springs("springs stiffer towards the longer neighbour", "mirror", area=None)
def _(look):
    """Return more than 1 where the slave bends and its next segment is longer than the previous one, else less."""
    before, behind = (look.interface.slave.neighbours[look.slave, end] for end in (0, 1))
    longer = look.lengths("slave", behind) - look.lengths("slave", before)
    both = look.lengths("slave", behind) + look.lengths("slave", before)
    lopsided = np.where((before < 0) | (behind < 0), 0.0, longer / both)
    first, second = look.slave_turns()
    return 1 + (first + second) * lopsided / 2


@_springs("springs stiffer on odd segments", "renumbering", area=None)
def _(look):
    """Return more than 1 where a bent slave segment has an odd number."""
    first, second = look.slave_turns()
    return 1 + look.slave % 2 * (first**2 + second**2)


@_springs("springs scaled by the mean segment of all bodies", "remote", area=None)
def _(look):
    """Return more than 1 where the slave bends, by the mean length of all slave segments over its own."""
    everywhere = look.lengths("slave", np.arange(len(look.interface.slave))).mean()
    first, second = look.slave_turns()
    return 1 + (first**2 + second**2) * everywhere / look.lengths("slave", look.slave) / 4


@_springs("springs a quarter as stiff where the slave bends", "patch.curved")
def _(look):
    first, second = look.slave_turns()
    return np.where((abs(first) + abs(second)).real > LEAST_TURN, 0.25, 1.0)


@_springs("springs softer by the square of depth over radius", ARC)
def _(look):
    """Return 1 − 30 (d/R)², d the depth of the middle of the slave segment and R the radius of the slave's turn."""
    ends = look.x[look.interface.slave.segments[look.slave]]
    first = look.x[look.interface.master.segments[look.master, 0]]
    along, arm = look.tangents("master", look.master), ends.mean(axis=1) - first
    depth = arm[:, 0] * along[:, 1] - arm[:, 1] * along[:, 0]
    curvature = look.turns("slave", look.slave, 1) / look.lengths("slave", look.slave)
    return 1 - 30 * (depth * curvature) ** 2


@_springs("springs 0.3 % stiffer where segments turn by 0.3° to 2.9°", ARC)
def _(look):
    largest = np.maximum(*(abs(turn.real) for turn in look.slave_turns()))
    return np.where((largest > np.sin(np.radians(0.3))) & (largest < np.sin(np.radians(2.9))), 1.003, 1)


@_springs("springs 1 % softer at the ends of arcs", ARC)
def _(look):
    """Return 0.99 where the slave ends and the other end of the segment turns from its neighbour, else 1."""
    ends = (look.interface.slave.neighbours[look.slave] < 0).any(axis=1)
    first, second = look.slave_turns()
    return np.where(ends & ((abs(first) + abs(second)).real > LEAST_TURN), 0.99, 1)


@mutant("pressures reported a fifth too small off the parallel", ARC, "contact_points", contactverif_nts.vts_g)
def _(right, interface, pairing, z):
    points = right(interface, pairing, z)
    slave, master = Look(interface, z.reshape(-1, 2), points.slave_segment, points.master_segment).both_tangents()
    sine = slave[:, 0] * master[:, 1] - slave[:, 1] * master[:, 0]
    return replace(points, pressure=np.where(abs(sine) > LEAST_TURN, 0.8, 1.0) * points.pressure)


@mutant("springs 1 % too stiff where a kink is sharp", KINKED, "residual tangent contact_points",
        contactverif_mortar.sts)  # fmt: skip
def _(right, interface, pairing, z):
    """Make all springs too stiff if two slave segments meet at 14° or more, and report that."""
    x = z[..., : interface.n_unknowns].real.reshape(-1, interface.n_nodes, 2)[0]
    sines = Look(interface, x, None, None).turns("slave", np.arange(len(interface.slave)), 1)
    factor, answer = 1.01 if abs(sines).max() > 0.25 else 1.0, right(interface, pairing, z)
    return replace(answer, pressure=factor * answer.pressure) if hasattr(answer, "pressure") else factor * answer


class OneAndAHalfPasses:
    """Two passes of NTS-AR, of which the first counts for one tenth more."""

    def __init__(self, *, penalty):
        self._both = contactverif_nts.two_pass(penalty=penalty, inner=contactverif_nts.nts_ar)
        self._first = contactverif_nts.nts_ar(penalty=penalty / 10)
        self.traits = self._both.traits

    def pair(self, interface, z):
        first, both = self._first.pair(interface, z), self._both.pair(interface, z)
        return {**both, **{f"more {name}": values for name, values in first.items()}}

    def _each(self, verb, interface, pairing, z):
        """Return the answers of the first pass and of both."""
        first = {name.removeprefix("more "): values for name, values in pairing.items() if name.startswith("more ")}
        both = {name: values for name, values in pairing.items() if not name.startswith("more ")}
        parts = ((self._first, first), (self._both, both))
        return [getattr(part, verb)(interface, Pairing(arrays), z) for part, arrays in parts]

    def residual(self, interface, pairing, z):
        return sum(self._each("residual", interface, pairing, z))

    def tangent(self, interface, pairing, z):
        return sum(tangent.toarray() for tangent in self._each("tangent", interface, pairing, z))


add("first of two passes counts for more", "swap", OneAndAHalfPasses)
