"""Right formulations at points and nodes, as somebody else might write them: no code of a plugin is used.

Each is right by the rule that its traits state, and differs from the built-in ones in the way of writing, in what
roundoff and ties decide, and in what it leaves out of its report.
"""

from dataclasses import replace

import numpy as np
from scipy import sparse

from contactverif import ContactPoints, Handle, Promises, Rules, Traits
from zoo.on_strips import ON_STRIPS
from zoo.search import Dual, Springs, closest_segments, cross, dot, report, root

AT_POINTS = Traits(
    promises=Promises(
        tangent="exact",
        conserves_force=True,
        conserves_moment=True,
        nodes_push=True,
        local=True,
        translation_stable=True,
    ),
    rules=Rules(penalty="distributed", area="current", gap="closest point", force_along="master normal"),
)
FOUR = np.polynomial.legendre.leggauss(4)  # Places and weights.
SHARE = 0.5  # The activation distance of a barrier over the shortest segment.
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)


def _unit(vectors):
    return vectors / np.sqrt((vectors**2).sum(axis=-1))[..., None]


class PointsFirst(Springs):
    """Springs at the slave nodes, each node once for each of its segments; points are formed first, at full size.

    Of tied segments the last one is taken, there is no tolerance past a free end, and the normal comes from an angle.
    """

    traits = Traits(
        promises=Promises(conserves_force=True), rules=Rules(gap="closest point", penalty="distributed", area="current")
    )
    places = np.array([-1.0, 1.0])

    def _points(self, interface, z):
        x = z.reshape(-1, 2)
        first, second = (x[interface.slave.segments[:, end]] for end in (0, 1))
        c = np.tile(self.places, len(first))
        carrier = np.repeat(np.arange(len(first)), len(self.places))
        point = np.einsum("p,pi->pi", (1 - c) / 2, first[carrier]) + np.einsum("p,pi->pi", (1 + c) / 2, second[carrier])
        weight = np.hypot(*(second - first)[carrier].T) / len(self.places)
        return x, carrier, c, point, weight

    def _look(self, interface, x, point):
        """Return for each point and master segment ξ, distance, normal and gap."""
        first, second = (x[interface.master.segments[:, end]] for end in (0, 1))
        along = second - first
        angle = np.arctan2(along[:, 1], along[:, 0])
        normal = np.stack([np.sin(angle), -np.cos(angle)], axis=1)
        offset, beyond = point[:, None] - first, point[:, None] - second
        xi = np.einsum("pmi,mi->pm", offset, along) / np.einsum("mi,mi->m", along, along)
        nearest = point[:, None] - (first + np.clip(xi, 0, 1)[..., None] * along)
        nearest = np.where((xi <= 0)[..., None], offset, np.where((xi >= 1)[..., None], beyond, nearest))
        distance = np.hypot(nearest[..., 0], nearest[..., 1])
        return xi, distance, normal, np.einsum("pmi,mi->pm", offset, normal)

    def contact_points(self, interface, pairing, z):
        x, carrier, c, point, weight = self._points(interface, z)
        xi, distance, normals, gaps = self._look(interface, x, point)
        rows = np.arange(len(c))
        master = distance.shape[1] - 1 - np.argmin(distance[:, ::-1], axis=1)
        place, gap = xi[rows, master], gaps[rows, master]
        free = interface.master.neighbours[master] < 0
        active = (gap <= 0) & ~(free[:, 0] & (place < 0)) & ~(free[:, 1] & (place > 1))
        return report(self.penalty, carrier, c, master, place, point, normals[master], gap, weight, active)

    def residual(self, interface, pairing, z):
        points, forces = self.contact_points(interface, pairing, z), np.zeros((interface.n_nodes, 2))
        at = points.active
        force = (points.pressure[at] * points.weight[at])[:, None] * points.normal[at]
        ends, c = interface.slave.segments[points.slave_segment[at]], points.c[at]
        segment, xi = interface.master.segments[points.master_segment[at]], points.xi[at]
        nodes, shares = np.hstack([ends, segment]), np.stack([(c - 1) / 2, -(1 + c) / 2, 1 - xi, xi], axis=1)
        np.add.at(forces, nodes, shares[..., None] * force[:, None])
        return forces.reshape(-1)


