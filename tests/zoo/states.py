"""Mutants that are wrong in some states, or with multipliers, and right everywhere else.

Defects that show in some states only, with forces and tangent that agree; contact points that ordinary meshes do not
punish; signs and shares; rows of multipliers; springs that lock.
"""

import time
from functools import partial

import numpy as np
from subjects import ResidualAlone

import contactverif_mortar
import contactverif_nts
from contactverif import Interface, Pairing, Surface
from contactverif.contract.arrays import dense
from contactverif.contract.traits import Traits
from contactverif_nts import nts_ar, nts_lm, vts_me
from zoo.making import BALANCED, add, answers, mutant, says, wrap

TRANSMISSION, RESULTANT = "patch.flat.transmission", "patch.flat.resultant"
FORCES, UNITS, UNILATERAL, RANK = "projection.forces", "units", "unilateral", "multipliers.rank"
EXCESS = 1.01
SMALL_TENSION = 1e-3  # The share of the largest multiplier that a tension must reach before it is released.

# Forces and tangent that are 1 % too large where a condition of (interface, x) holds. Reported pressures stay right.


def _wrong_in(condition):
    def factor(interface, z):
        return EXCESS if condition(interface, np.real(z[..., : interface.n_unknowns]).reshape(-1, 2)) else 1.0

    def residual(right, interface, pairing, z):
        factors = np.array([factor(interface, state) for state in z.reshape(-1, z.shape[-1])])
        return right(interface, pairing, z) * factors.reshape(*z.shape[:-1], 1)

    def tangent(right, interface, pairing, z):
        return right(interface, pairing, z) * factor(interface, z)

    return lambda *, penalty: wrap(penalty, residual=residual, tangent=tangent)


def _directions(surface, x):
    """Return the unit vectors (n_segments, 2) along the segments."""
    along = np.diff(x[surface.segments], axis=1)[:, 0]
    return along / np.linalg.norm(along, axis=1)[:, None]


def _turns(surface, x):
    """Return the sine of the turn at each vertex; negative where the body is concave."""
    t = _directions(surface, x)
    here = np.flatnonzero(surface.neighbours[:, 1] >= 0)
    other = surface.neighbours[here, 1]
    return t[here, 0] * t[other, 1] - t[here, 1] * t[other, 0]


def _along_master(interface, x):
    """Return the coordinates of slave and master nodes along the first master segment."""
    along = (x - x[0]) @ _directions(interface.master, x)[0]
    return along[: interface.n_slave_nodes], along[interface.n_slave_nodes :]


def _sine_of_tilt(interface, x):
    """Return the sine of the angle between the first slave segment and the longest master segment."""
    t = _directions(interface.slave, x)[0]
    m = _directions(interface.master, x)[interface.master.lengths(x).argmax()]
    return t[0] * m[1] - t[1] * m[0]


def _strip(interface, x):
    """Return whether a slave node is over a master node but for a small share of the shortest segment."""
    slave, master = _along_master(interface, x)
    apart = np.abs(slave[:, None] - master)
    shortest = min(side.lengths(x).min() for side in (interface.slave, interface.master))
    return ((apart > 1e-13 * shortest) & (apart < 1e-5 * shortest)).any()


def _large_ratio(interface, x):
    lengths = np.append(interface.slave.lengths(x), interface.master.lengths(x))
    return lengths.max() > 1e5 * lengths.min()


def _four_chains(interface, x):
    return sum(int((surface.neighbours[:, 0] < 0).sum()) for surface in (interface.slave, interface.master)) > 3


def _one_tilt(interface, x):
    t = _directions(interface.slave, x)[0]
    return 0.4 < np.arctan2(t[1], t[0]) % (np.pi / 2) < 0.5


def _steep(interface, x):
    return (_directions(interface.slave, x) @ _directions(interface.master, x).T > -np.sqrt(0.5)).any()


