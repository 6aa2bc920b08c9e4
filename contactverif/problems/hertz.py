"""Line contact of half-planes without friction: Hertz' answer, that with a layer of springs, stresses, displacements.

The pressure is symmetrical, p(x) = p(−x), and 0 for |x| ≥ a. It is a polynomial on each of many panels, which become
shorter towards the edges, where a penalty ε̂ makes a boundary layer of the width E*/ε̂. A penalty method converges to
the answer with the layer. Nothing here knows a mesh, a body or a formulation.

Axes: x along the surface, the depth η ≥ 0 into the body. A stress is positive in tension. Displacements are those of
plane strain, with E' = E/(1 − ν²) and ν' = ν/(1 − ν); they grow like ln r, so that only differences mean something.

Source: K. L. Johnson, Contact Mechanics (1985): equations 2.14, 2.19 and 2.24 (line load), Sections 4.2(c) (line
contact), 4.3 and 5.8 (elastic foundation), equation 4.49 (McEwan's stresses).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from math import ceil, log2, pi, sqrt

import numpy as np
from numpy.polynomial import legendre

from contactverif.contract.arrays import FloatArray, IntArray, freeze
from contactverif.contract.errors import MisuseError

TERMS = 16  # Number of Legendre polynomials on a panel: a root or a logarithm one panel away leaves 5.8^-16 = 6e-13.
# Hertz' pressure is √(2d/a) p0 at a distance d from the edge. The last panel of that width has a force of 1e-18 F.
_HERTZ_LEVELS = 40
# The last panel is this share of the boundary layer E*/ε̂: what is left of d² ln d there is below 1e-10 of the peak.
_LAST_PANEL = 2.0**-18
_MOST_LEVELS = 40  # Places on shorter panels at the edge x = a have few digits. With 2^-40 some 1e-9 are left.
# One line load stands for the strip of this share of a next to each edge. Its error is that share squared, times the
# share 3e-5 of the force.
_EDGE_STRIP = 2.0**-10
_NEAR = 3.0  # Points at least this many half-lengths from the middle of a panel take Gauss' rule: 5.8^-32 is left.
_RECURRENCE = 400  # The first ratio of Legendre functions is 1/t here: a point 1e-3 outside a panel has e^-36 left.


@cache
def gauss_rule(count: int) -> tuple[FloatArray, FloatArray]:
    """Return Gauss' points and weights on [−1, 1], read-only."""
    points, weights = legendre.leggauss(count)
    return freeze(points, np.float64), freeze(weights, np.float64)


