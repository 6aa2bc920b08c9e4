"""Right formulations on strips, as somebody else might write them from papers: no code of a plugin is used."""

import numpy as np
from scipy import sparse
from scipy.optimize import nnls

from contactverif import Abilities, PatchPromises, Promises, Rules, Traits
from zoo.search import Springs, add_at, closest_segments, cross, dot, report, share_of, spread, visible_strips

ON_STRIPS = Traits(
    promises=Promises(
        patch=PatchPromises(flat=True, kinked=True, overhang=True),
        converges=True,
        conserves_force=True,
        conserves_moment=True,
        local=True,
        translation_stable=True,
    ),
    rules=Rules(penalty="distributed", area="current"),
    abilities=Abilities(batched=True, takes_complex=True),
)
SHARES = np.array([5.0, 8.0, 5.0]) / 18  # Weights of three Gauss points.
TWO_PLACES = np.array([0.5 - 12**-0.5, 0.5 + 12**-0.5])
THREE_PLACES = 0.5 + np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0])
GAUSS = (np.polynomial.legendre.leggauss(3)[0] + 1) / 2, np.polynomial.legendre.leggauss(3)[1] / 2
STEP = 2.0**-200


class SegmentPenalty(Springs):
    """Springs at three Gauss points of each strip, each with a decision of its own; batches, and an exact tangent.

    After Zavarise and Wriggers, "A segment-to-segment contact strategy" (1998), with a penalty in place of multipliers:
    gap and pressure act along the slave's normal at both facing points. The tangent takes complex steps of each strip.
    """

    traits = ON_STRIPS.revise(
        integrates_linear_gap=True, tangent="exact", continuity="C0", nodes_push=True, force_along="slave normal"
    )

    places, weights = GAUSS
    snap = 0.0  # The share of a segment within which a node of the master lies on its end.

    def pair(self, interface, z):
        x = z.reshape(-1, 2)
        strips = visible_strips(interface.slave.segments, interface.master.segments, x, self.snap)
        return {
            "strips": strips,
            "active": self._at_points(self._corners(interface, strips, x))[0] < self.begins(interface),
        }

    def begins(self, interface):
        """Return the gap at which a point begins to push."""
        return 0.0

    def pull(self, interface, gap):
        """Return minus the pressure at a gap where a point pushes."""
        return self.penalty * gap

    def _corners(self, interface, strips, x):
        """Return the nodes (..., n, 6, 2) that a strip depends on: two of each segment, and those that cut it."""
        return x[..., self._nodes(interface, strips), :]

    def _nodes(self, interface, strips):
        segments = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        ends = np.where(strips[:, 2:] < 0, segments[0], strips[:, 2:])  # An end cuts at itself: its share is exact.
        return np.hstack([*segments, ends])

    def _at_points(self, corners):
        """Return gap, s, t, weight of the points (..., n, n_places), and the normal into the slave (..., n, 1, 2)."""
        a, b, first, second, low, high = (corners[..., number, :] for number in range(6))
        along = b - a
        square = dot(along, along)
        start, end = dot(low - a, along) / square, dot(high - a, along) / square
        s = start[..., None] + (end - start)[..., None] * self.places
        s_first, s_second = dot(first - a, along) / square, dot(second - a, along) / square
        t = (s - s_first[..., None]) / (s_second - s_first)[..., None]
        size = np.sqrt(square)
        heights = cross(along, first - a) / size, cross(along, second - a) / size
        gap = -((1 - t) * heights[0][..., None] + t * heights[1][..., None])
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
        return gap, s, t, ((end - start) * size)[..., None] * self.weights, normal[..., None, :]

    def _forces(self, interface, active, corners):
        """Return the forces (..., n, 4, 2) on both nodes of the slave segment, and of the master's."""
        gap, s, t, weight, normal = self._at_points(corners)
        pull = (np.where(active, self.pull(interface, gap), 0) * weight)[..., None] * normal
        return np.stack([(share[..., None] * pull).sum(axis=-2) for share in (1 - s, s, t - 1, -t)], axis=-2)

    def residual(self, interface, pairing, z):
        x = z.reshape(*z.shape[:-1], -1, 2)
        parts = self._forces(interface, pairing["active"], self._corners(interface, pairing["strips"], x))
        forces, nodes = np.zeros_like(x), self._nodes(interface, pairing["strips"])
        for number in range(4):
            add_at(forces, nodes[:, number], parts[..., number, :])
        return forces.reshape(z.shape)

    def tangent(self, interface, pairing, z):
        corners = self._corners(interface, pairing["strips"], z.reshape(-1, 2))
        moves = STEP * np.eye(12).reshape(12, 1, 6, 2)
        slopes = self._forces(interface, pairing["active"], corners + 1j * moves).imag / STEP  # (12, n, 4, 2)
        nodes = self._nodes(interface, pairing["strips"])
        unknowns = 2 * nodes[..., None] + np.arange(2)
        columns = np.broadcast_to(unknowns.reshape(-1, 12).T[:, :, None, None], slopes.shape)
        rows = np.broadcast_to(unknowns[:, :4], slopes.shape)
        entries = slopes.ravel(), (rows.ravel(), columns.ravel())
        return sparse.coo_array(entries, shape=(z.size, z.size)).tocsr()

    def contact_points(self, interface, pairing, z):
        x, strips = z.reshape(-1, 2), pairing["strips"]
        gap, s, t, weight, normal = self._at_points(self._corners(interface, strips, x))
        a, b = (x[interface.slave.segments[strips[:, 0], end]][:, None] for end in (0, 1))
        position = (1 - s)[..., None] * a + s[..., None] * b
        slave, master = (np.repeat(strips[:, column], len(self.places)) for column in (0, 1))
        normals = np.broadcast_to(normal, position.shape)
        return report(self.penalty, slave, 2 * s - 1, master, t, position, normals, gap, weight, pairing["active"])


