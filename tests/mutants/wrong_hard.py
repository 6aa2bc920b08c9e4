"""Mutants of the hard cases: right formulations with one habit that ordinary meshes do not punish.

Most of them leave out, or count twice, a contact point that some condition singles out. The condition is computed from
what the formulation itself reports, so that these mutants do not depend on the source of a kernel.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from mutate import Mutant, replaces, wrap

import contactverif_nts
from contactverif import Pairing

Keep = Callable[[Any, Any, Any], Any]


def _leaves_out(drop: Keep, make: Any = contactverif_nts.vts_ppt_balanced) -> Any:
    """Leave out the contact points for which `drop(interface, x, points)` says so."""

    def mutant(*, penalty: float) -> Any:
        inner = make(penalty=penalty)

        def pair(right: Any, interface: Any, z: Any) -> Any:
            pairing = Pairing(right(interface, z))
            points = inner.contact_points(interface, pairing, z)
            x = z[: interface.n_unknowns].reshape(-1, 2)
            return Pairing({**pairing, "active": pairing["active"] & ~drop(interface, x, points)})

        return wrap(penalty, make, pair=pair)

    return mutant


def _is_a_rounding_beside_a_node(interface: Any, x: Any, points: Any) -> Any:
    distance = np.minimum(np.abs(points.xi), np.abs(1 - points.xi))
    return (distance > 0) & (distance < 1e-14)


def _is_off_the_nearest_node(interface: Any, x: Any, points: Any) -> Any:
    """Say which points are not on a segment of the nearest master node."""
    first = interface.n_slave_nodes
    distances = np.linalg.norm(points.position[:, None] - x[None, first:], axis=2)
    nearest = first + np.nanargmin(np.where(np.isnan(distances), 0.0, distances), axis=1)
    return ~(interface.master.segments[points.master_segment] == nearest[:, None]).any(axis=1)


def _is_between_two_segments(interface: Any, x: Any, points: Any) -> Any:
    """Say which points are equally near to two segments that meet at an angle, or nearly so."""
    ends = x[interface.master.segments]
    along = ends[:, 1] - ends[:, 0]
    lengths = np.hypot(*along.T)
    steps = points.position[:, None] - ends[None, :, 0]
    feet = np.clip((steps * along).sum(axis=2) / lengths**2, 0, 1)
    distances = np.linalg.norm(steps - feet[..., None] * along, axis=2)
    order = np.argsort(distances, axis=1)
    rows = np.arange(len(distances))
    if distances.shape[1] < 2:
        return np.zeros(len(distances), bool)
    near = distances[rows, order[:, 1]] - distances[rows, order[:, 0]] < 1e-5 * lengths.min()
    tangents = along / lengths[:, None]
    first, second = tangents[order[:, 0]], tangents[order[:, 1]]
    turned = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) > 1e-3
    return near & turned


def _rounds_positions(bits: int, scale: Callable[[Any], float]) -> Any:
    """Round positions to a multiple of 2^-bits of a length before anything else."""

    def mutant(*, penalty: float) -> Any:
        def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
            grid = scale(z) * 2.0**-bits
            return right(interface, pairing, np.round(z / grid) * grid)

        return wrap(penalty, residual=residual)

    return mutant


def _moves_nodes(move: Callable[[Any, Any], Any], make: Any = contactverif_nts.vts_ppt_balanced) -> Any:
    """Pair and push as if the nodes x (..., n_nodes, 2) were at `move(interface, x)`."""

    def with_moved_nodes(interface: Any, z: Any) -> Any:
        n = interface.n_unknowns
        moved = np.array(z)
        x = moved[..., :n].reshape(*z.shape[:-1], -1, 2)
        moved[..., :n] = move(interface, x).reshape(*z.shape[:-1], n)
        return moved

    def mutant(*, penalty: float) -> Any:
        return wrap(
            penalty,
            make,
            pair=lambda right, interface, z: right(interface, with_moved_nodes(interface, z)),
            residual=lambda right, interface, pairing, z: right(interface, pairing, with_moved_nodes(interface, z)),
        )

    return mutant


def _thickens_the_slave(interface: Any, x: Any) -> Any:
    """Move the slave by a millionth of a segment out of its body."""
    ends = x[..., interface.slave.segments, :]
    along = 1e-6 * (ends[..., 1, :] - ends[..., 0, :]).mean(axis=-2)
    x[..., : interface.n_slave_nodes, :] += np.stack([along[..., 1], -along[..., 0]], axis=-1)[..., None, :]
    return x


def _stretches_the_ends(interface: Any, x: Any) -> Any:
    """Move the free ends of the master outwards by 99 lengths of their segments."""
    for segment, (before, behind) in enumerate(interface.master.neighbours):
        first, second = interface.master.segments[segment]
        along = x[..., second, :] - x[..., first, :]
        if before < 0:
            x[..., first, :] -= 99 * along
        if behind < 0:
            x[..., second, :] += 99 * along
    return x


def _divides_by_the_distance(*, penalty: float) -> Any:
    """Take the normal as the way from the foot to the point over its length, which is 0/0 in touch."""
    inner = contactverif_nts.vts_me(penalty=penalty)

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        state = z if z.ndim == 1 else z[0]
        gap = inner.contact_points(interface, pairing, state).gap
        with np.errstate(invalid="ignore"):
            unit = gap[~np.isnan(gap)] / gap[~np.isnan(gap)]
        return right(interface, pairing, z) * (unit.mean() if len(unit) else 1.0)

    return wrap(penalty, contactverif_nts.vts_me, residual=residual)


@replaces("tangent", contactverif_nts.vts_me)
def _counts_touch_as_both(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Count springs whose gaps are all 0 among the closed ones and among those that are about to close."""
    gaps = contactverif_nts.vts_me(penalty=1.0).contact_points(interface, pairing, z).gap
    return right(interface, pairing, z) * (2.0 if np.nanmax(np.abs(gaps)) < 1e-14 else 1.0)