@dataclass(frozen=True, eq=False)
class LinePressure:
    """A symmetrical pressure on the strip |x| ≤ a, a polynomial on each panel."""

    half_width: float  # The half-width a, a length.
    edges: FloatArray  # (n_panels + 1,) The ends of the panels over a, ascending from −1 to 1.
    # (n_panels, n_terms) The pressure of each panel in Legendre polynomials of the place on the panel, force per
    # length.
    coefficients: FloatArray
    # The approach δ of the integral equation, in which ln|x − s| has x and s in the unit of a; NaN where the pressure
    # solves none.
    approach: float = float("nan")

    @property
    def peak(self) -> float:
        """The pressure in the middle, force per length."""
        return float(self.pressure(np.zeros(1))[0])

    @property
    def force(self) -> float:
        """The total force F per unit of thickness."""
        return float(self._primitives[1][0, -1])

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure at x from the middle, in the shape of x; 0 outside."""
        panel, t = self._place(x)
        values = np.einsum("...n,...n", self.coefficients[panel], legendre.legvander(t, self._n_terms - 1))
        return np.where(np.abs(x) < self.half_width, values, 0.0)

    def integrals_up_to(self, x: FloatArray) -> FloatArray:
        """Return the force ∫ p ds and the moment ∫ s p ds (2, …) of the strip from −a to x, each in the shape of x."""
        panel, t = self._place(x)
        (parts, totals), polynomials = self._primitives, legendre.legvander(t, self._n_terms + 1)
        pairs = zip(totals, parts, strict=True)
        return np.stack([total[panel] + np.einsum("...n,...n", part[panel], polynomials) for total, part in pairs])

    def nodal_forces(self, x: FloatArray) -> FloatArray:
        """Return ∫ N_i p ds (n,) at ascending nodes x (n,), exact."""
        force, moment = np.diff(self.integrals_up_to(x))
        towards_second = (moment - x[:-1] * force) / np.diff(x)
        forces = np.zeros(len(x))
        forces[1:] += towards_second
        forces[:-1] += force - towards_second
        return forces

    def linear_error(self, x: FloatArray) -> float:
        """Return the L2 error of the best continuous function that is linear between ascending nodes x (n,).

        It is over the L2 norm of the pressure. The nodes reach beyond the strip.
        """
        lengths, forces = np.diff(x), self.nodal_forces(x)
        mass = np.diag((np.append(lengths, 0) + np.insert(lengths, 0, 0)) / 3)
        mass += np.diag(lengths / 6, 1) + np.diag(lengths / 6, -1)
        return self._error_of_best(float(forces @ np.linalg.solve(mass, forces)))

    def constant_error(self, x: FloatArray) -> float:
        """Return the same error of the best function that is constant between ascending nodes x (n,)."""
        return self._error_of_best(float((np.diff(self.integrals_up_to(x)[0]) ** 2 / np.diff(x)).sum()))

    def line_loads(self) -> tuple[FloatArray, FloatArray]:
        """Return places (n,) and forces (n,) of line loads that are as good as the pressure some way off.

        They lie at Gauss' points of the panels. Next to each edge one load stands for all of the shortest panels.
        """
        points, weights = gauss_rule(self._n_terms)
        long = np.maximum(np.abs(self.edges[1:]), np.abs(self.edges[:-1])) <= 1 - _EDGE_STRIP
        halves = self.half_width * self._halves[long, None]
        places = self.half_width * self._middles[long, None] + halves * points
        forces = halves * weights * (self.coefficients[long] @ legendre.legvander(points, self._n_terms - 1).T)
        ends = self.integrals_up_to(self.half_width * np.array([self.edges[1:][long][-1], 1.0]))
        force = self.force - ends[0, :1]
        middle = np.diff(ends[1]) / force
        return np.concatenate([-middle, places.ravel(), middle]), np.concatenate([force, forces.ravel(), force])

    def deflection(self, x: FloatArray) -> FloatArray:
        """Return −(2/π) ∫ p ln|x − s|/a ds, in the shape of x: E/(1 − ν²) times the displacement into the body."""
        flat = np.asarray(x, dtype=np.float64).reshape(-1) / self.half_width
        integrals = logarithm_integrals(flat, self.edges, self._n_terms)
        deflections: FloatArray = np.einsum("xpn,pn->x", integrals, self.coefficients) * (-2 * self.half_width / pi)
        return deflections.reshape(np.shape(x))

    @property
    def _n_terms(self) -> int:
        return int(self.coefficients.shape[1])

    @cached_property
    def square(self) -> float:
        """The integral ∫ p² ds."""
        squares = (self.coefficients**2 / (np.arange(self._n_terms) + 0.5)).sum(axis=1)
        return float(self.half_width * (self._halves @ squares))

    def _error_of_best(self, square: float) -> float:
        """Return the error of an orthogonal projection from its own ∫ p² ds."""
        return float(np.sqrt(max(0.0, 1 - square / self.square)))

    @cached_property
    def _middles(self) -> FloatArray:
        return (self.edges[1:] + self.edges[:-1]) / 2

    @cached_property
    def _halves(self) -> FloatArray:
        return np.diff(self.edges) / 2

    @cached_property
    def _primitives(self) -> tuple[FloatArray, FloatArray]:
        """Return coefficients (2, n_panels, n_terms + 2) of ∫ p ds and ∫ s p ds from the beginning of each panel.

        Then the sums (2, n_panels + 1) of both up to the beginning of each panel, and up to the end.
        """
        forces = np.pad(self.coefficients, ((0, 0), (0, 1)))
        moments = self._middles[:, None] * forces
        moments = moments + self._halves[:, None] * np.apply_along_axis(legendre.legmulx, 1, self.coefficients)
        scale = self.half_width * self._halves[:, None]
        parts = [scale * legendre.legint(values, lbnd=-1, axis=1) for values in (forces, self.half_width * moments)]
        primitives = np.stack(parts)
        return primitives, np.pad(np.cumsum(primitives.sum(axis=2), axis=1), ((0, 0), (1, 0)))

    def _place(self, x: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return panel and place on it, −1 … 1, both in the shape of x."""
        flat = np.clip(np.asarray(x, dtype=np.float64) / self.half_width, -1.0, 1.0)
        panel = np.clip(np.searchsorted(self.edges, flat, side="right") - 1, 0, len(self.edges) - 2)
        return panel, np.clip((flat - self._middles[panel]) / self._halves[panel], -1.0, 1.0)