class WholeShapes(Springs):
    """Mortar with the shapes of whole segments, standard or dual; the latter err where a segment is covered in part."""

    gaps = pressures = "standard"
    weights = GAUSS[1]

    def __init__(self, *, penalty):
        super().__init__(penalty=penalty)
        self.inner = SegmentPenalty(penalty=penalty)
        self.inner.weights = self.weights
        words = {"gap_shapes": self.gaps, "pressure_shapes": self.pressures}
        self.traits = ON_STRIPS.revise(gap="cells", force_along="slave normal", **words)

    def pair(self, interface, z):
        strips = self.inner.pair(interface, z)["strips"]
        gaps = self._weigh(interface, strips, z.reshape(-1, 2))[0]
        return {"strips": strips, "active": gaps < 0}

    def _weigh(self, interface, strips, x):
        """Return the weighted gaps (..., n_slave_nodes), and the points of the strips."""
        gap, s, t, weight, normal = self.inner._at_points(self.inner._corners(interface, strips, x))
        sums = np.zeros((*x.shape[:-2], 2, interface.n_slave_nodes), x.dtype)
        for node, shape in zip(interface.slave.segments[strips[:, 0]].T, shapes_of(s, self.gaps), strict=True):
            for number, factor in enumerate((gap, 1)):
                np.add.at(sums, (..., number, node), (shape * weight * factor).sum(axis=-1))
        covered = sums[..., 1, :] != 0
        return np.where(covered, sums[..., 0, :] / np.where(covered, sums[..., 1, :], 1), 0), (s, t, weight, normal)

    def residual(self, interface, pairing, z):
        x, strips = z.reshape(*z.shape[:-1], -1, 2), pairing["strips"]
        gaps, (s, t, weight, normal) = self._weigh(interface, strips, x)
        at_nodes = (self.penalty * np.where(pairing["active"], gaps, 0))[..., interface.slave.segments[strips[:, 0]]]
        pull = sum(shape * at_nodes[..., end, None] for end, shape in enumerate(shapes_of(s, self.pressures)))
        nodes = self.inner._nodes(interface, strips)[:, :4].T
        return spread(x, nodes, (1 - s, s, t - 1, -t), pull, normal[..., 0, :], weight)


def shapes_of(s, word):
    """Return the two shapes of a whole segment at shares s of it."""
    return (1 - s, s) if word == "standard" else (2 - 3 * s, 3 * s - 1)


class SimpsonPoints(SegmentPenalty):
    """Springs at the points of Simpson's rule: at the ends of strips a shape is 0, or what roundoff leaves."""

    places, weights = np.array([0.0, 0.5, 1.0]), np.array([1.0, 4.0, 1.0]) / 6


class TabulatedPoints(SegmentPenalty):
    """Springs at three Gauss points from a table of 14 digits, whose weights add up to 1 + 45u."""

    places = (np.array([-0.77459666924148, 0.0, 0.77459666924148]) + 1) / 2
    weights = np.array([0.55555555555556, 0.88888888888889, 0.55555555555556]) / 2


class ComputedPoints(SegmentPenalty):
    """Springs at the five Gauss points that the library NGSolve 6.2.2608 computes; the weights add up to 1 − 71u."""

    places = np.array([0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319])
    weights = np.array(
        [0.11846344252809062, 0.23931433524968324, 0.28444444444444444, 0.23931433524968324, 0.11846344252809062]
    )