def _deep(interface, x):
    """Return whether some slave node is deeper below the line of the first master segment than half its length."""
    first, second = x[interface.master.segments[0]]
    along, d = second - first, x[: interface.n_slave_nodes] - first
    return (d[:, 0] * along[1] - d[:, 1] * along[0] < -0.5 * (along @ along)).any()


def _overhang(interface, x):
    slave, master = _along_master(interface, x)
    return slave.max() > master.max() or slave.min() < master.min()


for _name, _property, _condition in (
    ("wrong above 100 segments", TRANSMISSION, lambda i, x: len(i.slave) + len(i.master) > 100),
    ("wrong at ratios of lengths above 1e5", RESULTANT, _large_ratio),
    ("wrong with four chains", FORCES, _four_chains),
    ("wrong with 50 master segments under two slave segments", TRANSMISSION,
     lambda i, x: len(i.master) >= 50 and len(i.slave) <= 2),
    ("wrong at tilts of 23° to 29°", FORCES, _one_tilt),
    ("wrong beyond 45°", FORCES, _steep),
    ("wrong at tilts of 1e-12 to 1e-2", "patch.tilted.resultant",
     lambda i, x: 1e-12 < np.abs(_sine_of_tilt(i, x)) < 1e-2),
    ("wrong on strips of overlap of 1e-13 to 1e-5", "hard.node-hit", _strip),
    ("wrong above 1024 segments", "total-stiffness", lambda i, x: len(i.slave) > 1024),
    ("wrong at a re-entrant vertex", FORCES, lambda i, x: (_turns(i.master, x) < -0.1).any()),
    ("wrong on a closed master", FORCES, lambda i, x: (i.master.neighbours >= 0).all()),
    ("wrong with matching nodes", TRANSMISSION, lambda i, x: np.isin(*_along_master(i, x)).any()),
    ("wrong deeper than half a segment", FORCES, _deep),
    ("wrong past the end of the master", FORCES, _overhang),
    ("wrong with seven nodes, or fourteen", TRANSMISSION, lambda i, x: i.n_nodes % 7 == 0),
    ("wrong by the clock", "purity", lambda i, x: time.perf_counter_ns() // 1000 % 2 == 0),
):  # fmt: skip
    add(_name, _property, _wrong_in(_condition))

# Contact points that are left out, or counted twice, where a condition of (interface, x, points) holds. It is computed
# from what the formulation itself reports, so that these mutants do not depend on the source of a kernel.


def _leaves_out(name, caught_by, drop, base=BALANCED):
    @mutant(name, caught_by, "pair", base)
    def _(right, interface, z):
        pairing = Pairing(right(interface, z))
        points = right.__self__.contact_points(interface, pairing, z)
        x = z[: interface.n_unknowns].reshape(-1, 2)
        return Pairing({**pairing, "active": pairing["active"] & ~drop(interface, x, points)})


def _is_off_the_nearest_node(interface, x, points):
    first = interface.n_slave_nodes
    distances = np.linalg.norm(points.position[:, None] - x[None, first:], axis=2)
    nearest = first + np.nanargmin(np.where(np.isnan(distances), 0.0, distances), axis=1)
    return ~(interface.master.segments[points.master_segment] == nearest[:, None]).any(axis=1)


def _is_between_two_segments(interface, x, points):
    """Say which points are equally near to two segments that meet at an angle, or nearly so."""
    ends = x[interface.master.segments]
    along = ends[:, 1] - ends[:, 0]
    lengths = np.hypot(*along.T)
    steps = points.position[:, None] - ends[None, :, 0]
    feet = np.clip((steps * along).sum(axis=2) / lengths**2, 0, 1)
    distances = np.linalg.norm(steps - feet[..., None] * along, axis=2)
    order, rows = np.argsort(distances, axis=1), np.arange(len(distances))
    if distances.shape[1] < 2:
        return np.zeros(len(distances), bool)
    near = distances[rows, order[:, 1]] - distances[rows, order[:, 0]] < 1e-5 * lengths.min()
    tangents = along / lengths[:, None]
    first, second = tangents[order[:, 0]], tangents[order[:, 1]]
    turned = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) > 1e-3
    return near & turned