def hertz_contact(half_width: float, radius: float, stiffness: float) -> LinePressure:
    """Return Hertz' pressure p0 √(1 − x²/a²) of a given half-width: p0 = E* a / 2R (Johnson, 4.43 to 4.45)."""
    points, weights = gauss_rule(TERMS)
    begin, end = 2.0 ** -np.arange(_HERTZ_LEVELS + 1.0), np.append(2.0 ** -np.arange(1.0, _HERTZ_LEVELS + 1), 0.0)
    gaps = (begin + end)[:, None] / 2 - (begin - end)[:, None] / 2 * points  # 1 − |x|/a keeps its digits at the edge.
    factors = (np.arange(TERMS) + 0.5) * weights[:, None] * legendre.legvander(points, TERMS - 1)
    half = stiffness * half_width / (2 * radius) * np.sqrt(gaps * (2 - gaps)) @ factors
    return LinePressure(half_width, _edges(_HERTZ_LEVELS), _mirror(half))


def layer_contact(
    half_width: float, radius: float, stiffness: float, penalty: float, *, terms: int = TERMS, more_levels: int = 0
) -> LinePressure:
    """Solve Hertz on a layer of springs for a given half-width.

    The equation is p/ε̂ − (2/πE*) ∫ p(s) ln|x − s|/a ds = δ − x²/2R for |x| ≤ a, and p = 0 at x = ±a. It is collocated
    at Gauss' points of the panels. `more_levels` adds panels at each edge to those that E*/(ε̂ a) asks for; they and
    twice as many terms change the pressure by less than 1e-10 of its peak.
    """
    numbers = {"half_width": half_width, "radius": radius, "stiffness": stiffness, "penalty": penalty}
    for name, number in numbers.items():
        if not 0 < number < np.inf:
            raise MisuseError(name, f"{number!r}", "a finite number > 0")
    layer = min(1.0, stiffness / (penalty * half_width))
    edges = _edges(min(max(2, ceil(-log2(layer * _LAST_PANEL))) + more_levels, _MOST_LEVELS))
    right = np.flatnonzero(edges[:-1] >= 0)
    points, _ = gauss_rule(terms)
    middles, halves = (edges[right] + edges[right + 1]) / 2, (edges[right + 1] - edges[right]) / 2
    places = (middles[:, None] + halves[:, None] * points).ravel()  # Those with x > 0, since all is even.
    integrals = logarithm_integrals(places, edges, terms)
    mirrored = integrals[:, right[0] - 1 :: -1] * (-1.0) ** np.arange(terms)
    compliance = 1 / penalty + half_width / stiffness  # A length per pressure: with a²/2R it makes all dimensionless.
    local, distant = 1 / (penalty * compliance), 2 * half_width / (pi * stiffness * compliance)
    size = len(right) * terms
    matrix = np.zeros((size + 1, size + 1))
    polynomials = legendre.legvander(points, terms - 1)
    matrix[:-1, :-1] = np.kron(np.eye(len(right)), local * polynomials)
    matrix[:-1, :-1] -= distant * (integrals[:, right] + mirrored).reshape(size, size)
    matrix[:-1, -1] = -1.0
    matrix[-1, -1 - terms : -1] = 1.0  # The pressure is 0 at the edge, where all polynomials are 1.
    unit = half_width**2 / (2 * radius)
    solution = np.linalg.solve(matrix, np.append(-(places**2), 0.0)) * unit
    half = solution[:-1].reshape(len(right), terms) / compliance
    return LinePressure(half_width, edges, _mirror(half), float(solution[-1]))


def _mirror(half: FloatArray) -> FloatArray:
    """Return the coefficients of all panels from those with x > 0; the pressure is even."""
    return np.concatenate([half[::-1] * (-1.0) ** np.arange(half.shape[1]), half])