class ByDifferences(SegmentPenalty):
    """Springs whose tangent is central differences on the frozen pairing, and stated to be no better."""

    traits = SegmentPenalty.traits.revise(tangent=1e-8)

    def tangent(self, interface, pairing, z):
        x = z.reshape(-1, 2)
        ends = x[np.vstack([interface.slave.segments, interface.master.segments])]
        step = 2.0**-20 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min()
        ahead, behind = (self.residual(interface, pairing, z + way * np.eye(z.size)) for way in (step, -step))
        return (ahead - behind).T / (2 * step)


class BothSidesHalved:
    """The mean of both choices of the slave, without bias: the symmetric form of Nitsche's method without stresses.

    After Mlika, Renard and Chouly, "An unbiased Nitsche's formulation" (2017), whose terms of stress are left out.
    Areas are means of both surfaces, so the traits state none.
    """

    traits = SegmentPenalty.traits.revise(
        area=None, force_along=None, integrates_linear_gap=None, unbiased=True, tangent=None
    )

    def __init__(self, *, penalty):
        self.inner = SegmentPenalty(penalty=penalty / 2)

    def _sides(self, interface):
        """Yield both choices of the slave: a prefix, the interface, and by how much the state is rolled."""
        yield "slave ", interface, 0
        yield "master ", interface.swap_roles(), 2 * interface.n_slave_nodes

    def pair(self, interface, z):
        return {
            prefix + name: values
            for prefix, each, shift in self._sides(interface)
            for name, values in self.inner.pair(each, np.roll(z, -shift)).items()
        }

    def residual(self, interface, pairing, z):
        total = np.zeros_like(z)
        for prefix, each, shift in self._sides(interface):
            decisions = {name: pairing[prefix + name] for name in ("strips", "active")}
            total += np.roll(self.inner.residual(each, decisions, np.roll(z, -shift, axis=-1)), shift, axis=-1)
        return total


class StripEnergy:
    """Springs with the lengths of the reference, ε̂/2 gap² at Gauss points of each strip; no tangent, and no points.

    Forces are derivatives by complex steps. What a master node cuts off the slave is energy, too, so that a free end of
    the master is pushed along the surface. No other formulation has forces that do no work in a closed loop there.
    """

    traits = ON_STRIPS.revise(
        kinked=None,
        overhang=None,
        converges=None,
        integrates_linear_gap=True,
        area="reference",
        batched=False,
        takes_complex=False,
    )

    def __init__(self, *, penalty):
        self.springs = SegmentPenalty(penalty=penalty)
        self.springs.snap = 1e-10  # Else a rounding of an end that lies on another one decides about a force.

    def pair(self, interface, z):
        return self.springs.pair(interface, z)

    def residual(self, interface, pairing, z):
        x, strips = z.reshape(-1, 2), pairing["strips"]
        nodes = self.springs._nodes(interface, strips)
        corners = x[nodes] + 1j * STEP * np.eye(12).reshape(12, 1, 6, 2)
        gap, *_, weight, _ = self.springs._at_points(corners)
        along = corners[..., 1, :] - corners[..., 0, :]
        stretch = np.sqrt((along**2).sum(axis=-1)) / interface.slave.lengths(interface.nodes)[strips[:, 0]]
        energy = (np.where(pairing["active"], gap, 0) ** 2 * weight).sum(axis=-1) / stretch * self.springs.penalty / 2
        forces = np.zeros_like(x)
        for corner, slope in enumerate((energy.imag / STEP).reshape(6, 2, -1)):
            add_at(forces, nodes[:, corner], slope.T)
        return forces.reshape(z.shape)


KNOTS = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])
TWO = np.array([-1.0, 1.0]) / np.sqrt(3.0)  # Exact for cubics


def shapes_at(c):
    """Return the three quadratic shapes (..., 3) at places from −1 to 1."""
    k = KNOTS[2]
    return np.stack([c * (c - k) / (2 * k * k), 1 - c * c / (k * k), c * (c + k) / (2 * k * k)], axis=-1)


