"""A right formulation as a user writes it with NumPy, and the mistakes that are put into it one at a time.

Two Gauss points lie on each part of a slave segment that faces a master segment. Forces are computed of all such pairs
of segments at once. The tangent of a pair is the derivative of its forces by complex steps in its eight unknowns.
"""

import numpy as np

from contactverif import PatchPromises, Promises, Rules, Traits

PLACES = np.array([0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)])


class Springs:
    """A bed of springs along the slave, right in forces and tangent."""

    traits = Traits(
        promises=Promises(patch=PatchPromises(flat=True), conserves_force=True, conserves_moment=True, tangent="exact"),
        rules=Rules(area="current", penalty="distributed"),
    )

    def __init__(self, *, penalty):
        self.penalty, self.memory = penalty, {}

    # Where mistakes are put. Points are those of all pairs, (n_points, n_pairs).

    def facing(self, share):
        return np.nonzero(share > 0)

    def unit(self, vector, length):
        return vector / length[:, None]

    def normals(self, normal):
        return normal

    def master_direction(self, normal, c, d):
        return -normal

    def part(self, s_c, s_d):
        return np.where(s_d.real > 0, s_d, 0), np.where(s_c.real < 1, s_c, 1)

    def points(self, start, end):
        """Return the places of the points on the slave segment, and the share of it that each stands for twice."""
        return [(start + place * (end - start), end - start) for place in PLACES]

    def on_master(self, t, on_slave, c, d):
        return t

    def gaps(self, gap, s):
        return gap

    def pressure(self, gap):
        return np.where(gap.real < 0, -self.penalty * gap, 0)

    def weights(self, length, slave_segment, n_segments):
        return length / 2

    def slave_shapes(self, s):
        return 1 - s, s

    def master_shapes(self, t):
        return 1 - t, t

    # The formulation.

    def pairs(self, interface, x):
        """Return the slave segments that face master segments, and their four nodes (n_pairs, 4)."""
        slave, master = interface.slave.segments, interface.master.segments
        along = x[slave[:, 1]] - x[slave[:, 0]]
        places = (x[None] - x[slave[:, 0], None]) @ along[:, :, None] / (along**2).sum(1)[:, None, None]
        first, second = (np.clip(places[:, master[:, end], 0], 0, 1) for end in (0, 1))
        i, j = self.facing(first - second)  # The master runs the other way.
        lengths = [np.linalg.norm(x[ends[:, 1]] - x[ends[:, 0]], axis=1).max() for ends in (slave, master)]
        apart = x[slave[i]].mean(axis=1) - x[master[j]].mean(axis=1)
        near = np.linalg.norm(apart, axis=1) < 2 * sum(lengths)  # What is further away belongs to another body.
        return i[near], np.hstack([slave[i], master[j]])[near]

    def forces(self, x, slave_segment, n_segments):
        """Return the forces (n_pairs, 4, 2) on the nodes of pairs at positions of that shape."""
        a, b, c, d = np.moveaxis(x, 1, 0)
        along = b - a
        square = (along * along).sum(1)
        length = np.sqrt(square)
        normal = self.normals(self.unit(np.stack([along[:, 1], -along[:, 0]], 1), length))
        direction = self.master_direction(normal, c, d)
        s_c, s_d = ((c - a) * along).sum(1) / square, ((d - a) * along).sum(1) / square
        s, share = map(np.array, zip(*self.points(*self.part(s_c, s_d)), strict=True))
        on_slave = (1 - s)[..., None] * a + s[..., None] * b
        t = self.on_master((s - s_c) / (s_d - s_c), on_slave, c, d)
        on_master = (1 - t)[..., None] * c + t[..., None] * d
        gap = self.gaps(((on_master - on_slave) * normal).sum(-1), s)
        size = (self.pressure(gap) * share * self.weights(length, slave_segment, n_segments))[..., None]
        sides = ((self.slave_shapes(s), size * normal), (self.master_shapes(t), size * direction))
        return np.stack([(shape[..., None] * force).sum(0) for shapes, force in sides for shape in shapes], 1)

    def residual(self, interface, pairing, z):
        x = z.reshape(-1, 2)
        i, nodes = self.pairs(interface, x)
        residual = np.zeros_like(x)
        np.add.at(residual, nodes, self.forces(x[nodes], i, len(interface.slave.segments)))
        return residual.reshape(-1)

    def tangent(self, interface, pairing, z):
        x, h = z.reshape(-1, 2), 2.0**-100 * np.ptp(z)
        i, nodes = self.pairs(interface, x)
        unknowns = (2 * nodes[:, :, None] + [0, 1]).reshape(-1, 8)
        tangent = np.zeros((z.size, z.size))
        for column, step in enumerate(1j * h * np.eye(8).reshape(8, 4, 2)):
            change = self.forces(x[nodes] + step, i, len(interface.slave.segments)).imag / h
            np.add.at(tangent, (unknowns, unknowns[:, [column]]), change.reshape(-1, 8))
        return tangent