def logarithm_integrals(x: FloatArray, edges: FloatArray, terms: int) -> FloatArray:
    """Return ∫ P_n ln|x − s| ds over each panel for n = 0 … terms − 1, shape (n_points, n_panels, terms).

    With t the place of x on the panel [m − h, m + h], it is h (2 ln h [n = 0] + ∫ P_n(τ) ln|t − τ| dτ), and for n ≥ 1
    the last integral is 2 (Q_{n+1} − Q_{n−1})/(2n + 1), since its derivative is 2 Q_n (Q: Legendre functions of the
    second kind).
    """
    middles, halves = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    t = (x[:, None] - middles) / halves
    t = np.where(np.abs(t) == 1, np.nextafter(t, 0), t)
    integrals = np.empty((*t.shape, terms))
    near = np.abs(t) < _NEAR
    points, weights = gauss_rule(2 * terms)
    rule = weights[:, None] * legendre.legvander(points, terms - 1)
    integrals[~near] = np.log(np.abs(t[~near][:, None] - points)) @ rule
    integrals[near] = _near_integrals(t[near], terms)
    integrals[..., 0] += 2 * np.log(halves)
    integrals *= halves[:, None]
    return integrals


def _near_integrals(t: FloatArray, terms: int) -> FloatArray:
    """Return ∫ P_n(τ) ln|t − τ| dτ over [−1, 1] for n = 0 … terms − 1, shape (n_points, terms).

    The functions Q_n follow from a recurrence that is stable: upwards for |t| < 1, downwards for ratios Q_n/Q_{n−1}
    beyond.
    """
    q, inside = np.empty((len(t), terms + 1)), np.abs(t) < 1
    s = t[inside]
    upwards = [np.arctanh(s), s * np.arctanh(s) - 1]
    for n in range(1, terms):
        upwards.append(((2 * n + 1) * s * upwards[n] - n * upwards[n - 1]) / (n + 1))
    q[inside] = np.column_stack(upwards)
    if not inside.all():
        s = t[~inside]
        ratios = [1 / s]
        for n in range(_RECURRENCE, 0, -1):
            ratios.append(n / ((2 * n + 1) * s - (n + 1) * ratios[-1]))
        first = np.log((s + 1) / (s - 1)) / 2
        q[~inside] = np.multiply.accumulate(np.column_stack([first, *ratios[: -terms - 1 : -1]]), axis=1)
    rest = 2 * (q[:, 2:] - q[:, :-2]) / (2 * np.arange(1, terms) + 1)
    first = (t + 1) * np.log(np.abs(t + 1)) - (t - 1) * np.log(np.abs(t - 1)) - 2
    return np.column_stack([first, rest])


def _edges(levels: int) -> FloatArray:
    """Return ends of panels from −1 to 1, each half as long as the one before towards the edges."""
    right = np.append(1 - 2.0 ** -np.arange(levels + 1), 1.0)
    return np.concatenate([-right[:0:-1], right])


_ROUNDED = 1 - 1e-7  # The least half-width over that without a layer, or without half-planes: roundoff may lower it.


def half_width(force: float, radius: float, stiffness: float) -> float:
    """Return the half-width a = √(4FR / πE*) of the contact, a length; F per unit of thickness (Johnson, 4.43)."""
    return sqrt(4 * force * radius / (pi * stiffness))


def layer_half_width(force: float, radius: float, penalty: float) -> float:
    """Return the half-width (3FR / 2ε̂)^⅓ if the layer alone gives way: p = ε̂ (a² − x²) / 2R (Johnson, 4.3)."""
    return float((1.5 * force * radius / penalty) ** (1 / 3))


def peak(force: float, radius: float, stiffness: float) -> float:
    """Return the pressure p0 = 2F / πa in the middle, force per length (Johnson, 4.45)."""
    return 2 * force / (pi * half_width(force, radius, stiffness))


@lru_cache(maxsize=32)  # A root of some ten solutions: tests and tables ask for the same disk again and again.
def solve_winkler_contact(force: float, radius: float, stiffness: float, penalty: float) -> LinePressure:
    """Solve Hertz on a Winkler layer for the force F > 0 per unit of thickness.

    The equation is p/ε̂ − (2/πE*) ∫ p(s) ln|x − s| ds = δ − x²/2R in contact, and p = 0 at its edge: there the layer is
    not pressed any more. It is solved to 1e-10 for a given half-width, or to 1e-8 if E*/(ε̂ a) is below 1e-8. The
    half-width is the one that carries F.
    """

    def missing(half_width: float) -> float:
        return layer_contact(half_width, radius, stiffness, penalty).force - force

    from scipy.optimize import brentq  # It takes long to import, and the first rows of a run do not need it.

    # Half-planes and layer together give way by more than each of them alone, and by less than one after the other.
    alone = half_width(force, radius, stiffness), layer_half_width(force, radius, penalty)
    width = brentq(missing, _ROUNDED * max(alone), sum(alone), xtol=1e-14 * max(alone), rtol=1e-14)
    return layer_contact(width, radius, stiffness, penalty)