class DiscontinuousMortar(Springs):
    """Springs of gaps that are projected on quadratic polynomials of each covered part of a slave segment.

    After Wohlmuth, "Discretization methods and iterative solvers based on domain decomposition" (2001), with
    discontinuous multipliers. The shapes are Lagrange's at the three Gauss points of what is covered without a break,
    so that their mass is diagonal. Contact points are the Gauss points of the covered parts, with the projected gaps.
    """

    traits = ON_STRIPS.revise(integrates_linear_gap=True, force_along="slave normal")

    def pair(self, interface, z):
        x = z.reshape(-1, 2)
        strips = visible_strips(interface.slave.segments, interface.master.segments, x)
        begins = np.ones(len(strips), dtype=bool)
        same = strips[1:, 0] == strips[:-1, 0]
        begins[1:] = ~(same & (strips[1:, 2] == strips[:-1, 3]))  # A part begins where no strip ends.
        first, part = np.flatnonzero(begins), np.cumsum(begins) - 1
        last = np.append(first[1:], len(strips))[: len(first)] - 1
        parts = np.column_stack([strips[first, 0], strips[first, 2], strips[last, 3]]).reshape(-1, 3)
        pairing = {"strips": strips, "part": part.astype(np.int64), "parts": parts}
        return {**pairing, "active": self._project(interface, pairing, x)[0] < 0}

    def _project(self, interface, pairing, x):
        """Return the projected gaps (..., n_parts, 3), ranges of parts, and what the points of strips have."""
        strips, part, parts = pairing["strips"], pairing["part"], pairing["parts"]
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        carrier = interface.slave.segments[parts[:, 0]]
        low, high = share_of(parts[:, 1], 0, carrier, x), share_of(parts[:, 2], 1, carrier, x)
        start, end = share_of(strips[:, 2], 0, slave, x), share_of(strips[:, 3], 1, slave, x)
        s = ((start + end)[..., None] + (end - start)[..., None] * TWO) / 2
        middle, half = ((low + high) / 2)[..., part, None], ((high - low) / 2)[..., part, None]
        shapes = shapes_at((s - middle) / half)
        a = x[..., slave[:, 0], :]
        along = x[..., slave[:, 1], :] - a
        to_first, to_second = x[..., master[:, 0], :] - a, x[..., master[:, 1], :] - a
        square = dot(along, along)
        run = x[..., master[:, 1], :] - x[..., master[:, 0], :]
        t = (s * square[..., None] - dot(to_first, along)[..., None]) / dot(run, along)[..., None]
        size = np.sqrt(square)
        gap = -((1 - t) * cross(along, to_first)[..., None] + t * cross(along, to_second)[..., None]) / size[..., None]
        share = ((end - start) / (high - low)[..., part] / 2)[..., None]  # Of the part's length, for each point
        sums = np.zeros((*gap.shape[:-2], len(parts), 3), gap.dtype)
        add = ((share * gap)[..., None] * shapes).sum(axis=-2)
        np.add.at(sums, (..., part, slice(None)), add)
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
        weight = ((end - start) * size / 2)[..., None]
        return sums / SHARES, (low, high), (shapes, s, t, weight, normal)

    def residual(self, interface, pairing, z):
        x = z.reshape(*z.shape[:-1], -1, 2)
        gaps, _, (shapes, s, t, weight, normal) = self._project(interface, pairing, x)
        nodal = self.penalty * np.where(pairing["active"], gaps, 0)
        pull = (nodal[..., pairing["part"], None, :] * shapes).sum(axis=-1) * weight
        slave = interface.slave.segments[pairing["strips"][:, 0]].T
        master = interface.master.segments[pairing["strips"][:, 1]].T
        return spread(x, (*slave, *master), (1 - s, s, t - 1, -t), pull, normal)

    def contact_points(self, interface, pairing, z):
        x = z.reshape(-1, 2)
        gaps, (low, high), _ = self._project(interface, pairing, x)
        slave = pairing["parts"][:, 0]
        a, b = (x[interface.slave.segments[slave, end]] for end in (0, 1))
        c = ((low + high - 1)[:, None] + (high - low)[:, None] * KNOTS).ravel()
        carrier = np.repeat(slave, 3)
        position = ((1 - c) / 2)[:, None] * np.repeat(a, 3, axis=0) + ((1 + c) / 2)[:, None] * np.repeat(b, 3, axis=0)
        along = b - a
        size = np.hypot(*along.T)
        normal = np.repeat(np.column_stack([-along[:, 1], along[:, 0]]) / size[:, None], 3, axis=0)
        weight, t = ((high - low) * size)[:, None] * SHARES, np.full(len(c), np.nan)
        nothing = np.full(len(c), -1)
        return report(self.penalty, carrier, c, nothing, t, position, normal, gaps, weight, pairing["active"])