NOT_NAMED = r"(?!)"  # No rule knows the mistake.


def mistake(summary, words, **methods):
    """Return a class of springs with other methods, and the words of its diagnosis that say place and kind."""
    return type("Mistake", (Springs,), {"__doc__": summary, **methods}), words


def in_tangent(change):
    """Return the method of a tangent that is `change(right tangent, interface)`."""
    return lambda self, interface, pairing, z: change(Springs.tangent(self, interface, pairing, z), interface)


def once(method, key):
    """Return a method whose first answer for each key is kept; `key` is a function of its arguments."""

    def keep(self, *arguments):
        name = key(*arguments)
        if name not in self.memory:
            self.memory[name] = getattr(Springs, method)(self, *arguments)
        return self.memory[name]

    return keep


def _half_at_free_ends(self, length, slave_segment, n_segments):
    return length / 2 * np.where((slave_segment == 0) | (slave_segment == n_segments - 1), 0.5, 1)


def _previous_normal(self, normal):
    before, self.memory["normal"] = self.memory.get("normal"), normal.real
    return normal if before is None or before.shape != normal.shape else before


def _without_column(column):
    def drop(matrix, interface):
        matrix[:, column] = 0
        return matrix

    return in_tangent(drop)


KNOWN = {  # {name on the command line: (factory, words)}. The authors of the rules of the diagnosis knew these.
    "half-ends": mistake("Half the length counts for the first and the last slave segment.",
        r"slave segment 0 0\.5 times, slave segment \d 0\.5 times", weights=_half_at_free_ends),
    "sign-of-xi": mistake("The derivative of the place on the master segment has the opposite sign in the tangent.",
        r"the part of δξ, .* on the master's rows", on_master=lambda self, t, *_: np.conj(t)),
    "shapes": mistake("The two shape functions of the slave segment are exchanged.",
        r"two shape functions of each slave segment are exchanged", slave_shapes=lambda self, s: (s, 1 - s)),
    "old-normal": mistake("The normals are those of the call before.", r"kept between calls", normals=_previous_normal),
    "sign-of-gap": mistake("The gap has the opposite sign: springs pull where surfaces are apart.",
        r"no force at all|opposite sign", pressure=lambda self, gap: Springs.pressure(self, -gap)),
    "factor-2": mistake("Each point has the weight of two.", r"every node has 2 times",
        pressure=lambda self, gap: 2 * Springs.pressure(self, gap)),
    "last-master": mistake("The loop over master segments ends one too early.", r"master segment( \d)? is left out",
        facing=lambda self, share: np.nonzero(share[:, :-1] > 0)),
    "absolute": mistake("A gap counts as closed from 1e-8 on, whatever the unit of length.",
        r"look for an absolute length|do not scale",
        pressure=lambda self, gap: np.where(gap.real < -1e-8, Springs.pressure(self, gap), 0)),
    "column": mistake("The tangent's last column is missing.", r"column \d+ \(.*\) is missing",
        tangent=_without_column(-1)),
    "length-part": mistake("The tangent lacks the change of the slave segment's length.",
        r"the part of the length of the slave's segments", weights=lambda self, length, *_: length.real / 2),
    "master-half": mistake("Each node of a master segment takes half of the force, wherever it acts.", r"master",
        master_shapes=lambda self, t: (np.full(t.shape, 0.5), np.full(t.shape, 0.5))),
    "no-length": mistake("The springs are not multiplied by the length of the segment.", r"length",
        weights=lambda *_: 0.5),
}  # fmt: skip


def _along_own_normal(self, normal, c, d):
    along = d - c
    return np.stack([along[:, 1], -along[:, 0]], 1) / np.sqrt((along * along).sum(1))[:, None]


def _last_pair_only(self, interface, pairing, z):
    x = z.reshape(-1, 2)
    i, nodes = self.pairs(interface, x)
    residual = np.zeros_like(x)
    residual[nodes] += self.forces(x[nodes], i, len(interface.slave.segments))
    return residual.reshape(-1)