class TurnedFrame(PointsFirst):
    """Springs at two points of each slave segment, computed in a frame along the first one, and turned back."""

    traits = PointsFirst.traits.revise(translation_stable=True)
    places = np.array([-0.5, 0.5])

    def contact_points(self, interface, pairing, z):
        x = z.reshape(-1, 2)
        along = _unit(x[1] - x[0])
        frame = np.array([along, [-along[1], along[0]]])
        points = super().contact_points(interface, pairing, ((x - x[0]) @ frame.T).reshape(-1))
        return replace(points, position=self._points(interface, z)[3], normal=points.normal @ frame)


class SlaveNormalAtGaussPoints(PointsFirst):
    """Springs at two Gauss points of each slave segment, along its normal; a point that sees nothing is not reported.

    There are no cells: each point looks for the nearest segment on its own line, differences first.
    """

    traits = Traits(
        promises=Promises(conserves_force=True, translation_stable=True),
        rules=Rules(gap="slave normal", penalty="distributed", area="current"),
    )
    places = GAUSS

    def contact_points(self, interface, pairing, z):
        x, carrier, c, point, weight = self._points(interface, z)
        a, b = (x[interface.slave.segments[carrier, end]] for end in (0, 1))
        first, second = (x[interface.master.segments[:, end]] for end in (0, 1))
        tau = _unit(b - a)
        normal = np.stack([-tau[:, 1], tau[:, 0]], axis=1)  # Into the slave, out of the master
        along = second - first
        offset = ((1 - c) / 2)[:, None, None] * (a[:, None] - first) + ((1 + c) / 2)[:, None, None] * (
            b[:, None] - first
        )
        advance = np.einsum("pi,mi->pm", tau, along)
        with np.errstate(divide="ignore", invalid="ignore"):
            xi = np.einsum("pmi,pi->pm", offset, tau) / advance
            foot = xi[..., None] * along
            gap = np.einsum("pmi,pi->pm", offset - foot, normal)
        sees = (advance < 0) & (xi >= 0) & (xi <= 1)
        master = np.where(sees, np.abs(gap), np.inf).argmin(axis=1)
        here = np.flatnonzero(sees.any(axis=1))
        m = master[here]
        gaps = gap[here, m]
        places = (carrier[here], c[here], m, xi[here, m], point[here], normal[here])
        return report(self.penalty, *places, gaps, weight[here], gaps < 0)


class NearbyOnly(PointsFirst):
    """Springs at four points of each slave segment, which look no farther than one segment and turn the index of ties.

    Points that find nothing name no master segment and leave all numbers NaN.
    """

    traits = PointsFirst.traits.revise(overhang=False)
    places = np.array([-0.75, -0.25, 0.25, 0.75])

    def contact_points(self, interface, pairing, z):
        points = super().contact_points(interface, pairing, z)
        lengths = interface.slave.lengths(z.reshape(-1, 2))[points.slave_segment]
        far = (points.gap > lengths) & ~points.active
        numbers = {name: np.where(far, np.nan, getattr(points, name)) for name in ("xi", "gap")}
        normal = np.where(far[:, None], np.nan, points.normal)
        master = np.where(far, -1, points.master_segment)
        arrays = {name: getattr(points, name) for name in ("slave_segment", "c", "position", "pressure", "weight")}
        ends = {"area_from": points.c - 0.25, "area_to": points.c + 0.25}
        return ContactPoints(**arrays, **numbers, **ends, active=points.active, master_segment=master, normal=normal)