@replaces("residual", contactverif_nts.nts_ar)
def _divides_by_the_cosine(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
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


def _counts_twice(make: Any, double: Keep) -> Any:
    """Double all forces where `double(interface, x, points)` says so of a point."""

    def mutant(*, penalty: float) -> Any:
        inner = make(penalty=penalty)

        def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
            state = z if z.ndim == 1 else z[0]
            points = inner.contact_points(interface, pairing, state)
            twice = double(interface, state[: interface.n_unknowns].reshape(-1, 2), points)
            return right(interface, pairing, z) * (2.0 if twice.any() else 1.0)

        return wrap(penalty, make, residual=residual)

    return mutant


MUTANTS = (
    Mutant("point exactly over a master node left out", "hard.c",
           _leaves_out(lambda interface, x, points: (points.xi == 0) | (points.xi == 1))),
    Mutant("point a rounding beside a master node counted twice", "hard.node-hit",
           _counts_twice(contactverif_nts.vts_me, _is_a_rounding_beside_a_node)),
    Mutant("point on a tiny segment left out", "hard.short-segment",
           _leaves_out(lambda interface, x, points: (lengths := interface.slave.lengths(x))[points.slave_segment]
                       < 1e-4 * lengths.max())),
    Mutant("positions kept to 44 bits", "hard.offset", _rounds_positions(44, lambda z: float(np.abs(z).max()))),
    Mutant("deep point left out", "hard.deep",
           _leaves_out(lambda interface, x, points: points.gap < -0.4 * interface.master.lengths(x).max())),
    Mutant("segments of the nearest node alone", "hard.search", _leaves_out(_is_off_the_nearest_node)),
    Mutant("positions rounded to 1e-12", "hard.stiff", _rounds_positions(40, lambda z: 1.0)),
    Mutant("area of competence over many segments left out", "hard.contrast",
           _leaves_out(lambda interface, x, points: points.weight > 2.2 * interface.master.lengths(x).mean())),
    Mutant("short area of competence left out", "hard.dead-zone",
           _leaves_out(lambda interface, x, points: points.weight < 5e-3 * interface.slave.lengths(x).min())),
    Mutant("slave thicker by a millionth of a segment", "hard.zero-load", _moves_nodes(_thickens_the_slave)),
    Mutant("normal from foot to point", "hard.touch", _divides_by_the_distance),
    Mutant("twice the stiffness in touch", "hard.touch", _counts_touch_as_both),
    Mutant("point between two segments left out", "hard.convex-kink",
           _leaves_out(_is_between_two_segments, contactverif_nts.nts_ar)),
    Mutant("point with its foot on no segment left out", "hard.concave-corner",
           _leaves_out(lambda interface, x, points: (points.xi < 0) | (points.xi > 1), contactverif_nts.nts_ar)),
    Mutant("force over the cosine of the tilt", "hard.steep-slave", _divides_by_the_cosine),
    Mutant("master continued past its free end", "hard.free-end",
           _moves_nodes(_stretches_the_ends, contactverif_nts.nts_ar)),
)  # fmt: skip