def _pairs_with_a_node_on_the_slave(self, interface, x):
    i, nodes = Springs.pairs(self, interface, x)
    a, b, c, d = np.moveaxis(x[nodes], 1, 0)
    along = b - a
    s_c, s_d = (((node - a) * along).sum(1) / (along * along).sum(1) for node in (c, d))
    is_near = ((s_c >= 0) & (s_c < 1)) | ((s_d >= 0) & (s_d < 1))
    return i[is_near], nodes[is_near]


def _pairs_of_the_first_call(self, interface, x):
    mesh = interface.slave.segments.tolist(), interface.master.segments.tolist()
    if self.memory.get("mesh") != mesh:
        self.memory |= {"mesh": mesh, "pairs": Springs.pairs(self, interface, x)}
    return self.memory["pairs"]


def _mirrored_upper_triangle(matrix, interface):
    upper = np.triu(matrix)
    return upper + np.triu(upper, 1).T


def _one_master_each(self, share):
    i = np.flatnonzero(share.max(1) > 0)
    return i, share.argmax(1)[i]


def _master_lengths(self, normal, c, d):
    self.memory["length"] = np.sqrt(((d - c) ** 2).sum(1))  # Of this call: nothing is kept.
    return -normal


def _open_points_too(self, gap):
    linear = -self.penalty * gap
    return np.where(gap.real < 0, linear, linear - linear.real)


def _added_to_all_before(self, interface, pairing, z):
    force, total = Springs.residual(self, interface, pairing, z), self.memory.get("total")
    self.memory["total"] = force if total is None or total.shape != force.shape else total + force
    return self.memory["total"].copy()


# Eight mistakes each, written without knowledge of the rules. The words were added when rules for them were.
UNSEEN = {
    "own-normal": mistake(
        "The force on a master segment acts along the master's own normal, so it is not opposite to that on the slave.",
        r"along the master's normal on the master", master_direction=_along_own_normal),
    "whole-segment": mistake(
        "The Gauss points are those of the whole slave segment, which is not cut at the nodes of the master.",
        r"whole slave segments, not cut",
        points=lambda self, start, end: [(np.full_like(start, p), (start.real <= p) & (p < end.real)) for p in PLACES]),
    "last-pair": mistake(
        "The residual is assembled with `+=`, so a node that several pairs share gets the force of the last one only.",
        r"`np\.add\.at`", residual=_last_pair_only),
    "fixed-points": mistake(
        "The tangent lacks the change of the places of the Gauss points on the slave: only the lengths of parts vary.",
        r"the part of the places of points",
        points=lambda self, start, end: [(s.real, share) for s, share in Springs.points(self, start, end)]),
    "transposed": mistake("The tangent is transposed: rows are unknowns, and columns are forces.",
        r"the transposed derivative", tangent=in_tangent(lambda matrix, _: matrix.T)),
    "node-on-slave": mistake(
        "A master segment is found by its nodes: one that has none on the slave segment, but covers it, is missed.",
        r"finer than its master: slave segments .* left out", pairs=_pairs_with_a_node_on_the_slave),
    "pairs-kept": mistake(
        "The search runs at the first call for a mesh, and later calls take its pairs wherever the nodes have gone.",
        r"kept between calls: .* face other segments", pairs=_pairs_of_the_first_call),
    "never-zero": mistake(
        "The normal is divided by the length plus 1e-8, against division by zero, whatever the unit of length.",
        r"look for an absolute length", unit=lambda self, vector, length: vector / (length[:, None] + 1e-8)),
}  # fmt: skip
LATER = {
    "wrong-interval": mistake(
        "The Gauss points ±1/√3 of the interval [-1, 1] are taken as they are for places in [0, 1].",
        r"the points of integration",
        points=lambda self, start, end: [
            (start + place * (end - start), end - start) for place in (-np.sqrt(1 / 3), np.sqrt(1 / 3))]),
    "master-jacobian": mistake(
        "The share of the slave segment is multiplied by the length of the master segment, not by that of the slave's.",
        r"the length of the master segment stands where", master_direction=_master_lengths,
        weights=lambda self, *_: self.memory["length"] / 2),
    "normal-fixed": mistake("The tangent lacks the change of the slave's normals: they do not turn with the segment.",
        r"the part of δn, .* of the slave, is missing", normals=lambda self, normal: normal.real),
    "open-stiff": mistake(
        "The tangent does not ask whether a point is closed: open points have stiffness, though they have no force.",
        r"only where a part of the slave is apart", pressure=_open_points_too),
    "upper-only": mistake(
        "The upper triangle of the tangent is computed and mirrored, but the tangent is not symmetric.",
        r"the upper triangle of the derivative, mirrored", tangent=in_tangent(_mirrored_upper_triangle)),
    "one-master": mistake(
        "A slave segment is paired with one master segment only, that with the largest share; others are left out.",
        r"parts are left out: slave segment 0 on master segment 2", facing=_one_master_each),
    "not-cut": mistake(
        "A part is not cut at the slave segment's first node: it reaches beyond it, as far as the master segment does.",
        r"the points of integration, their weights and their range",
        part=lambda self, s_c, s_d: (s_d, np.where(s_c.real < 1, s_c, 1))),
    "not-zeroed": mistake(
        "The array of forces is allocated once and never set to zero, "
        "so a call adds its forces to those of all before.",
        r"`residual` answers otherwise when it is asked the same again", residual=_added_to_all_before),
}  # fmt: skip