class NodalLeastSquares(Springs):
    """Springs with pressures between the slave's nodes that fit best, in batches; no tangent, and no contact points.

    After Puso and Laursen, "A mortar segment-to-segment contact method" (2004), with the consistent mass of a
    projection in L2 in place of gaps that each node weighs by itself: of all pressures p = ΣN_j p_j with p_j ≥ 0, the
    formulation takes the one for which ∫(p + ε̂ g)² over what is covered is least. Its active nodes A solve
    Σ_A M_ij p_j = −ε̂ ∫N_i g, with M = ∫N_i N_j. Nodes whose weighted gap is open are never active, since no entry of M
    is negative.
    """

    traits = ON_STRIPS.revise(locks=False, nodes_push=True, force_along="slave normal")

    def pair(self, interface, z):
        x = z.reshape(-1, 2)
        strips = visible_strips(interface.slave.segments, interface.master.segments, x)
        sums, mass = self._integrals(interface, strips, self._at_points(interface, strips, x))
        covered = np.flatnonzero(mass.diagonal() > 0)
        active = np.zeros(interface.n_slave_nodes, bool)
        if (sums < 0).any():
            # Shapes of one size, however little of a node is covered, and forces of one size in any unit.
            scale, size = np.sqrt(mass.diagonal()[covered]), np.abs(sums).max()
            factor = np.linalg.cholesky(mass[np.ix_(covered, covered)] / np.outer(scale, scale))
            fit, _ = nnls(factor.T, np.linalg.solve(factor, -sums[covered] / size / scale))
            active[covered] = fit > 0
        return {"strips": strips, "active": active}

    def _at_points(self, interface, strips, x):
        """Return gap, s, t, weight (..., n, 2) and normal (..., n, 2) of the points of each strip."""
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        low, high = share_of(strips[:, 2], 0, slave, x), share_of(strips[:, 3], 1, slave, x)
        a, first, second = x[..., slave[:, 0], :], x[..., master[:, 0], :], x[..., master[:, 1], :]
        along = x[..., slave[:, 1], :] - a
        s = low[..., None] + (high - low)[..., None] * TWO_PLACES
        foot, run = dot(first - a, along)[..., None], dot(second - first, along)[..., None]
        t = (s * dot(along, along)[..., None] - foot) / run
        size = np.sqrt(dot(along, along))
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
        gap = -(dot(first - a, normal)[..., None] + t * dot(second - first, normal)[..., None])
        return gap, s, t, ((high - low) * size)[..., None] * np.array([0.5, 0.5]), normal

    def _integrals(self, interface, strips, points):
        """Return ∫N g (..., n_slave_nodes) and M (..., n_slave_nodes, n_slave_nodes)."""
        gap, s, _, weight, _ = points
        n, ends = interface.n_slave_nodes, interface.slave.segments[strips[:, 0]]
        mass = np.zeros((*gap.shape[:-2], n, n), gap.dtype)
        sums = np.zeros((*gap.shape[:-2], n), gap.dtype)
        shapes = 1 - s, s
        for i in range(2):
            np.add.at(sums, (..., ends[:, i]), (shapes[i] * weight * gap).sum(axis=-1))
            for j in range(2):
                np.add.at(mass, (..., ends[:, i], ends[:, j]), (shapes[i] * shapes[j] * weight).sum(axis=-1))
        return sums, mass

    def _pressures(self, interface, pairing, points):
        """Return the nodal pressures (..., n_slave_nodes), 0 where a node is not active."""
        sums, mass = self._integrals(interface, pairing["strips"], points)
        nodes = np.flatnonzero(pairing["active"])
        pressures = np.zeros_like(sums)
        size = np.abs(np.diagonal(mass, axis1=-2, axis2=-1).real[..., nodes])
        scale = np.sqrt(np.where(size > 0, size, 1))  # It cancels, and keeps digits where little is covered.
        scaled = mass[..., nodes[:, None], nodes] / (scale[..., None] * scale[..., None, :])
        fit = np.linalg.solve(scaled, (-sums[..., nodes] / scale)[..., None])[..., 0]
        pressures[..., nodes] = self.penalty * fit / scale
        return pressures

    def residual(self, interface, pairing, z):
        x, strips = z.reshape(*z.shape[:-1], -1, 2), pairing["strips"]
        points = self._at_points(interface, strips, x)
        nodal = -self._pressures(interface, pairing, points)
        _, s, t, weight, normal = points
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        pull = (1 - s) * nodal[..., slave[:, 0], None] + s * nodal[..., slave[:, 1], None]
        return spread(x, (*slave.T, *master.T), (1 - s, s, t - 1, -t), pull, normal, weight)