class NodeVectors:
    """The active nodes (n,) with gaps, places ξ and the vectors N, T and N₀ (n, 6) of node, first and second node.

    After Wriggers, "Computational Contact Mechanics" (2006), Section 9.1.
    """

    def __init__(self, interface, pairing, x):
        self.number = np.flatnonzero(pairing["active"])
        ends = interface.master.segments[pairing["master"][self.number]]
        nodes = np.column_stack([interface.slave.nodes[self.number], ends])
        self.unknowns = (2 * nodes[..., None] + np.arange(2)).reshape(-1, 6)
        point, first, second = (x[nodes[:, number]] for number in range(3))
        run = second - first
        self.length = np.hypot(*run.T)
        t = run / self.length[:, None]
        n = np.column_stack([t[:, 1], -t[:, 0]])
        self.gap = np.einsum("pi,pi->p", point - first, n)
        self.xi = np.einsum("pi,pi->p", point - first, t) / self.length
        shares, ones = np.array([np.ones_like(self.xi), self.xi - 1, -self.xi]), np.array([0.0, -1.0, 1.0])
        self.n, self.t = (np.einsum("kp,pi->pki", shares, each).reshape(-1, 6) for each in (n, t))
        self.n0 = np.einsum("k,pi->pki", ones, n).reshape(-1, 6)

    def turn(self):
        """Return the derivative (n, 6, 6) of the vectors N."""
        mixed = np.einsum("pi,pj->pij", self.t, self.n0)
        curved = (self.gap / self.length**2)[:, None, None] * np.einsum("pi,pj->pij", self.n0, self.n0)
        return -(mixed + mixed.transpose(0, 2, 1)) / self.length[:, None, None] - curved


def pair_nodes(interface, x):
    """Return the master segment and the gap of each slave node, and whether its foot is on the master."""
    points = x[interface.slave.nodes]
    master, over = closest_segments(points, interface.master, x)
    first, second = (x[interface.master.segments[master, end]] for end in (0, 1))
    run = second - first
    across = (points - first)[:, 0] * run[:, 1] - (points - first)[:, 1] * run[:, 0]
    return master.astype(np.int64), across / np.hypot(*run.T), over


def add_matrices(total, rows, columns, parts):
    np.add.at(total, (rows[:, :, None], columns[:, None, :]), parts)


class NodesWithAreas(Springs):
    """Springs at slave nodes with half of each of their segments as area, whose change the tangent knows."""

    area = "current"
    traits = AT_POINTS

    def pair(self, interface, z):
        master, gap, over = pair_nodes(interface, z.reshape(-1, 2))
        return {"master": master, "active": over & (gap < 0)}

    def _areas(self, interface, x):
        places = x if self.area == "current" else interface.nodes
        a, b = (places[interface.slave.segments[:, end]] for end in (0, 1))
        return np.bincount(interface.slave.segments.ravel(), np.repeat(np.hypot(*(b - a).T) / 2, 2))

    def residual(self, interface, pairing, z):
        x = z.reshape(-1, 2)
        vectors, forces = NodeVectors(interface, pairing, x), np.zeros_like(z)
        size = self.penalty * self._areas(interface, x)[vectors.number] * vectors.gap
        np.add.at(forces, vectors.unknowns, size[:, None] * vectors.n)
        return forces

    def tangent(self, interface, pairing, z):
        x, matrix = z.reshape(-1, 2), np.zeros((z.size, z.size))
        vectors = NodeVectors(interface, pairing, x)
        area = self.penalty * self._areas(interface, x)[vectors.number]
        parts = np.einsum("pi,pj->pij", vectors.n, vectors.n) + vectors.gap[:, None, None] * vectors.turn()
        add_matrices(matrix, vectors.unknowns, vectors.unknowns, area[:, None, None] * parts)
        if self.area == "current":
            self._add_change_of_areas(interface, vectors, x, matrix)
        return matrix

    def _add_change_of_areas(self, interface, vectors: NodeVectors, x, matrix):
        row = np.full(interface.n_slave_nodes, -1)
        row[vectors.number] = np.arange(len(vectors.number))
        for a, b in interface.slave.segments:
            along = (x[b] - x[a]) / np.hypot(*(x[b] - x[a]))
            columns = np.array([2 * a, 2 * a + 1, 2 * b, 2 * b + 1])
            change = np.concatenate([-along, along]) / 2
            for at in (row[a], row[b]):
                if at >= 0:
                    force = self.penalty * vectors.gap[at] * vectors.n[at]
                    matrix[np.ix_(vectors.unknowns[at], columns)] += np.outer(force, change)


