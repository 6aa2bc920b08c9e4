"""Formulations on faces that are wrong far away, at a node, in touch, beside another surface, or on many faces."""

from dataclasses import replace
from typing import Any

import numpy as np
from mutate import Mutant, wrap
from wrong_surface_contact import NTS_AR
from wrong_surfaces import STS, changes_points

from contactverif import Pairing
from contactverif_surfaces.cell_points import CellPoints, SlaveView

LONGEST = 100  # More nodes than a random mesh has.


def _lose_nodes_on_edges(right: Any, interface: Any, z: Any) -> Pairing:
    """Take a foot on an edge of the master for one on neither face."""
    pairing = right(interface, z)
    points = NTS_AR(penalty=1.0).contact_points(interface, pairing, z)
    home = pairing["home"].copy()
    home[np.flatnonzero(home >= 0)[points.master_shape.min(axis=1) < 1e-12]] = -1
    return Pairing({"home": home, "active": pairing["active"] & (home >= 0)})


def _see_near_faces(right: Any, interface: Any, z: Any) -> Pairing:
    """Take a penetration of two fifths of an edge or more for the other side of the body."""
    pairing = right(interface, z)
    points = NTS_AR(penalty=1.0).contact_points(interface, pairing, z)
    corners = z.reshape(-1, 3)[interface.slave.faces]
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    active = pairing["active"].copy()
    active[np.flatnonzero(pairing["home"] >= 0)] &= points.gap > -0.4 * edge
    return Pairing({"home": pairing["home"], "active": active})


def _round_far_away(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Form points at sixteen times their distance from the origin."""
    far = 16 * np.abs(z).max()
    return right(interface, pairing, (z + far) - far)


def _look_at_nearest_node(right: Any, interface: Any, z: Any) -> Pairing:
    """Keep a cell only if its master face has the node that is nearest to the middle of the slave face."""
    pairing, x = right(interface, z), z.reshape(-1, 3)
    middles = x[interface.slave.faces].mean(axis=1)
    nodes = np.unique(interface.master.faces)
    nearest = nodes[np.linalg.norm(middles[:, None] - x[nodes], axis=-1).argmin(axis=1)]
    near = (interface.master.faces[pairing["master_face"]] == nearest[pairing["slave_face"]][:, None]).any(axis=1)
    return Pairing({name: array[near] for name, array in pairing.items()})


def _press_in_touch(points: CellPoints, view: SlaveView) -> CellPoints:
    """Take a gap of 1e-12 edges for none."""
    edge = view.slave[..., 1, :] - view.slave[..., 0, :]
    return replace(points, gap=points.gap - 1e-12 * np.sqrt((edge * edge).sum(axis=-1))[..., None])


def _forget_rows(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    tangent = right(interface, pairing, z).toarray()
    tangent[3 * LONGEST :] = 0.0
    return tangent


def _share_keys(right: Any, interface: Any, z: Any) -> Pairing:
    """Keep one cell for each number 100 × slave face + master face."""
    pairing = right(interface, z)
    key = 100 * pairing["slave_face"] + pairing["master_face"]
    first = np.sort(np.unique(key, return_index=True)[1])
    return Pairing({name: array[first] for name, array in pairing.items()})


def _follow_front(right: Any, interface: Any, z: Any) -> Pairing:
    """Find the cells that hang together with the first one, by nodes of both sides."""
    pairing = right(interface, z)
    slave = interface.slave.faces[pairing["slave_face"]]
    master = interface.master.faces[pairing["master_face"]]
    found = np.arange(len(slave)) == 0
    while True:
        near = np.isin(slave, slave[found]).any(axis=1) & np.isin(master, master[found]).any(axis=1)
        if not (near & ~found).any():
            return Pairing({name: array[found] for name, array in pairing.items()})
        found |= near


def _symmetrise(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Make a tangent symmetric that is so to a thousandth of its largest entry."""
    tangent = right(interface, pairing, z)
    skew = (tangent - tangent.T) / 2
    return (tangent - skew).tocsr() if abs(skew).max() <= 1e-3 * abs(tangent).max() else tangent


def _know_eight_faces(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Give a node the areas of its first eight faces alone."""
    faces, forces = interface.slave.faces, right(interface, pairing, z)
    corners = z.reshape(-1, 3)[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    whole, first = np.zeros(interface.n_nodes), np.zeros(interface.n_nodes)
    counts = np.zeros(interface.n_nodes, int)
    for face, area in zip(faces, areas, strict=True):
        whole[face] += area
        first[face] += np.where(counts[face] < 8, area, 0.0)
        counts[face] += 1
    share = np.where(whole > 0, first / np.where(whole > 0, whole, 1.0), 1.0)
    return (forces.reshape(-1, 3) * share[:, None]).reshape(-1)


def _stiffen(*, penalty: float) -> Any:
    """Return springs that are too stiff, and state neither area nor unit nor what they transmit."""
    springs = STS(penalty=1.05 * penalty)
    traits = springs.traits.revise(penalty=None, area=None, flat=None, normal=None, integrates_linear_gap=None)
    return replace(springs, traits=traits)


def _tire(*, penalty: float) -> Any:
    calls: list[None] = []

    def residual(right: Any, *arguments: Any) -> Any:
        calls.append(None)
        return right(*arguments) * (1 if len(calls) < 900 else 1 + 2.0**-40)

    return wrap(penalty, STS, residual=residual)


MUTANTS = (
    Mutant("node lost on an edge of the master", "hard.node-hit",
           lambda *, penalty: wrap(penalty, NTS_AR, pair=_lose_nodes_on_edges)),
    Mutant("gap formed far away", "hard.offset", lambda *, penalty: wrap(penalty, STS, residual=_round_far_away)),
    Mutant("deep nodes taken for the other side", "hard.deep",
           lambda *, penalty: wrap(penalty, NTS_AR, pair=_see_near_faces)),
    Mutant("penalty in single precision", "hard.deep", lambda *, penalty: wrap(float(np.float32(penalty)), STS)),
    Mutant("faces sought at the nearest node alone", "hard.search",
           lambda *, penalty: wrap(penalty, STS, pair=_look_at_nearest_node)),
    Mutant("a touch that presses", "hard.touch", changes_points(_press_in_touch)),
    Mutant("rows of the tangent forgotten behind the hundredth node", "tangent.long",
           lambda *, penalty: wrap(penalty, STS, tangent=_forget_rows)),
    Mutant("one cell for each hundred of slave face and master face", "hard.search",
           lambda *, penalty: wrap(penalty, STS, pair=_share_keys)),
    Mutant("springs a twentieth too stiff, of an unstated area", "total-stiffness", _stiffen),
    Mutant("an instance that tires", "purity.long", _tire),
    Mutant("a front that starts once", "remote", lambda *, penalty: wrap(penalty, STS, pair=_follow_front)),
    Mutant("tangent made symmetric where it nearly is", "tangent.long",
           lambda *, penalty: wrap(penalty, STS, tangent=_symmetrise)),
    Mutant("areas of eight faces a node", "hard.node-hit",
           lambda *, penalty: wrap(penalty, NTS_AR, residual=_know_eight_faces)),
)  # fmt: skip