class HalfPasses(Springs):
    """Springs at three Gauss points of each strip of either surface, which push their own body alone; batches.

    After Sauer and De Lorenzis, "A computational contact formulation based on surface potentials" (2013), Section 5:
    both surfaces are slaves, and each pass keeps only the forces on its own nodes.
    """

    traits = ON_STRIPS.revise(unbiased=True, nodes_push=True, conserves_force=None, conserves_moment=None)

    def pair(self, interface, z):
        x = z.reshape(-1, 2)
        sides = interface.slave.segments, interface.master.segments
        strips = [visible_strips(*each, x) for each in (sides, sides[::-1])]
        on_master = np.repeat([False, True], [len(each) for each in strips])
        pairing = {"strips": np.vstack(strips), "on_master": on_master}
        return {**pairing, "active": self._points(interface, pairing, x)[0] < 0}

    def _points(self, interface, pairing, x):
        """Return gap, s, t and weight of the points (..., n, 3), and normals (..., n, 2) into the body of the strip."""
        carrier, opposite = self._nodes(interface, pairing)
        a, first = x[..., carrier[:, 0], :], x[..., opposite[:, 0], :]
        along, run = x[..., carrier[:, 1], :] - a, x[..., opposite[:, 1], :] - first
        low, high = (share_of(pairing["strips"][:, 2 + end], end, carrier, x)[..., None] for end in (0, 1))
        square = dot(along, along)[..., None]
        size = np.sqrt(square)
        s = low + THREE_PLACES * (high - low)
        t = (s * square - dot(first - a, along)[..., None]) / dot(run, along)[..., None]
        gap = -(cross(along, first - a)[..., None] + t * cross(along, run)[..., None]) / size
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size
        return gap, s, t, SHARES * (high - low) * size, normal

    @staticmethod
    def _nodes(interface, pairing):
        """Return the nodes (n, 2) of the segments that carry the strips, and of those opposite."""
        number, other = pairing["strips"][:, 0], pairing["strips"][:, 1]
        nodes = np.empty((2, len(number), 2), np.int64)
        for second in (False, True):
            these = pairing["on_master"] == second
            sides = (interface.slave.segments, interface.master.segments)[:: -1 if second else 1]
            nodes[0, these], nodes[1, these] = sides[0][number[these]], sides[1][other[these]]
        return nodes

    def residual(self, interface, pairing, z):
        x = z.reshape(*z.shape[:-1], -1, 2)
        gap, s, _, weight, normal = self._points(interface, pairing, x)
        pull = self.penalty * np.where(pairing["active"], gap, 0) * weight
        return spread(x, self._nodes(interface, pairing)[0].T, (1 - s, s), pull, normal)

    def contact_points(self, interface, pairing, z):
        x, strips = z.reshape(-1, 2), pairing["strips"]
        gap, s, t, weight, normal = self._points(interface, pairing, x)
        a, b = (x[self._nodes(interface, pairing)[0][:, end]][:, None] for end in (0, 1))
        position = (1 - s)[..., None] * a + s[..., None] * b
        normals, on_master = np.repeat(normal, 3, axis=0), np.repeat(pairing["on_master"], 3)
        carrier, opposite = (np.repeat(strips[:, column], 3) for column in (0, 1))
        places = (carrier, 2 * s - 1, opposite, t, position, normals, gap, weight, pairing["active"])
        return report(self.penalty, *places, on_master=on_master)


