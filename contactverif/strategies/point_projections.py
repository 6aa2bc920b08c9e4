"""Points and surfaces of segments that test a search for the nearest segment, each with its exact answer.

Whether an example is of its kind is decided by the exact answer alone. Complex numbers stand for vectors: a product
turns and stretches, and −i times a tangent is the outward normal of a segment whose body is on the left.
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import accumulate, pairwise
from typing import Self

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Surface
from contactverif.oracle.nearest import Nearest, nearest_segments

_TOLERANCE = 4  # The error that roundoff explains, in units of u (L + |P − A|).


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """A point, a surface of segments, and the exact segments that are nearest to the point.

    Attributes
    ----------
    kind : str
        The kind of situation, as `projections` lists them.
    point : tuple[float, float]
        The point P.
    nodes : FloatArray, shape (n_nodes, 2)
        The positions of the nodes.
    segments : IntArray, shape (n_segments, 2)
        First and second node of each segment; the body is on the left.
    """

    kind: str
    point: tuple[float, float]
    nodes: FloatArray
    segments: IntArray
    _exact: Nearest = field(repr=False)

    @classmethod
    def exact(cls, kind: str, point: tuple[float, float], nodes: FloatArray, segments: IntArray) -> Self:
        """Return a point and a surface with their exact answer."""
        return cls(kind, point, nodes, segments, nearest_segments(nodes, segments, point))

    @property
    def tied(self) -> tuple[int, ...]:
        """All segments at the least distance.

        The first one has the smallest overshoot, the length by which its foot lies past its end. Where two segments
        meet at the nearest node, it tells the side.
        """
        return tuple(near.segment for near in self._exact.segments)

    @property
    def xi(self) -> Fraction:
        """The foot of P on the line of `tied[0]`: 0 at its first node, 1 at its second, not clipped."""
        return self._exact.segments[0].xi

    @property
    def side(self) -> int:
        """The side of P: −1 inside the body, 1 outside, 0 on the surface."""
        return _sign(self._exact.segments[0].signed_squared_gap)

    @property
    def squared_distance(self) -> Fraction:
        """The square of the distance to the nearest segment."""
        return self._exact.squared_distance

    def find_mistake(
        self, segment: int, *, xi: float | None = None, side: int | None = None, distance: float | None = None
    ) -> str:
        """Return what is wrong with the answer of a search and not explained by roundoff; empty if nothing is.

        Roundoff explains a length of 4u(L + |P − A|), with u = 2⁻⁵³, the length L of the segment and its first node A:
        in the distance, in ξ L, in a gap whose side is wrong, and, for both segments together, in the distance of a
        segment that is not the nearest. In a tie each segment is right.

        Parameters
        ----------
        segment : int
            The nearest segment.
        xi : float | None
            The foot on its line, not clipped; None leaves it out, as for the other numbers.
        side : int | None
            −1 if the point is inside the body, 1 if it is outside, 0 if it is on the surface.
        distance : float | None
            The distance to the closed segment.
        """
        if segment not in range(len(self.segments)):
            return f"segment {segment} of {len(self.segments)}"
        near = next((near for near in self._exact.segments if near.segment == segment), None)
        gaps = [self._exact.signed_squared_gap_at(each) for each in self._exact.segments]
        length, room = self._length_and_room(segment)
        if near is None:
            room += self._length_and_room(self.tied[0])[1]
            there = nearest_segments(self.nodes, self.segments[segment : segment + 1], self.point).squared_distance
            farther = _root_difference(there, self.squared_distance)
            if farther > room:
                return f"segment {segment}, which is {farther:.3g} farther than segment {self.tied[0]}"
        else:
            gaps = [self._exact.signed_squared_gap_at(near)]
            error = 0.0 if xi is None else abs(float(Fraction(xi) - near.xi)) if math.isfinite(xi) else math.inf
            if not length * error <= room:
                return f"ξ = {xi!r}, which is {float(near.xi)!r} but for roundoff"
            if distance is not None:
                error = math.inf
                if math.isfinite(distance) and distance >= 0:
                    error = abs(_root_difference(Fraction(distance) ** 2, self.squared_distance))
                if error > room:
                    return f"distance {distance!r}, which is {math.sqrt(self.squared_distance)!r} but for roundoff"
        if side is not None and all(side != _sign(gap) and abs(gap) > Fraction(room) ** 2 for gap in gaps):
            return f"side {side}, where the gap is {math.copysign(math.sqrt(abs(gaps[0])), gaps[0]):.3g}"
        return ""

    def _length_and_room(self, segment: int) -> tuple[float, float]:
        """Return the length of a segment, and the length that roundoff explains there."""
        first, second = self.nodes[self.segments[segment]]
        length, reach = (math.hypot(*arm.tolist()) for arm in (second - first, np.array(self.point) - first))
        return length, _TOLERANCE * UNIT_ROUNDOFF * (length + reach)


def projections(*, kinds: Collection[str] | None = None) -> SearchStrategy[Projection]:
    """Return points and surfaces, near which a search for the nearest segment decides in some special way.

    Parameters
    ----------
    kinds : Collection[str] | None
        The kinds of situations, each as likely as the others; all of these by default:

        - ``inside``: the foot is between the nodes of one segment;
        - ``free-end``: the foot is past a free end, by as little as 1e-12 lengths;
        - ``convex-vertex``, ``concave-vertex``: outside, or inside, between the two normals of a vertex;
        - ``valley``: near the bisector of a concave vertex;
        - ``bisector``: exactly on the bisector of a vertex, a tie;
        - ``node-hit``, ``node-almost-hit``: the foot is exactly a node, or but for roundoff;
        - ``near-tie``: one unit in the last place off a tie;
        - ``three-feet``: equally far from three segments or more, a tie;
        - ``touching``, ``tiny-gap``: exactly on the surface, or one unit in the last place off it;
        - ``node-elsewhere``: the nearest node is not on the nearest segment;
        - ``sharp-tip``: before a tip below 90°, behind the line of one side;
        - ``several-chains``: two to four chains, whose segments are numbered in random order;
        - ``thin-body``: in a thin closed body before another one;
        - ``seam``: near the segment that closes a chain, or an end of it;
        - ``offset-1e6``, ``offset-1e8``: coordinates near that, lengths near 1;
        - ``tiny-segment``: a segment of 1e-9 beside those of 1;
        - ``far-away``: a distance of 1e3 to 1e9 lengths;
        - ``other-units``: all coordinates times 2^-60 or 2^60;
        - ``long-chain``: a chain of a thousand segments.

    Examples
    --------
    >>> from hypothesis import find
    >>> from contactverif.strategies import projections
    >>> tie = find(projections(kinds=["bisector"]), lambda projection: True)
    >>> tie.tied, tie.find_mistake(1), tie.find_mistake(2)
    ((1, 2), '', '')
    """
    selection = tuple(KINDS) if kinds is None else tuple(kinds)
    unknown = [kind for kind in selection if kind not in KINDS]
    if unknown or not selection:
        raise MisuseError("kinds", ", ".join(map(repr, unknown)) or "none", f"some of {', '.join(KINDS)}")
    return st.sampled_from(selection).flatmap(_projections)


@st.composite
def _projections(draw: DrawFn, kind: str) -> Projection:
    make, holds = KINDS[kind]
    return draw(st.composite(make)().map(lambda scene: scene.project(kind)).filter(holds))


Chain = list[complex]  # Walked with the body on the left.


@dataclass(frozen=True, slots=True)
class _Scene:
    chains: Sequence[Chain]
    point: complex
    closed: Collection[int] = ()  # The places of the chains whose last node is joined to the first.
    order: Sequence[int] | None = None  # The segments in another order.

    def move(self, motion: Callable[[complex], complex]) -> "_Scene":
        return _Scene([[*map(motion, chain)] for chain in self.chains], motion(self.point), self.closed, self.order)

    def project(self, kind: str) -> Projection:
        starts = [*accumulate(map(len, self.chains), initial=0)]
        pairs: list[tuple[int, int]] = []
        for place, (begin, end) in enumerate(pairwise(starts)):
            pairs += pairwise([*range(begin, end), *([begin] if place in self.closed else [])])
        segments = Surface(np.array([pairs[number] for number in self.order] if self.order else pairs)).segments
        nodes = np.array([(node.real, node.imag) for chain in self.chains for node in chain])
        point = (self.point.real, self.point.imag)
        return Projection.exact(kind, point, nodes, segments)


# Pairs of whole numbers with a whole length: a turn by such a pair, times its length, is exact.
_PYTHAGOREAN = ((3, 4), (4, 3), (5, 12), (12, 5), (8, 15), (7, 24), (20, 21))
_EXACT_TURNS = st.sampled_from([1, 1j, *(complex(a, b) * quarter for a, b in _PYTHAGOREAN for quarter in (1, 1j, -1))])
_SIGNS = st.sampled_from([1, -1])
_TURNS = (1, 1j, -1, -1j)  # Quarter turns.
_PARTS = st.integers(1, 2**16).map(lambda k: k / (2**16 + 1))  # Open at both ends, so that no limit is hit by chance.


def _real(draw: DrawFn, low: float, high: float) -> float:
    """Draw a number between two others, with a full mantissa."""
    return low + (high - low) * draw(_PARTS)


def _power(draw: DrawFn, low: int, high: int) -> float:
    """Draw a number between 2^low and 2^(high + 1), each binary order as likely as the others."""
    return math.ldexp(1 + draw(_PARTS), draw(st.integers(low, high)))


def _turn(t: float) -> complex:
    """Return the unit vector at the angle 2 atan(t)."""
    return complex(1 - t * t, 2 * t) / (1 + t * t)


def _direction(draw: DrawFn) -> complex:
    return _turn(_real(draw, -1, 1)) * draw(st.sampled_from(_TURNS))


def _normal(first: complex, second: complex) -> complex:
    return -1j * (second - first) / abs(second - first)


def _rough_chain(draw: DrawFn, least: int, most: int, steepest: float = 0.3) -> Chain:
    """Draw a chain that runs to the left over its body, no segment steeper than 2 atan(steepest)."""
    count = draw(st.integers(least, most))
    steps = [-_real(draw, 0.25, 1.5) * _turn(_real(draw, -steepest, steepest)) for _ in range(count)]
    return [*accumulate(steps, initial=0j)]


def _lattice_chain(draw: DrawFn, spacing: int = 1) -> Chain:
    """Draw a chain of whole numbers that runs to the left over its body."""
    steps = draw(st.lists(st.builds(complex, st.integers(-4, -1), st.integers(-2, 2)), min_size=1, max_size=8))
    return [*accumulate((spacing * step for step in steps), initial=0j)]


def _polygon(draw: DrawFn, least: int, most: int, flat: float = 1.0) -> Chain:
    """Draw a convex closed chain around the origin, counter-clockwise, of size 1 × flat."""
    count = draw(st.integers(least, most))
    places = [4 * (number + _real(draw, 0.1, 0.9)) / count for number in range(count)]  # A quarter is t = 0 … 1.
    corners = [_turn(place % 1) * _TURNS[int(place)] for place in places]
    return [complex(corner.real, flat * corner.imag) for corner in corners]


def _moved_exactly(draw: DrawFn, scene: _Scene) -> _Scene:
    """Turn, move and scale a scene of whole numbers without any rounding."""
    turn, reach = draw(_EXACT_TURNS), 2 ** draw(st.integers(0, 20))
    way = complex(draw(st.integers(-reach, reach)), draw(st.integers(-reach, reach)))
    scale = math.ldexp(1, draw(st.integers(-12, 4)))
    return scene.move(lambda place: (place * turn + way) * scale)


def _moved_anyhow(draw: DrawFn, scene: _Scene) -> _Scene:
    """Turn a scene by any angle and move it; each coordinate fills its mantissa."""
    turn, way = _direction(draw), complex(_real(draw, -8, 8), _real(draw, -8, 8))
    return scene.move(lambda place: place * turn + way)


def _moved_chain(draw: DrawFn, least: int, most: int, steepest: float = 0.3) -> Chain:
    return _moved_anyhow(draw, _Scene([_rough_chain(draw, least, most, steepest)], 0j)).chains[0]


def _beside(draw: DrawFn, first: complex, second: complex, low: int = -30, high: int = -2) -> complex:
    """Draw a point over or under the inside of a segment, at a distance between two powers of 2 of its length."""
    share, gap = _real(draw, 0.05, 0.95), draw(_SIGNS) * _power(draw, low, high)
    return first + share * (second - first) + gap * -1j * (second - first)


def _home(draw: DrawFn, chain: Chain) -> tuple[complex, complex]:
    number = draw(st.integers(0, len(chain) - 2))
    return chain[number], chain[number + 1]


def _inside(draw: DrawFn) -> _Scene:
    chain = _rough_chain(draw, 2, 12)
    return _moved_anyhow(draw, _Scene([chain], _beside(draw, *_home(draw, chain))))


def _free_end(draw: DrawFn) -> _Scene:
    chain = _rough_chain(draw, 1, 6)
    before, end = draw(st.sampled_from([(chain[1], chain[0]), (chain[-2], chain[-1])]))
    along = (end - before) / abs(end - before)
    off = draw(_SIGNS) * _power(draw, -20, 0) * 1j
    return _moved_anyhow(draw, _Scene([chain], end + (_power(draw, -40, 0) + off) * along))


def _vertex(draw: DrawFn, side: int) -> _Scene:
    chain = _rough_chain(draw, 2, 8)
    number = draw(st.integers(1, len(chain) - 2))
    first, vertex, last = chain[number - 1 : number + 2]
    if ((last - vertex) / (vertex - first)).imag * side < 0:  # The mirror image sticks out to the other side.
        chain = [place.conjugate() for place in chain]
        first, vertex, last = chain[number - 1 : number + 2]
    share, reach = _real(draw, 0, 1), side * _power(draw, -20, -3)
    point = vertex + reach * (share * _normal(first, vertex) + (1 - share) * _normal(vertex, last))
    return _moved_anyhow(draw, _Scene([chain], point))


def _valley(draw: DrawFn) -> _Scene:
    left, right = _real(draw, 0.3, 3), _real(draw, 0.3, 3)
    chain = [complex(8, 4 * right), complex(4, 4 * right), 0j, complex(-4, 4 * left), complex(-8, 4 * left)]
    height = _power(draw, -12, 0)
    off = height * draw(_SIGNS) * _power(draw, -40, -4)
    normals = _normal(chain[1], chain[2]), _normal(chain[2], chain[3])
    return _moved_anyhow(draw, _Scene([chain], height * sum(normals) + off * 1j * normals[0]))


def _bisector(draw: DrawFn) -> _Scene:
    width, height = draw(st.integers(2, 12)), draw(_SIGNS) * draw(st.integers(1, 24))
    chain = [complex(x, height if x else 0) for x in (width + 4, width, 0, -width, -width - 4)]
    return _moved_exactly(draw, _Scene([chain], draw(_SIGNS) * draw(st.integers(1, 16)) / 8 * 1j))


def _node_hit(draw: DrawFn) -> _Scene:
    chain = _lattice_chain(draw)
    first, second = _home(draw, chain)
    off = draw(_SIGNS) / 2 ** draw(st.integers(1, 8)) * 1j
    return _moved_exactly(draw, _Scene([chain], draw(st.sampled_from([first, second])) + off * (second - first)))


def _node_almost_hit(draw: DrawFn) -> _Scene:
    chain = _moved_chain(draw, 2, 8, steepest=0.9)
    first, second = _home(draw, chain)
    off = draw(_SIGNS) * _power(draw, -20, -3)
    return _Scene([chain], draw(st.sampled_from([first, second])) + off * _normal(first, second))


def _one_ulp_off(draw: DrawFn, scene: _Scene) -> _Scene:
    """Replace one coordinate of the point by a neighbouring double, 0 by ± the unit roundoff."""
    x, y, way = scene.point.real, scene.point.imag, draw(_SIGNS)
    moved_x, moved_y = (math.nextafter(value, way * math.inf) if value else way * 2.0**-53 for value in (x, y))
    return _Scene(scene.chains, draw(st.sampled_from([complex(x, moved_y), complex(moved_x, y)])))


def _three_feet(draw: DrawFn) -> _Scene:
    """Draw three to five segments that touch one circle of whole numbers, and its centre."""
    radius = math.lcm(*(math.isqrt(a * a + b * b) for a, b in _PYTHAGOREAN))
    turns, side = draw(st.permutations(_PYTHAGOREAN)), draw(_SIGNS)
    chains = []
    for number, (a, b) in enumerate(turns[: draw(st.integers(3, 5))]):
        towards, times = complex(a, b) * _TURNS[number % 4], radius // math.isqrt(a * a + b * b)
        foot, half = times * towards, side * (times // 32) * 1j * towards
        chains.append([foot + half, foot - half])
    return _moved_exactly(draw, _Scene(chains, 0j))


def _touching(draw: DrawFn) -> _Scene:
    chain = _lattice_chain(draw, spacing=16)
    first, second = _home(draw, chain)
    return _moved_exactly(draw, _Scene([chain], first + draw(st.integers(0, 16)) / 16 * (second - first)))


def _tiny_gap(draw: DrawFn) -> _Scene:
    chain = _lattice_chain(draw, spacing=16)
    first, second = _home(draw, chain)
    sixteenths = draw(st.integers(1, 15).filter(lambda k: k != 8))
    turn = draw(st.sampled_from([1, 1j, *(complex(a, b) for a, b in _PYTHAGOREAN)])) / 2**8
    scene = _Scene([chain], first + sixteenths / 16 * (second - first))
    return _one_ulp_off(draw, scene.move(lambda place: (place - (first + second) / 2) * turn))


def _cavity(draw: DrawFn) -> _Scene:
    """Draw a point over a long segment, below nodes of another body that are nearer than the ends of the segment."""
    height = _real(draw, 0.3, 1)
    above = [-node - complex(5, -2.5 * height) for node in _rough_chain(draw, 6, 12, steepest=0.05)]
    point = complex(_real(draw, -5, -1), height * _real(draw, 0.2, 1))
    return _moved_anyhow(draw, _Scene([[10 + 0j, -10 + 0j], above], point))


def _sharp_tip(draw: DrawFn) -> _Scene:
    """Draw a point before a tip of the body with an angle of 5° to 84°."""
    down, up = -_turn(_real(draw, 0.02, 0.38)), -_turn(-_real(draw, 0.02, 0.38))
    return _moved_anyhow(draw, _Scene([[down, 0j, up]], _power(draw, -20, 0) * _turn(_real(draw, -0.9, 0.9))))


def _several_chains(draw: DrawFn) -> _Scene:
    chains = []
    for level in range(draw(st.integers(2, 4))):
        chain = _rough_chain(draw, 2, 6, steepest=0.05)
        if draw(st.booleans()):  # Its body is on the other side.
            chain = [chain[-1] - node for node in chain]
        way = complex(_real(draw, -1, 1), 2.5 * level)
        chains.append([node + way for node in chain])
    order = draw(st.permutations(range(sum(map(len, chains)) - len(chains))))
    scattered = complex(_real(draw, -10, 2), _real(draw, -2, 10))  # In the box of all chains, or beside it.
    point = scattered if draw(st.booleans()) else _beside(draw, *_home(draw, draw(st.sampled_from(chains))))
    return _moved_anyhow(draw, _Scene(chains, point, order=order))


def _thin_body(draw: DrawFn) -> _Scene:
    """Draw a point in a thin closed body that lies before another one, on either side of its middle."""
    body = _polygon(draw, 8, 20, flat=_power(draw, -8, -4))
    way = complex(2, -_real(draw, 0.4, 0.6))
    behind = [node + way for node in _rough_chain(draw, 4, 4, steepest=0.02)]
    first, second = draw(st.permutations(body))[:2]
    share = 0.5 + draw(_SIGNS) * _power(draw, -30, -3)
    return _moved_anyhow(draw, _Scene([body, behind], first + share * (second - first), closed=[0]))


def _seam(draw: DrawFn) -> _Scene:
    """Draw a point over the segment that joins the last node of a closed chain to the first, or over its ends."""
    chain = [4 * node for node in _polygon(draw, 3, 12)]
    first, second = chain[-1], chain[0]
    along = (second - first) / abs(second - first)
    if draw(st.booleans()):
        point = _beside(draw, first, second, -20, -2)
    else:
        end, side = draw(st.sampled_from([(first, -1), (second, 1)]))
        point = end + (side * _power(draw, -30, -4) - 1j * _power(draw, -8, -2)) * along
    return _moved_anyhow(draw, _Scene([chain], point, closed=[0]))


def _offset(draw: DrawFn, offset: float) -> _Scene:
    """Draw a chain far from the origin; half of the gaps are a few units in the last place there."""
    way = offset * _direction(draw)
    chain = [node + way for node in _moved_chain(draw, 2, 12)]
    last = math.frexp(offset)[1] - 53
    powers = draw(st.sampled_from([(last, last + 4), (-30, -2)]))
    return _Scene([chain], _beside(draw, *_home(draw, chain), *powers))


def _tiny_segment(draw: DrawFn) -> _Scene:
    """Draw a chain near the origin with one segment of 1e-9, and a point 1e-10 … 1 away from it."""
    before, behind = _rough_chain(draw, 1, 4), _rough_chain(draw, 1, 4)
    tiny, turn = -1e-9 * _turn(_real(draw, -0.3, 0.3)), _direction(draw)
    chain = [*(node - before[-1] for node in before), *(node + tiny for node in behind)]
    return _Scene([chain], _power(draw, -33, -1) * _direction(draw)).move(lambda place: place * turn)


def _far_away(draw: DrawFn) -> _Scene:
    chain = _moved_chain(draw, 2, 12)
    return _Scene([chain], draw(st.sampled_from(chain)) + _power(draw, 10, 29) * _direction(draw))


def _other_units(draw: DrawFn) -> _Scene:
    factor = math.ldexp(1, 60 * draw(_SIGNS))
    return _inside(draw).move(lambda place: place * factor)


def _long_chain(draw: DrawFn) -> _Scene:
    steps = [after - before for before, after in pairwise(_rough_chain(draw, 3, 9))]
    chain = [*accumulate((steps[number % len(steps)] for number in range(1000)), initial=0j)]
    return _moved_anyhow(draw, _Scene([chain], _beside(draw, *_home(draw, chain), -20, -2)))


def _has_inner_foot(projection: Projection) -> bool:
    return len(projection.tied) == 1 and 0 < projection.xi < 1


def _is_tie(projection: Projection) -> bool:
    """Return whether no rule but the number of the segment decides."""
    return projection._exact.n_undecided > 1


def _lies_off_a_vertex(projection: Projection) -> bool:
    return len(projection.tied) == 2 and not _is_tie(projection)


def _is_past_free_end(projection: Projection) -> bool:
    neighbours = Surface(projection.segments).neighbours[projection.tied[0]]
    return len(projection.tied) == 1 and not 0 <= projection.xi <= 1 and bool(neighbours[int(projection.xi > 1)] < 0)


def _is_nearer_to_another_node(projection: Projection) -> bool:
    squares = ((projection.nodes - np.array(projection.point)) ** 2).sum(axis=1)
    ends = projection.segments[projection.tied[0]]
    return _has_inner_foot(projection) and bool(squares.min() < (1 - 1e-9) * squares[ends].min())


def _is_before_sharp_tip(projection: Projection) -> bool:
    """Return whether the tip is nearest, and one of its lines has the point on its left."""
    gaps = [near.signed_squared_gap for near in projection._exact.segments]
    return _lies_off_a_vertex(projection) and gaps[0] > 0 > gaps[1]


KINDS: dict[str, tuple[Callable[[DrawFn], _Scene], Callable[[Projection], bool]]] = {
    "inside": (_inside, _has_inner_foot),
    "free-end": (_free_end, _is_past_free_end),
    "convex-vertex": (lambda draw: _vertex(draw, 1), lambda case: _lies_off_a_vertex(case) and case.side > 0),
    "concave-vertex": (lambda draw: _vertex(draw, -1), lambda case: _lies_off_a_vertex(case) and case.side < 0),
    "valley": (_valley, _has_inner_foot),
    "bisector": (_bisector, _is_tie),
    "node-hit": (_node_hit, lambda case: case.side != 0 and any(near.xi in (0, 1) for near in case._exact.segments)),
    "node-almost-hit": (
        _node_almost_hit,
        lambda case: any(0 < min(abs(near.xi), abs(near.xi - 1)) < 1e-12 for near in case._exact.segments),
    ),
    "near-tie": (lambda draw: _one_ulp_off(draw, _bisector(draw)), _has_inner_foot),
    "three-feet": (_three_feet, lambda case: len(case.tied) >= 3),
    "touching": (_touching, lambda case: case.squared_distance == 0),
    "tiny-gap": (_tiny_gap, lambda case: _has_inner_foot(case) and 0 < case.squared_distance <= 1e-30),
    "node-elsewhere": (_cavity, _is_nearer_to_another_node),
    "sharp-tip": (_sharp_tip, _is_before_sharp_tip),
    "several-chains": (_several_chains, lambda case: True),
    "thin-body": (_thin_body, lambda case: case.side < 0),
    "seam": (_seam, lambda case: len(case.segments) - 1 in case.tied),
    "offset-1e6": (lambda draw: _offset(draw, 1e6), lambda case: True),
    "offset-1e8": (lambda draw: _offset(draw, 1e8), lambda case: True),
    "tiny-segment": (_tiny_segment, lambda case: True),
    "far-away": (_far_away, lambda case: True),
    "other-units": (_other_units, _has_inner_foot),
    "long-chain": (_long_chain, lambda case: True),
}


def _sign(value: Fraction) -> int:
    return (value > 0) - (value < 0)


def _root_difference(a: Fraction, b: Fraction) -> float:
    """Return √a − √b without cancellation."""
    return float(a - b) / (math.sqrt(a) + math.sqrt(b)) if a != b else 0.0