class NodesWithPotential(NodesWithAreas):
    """Springs with areas of the reference: forces are the gradient of Σ ε̂ A g²/2, so the tangent is symmetric.

    All decisions are in a handle, as those of a library are.
    """

    area = "reference"
    traits = NodesWithAreas.traits.revise(area="reference", symmetric=True)

    def pair(self, interface, z):
        return {"contacts": Handle(super().pair(interface, z))}

    def residual(self, interface, pairing, z):
        return super().residual(interface, pairing.handle, z)

    def tangent(self, interface, pairing, z):
        return super().tangent(interface, pairing.handle, z)


class NodesWithMultipliers(Springs):
    """A nodal force in place of each spring; rows −g where a node is in contact, and λ where it is not."""

    traits = AT_POINTS.revise(
        symmetric=True, independent_multipliers=True, enforcement="multiplier", penalty="nodal", area=None
    )

    def n_multipliers(self, interface):
        return int(interface.n_slave_nodes)

    def pair(self, interface, z):
        positions, multipliers = z[: interface.n_unknowns], z[interface.n_unknowns :]
        master, gap, over = pair_nodes(interface, positions.reshape(-1, 2))
        return {"master": master, "active": over & (multipliers - self.penalty * gap > 0)}

    def residual(self, interface, pairing, z):
        n, answer = interface.n_unknowns, z.copy()
        answer[:n] = 0
        vectors = NodeVectors(interface, pairing, z[:n].reshape(-1, 2))
        np.add.at(answer, vectors.unknowns, -z[n + vectors.number, None] * vectors.n)
        answer[n + vectors.number] = -vectors.gap
        return answer

    def tangent(self, interface, pairing, z):
        n, matrix = interface.n_unknowns, np.zeros((z.size, z.size))
        vectors = NodeVectors(interface, pairing, z[:n].reshape(-1, 2))
        rows = n + vectors.number
        add_matrices(matrix, vectors.unknowns, vectors.unknowns, -z[rows][:, None, None] * vectors.turn())
        matrix[vectors.unknowns, rows[:, None]] = matrix[rows[:, None], vectors.unknowns] = -vectors.n
        idle = np.setdiff1d(np.arange(n, z.size), rows)
        matrix[idle, idle] = 1
        return matrix