class MiddleLine(Springs):
    """Springs at two Gauss points of each overlap on a line halfway between segments, with a decision each; batches.

    After McDevitt and Laursen, "A mortar-finite element formulation for frictional contact problems" (2000): both
    segments of a pair are projected on that line, gaps and pressures act along its normal, and lengths are its own.
    """

    traits = ON_STRIPS.revise(unbiased=True, nodes_push=True, area=None)

    def pair(self, interface, z):
        """Return the pairs that one side or the other sees, and which of their ends bound the overlap."""
        x = z.reshape(-1, 2)
        sides = interface.slave.segments, interface.master.segments
        pairs = {(int(i), int(j)) for i, j in visible_strips(*sides, x)[:, :2]}
        pairs |= {(int(i), int(j)) for j, i in visible_strips(*sides[::-1], x)[:, :2]}
        table = np.array(sorted(pairs), np.int64).reshape(-1, 2)
        a, b, first, second = self._places(*self._line(interface, table, x)[:2])
        by_slave = np.stack([a >= second, b <= first], axis=-1)
        pairing = {"pairs": table, "cut by slave": by_slave, "overlaps": np.maximum(a, second) < np.minimum(b, first)}
        return {**pairing, "active": self._at_points(interface, pairing, x)[0] < 0}

    def _line(self, interface, pairs, x):
        """Return the corners (..., n, 4, 2) relative to the slave's first node, and the middle line's direction."""
        nodes = np.hstack([interface.slave.segments[pairs[:, 0]], interface.master.segments[pairs[:, 1]]])
        corners = x[..., nodes, :] - x[..., nodes[:, :1], :]
        u, v = corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 3, :]
        line = u / np.sqrt(dot(u, u))[..., None] + v / np.sqrt(dot(v, v))[..., None]
        return corners, line / np.sqrt(dot(line, line))[..., None], nodes

    @staticmethod
    def _places(corners, line):
        """Return the places (4, ..., n) of the corners along the line."""
        return np.moveaxis(dot(corners, line[..., None, :]), -1, 0)

    def _at_points(self, interface, pairing, x):
        corners, line, nodes = self._line(interface, pairing["pairs"], x)
        a, b, first, second = self._places(corners, line)
        heights = cross(line[..., None, :], corners)
        by_slave = pairing["cut by slave"]
        low, high = np.where(by_slave[:, 0], a, second), np.where(by_slave[:, 1], b, first)
        at = low[..., None] + (high - low)[..., None] * TWO_PLACES
        s = (at - a[..., None]) / (b - a)[..., None]
        t = (at - first[..., None]) / (second - first)[..., None]
        gap = (1 - s) * heights[..., 0, None] + s * heights[..., 1, None]
        gap = gap - (1 - t) * heights[..., 2, None] - t * heights[..., 3, None]
        normal = np.stack([-line[..., 1], line[..., 0]], axis=-1)
        weight = np.where(pairing["overlaps"], high - low, 0)[..., None] / 2
        return gap, s, t, weight, normal, nodes

    def residual(self, interface, pairing, z):
        x = z.reshape(*z.shape[:-1], -1, 2)
        gap, s, t, weight, normal, nodes = self._at_points(interface, pairing, x)
        pull = self.penalty * np.where(pairing["active"], gap, 0) * weight
        return spread(x, nodes.T, (1 - s, s, t - 1, -t), pull, normal)


class OnePoint(Springs):
    """Springs at the middles of what slave segments see, in batches; no tangent, and no contact points.

    After Zavarise and De Lorenzis, "A modified node-to-segment algorithm passing the contact patch test" (2009), with
    one virtual slave node. The area of competence is what of the segment faces the master, the node is its middle, and
    the force reaches the master by the lengths of the strips, so that forces balance at any tilt.
    """

    traits = ON_STRIPS.revise(kinked=None, conserves_moment=None, local=None)

    def pair(self, interface, z):
        x = z.reshape(-1, 2)
        strips = visible_strips(interface.slave.segments, interface.master.segments, x)
        numbers, area = np.unique(strips[:, 0], return_inverse=True)
        pairing = {"strips": strips, "area": area.astype(np.int64), "carrier": numbers.astype(np.int64)}
        middle, point, _ = self._areas(interface, pairing, x)
        home, over = closest_segments(point, interface.master, x)
        gap, _, _ = self._gaps(interface, home, middle, pairing["carrier"], x)
        return {**pairing, "home": home.astype(np.int64), "active": over & (gap < 0)}

    def _areas(self, interface, pairing, x):
        """Return the middle share, the point and the length of each area, and what a strip has of them."""
        strips, area = pairing["strips"], pairing["area"]
        slave = interface.slave.segments[strips[:, 0]]
        low, high = share_of(strips[:, 2], 0, slave, x), share_of(strips[:, 3], 1, slave, x)
        sums = np.zeros((2, *low.shape[:-1], len(pairing["carrier"])), low.dtype)
        np.add.at(sums[0], (..., area), high - low)
        np.add.at(sums[1], (..., area), (high - low) * (high + low) / 2)
        middle = sums[1] / sums[0]
        a, b = (x[..., interface.slave.segments[pairing["carrier"], end], :] for end in (0, 1))
        point = (1 - middle)[..., None] * a + middle[..., None] * b
        return middle, point, (low, high, sums[0])

    def _gaps(self, interface, home, middle, carrier, x):
        """Return gap, normal of the closest segment, and length of the slave segment."""
        a, b = (x[..., interface.slave.segments[carrier, end], :] for end in (0, 1))
        first, second = (x[..., interface.master.segments[home, end], :] for end in (0, 1))
        run = second - first
        normal = np.stack([run[..., 1], -run[..., 0]], axis=-1) / np.sqrt(dot(run, run))[..., None]
        gap = (1 - middle) * dot(a - first, normal) + middle * dot(b - first, normal)
        return gap, normal, np.sqrt(dot(b - a, b - a))

    def residual(self, interface, pairing, z):
        x = z.reshape(*z.shape[:-1], -1, 2)
        strips, area, carrier = pairing["strips"], pairing["area"], pairing["carrier"]
        middle, _, (low, high, covered) = self._areas(interface, pairing, x)
        gap, normal, length = self._gaps(interface, pairing["home"], middle, carrier, x)
        pull = (self.penalty * np.where(pairing["active"], gap * covered * length, 0))[..., None] * normal
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        a, along = x[..., slave[:, 0], :], x[..., slave[:, 1], :] - x[..., slave[:, 0], :]
        first, run = x[..., master[:, 0], :] - a, x[..., master[:, 1], :] - x[..., master[:, 0], :]
        s = (low + high) / 2  # A linear shape has its mean in the middle of the strip.
        t = (s * dot(along, along) - dot(first, along)) / dot(run, along)
        part = ((high - low) / covered[..., area])[..., None] * pull[..., area, :]
        forces = np.zeros_like(x)
        add_at(forces, interface.slave.segments[carrier, 0], (1 - middle)[..., None] * pull)
        add_at(forces, interface.slave.segments[carrier, 1], middle[..., None] * pull)
        add_at(forces, master[:, 0], (t - 1)[..., None] * part)
        add_at(forces, master[:, 1], -t[..., None] * part)
        return forces.reshape(z.shape)