def _is_on_a_tiny_segment(interface, x, points):
    lengths = interface.slave.lengths(x)
    return lengths[points.slave_segment] < 1e-4 * lengths.max()


_leaves_out("point exactly over a master node left out", "hard.c", lambda i, x, p: (p.xi == 0) | (p.xi == 1))
_leaves_out("point on a tiny segment left out", "hard.short-segment", _is_on_a_tiny_segment)
_leaves_out("deep point left out", "hard.deep", lambda i, x, p: p.gap < -0.4 * i.master.lengths(x).max())
_leaves_out("segments of the nearest node alone", "hard.search", _is_off_the_nearest_node)
# A hole is a closed chain that is walked clockwise.
_leaves_out("hole taken for a disc", "hard.search", lambda i, x, p: (i.master.neighbours >= 0).all()
            & ((p.normal * (p.position - x[i.n_slave_nodes :].mean(axis=0))).sum(axis=1) < 0))  # fmt: skip
_leaves_out("seam of a closed slave left out", "accuracy.arc", lambda i, x, p: (i.slave.neighbours >= 0).all()
            & (np.diff(i.slave.segments, axis=1)[p.slave_segment, 0] < 0))  # fmt: skip
_leaves_out("area of competence over many segments left out", "hard.contrast",
            lambda i, x, p: p.weight > 2.2 * i.master.lengths(x).mean())  # fmt: skip
_leaves_out("short area of competence left out", "hard.dead-zone",
            lambda i, x, p: p.weight < 5e-3 * i.slave.lengths(x).min())  # fmt: skip
_leaves_out("point between two segments left out", "hard.convex-kink", _is_between_two_segments, nts_ar)
_leaves_out("point with its foot on no segment left out", "hard.concave-corner",
            lambda i, x, p: (p.xi < 0) | (p.xi > 1), nts_ar)  # fmt: skip


def _counter_clockwise(interface, z):
    """Return the interface with each closed chain turned so that it runs counter-clockwise, as around a disc."""
    x = np.real(z.reshape(-1, z.shape[-1])[0, : interface.n_unknowns]).reshape(-1, 2)
    surfaces = []
    for side in (interface.slave, interface.master):
        segments = side.segments.copy()
        for chain in np.split(side.chain_order, side.chain_starts[1:]):
            first, second = x[segments[chain, 0]], x[segments[chain, 1]]
            around = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum() < 0
            if around and (side.neighbours[chain] >= 0).all():
                segments[chain] = segments[chain, ::-1]
        surfaces.append(Surface(segments))
    return Interface(interface.nodes, *surfaces)


@mutant("closed chains turned counter-clockwise", "hard.search", "pair residual tangent contact_points", nts_ar)
def _(right, interface, *state):
    return right(_counter_clockwise(interface, state[-1]), *state)


def _points_of(right, interface, pairing, z):
    """Return the contact points of a state, or of the first of a batch, and its positions."""
    state = z if z.ndim == 1 else z[0]
    return right.__self__.contact_points(interface, pairing, state), state[: interface.n_unknowns].reshape(-1, 2)


@mutant("point a rounding beside a master node counted twice", "hard.node-hit", "residual", vts_me)
def _(right, interface, pairing, z):
    points, _ = _points_of(right, interface, pairing, z)
    distance = np.minimum(np.abs(points.xi), np.abs(1 - points.xi))
    return right(interface, pairing, z) * (2.0 if ((distance > 0) & (distance < 1e-14)).any() else 1.0)


@mutant("normal from foot to point", "hard.touch", "residual", vts_me)
def _(right, interface, pairing, z):
    """Take the normal as the way from the foot to the point over its length, which is 0/0 in touch."""
    gap = _points_of(right, interface, pairing, z)[0].gap
    with np.errstate(invalid="ignore"):
        unit = gap[~np.isnan(gap)] / gap[~np.isnan(gap)]
    return right(interface, pairing, z) * (unit.mean() if len(unit) else 1.0)