class GaussClosest(Springs):
    """Springs at two Gauss points of each slave segment along the master's normal, with an exact tangent.

    After Fischer and Wriggers, "Frictionless 2D contact formulations for finite deformations based on the mortar
    method" (2005), where the points of the integrals are projected alone; here each has a spring, and there are no
    cells. The kernel runs on arrays, and on dual numbers for the tangent.
    """

    traits = AT_POINTS.revise(integrates_linear_gap=True, nodes_push=None)

    def pair(self, interface, z):
        x = z.reshape(-1, 2)
        a, b = (np.repeat(x[interface.slave.segments[:, end]], 2, axis=0) for end in (0, 1))
        c = np.tile(GAUSS, len(interface.slave))[:, None]
        master, over = closest_segments((1 - c) / 2 * a + (1 + c) / 2 * b, interface.master, x)
        gap = self._kernel(self._corners(interface, master, x))[0]
        return {"master": master.astype(np.int64), "active": over & (gap <= 0)}

    def _nodes(self, interface, master):
        return np.hstack([np.repeat(interface.slave.segments, 2, axis=0), interface.master.segments[master]])

    def _corners(self, interface, master, x):
        """Return the coordinates of the four nodes of each point: x and y of A, B, 1 and 2, each (n_points,)."""
        return list(x[self._nodes(interface, master)].reshape(-1, 8).T)

    def _kernel(self, corners):
        """Return gap, ξ, the master's normal and the length of the slave segment, of arrays or of dual numbers."""
        ax, ay, bx, by, px, py, qx, qy = corners
        n = np.size(ax.value if isinstance(ax, Dual) else ax)
        shares = (1 - np.tile(GAUSS, n // 2)) / 2, (1 + np.tile(GAUSS, n // 2)) / 2
        ux, uy = qx - px, qy - py
        vx = (ax - px) * shares[0] + (bx - px) * shares[1]
        vy = (ay - py) * shares[0] + (by - py) * shares[1]
        size = root(ux * ux + uy * uy)
        tx, ty = ux / size, uy / size
        return (
            vx * ty - vy * tx,
            (vx * tx + vy * ty) / size,
            (ty, 0.0 - tx),
            root((bx - ax) * (bx - ax) + (by - ay) * (by - ay)),
        )

    def _parts(self, active, corners):
        """Return the eight forces of each point, x and y at A, B, 1 and 2."""
        gap, xi, normal, length = self._kernel(corners)
        c = np.tile(GAUSS, len(active) // 2)
        size = gap * length * (self.penalty * np.where(active, 0.5, 0.0))
        pulls = [size * each for each in normal]
        return [pull * share for share in ((1 - c) / 2, (1 + c) / 2, xi - 1.0, 0.0 - xi) for pull in pulls]

    def residual(self, interface, pairing, z):
        parts = self._parts(pairing["active"], self._corners(interface, pairing["master"], z.reshape(-1, 2)))
        forces = np.zeros_like(z).reshape(-1, 2)
        nodes = self._nodes(interface, pairing["master"])
        for number in range(4):
            np.add.at(forces, nodes[:, number], np.column_stack(parts[2 * number : 2 * number + 2]))
        return forces.reshape(-1)

    def tangent(self, interface, pairing, z):
        corners = self._corners(interface, pairing["master"], z.reshape(-1, 2))
        unit = np.eye(8)
        duals = [Dual(value, np.broadcast_to(unit[number], (len(value), 8))) for number, value in enumerate(corners)]
        slopes = np.stack([part.slope for part in self._parts(pairing["active"], duals)], axis=1)
        nodes = self._nodes(interface, pairing["master"])
        unknowns = (2 * nodes[..., None] + np.arange(2)).reshape(-1, 8)
        rows, columns = (np.broadcast_to(each, slopes.shape) for each in (unknowns[:, :, None], unknowns[:, None, :]))
        return sparse.csc_array((slopes.ravel(), (rows.ravel(), columns.ravel())), shape=(z.size, z.size))

    def contact_points(self, interface, pairing, z):
        x, master, active = z.reshape(-1, 2), pairing["master"], pairing["active"]
        gap, xi, normal, length = self._kernel(self._corners(interface, master, x))
        carrier, c = np.repeat(np.arange(len(interface.slave)), 2), np.tile(GAUSS, len(interface.slave))
        a, b = (x[interface.slave.segments[carrier, end]] for end in (0, 1))
        position = ((1 - c) / 2)[:, None] * a + ((1 + c) / 2)[:, None] * b
        low = np.where(c < 0, -1.0, 0.0)
        places = (carrier, c, master, xi, position, np.column_stack(normal), gap, length / 2, active)
        return report(self.penalty, *places, (low, low + 1))


class SmoothedNormals(Springs):
    """Springs at four Gauss points of each pair of segments that overlap in the field; a residual and nothing else.

    After Yang, Laursen and Meng, "Two dimensional mortar contact methods for large deformation frictional sliding"
    (2005): normals are averaged at the slave's nodes and interpolated between them. Master nodes are projected on the
    slave along that field, which is the root of a quadratic equation. A slave node at a corner of more than 90° has no
    mean normal: each of its segments keeps its own there. Where the field folds, both roots fall together and lose
    digits, so none are promised.
    """

    traits = ON_STRIPS.revise(kinked=None, translation_stable=None, batched=False, takes_complex=False)

    def residual(self, interface, pairing, z):
        x = z.reshape(-1, 2)
        slave, master = interface.slave.segments, interface.master.segments
        a, along = x[slave[:, 0]], x[slave[:, 1]] - x[slave[:, 0]]
        normals = self._normals(interface.slave, along)  # (n_slave, 2, 2), out of the slave
        places = self._project(a, along, normals, x[master])  # (n_slave, n_master, 2)
        low, high = np.maximum(places[..., 1], 0), np.minimum(places[..., 0], 1)
        number, other = np.nonzero(low < high)  # False where a node has no projection
        size = np.sqrt(dot(along, along))[number]
        forces = np.zeros_like(x)
        for place, weight in zip((FOUR[0] + 1) / 2, FOUR[1] / 2, strict=True):
            s = low[number, other] + place * (high - low)[number, other]
            n = (1 - s)[:, None] * normals[number, 0] + s[:, None] * normals[number, 1]
            n = n / np.sqrt(dot(n, n))[:, None]
            t, gap = self._shoot(a[number], along[number], s, n, x[master])
            visible = (places[number, :, 1] <= s[:, None]) & (s[:, None] <= places[number, :, 0])
            visible |= (t >= 0) & (t <= 1)  # Where the field folds, a line hits what the field does not point at.
            depth = np.where(visible, np.abs(gap), np.inf)
            points = np.arange(len(number))
            counts = (gap[points, other] < 0) & (depth[points, other] <= depth.min(axis=1, initial=np.inf))
            load = np.where(counts, -self.penalty * gap[points, other] * weight, 0.0)
            load = load * (high - low)[number, other] * size
            t = np.where(counts, t[points, other], 0.0)
            shares = ((slave[number], 1 - s, s), (master[other], t - 1, -t))
            for ends, first, second in shares:
                np.add.at(forces, ends[:, 0], (first * load)[:, None] * n)
                np.add.at(forces, ends[:, 1], (second * load)[:, None] * n)
        return forces.reshape(-1)

    @staticmethod
    def _normals(slave, along):
        """Return the normals (n_slave, 2, 2) at both ends of each segment, of length 1."""
        flat = np.column_stack([along[:, 1], -along[:, 0]]) / np.sqrt(dot(along, along))[:, None]
        ends = np.stack([flat, flat], axis=1)
        for end in (0, 1):
            beside = flat[slave.neighbours[:, end]]
            blunt = (slave.neighbours[:, end] >= 0) & (dot(beside, flat) > 0)
            mean = flat + beside
            length = np.sqrt(np.where(blunt, dot(mean, mean), 1.0))
            ends[blunt, end] = mean[blunt] / length[blunt, None]
        return ends

    @staticmethod
    def _project(a, along, normals, nodes):
        """Return where on the slave (n_slave, n_master, 2) the field points at the nodes of master segments.

        Of two such places that counts which is nearer to the middle of the segment, so that neither end is preferred.
        """
        offset = nodes[None] - (a + along / 2)[:, None, None]
        middle, change = ((normals[:, 1] + sign * normals[:, 0])[:, None, None] / 2 for sign in (1, -1))
        d = along[:, None, None] / 2
        c0, c1, c2 = cross(offset, middle), cross(offset, change) - cross(d, middle), -cross(d, change)
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(c1 * c1 - 4 * c2 * c0)
            return (1 - 2 * c0 / (c1 + np.copysign(root, c1))) / 2

    @staticmethod
    def _shoot(a, along, s, n, ends):
        """Return where lines from points at s along n meet all master segments (n, n_master), and the gaps there."""
        run = (ends[:, 1] - ends[:, 0])[None]
        offset = (ends[None, :, 0] - a[:, None]) - (s[:, None] * along)[:, None]
        line = n[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            t = -cross(offset, line) / cross(run, line)
            return t, dot(offset + t[..., None] * run, line)


class LogBarrier(Springs):
    """Potential κ Σ w b(d) over all nodes nearer than d̂ to the other surface, with its exact gradient and Hessian.

    After Li et al., "Incremental Potential Contact" (2020), Eq. 6: b(d) = −(d − d̂)² ln(d/d̂), here of the distance and
    with the reference length of a node as its weight, so that the sum does not depend on how many nodes there are. The
    nearest point lies inside a segment or at a vertex; which of both is a decision of the pairing.
    """

    traits = Traits(
        promises=Promises(
            tangent="exact",
            symmetric=True,
            conserves_force=True,
            conserves_moment=True,
            unbiased=True,
            never_intersects=True,
        ),
        rules=Rules(enforcement="barrier", activation=SHARE, penalty_power=0.0),
    )

    def pair(self, interface, z):
        x, rows = z.reshape(-1, 2), []
        for points, side in ((interface.slave, interface.master), (interface.master, interface.slave)):
            first, run = x[side.segments[:, 0]], np.diff(x[side.segments], axis=1)[:, 0]
            way = x[points.nodes][:, None] - first
            share = (way * run).sum(axis=2) / (run**2).sum(axis=1)
            distance = np.linalg.norm(way - np.clip(share, 0, 1)[..., None] * run, axis=2)
            number, near = np.arange(len(points.nodes)), distance.argmin(axis=1)
            share, ends = share[number, near], side.segments[near]
            vertex = (share <= 0) | (share >= 1)
            ends = np.where(vertex[:, None], np.where(share <= 0, *ends.T)[:, None], ends)
            pairs = np.column_stack([vertex, points.nodes, ends])
            rows.append(pairs[distance[number, near] < self._range(interface)])
        return {"pairs": np.vstack(rows).astype(np.int64)}

    def residual(self, interface, pairing, z):
        total = np.zeros_like(z)
        weight, unknowns, distance, gradient, _ = self._terms(interface, pairing, z)
        slope, _ = self._derivatives(distance, interface)
        np.add.at(total, unknowns, self.penalty * (weight * slope)[:, None] * gradient)
        return total

    def tangent(self, interface, pairing, z):
        total = np.zeros((z.size, z.size))
        weight, unknowns, distance, gradient, hessian = self._terms(interface, pairing, z)
        slope, curvature = self._derivatives(distance, interface)
        blocks = curvature[:, None, None] * _outer(gradient, gradient) + slope[:, None, None] * hessian
        np.add.at(total, (unknowns[:, :, None], unknowns[:, None, :]), self.penalty * weight[:, None, None] * blocks)
        return total

    def _terms(self, interface, pairing, z):
        """Return weights (n,), unknowns (n, 6), distances (n,), their gradients (n, 6) and Hessians (n, 6, 6)."""
        x, (vertex, *nodes) = z.reshape(-1, 2), pairing["pairs"].T
        node, start, end = (x[each] for each in nodes)
        way, ones = node - start, np.ones(len(node))
        run = np.where(vertex[:, None] == 1, np.column_stack([way[:, 1], -way[:, 0]]), end - start)
        length = np.linalg.norm(run, axis=1)
        tangent = run / length[:, None]
        normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
        height = (way * normal).sum(axis=1)
        normal, distance = np.sign(height)[:, None] * normal, np.abs(height)
        xi = np.where(vertex == 1, 0.0, (way * tangent).sum(axis=1) / length)
        shares = np.column_stack([ones, xi - 1, -xi])
        gradient, along = (_outer(shares, each).reshape(-1, 6) for each in (normal, tangent))
        turned = _outer(np.column_stack([0 * ones, -ones, ones]), normal).reshape(-1, 6)
        mixed = _outer(along, turned)
        across = -(mixed + mixed.transpose(0, 2, 1)) / length[:, None, None]
        across = across - (distance / length**2)[:, None, None] * _outer(turned, turned)
        around = _outer(along, along) / distance[:, None, None]
        hessian = np.where(vertex[:, None, None] == 1, around, across)
        unknowns = (2 * np.column_stack(nodes)[..., None] + [0, 1]).reshape(-1, 6)
        return self._weights(interface)[nodes[0]], unknowns, distance, gradient, hessian

    def _range(self, interface):
        """Return the activation distance."""
        sides = (interface.slave, interface.master)
        return SHARE * min(float(side.lengths(interface.nodes).min()) for side in sides)

    def _weights(self, interface):
        """Return half of the reference length of each node's segments."""
        weights = np.zeros(interface.n_nodes)
        for side in (interface.slave, interface.master):
            for end in (0, 1):
                np.add.at(weights, side.segments[:, end], side.lengths(interface.nodes) / 2)
        return weights

    def _derivatives(self, distance, interface):
        """Return b'(d) and b''(d) over d̂, so that κ is a pressure."""
        range_ = self._range(interface)
        past, logarithm = np.minimum(distance - range_, 0.0), np.log(distance / range_)
        ratio = past / distance
        curvature = np.where(past < 0, -2 * logarithm - 4 * ratio + ratio**2, 0.0)
        return (-2 * past * logarithm - past * ratio) / range_, curvature / range_


def _outer(first, second):
    return first[:, :, None] * second[:, None, :]