class CommonPlane(Springs):
    """A spring in the middle of each overlap of two segments, seen along the mean of both normals.

    As the common planes of explicit codes. Of master segments over one place
    of the slave that one counts whose middle is nearest to the slave's; of equally near ones the first.
    """

    traits = Traits(promises=Promises(conserves_force=True, conserves_moment=True), rules=Rules(penalty="distributed"))

    def pair(self, interface, z):
        x, master, rows = z.reshape(-1, 2), interface.master.segments, []
        for slave in interface.slave.segments:
            middle, covered = x[slave].mean(axis=0), []
            for number in np.argsort(np.hypot(*(x[master].mean(axis=1) - middle).T), kind="stable"):
                nodes = [*slave, *master[number]]
                if dot(x[nodes[1]] - x[nodes[0]], x[nodes[3]] - x[nodes[2]]) < 0:
                    along = self._frame(x[nodes][None])[1][0]
                    low = max(along[:2].argmin(), 2 + along[2:].argmin(), key=lambda end: along[end])
                    high = min(along[:2].argmax(), 2 + along[2:].argmax(), key=lambda end: along[end])
                    begin, end = sorted((along[[low, high]] - along[0]) / (along[1] - along[0]))
                    if along[low] < along[high] and not any(a < (begin + end) / 2 < b for a, b in covered):
                        covered.append((begin, end))
                        rows.append([*nodes, low, high])
        table = np.array(rows, dtype=np.int64).reshape(-1, 6)
        return {"nodes": table[:, :4], "ends": table[:, 4:], "active": self._look(x, table[:, :4], table[:, 4:])[0] < 0}

    def _frame(self, corners):
        """Return the normal out of the master (n, 2), and the places (n, 4) of the nodes across it."""
        slave, master = (
            along / np.hypot(*along.T)[:, None] for along in (corners[:, end + 1] - corners[:, end] for end in (0, 2))
        )
        mean = master - slave
        mean = mean / np.hypot(*mean.T)[:, None]
        return np.column_stack([mean[:, 1], -mean[:, 0]]), np.einsum("nki,ni->nk", corners - corners[:, :1], mean)

    def _look(self, x, nodes, ends):
        normal, along = self._frame(x[nodes])
        low, high = np.take_along_axis(along, ends, axis=1).T
        places = ((low + high)[:, None] / 2 - along[:, ::2]) / (along[:, 1::2] - along[:, ::2])
        shares = np.column_stack([1 - places[:, 0], places[:, 0], places[:, 1] - 1, -places[:, 1]])
        heights = np.einsum("nki,ni->nk", x[nodes] - x[nodes[:, :1]], normal)
        return (shares * heights).sum(axis=1), high - low, shares, normal

    def residual(self, interface, pairing, z):
        forces = np.zeros((interface.n_nodes, 2))
        gap, length, shares, normal = self._look(z.reshape(-1, 2), pairing["nodes"], pairing["ends"])
        pulls = (self.penalty * np.where(pairing["active"], gap * length, 0))[:, None, None] * shares[..., None]
        np.add.at(forces, pairing["nodes"], pulls * normal[:, None])
        return forces.reshape(-1)