@mutant("twice the stiffness in touch", "hard.touch", "tangent", vts_me)
def _(right, interface, pairing, z):
    """Count springs whose gaps are all 0 among the closed ones and among those that are about to close."""
    gaps = right.__self__.contact_points(interface, pairing, z).gap
    return right(interface, pairing, z) * (2.0 if np.nanmax(np.abs(gaps)) < 1e-14 else 1.0)


def _rounds_positions(bits, scale):
    """Round positions to a multiple of 2^-bits of a length before anything else."""

    def residual(right, interface, pairing, z):
        grid = scale(z) * 2.0**-bits
        return right(interface, pairing, np.round(z / grid) * grid)

    return answers("residual", residual)


def _moves_nodes(move, base=BALANCED):
    """Pair and push as if the nodes x (..., n_nodes, 2) were at `move(interface, x)`."""

    def act(right, interface, *others):
        *pairing, z = others
        n, moved = interface.n_unknowns, np.array(z)
        x = moved[..., :n].reshape(*z.shape[:-1], -1, 2)
        moved[..., :n] = move(interface, x).reshape(*z.shape[:-1], n)
        return right(interface, *pairing, moved)

    return answers("pair residual", act, base)


def _thickens_the_slave(interface, x):
    """Move the slave by a millionth of a segment out of its body."""
    ends = x[..., interface.slave.segments, :]
    along = 1e-6 * (ends[..., 1, :] - ends[..., 0, :]).mean(axis=-2)
    x[..., : interface.n_slave_nodes, :] += np.stack([along[..., 1], -along[..., 0]], axis=-1)[..., None, :]
    return x


def _stretches_the_ends(interface, x):
    """Move the free ends of the master outwards by 99 lengths of their segments."""
    for segment, (before, behind) in enumerate(interface.master.neighbours):
        first, second = interface.master.segments[segment]
        along = x[..., second, :] - x[..., first, :]
        if before < 0:
            x[..., first, :] -= 99 * along
        if behind < 0:
            x[..., second, :] += 99 * along
    return x


add("positions kept to 44 bits", "hard.offset", _rounds_positions(44, lambda z: float(np.abs(z).max())))
add("positions rounded to 1e-12", "hard.stiff", _rounds_positions(40, lambda z: 1.0))
add("slave thicker by a millionth of a segment", "hard.zero-load", _moves_nodes(_thickens_the_slave))
add("master continued past its free end", "hard.free-end", _moves_nodes(_stretches_the_ends, nts_ar))


@mutant("force over the cosine of the tilt", "hard.steep-slave", "residual", nts_ar)
def _(right, interface, pairing, z):
    """Divide forces by the cosine of the angle between the first segments of slave and master."""
    x = np.real(z).reshape(*z.shape[:-1], -1, 2)
    slave, master = (
        x[..., segments[0, 1], :] - x[..., segments[0, 0], :]
        for segments in (interface.slave.segments, interface.master.segments)
    )
    cosine = (
        -(slave * master).sum(axis=-1) / np.hypot(*np.moveaxis(slave, -1, 0)) / np.hypot(*np.moveaxis(master, -1, 0))
    )
    return right(interface, pairing, z) / cosine[..., None]


# Forces as a whole: precision, signs, shares and sizes.


@mutant("positions in single precision", TRANSMISSION, "residual")
def _(right, interface, pairing, z):
    rounded = z.astype(np.complex64 if np.iscomplexobj(z) else np.float32).astype(z.dtype)
    return right(interface, pairing, rounded)


@mutant("small forces dropped", UNITS, "residual")
def _(right, interface, pairing, z):
    forces = right(interface, pairing, z)
    return np.where(np.abs(forces) < 1e-12, 0, forces)