def _single_precision(self, interface, pairing, z):
    return Springs.residual(self, interface, pairing, z.astype(np.float32).astype(float))


def _coarse_differences(self, interface, pairing, z):
    h = 1e-3 * np.ptp(z)
    still = self.residual(interface, pairing, z)
    return np.stack([(self.residual(interface, pairing, z + step) - still) / h for step in h * np.eye(z.size)], 1)


def _break_at_first_open(self, x, slave_segment, n_segments):
    forces = Springs.forces(self, x, slave_segment, n_segments)
    for pair, force in enumerate(forces):
        if not force.real.any():
            forces[pair:] = 0
            break
    return forces


def _arctan_of_slope(self, normal):
    angle = np.arctan(normal[:, 0] / (-normal[:, 1] + 1e-15))
    return np.stack([np.sin(angle), -np.cos(angle)], 1)


def _foot_on_master(self, t, on_slave, c, d):
    return ((on_slave - c) * (d - c)).sum(-1) / ((d - c) * (d - c)).sum(1)


def _mean_length(self, length, slave_segment, n_segments):
    _, first = np.unique(slave_segment, return_index=True)
    return length[first].mean() / 2 if len(first) else length / 2


def _tangent_of_all_unknowns(self, interface, pairing, z):
    """Return the derivative in all unknowns, as each force depends on the lengths of all segments."""
    x, h = z.reshape(-1, 2), 2.0**-100 * np.ptp(z)
    i, nodes = self.pairs(interface, x)
    tangent = np.zeros((z.size, z.size))
    for column, unit in enumerate(np.eye(z.size)):
        change = self.forces((z + 1j * h * unit).reshape(-1, 2)[nodes], i, len(interface.slave.segments)).imag / h
        np.add.at(tangent[:, column].reshape(-1, 2), nodes, change)
    return tangent


def _part_or_nothing(self, s_c, s_d):
    start, end = Springs.part(self, s_c, s_d)
    return start, np.where(end.real > start.real, end, start)


def _master_rigid(matrix, interface):
    matrix[:, (2 * np.unique(interface.master.segments)[:, None] + [0, 1]).ravel()] = 0
    return matrix