_POINTS = 8  # Number of Gauss points on each edge of a loaded side.
_CHUNK = 512  # Number of points that are superposed at once, so that tables stay in the cache.


def _superpose(
    pressure: LinePressure, kernel: Callable[..., FloatArray], x: FloatArray, depth: FloatArray
) -> FloatArray:
    """Return the sums (n, k) of a field of line loads of 1 at x = 0; places are some way from the loaded strip."""
    (places, forces), count = pressure.line_loads(), max(1, -(-len(x) // _CHUNK))
    chunks = zip(np.array_split(x, count), np.array_split(depth, count), strict=True)
    return np.concatenate(
        [np.einsum("psk,s->pk", kernel(along[:, None] - places, down[:, None]), forces) for along, down in chunks]
    )


def stresses(pressure: LinePressure, x: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the stresses σ_xx, σ_ηη and σ_xη (n, 3) under a pressure, by superposing Flamant's (Johnson, 2.14).

    Places x and depth (n,) are some way from the loaded strip: the error is 1e-11 of the peak at a distance a, 1e-8 at
    a/4.
    """

    def line_load(x: FloatArray, depth: FloatArray) -> FloatArray:
        factor = -2 * depth / (pi * (x**2 + depth**2) ** 2)
        return np.stack([factor * x**2, factor * depth**2, factor * x * depth], axis=-1)

    return _superpose(pressure, line_load, x, depth)


def displacements(pressure: LinePressure, x: FloatArray, depth: FloatArray, young: float, poisson: float) -> FloatArray:
    """Return the displacements (n, 2) along x and into the body under a pressure, superposed (Johnson, 2.19).

    Places x and depth (n,) are some way from the loaded strip. Lengths in the logarithm are over the half-width.
    """
    contraction, unit = poisson / (1 - poisson), pressure.half_width

    def line_load(x: FloatArray, depth: FloatArray) -> FloatArray:
        x, depth = x / unit, depth / unit
        square = x**2 + depth**2
        along = -(1 - contraction) * np.arctan2(x, depth) + (1 + contraction) * x * depth / square
        into = -np.log(square) - (1 + contraction) * x**2 / square
        return np.stack([along, into], axis=-1) / pi

    return _superpose(pressure, line_load, x, depth) * (1 - poisson**2) / young


def surface_displacements(pressure: LinePressure, x: FloatArray, young: float, poisson: float) -> FloatArray:
    """Return the displacements (n, 2) of the surface at x (n,), anywhere, along x and into the body (Johnson, 2.24).

    Their constants are those of `displacements`.
    """
    beyond = pressure.force - 2 * pressure.integrals_up_to(x)[0]
    contraction = poisson / (1 - poisson)
    along = (1 - contraction) / 2 * beyond
    into = pressure.deflection(x) - (1 + contraction) / pi * pressure.force
    return np.stack([along, into], axis=-1) * (1 - poisson**2) / young


def side_forces(pressure: LinePressure, x: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the nodal forces (m, n, 2) of the half-plane's stresses on both sides and on the far edge of a box.

    They are along x and into the body, at columns x (n,) and rows (m,).
    """
    forces, (points, weights) = np.zeros((len(depth), len(x), 2)), gauss_rule(_POINTS)
    share = (points + 1) / 2
    for nodal, lines, sign, place, components in (
        (forces[:, 0], depth, -1, x[0], [0, 2]),
        (forces[:, -1], depth, 1, x[-1], [0, 2]),
        (forces[-1], x, 1, depth[-1], [2, 1]),
    ):
        lengths = np.diff(lines)
        along = (lines[:-1, None] + share * lengths[:, None]).reshape(-1)
        across = np.full(len(along), place)
        x_there, depth_there = (along, across) if lines is x else (across, along)
        values = stresses(pressure, x_there, depth_there)[:, components].reshape(-1, _POINTS, 2)
        values = values * (weights / 2 * lengths[:, None])[..., None]
        side = np.zeros((len(lines), 2))  # ∫ N_i t ds
        side[:-1] += np.einsum("p,epk->ek", 1 - share, values)
        side[1:] += np.einsum("p,epk->ek", share, values)
        nodal += sign * side
    return forces