@mutant("forces that rollers take from the bodies", "patch.variants", "residual")
def _(right, interface, pairing, z):
    """Add a couple of forces along the interface at the ends of the slave."""
    forces = np.array(right(interface, pairing, z)).reshape(*z.shape[:-1], -1, 2)
    first, last = interface.slave.segments[0, 0], interface.slave.segments[-1, 1]
    x = z.reshape(forces.shape)
    along = (x[..., last, :] - x[..., first, :]) * right.__self__.penalty * 1e-3
    forces[..., first, :] += along
    forces[..., last, :] -= along
    return forces.reshape(z.shape)


@mutant("shares of the slave nodes spread too far", "nodal-push", "residual", vts_me)
def _(right, interface, pairing, z):
    """Double the distance of each point from the middle of its segment in the shares of its nodes: force is kept."""
    forces = np.array(right(interface, pairing, z)).reshape(*z.shape[:-1], -1, 2)
    for first, second in interface.slave.segments:
        between = (forces[..., first, :] - forces[..., second, :]) / 2
        forces[..., first, :] += between
        forces[..., second, :] -= between
    return forces.reshape(z.shape)


def _scale(factor, base):
    return answers("residual tangent", lambda right, *state: factor * right(*state), base)


add("all signs turned round", UNILATERAL, _scale(-1, nts_ar))
add("all signs of a mortar method turned round", UNILATERAL, _scale(-1, contactverif_mortar.mortar))
add("all signs of multipliers turned round", UNILATERAL, _scale(-1, nts_lm))
add("two passes of NTS-AR a tenth too soft", "patch.flat.published",
    _scale(0.9, partial(contactverif_nts.two_pass, inner=nts_ar)))  # fmt: skip


def _stiffens(factor):
    """Return the forces of NTS-AR with another stiffness, and nothing else: no other part, and no promise."""

    def make(*, penalty):
        springs = ResidualAlone(nts_ar(penalty=factor * penalty))
        springs.traits = Traits()
        return springs

    return make


add("three times too stiff, without a promise", "total-stiffness", _stiffens(3.0))
add("a third as stiff, without a promise", "total-stiffness", _stiffens(1 / 3))
add("half again too stiff, without a promise", "total-stiffness", _stiffens(1.5))


@mutant("springs softer by 5 % once the contact has an edge", "accuracy.hertz", "residual tangent",
        says(BALANCED, converges=True))  # fmt: skip
def _(right, interface, pairing, z):
    active = pairing["active"]
    return (1.0 if active.all() or not active.any() else 0.95) * right(interface, pairing, z)


# Multipliers: rows of another size, decisions beside their threshold, and rows that are 0 = 0. All but the softened
# ones have the right solution wherever all of the slave sees the master.


def _change_rows(base, factors):
    """Multiply the constraint rows by factors of the penalty and the pairing, in the residual and in the tangent."""

    def make(*, penalty):
        def residual(right, interface, pairing, z):
            answer, n = np.array(right(interface, pairing, z)), interface.n_unknowns
            answer[..., n:] *= factors(penalty, pairing)
            return answer

        def tangent(right, interface, pairing, z):
            matrix, n = np.array(dense(right(interface, pairing, z))), interface.n_unknowns
            matrix[n:] *= np.broadcast_to(factors(penalty, pairing), len(z) - n)[:, None]
            return matrix

        return wrap(penalty, base, residual=residual, tangent=tangent)

    return make


def _leaves_rows_empty(base):
    """Leave the row of a slave node that sees nothing empty: 0 = 0."""

    def make(*, penalty):
        inner = base(penalty=penalty)

        def pair(interface, z):
            state, n = np.array(z), interface.n_unknowns
            state[n:] = 1e300
            return Pairing({**inner.pair(interface, z), "sees": inner.pair(interface, state)["active"]})

        changed = _change_rows(base, lambda _, pairing: np.where(pairing["sees"], 1.0, 0.0))(penalty=penalty)
        changed.pair = pair
        return changed

    return make