FURTHER = {
    "single-precision": mistake("Positions are rounded to single precision before the forces are computed of them.",
        r"numbers have single precision",
        residual=_single_precision),
    "quadrature-at-starts": mistake(
        "Each part is cut into four cells, and each cell's point lies at the cell's start instead of its middle.",
        r"0.125 of its length nearer to the part's start",
        points=lambda self, start, end: [(start + cell / 4 * (end - start), (end - start) / 2) for cell in range(4)]),
    "coarse-differences": mistake(
        "The tangent is of forward differences with a step far too large, a thousandth of the model's size.",
        r"one-sided differences with a step of about 0.00", tangent=_coarse_differences),
    "break-at-first-open": mistake(
        "The loop over the pairs breaks at the first open pair instead of going on to the next.",
        r"where slave segment 0 is open, nothing pushes slave nodes 2, 3", forces=_break_at_first_open),
    "arctan-of-slope": mistake(
        "The normal comes of the arctan of the slope instead of arctan2, so it flips where the slave runs leftwards.",
        r"turned by 180°", normals=_arctan_of_slope),
    "tangent-symmetrised": mistake("The tangent is symmetrised, half the sum of itself and its transpose.",
        r"the symmetric part of the derivative", tangent=in_tangent(lambda matrix, _: (matrix + matrix.T) / 2)),
    "mixed-projections": mistake(
        "Points are projected at right angles to the master, but the gap and the force are along the slave's normal.",
        r"their moments do not: look at the projection", on_master=_foot_on_master),
    "master-own-normal": mistake(
        "The master is pushed along its own normal, the slave along the slave's, so the two forces are not opposite.",
        r"the slave's normal on the slave, along the master's normal on the master",
        master_direction=_along_own_normal),
    "tangent-limits-fixed": mistake(
        "The tangent does not vary the limits of the parts, though they move with the nodes of the master.",
        r"the derivative of the limits",
        part=lambda self, s_c, s_d: tuple(end.real for end in Springs.part(self, s_c, s_d))),
    "tangent-normal-sign": mistake("The normal's variation enters the tangent with the wrong sign.",
        r"part of δn, .* has the opposite sign", normals=lambda self, normal: normal.conj()),
    "mean-length": mistake("Every slave segment counts with the mean length, as if the slave's mesh were uniform.",
        r"counts with the mean length", weights=_mean_length, tangent=_tangent_of_all_unknowns),
    "tangent-of-first-state": mistake(
        "The tangent is computed in the first state only and returned again in all later ones.",
        r"`tangent` answers otherwise after `tangent`", tangent=once("tangent", lambda interface, pairing, z: z.size)),
    "search-done-once": mistake(
        "The search runs in the first call only, and its pairs are kept however far the bodies slide later.",
        r"at which nodes face other segments",
        pairs=once("pairs", lambda interface, x: (len(x), len(interface.slave), len(interface.master))),
        part=_part_or_nothing),
    "tangent-master-rigid": mistake(
        "The tangent takes the master for rigid: no derivatives in the master's nodes, though these move as well.",
        r"takes the master for rigid", tangent=in_tangent(_master_rigid)),
}  # fmt: skip


def _nearer_node(self, t):
    first = np.where(t.real < 0.5, 1.0, 0.0)
    return first, 1 - first


def _averages_as_nodal_gaps(self, gap, s):
    first, second = ((shape * gap).sum(0) / shape.sum(0) for shape in (1 - s, s))
    return (1 - s) * first + s * second


def _without_deep_pairs(self, interface, x):
    i, nodes = Springs.pairs(self, interface, x)
    a, b, c, d = np.moveaxis(x[nodes], 1, 0)
    along, apart = b - a, a + b - c - d
    depth = (along[:, 1] * apart[:, 0] - along[:, 0] * apart[:, 1]) / 2
    keep = depth < 0.001 * (along**2).sum(1)  # Both sides times the length.
    return i[keep], nodes[keep]


def _without_end_segments(self, interface, x):
    i, nodes = Springs.pairs(self, interface, x)
    neighbours = np.bincount(interface.slave.segments.ravel(), minlength=len(x))
    inner = (neighbours[nodes[:, :2]] == 2).all(axis=1)
    return i[inner], nodes[inner]


def _by_components(matrix, interface):
    order = np.arange(len(matrix)).reshape(-1, 2).T.ravel()
    return matrix[np.ix_(order, order)]


