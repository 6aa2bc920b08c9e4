"""Hard cases at vertices and free ends, where formulations may differ, and how far they may.

No two formulations agree at a kink, so these cases carry bounds and no exact forces. The bounds hold for every rule by
which a gap is measured, and for every quadrature with positive weights that add up to the slave's length.

Parameters of a case, in units of the penalty ε̂:

edges (2, 2)
    Two unit vectors. The total force on the slave is a sum of positive multiples of directions between them; the second
    is to the left of the first. They are the normals of master segments that the slave may touch.
axis (2,)
    The direction in which the total force is measured.
bounds (2,)
    The least and the largest total force along the axis over ε̂, a length squared, for any rule.
penetration
    A typical penetration, a length.
segment_bounds (2,)
    The same as `bounds` for a rule that pushes along normals of segments, and loses nothing at a vertex.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from math import cos, radians, sin

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.problems.flat_states import collect

_PENALTY = 16.0
_DEPTH = 2.0**-4
_Vector = tuple[float, float]
_UP = (0.0, 1.0)
_FLAT = ((4.0, 0.0), (2.5, 0.0), (1.0, 0.0), (0.0, 0.0))


@collect
def convex_kink_states() -> Iterator[Case]:
    """Return a roof that penetrates another one, its vertex swept over the bisector from one side to the other.

    The slave's roof is parallel to the master's, so that each side has one gap: d cos a, and ∓ δ sin a if the slave is
    moved by δ. With an averaged direction a point at the vertex may see the gap d, straight up.
    """
    moves = (0.0, *(sign * 10.0**-exponent for exponent in (3, 6, 9, 12) for sign in (1, -1)))
    angles = (0.1, 0.5, 1.5)
    octaves = [(angles[exponent % 3], 2.0**-exponent * (-1) ** (exponent // 3)) for exponent in range(5, 44, 2)]
    for angle, move in [*product(angles, moves), *octaves]:
        a, depth = angle / 2, _DEPTH
        side = f"{abs(move):.0e} {'right' if move > 0 else 'left'} of" if move else "on"
        master = [(place * cos(a), -abs(place) * sin(a)) for place in (2.0, 1.0, 0.0, -1.0, -2.0)]
        slave = [(place * cos(a) + move, -abs(place) * sin(a) - depth) for place in (-1.6, -0.7, 0.0, 0.8, 1.6)]
        gap, change = depth * cos(a), abs(move) * sin(a)
        yield _bounded_case(
            f"kink of {angle}, {side} the bisector",
            slave,
            master,
            edges=((sin(a), cos(a)), (-sin(a), cos(a))),
            bounds=(3.2 * (gap - change) * cos(a), 3.2 * (depth + abs(move))),
            segment_bounds=(3.2 * (gap - change) * cos(a), 3.2 * (gap + change) * cos(a)),
            penetration=gap,
        )


@collect
def concave_corner_states() -> Iterator[Case]:
    """Return a corner pushed into a re-entrant corner of 90°; its node is as far from one face as from the other.

    Each face has the gap d. A stretch of d on either side of the slave's node faces neither face along its normal, so
    an integral over facing parts lacks it. A rule that looks along the slave's normal at points alone may lose the
    point at the node, and with it no more than both segments there.
    """
    ways = {"right": (1, 0), "left": (-1, 0), "up": (0, 1), "down": (0, -1)}
    steps = {"on the diagonal": (0, 0), **{f"a rounding {way}": step for way, step in ways.items()}}
    for (label, depth), (way, (right, up)) in product({"2^-6": 2.0**-6, "2^-10": 2.0**-10}.items(), steps.items()):
        x, y = (float(np.nextafter(-depth, -depth + step)) if step else -depth for step in (right, up))
        slave = [(-depth, 1.5), (-depth, 0.6), (x, y), (0.7, -depth), (1.5, -depth)]
        master = [(2.0, 0.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (0.0, 2.0)]
        whole, rounding = 2 * (1.5 + depth), float(np.spacing(depth))
        yield _bounded_case(
            f"gap {label}, {way}",
            slave,
            master,
            edges=((1.0, 0.0), (0.0, 1.0)),
            axis=(1.0, 1.0),
            bounds=((3.0 - 1.3) * (depth - rounding), 2 * whole * (depth + rounding)),
            segment_bounds=(3.0 * (depth - rounding), whole * (depth + rounding)),
            penetration=depth,
        )


@collect
def free_end_states() -> Iterator[Case]:
    """Return slaves at, past and beyond the free end of a flat master, where a formulation decides by itself.

    Whether a point at the end, or a little past it, is in contact is a choice (a tolerance τ, a cut, or neither). It
    concerns the first slave segment alone, so that the total is that of the others at least.
    """
    depth, up = _DEPTH, _UP
    places = {
        "first node at the end": 0.0,
        "first node a rounding inside": 2.0**-53,
        "first node a rounding outside": -(2.0**-53),
        **{f"first node {share} of a segment past the end": -share for share in (1e-3, 0.0099, 0.0101, 0.1, 0.5)},
        **{f"first node {share} of a segment inside": share for share in (1e-3, 0.0099, 0.0101, 0.1)},
    }
    for name, place in places.items():
        slave = [(place, -depth), (0.75, -depth), (1.5, -depth), (3.0, -depth)]
        bounds = (2.25 * depth, (3.0 - place) * depth)
        yield _bounded_case(name, slave, edges=(up, up), bounds=bounds)
    for name, first in {"wholly outside by a segment": -3.0, "wholly outside by far": -64.0}.items():
        slave = [(first, -depth), (first + 1, -depth), (first + 2, -depth)]
        yield _bounded_case(name, slave, edges=(up, up), bounds=(0.0, 0.0))
    for exponent in range(4, 52, 3):
        strip = 2.0**-exponent * (-1) ** exponent
        name = f"first node 2^-{exponent} of a segment {'inside' if strip > 0 else 'past the end'}"
        slave = [(strip, -depth), (0.75, -depth), (1.5, -depth), (3.0, -depth)]
        yield _bounded_case(name, slave, edges=(up, up), bounds=(2.25 * depth, (3.0 - strip) * depth))
        slave = [(abs(strip) - 1.5, -depth), (abs(strip) - 1.0, -depth), (abs(strip), -depth)]
        name = f"all but 2^-{exponent} of a segment outside"
        yield _bounded_case(name, slave, edges=(up, up), bounds=(0.0, depth))


@collect
def steep_slave_states() -> Iterator[Case]:
    """Return one slave segment that stands on a flat master, or faces away from it, with one node or both inside.

    A formulation may see it or not; one that looks along the slave's normal may see a gap as long as the interface.
    """
    depth, up = _DEPTH, _UP
    for degrees, (label, turn) in product((89.9, 90.0, 180.0), {"": 1, ", on its other side": -1}.items()):
        angle = radians(degrees)
        along = {90.0: (0.0, 1.0), 180.0: (-1.0, 0.0)}.get(degrees, (cos(angle), sin(angle)))
        if turn < 0 and degrees == 180.0:
            continue  # The segment seen from its front is no hard case.
        first, second = (1.75, -depth), (1.75 + along[0], -depth + along[1])
        inward = (turn * -along[1], turn * along[0])  # Into the slave's body.
        chain = [first, second] if turn > 0 else [second, first]
        edges = (up, up) if degrees == 180.0 else (up, inward) if turn > 0 else (inward, up)
        yield _bounded_case(f"{degrees:g}°{label}", chain, edges=edges, bounds=(0.0, 4.0))


def _bounded_case(
    name: str,
    slave: Sequence[_Vector],
    master: Sequence[_Vector] = _FLAT,
    *,
    edges: tuple[_Vector, _Vector],
    axis: _Vector = _UP,
    bounds: _Vector,
    segment_bounds: _Vector | None = None,
    penetration: float = _DEPTH,
) -> Case:
    """Return a state of two chains with its bounds; the reference is the same state."""
    numbers = {"edges": edges, "axis": axis, "bounds": bounds, "segment_bounds": segment_bounds or bounds}
    parameters = {name: np.array(values) for name, values in numbers.items()} | {"penetration": np.array(penetration)}
    interface = Interface.from_chains(slave, master)
    return Case(interface, interface.nodes.reshape(-1), _PENALTY, parameters, name=name)