for _name, _property, _base, _factors in (
    ("constraint rows times the penalty", UNILATERAL, nts_lm, lambda penalty, _: penalty),
    ("constraint rows of pressures times the penalty", UNILATERAL, contactverif_mortar.mortar_lm,
     lambda penalty, _: penalty),
    ("constraint rows twice as large", UNILATERAL, contactverif_mortar.mortar_dual_lm, lambda *_: 2.0),
    ("rows of inactive constraints times the penalty", UNILATERAL, contactverif_nts.vts_me_lm,
     lambda penalty, pairing: np.where(pairing["active"], 1.0, penalty)),
):  # fmt: skip
    add(_name, _property, _change_rows(_base, _factors))
add("row of a node that sees nothing is 0 = 0", RANK, _leaves_rows_empty(nts_lm))
add("row of a mortar node that sees nothing is 0 = 0", RANK, _leaves_rows_empty(contactverif_mortar.mortar_lm))


@mutant("small tension is not released", UNILATERAL, "pair", nts_lm)
def _(right, interface, z):
    """Release a node only where its tension λ − c g < 0 is larger than a share of the largest multiplier."""
    later, n = np.array(z), interface.n_unknowns
    later[n:] += SMALL_TENSION * np.abs(z[n:]).max()
    return right(interface, later)


@mutant("tension is not released where surfaces penetrate", UNILATERAL, "pair", contactverif_mortar.mortar_lm)
def _(right, interface, z):
    """Decide by the gap alone where there is a penetration, whatever the multiplier is."""
    unloaded, n = np.array(z), interface.n_unknowns
    unloaded[n:] = 0.0
    either = right(interface, z)["active"] | right(interface, unloaded)["active"]
    return Pairing({**right(interface, z), "active": either})


def _soft_multipliers(*, penalty):
    """Soften the constraint by λ/c, so that the solution depends on the scale of the decision."""

    def residual(right, interface, pairing, z):
        answer, n = right(interface, pairing, z), interface.n_unknowns
        rows = np.where(pairing["active"], z[..., n:] / penalty, 0.0)
        return np.concatenate([answer[..., :n], answer[..., n:] - rows], axis=-1)

    def tangent(right, interface, pairing, z):
        matrix, n = np.array(right(interface, pairing, z).toarray()), interface.n_unknowns
        matrix[range(n, len(z)), range(n, len(z))] -= np.where(pairing["active"], 1 / penalty, 0.0)
        return matrix

    return wrap(penalty, nts_lm, residual=residual, tangent=tangent)


def _smoothing(interface):
    """Return the matrix (n_slave_nodes, n_slave_nodes) that replaces ¼ of a pressure by that of each neighbour."""
    matrix = np.eye(interface.n_slave_nodes)
    for first, second in interface.slave.segments:
        matrix[[first, second], [first, second]] -= 0.25
        matrix[[first, second], [second, first]] += 0.25
    return matrix


def _smooths_multipliers(*, penalty):
    """Press with multipliers that are averaged over neighbours first; the constraints remain those of mortar.

    Forces balance, and a uniform pressure is exact. Only a pressure that varies shows what is wrong.
    """

    def smooth(interface, z):
        n = interface.n_unknowns
        return np.concatenate([z[..., :n], z[..., n:] @ _smoothing(interface).T], axis=-1)

    def residual(right, interface, pairing, z):
        n = interface.n_unknowns
        forces, rows = right(interface, pairing, smooth(interface, z)), right(interface, pairing, z)
        return np.concatenate([forces[..., :n], rows[..., n:]], axis=-1)

    def tangent(right, interface, pairing, z):
        n = interface.n_unknowns
        forces, rows = (dense(right(interface, pairing, state)) for state in (smooth(interface, z), z))
        return np.vstack([np.hstack([forces[:n, :n], forces[:n, n:] @ _smoothing(interface)]), rows[n:]])

    return wrap(penalty, contactverif_mortar.mortar_lm, residual=residual, tangent=tangent)


add("constraint softened by its multiplier", "complementarity", _soft_multipliers)
add("multipliers smoothed before they press", "stability.inf-sup", _smooths_multipliers)