def _steps_that_pile_up(self, interface, pairing, z):
    x, h = z.reshape(-1, 2), 2.0**-100 * np.ptp(z)
    i, nodes = self.pairs(interface, x)
    unknowns = (2 * nodes[:, :, None] + [0, 1]).reshape(-1, 8)
    tangent, moved = np.zeros((z.size, z.size)), x[nodes].astype(complex)
    for column in range(8):
        moved[:, column // 2, column % 2] += 1j * h
        change = self.forces(moved, i, len(interface.slave.segments)).imag / h
        np.add.at(tangent, (unknowns, unknowns[:, [column]]), change.reshape(-1, 8))
    return tangent


def _lump(matrix, interface):
    blocks = matrix.reshape(len(matrix) // 2, 2, len(matrix) // 2, 2)
    for side in (interface.slave, interface.master):
        nodes = np.unique(side.segments)
        sums = blocks[nodes][:, :, nodes].sum(axis=2)
        blocks[np.ix_(nodes, [0, 1], nodes, [0, 1])] = 0
        blocks[nodes, :, nodes] = sums
    return matrix


FRESH = {
    "force-to-nearest-master-node": mistake(
        "The whole force of a Gauss point goes to the nearer node of the master segment.",
        r"goes to the nearer node of the master", master_shapes=_nearer_node),
    "averaged-gaps-as-nodal": mistake(
        "Averages of the gap weighted by shape functions are interpolated as if they were the gap at the slave nodes.",
        NOT_NAMED, gaps=_averages_as_nodal_gaps),
    "deep-overlap-dropped": mistake(
        "Pairs that overlap by more than a thousandth of the slave segment are taken for hits from behind and dropped.",
        r"look for a limit of depths", pairs=_without_deep_pairs),
    "end-slave-segments-skipped": mistake(
        "Slave segments with a node at a free end are skipped, as they lack a neighbour.",
        r"slave segments 0, 2 are left out", pairs=_without_end_segments),
    "quadratic-pressure": mistake("The pressure is the penalty times the square of the penetration.", r"to the power 2",
        pressure=lambda self, gap: np.where(gap.real < 0, self.penalty * gap**2, 0)),
    "tangent-by-components": mistake(
        "The tangent numbers all x before all y, but the residual has x and y of each node side by side.",
        r"all x before all y", tangent=in_tangent(_by_components)),
    "steps-pile-up": mistake(
        "The step in one unknown is not taken back before the step in the next unknown of the pair.", NOT_NAMED,
        tangent=_steps_that_pile_up),
    "lumped-tangent": mistake(
        "The tangent's blocks of slave with slave and of master with master are lumped to each node by sums of rows.",
        r"as if it were lumped", tangent=in_tangent(_lump)),
}  # fmt: skip
EVERY = KNOWN | UNSEEN | LATER | FURTHER | FRESH


def _half_at_end_nodes(self, interface, pairing, z):
    forces = Springs.residual(self, interface, pairing, z).reshape(-1, 2)
    forces[interface.slave.segments[interface.slave.neighbours < 0]] *= 0.5
    return forces.reshape(-1)


def _whole_springs_at_nodes(self, interface, pairing, z):
    forces = Springs.residual(self, interface, pairing, z).reshape(-1, 2)
    n = interface.n_slave_nodes
    forces[:n] = 0
    forces[:n, 1] = np.minimum(0, z.reshape(-1, 2)[:n, 1]) * self.penalty
    return forces.reshape(-1)


def _deep_tangent_wrong(self, interface, pairing, z):
    """Double the material part in deep penetration alone, so that the error grows by no power of it."""
    matrix = Springs.tangent(self, interface, pairing, z)
    if z[1] < -(2.0**-6):
        matrix[1::2, 1::2] *= 2
    return matrix


def _with(words, name="", **methods):
    return (EVERY[name][0], words) if name else mistake("", words, **methods)


# What the diagnosis of one property says in full.
FORCES = {
    "opposite sign": _with("every node has -1 times the exact force: the sign",
        forces=lambda self, *pairs: -Springs.forces(self, *pairs)),
    "twice": _with("every node has 2 times the exact force: two passes", "factor-2"),
    "half at end segments": _with("slave segment 0 0.5 times, slave segment 2 0.5 times the exact one", "half-ends"),
    "half at end nodes": _with("only free ends are wrong: 0.5 times the exact force on the slave",
        residual=_half_at_end_nodes),
    "slave shapes exchanged": _with("the two shape functions of each slave segment are exchanged", "shapes"),
    "master shapes exchanged": _with("the two shape functions of each master segment are exchanged",
        master_shapes=lambda self, t: (t, 1 - t)),
    "no force": _with("there is no force at all", forces=lambda self, *pairs: 0 * Springs.forces(self, *pairs)),
    "last master missed": _with("the last master segment is left out", "last-master"),
    "absolute gap": _with("forces do not scale with a mesh 2^20 times smaller", "absolute"),
    "whole springs": _with("each slave node has a whole spring", residual=_whole_springs_at_nodes),
}  # fmt: skip
TANGENTS = {
    "turned": _with("the tangent has the opposite sign", tangent=in_tangent(lambda matrix, _: -matrix)),
    "twice": _with("the tangent has a factor 2", tangent=in_tangent(lambda matrix, _: 2 * matrix)),
    "deep": _with("entries in n–n are wrong", tangent=_deep_tangent_wrong),
    "column": _with("column 1 (y of slave node 0) is missing, all others are right", tangent=_without_column(1)),
}  # fmt: skip
