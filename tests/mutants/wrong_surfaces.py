"""Formulations on faces that are wrong on purpose, each with the property that is meant to catch it in space.

Most are segment-to-segment contact with another rule for the points of a cell, so that residual and tangent agree and
only what the rule computes is wrong.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from mutate import Mutant, says, wrap
from readable_cells import centre_points

import contactverif_surfaces
from contactverif import Pairing
from contactverif_surfaces.cell_points import CellPoints, SlaveView, gauss_points, unit_vectors
from contactverif_surfaces.face_search import MOST_CORNERS, find_cells

TRANSMISSION, RESULTANT = "patch.flat.transmission", "patch.flat.resultant"
FORCE, MOMENT, TANGENT, OBJECTIVITY = "balance.force", "balance.moment", "tangent.directional", "objectivity"
SCALING, RENUMBERING, MIRROR, PURITY = "units", "renumbering", "mirror", "purity"
STS, CELL, QUARTERS, MORTAR = (
    getattr(contactverif_surfaces, name) for name in ("sts_3d", "vts_cell_3d", "vts_ppt_3d", "mortar_3d")
)
Rule = Callable[[SlaveView, Any], CellPoints]


def right_rule(view: SlaveView, codes: Any) -> CellPoints:
    return gauss_points(view, codes, 3)


def by_rule(rule: Rule) -> Callable[..., Any]:
    """Return the factory of springs with another rule for residual, tangent, pairing and contact points."""
    return lambda *, penalty: replace(STS(penalty=penalty), rule=rule)


def changes_points(change: Callable[[CellPoints, SlaveView], CellPoints]) -> Callable[..., Any]:
    """Return the factory of springs whose points are those of `change(points, view)`."""
    return by_rule(lambda view, codes: change(right_rule(view, codes), view))


def in_tangent(rule: Rule) -> Callable[..., Any]:
    """Return the factory of springs whose tangent alone follows another rule."""

    def make(*, penalty: float) -> Any:
        wrong = replace(STS(penalty=penalty), rule=rule)
        return wrap(penalty, STS, tangent=lambda right, *arguments: wrong.tangent(*arguments))

    return make


def _whole_face(points: CellPoints, view: SlaveView) -> CellPoints:
    first = view.slave[..., 1:, :] - view.slave[..., :1, :]
    area = (first[..., 0, 0] * first[..., 1, 1] - first[..., 0, 1] * first[..., 1, 0]) / 2
    whole = points.weight.sum(axis=-1)
    factor = np.where(np.abs(whole) > 0, area / np.where(np.abs(whole) > 0, whole, 1.0), 0.0)
    return replace(points, weight=points.weight * factor[..., None])


def _lose_corner(view: SlaveView, codes: Any) -> CellPoints:
    """Leave out the last corner of cells with five and more."""
    codes = codes.copy()
    for row in codes:
        n_corners = len(np.unique(row, axis=0))
        if n_corners > 4:
            row[n_corners - 1 :] = row[n_corners - 2]
    return right_rule(view, codes)


def _first_corner_fan(view: SlaveView, codes: Any) -> CellPoints:
    """Put Gauss points on triangles around the first corner of a cell: exact as long as all of it is in contact."""
    corners = view.cell_corners(codes)
    first = np.broadcast_to(corners[..., :1, :], corners[..., 1:-1, :].shape)
    triangles = np.stack([first, corners[..., 1:-1, :], corners[..., 2:, :]], axis=-2)
    edges = triangles[..., 1:, :] - triangles[..., :1, :]
    area = (edges[..., 0, 0] * edges[..., 1, 1] - edges[..., 0, 1] * edges[..., 1, 0]) / 2
    shares = np.array([[4.0, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
    places = np.einsum("qc,...tcd->...tqd", shares, triangles)
    count = 3 * places.shape[-3]
    weight = np.repeat(area[..., None] / 3, 3, axis=-1)
    return view.points_at(places.reshape(*places.shape[:-3], count, 2), weight.reshape(*weight.shape[:-2], count))


def _first_corner_gap(points: CellPoints, view: SlaveView) -> CellPoints:
    """Weigh the points by where they lie towards the first corner of the slave face."""
    towards = points.slave_shape[..., 0]
    return replace(points, weight=points.weight * (1 + (towards - 1 / 3) / 8))


def _roll_slave(points: CellPoints, view: SlaveView) -> CellPoints:
    return replace(points, slave_shape=np.roll(points.slave_shape, 1, axis=-1))


def _roll_master(points: CellPoints, view: SlaveView) -> CellPoints:
    return replace(points, master_shape=np.roll(points.master_shape, 1, axis=-1))


def _reverse_gap(points: CellPoints, view: SlaveView) -> CellPoints:
    """Take the heights of the master in the order in which the clip walks along it."""
    reverse = points.master_shape[..., ::-1]
    gap = (reverse * view.master_height[..., None, :]).sum(axis=-1)
    return replace(points, gap=gap - (points.slave_shape * view.slave_height[..., None, :]).sum(axis=-1))


class TwoNormals(CellPoints):
    """Points that push the slave along its own normal, and the master along another one."""

    def push(self, force: Any) -> Any:
        slave, master = super().push(force)
        tilt = np.zeros_like(self.normal)
        tilt[..., 0] = 1e-6
        size = np.sqrt((master * master).sum(axis=-1))[..., None]
        return slave, master + size * tilt[..., None, :]


def _two_normals(points: CellPoints, view: SlaveView) -> CellPoints:
    names = ("slave_shape", "master_shape", "weight", "gap", "normal")
    return TwoNormals(**{name: getattr(points, name) for name in names})


def _half_master(points: CellPoints, view: SlaveView) -> CellPoints:
    """Push the master by shape functions that do not add up to one."""
    return replace(points, master_shape=points.master_shape * (1 - 1e-9))


def _push_middle(points: CellPoints, view: SlaveView) -> CellPoints:
    """Push the master at the middle of its face."""
    n_corners = points.master_shape.shape[-1]
    return replace(points, master_shape=0 * points.master_shape + 1 / n_corners)


def _vertical(points: CellPoints, view: SlaveView) -> CellPoints:
    normal = 0 * points.normal
    normal[..., 2] = np.where(points.normal[..., 2].real < 0, -1.0, 1.0)
    return replace(points, normal=normal)


def _leaning(points: CellPoints, view: SlaveView) -> CellPoints:
    axis = np.array([0.0, 0.0, 1e-7])
    return replace(points, normal=unit_vectors(points.normal + axis))


def _flat_area(points: CellPoints, view: SlaveView) -> CellPoints:
    """Measure areas in the plane z = 0 of the frame in which the state is described."""
    return replace(points, weight=points.weight * np.abs(points.normal[..., 2:].real))


def _frozen(name: str) -> Rule:
    """Return the right rule with a part of the points whose change the tangent forgets."""

    def rule(view: SlaveView, codes: Any) -> CellPoints:
        points = right_rule(view, codes)
        return replace(points, **{name: getattr(points, name).real + 0j * getattr(points, name)})

    return rule


def _open_below(limit: float) -> Callable[..., Any]:
    """Return the factory of springs that leave points open that penetrate less than a length."""

    def make(*, penalty: float) -> Any:
        springs = STS(penalty=penalty)

        def pair_few(right: Any, interface: Any, z: Any) -> Any:
            pairing = right(interface, z)
            points = springs.contact_points(interface, pairing, z)
            deep = (points.gap < -limit).reshape(pairing["active"].shape)
            return Pairing({**pairing, "active": deep})

        return wrap(penalty, STS, pair=pair_few)

    return make


def _guard_length(points: CellPoints, view: SlaveView) -> CellPoints:
    """Guard the division by a length with an absolute number."""
    size = np.sqrt((view.slave[..., 1, :] ** 2).sum(axis=-1))
    return replace(points, weight=points.weight * (size / (size + 1e-12))[..., None])


def _keeps_first_pairing(*, penalty: float) -> Any:
    pairings: list[Any] = []

    def pair(right: Any, interface: Any, z: Any) -> Any:
        pairings.append(right(interface, z))
        first, last = pairings[0], pairings[-1]
        return first if first["active"].shape == last["active"].shape else last

    return wrap(penalty, STS, pair=pair)


def _transpose(right: Any, *arguments: Any) -> Any:
    return right(*arguments).T.tocsr()


def _loses_blocks(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Leave out what master nodes feel of each other."""
    tangent = right(interface, pairing, z).tolil()
    first = 3 * interface.n_slave_nodes
    tangent[first:, first:] = 0.0
    return tangent.tocsr()


def _soften_tilt(points: CellPoints, view: SlaveView) -> CellPoints:
    """Multiply areas by the cosine of the tilt between both faces."""
    first, second = view.master[..., 1, :] - view.master[..., 0, :], view.master[..., 2, :] - view.master[..., 0, :]
    rises = view.master_height[..., 1:3] - view.master_height[..., :1]
    plane = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    by_x = (rises[..., 0] * second[..., 1] - rises[..., 1] * first[..., 1]) / plane
    by_y = (rises[..., 1] * first[..., 0] - rises[..., 0] * second[..., 0]) / plane
    cosine = 1 / np.sqrt(1 + by_x**2 + by_y**2)
    return replace(points, weight=points.weight * cosine[..., None])


def _drop_entries(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    tangent = right(interface, pairing, z).tocoo()
    large = np.abs(tangent.data) >= 1e-3 * np.abs(tangent.data).max(initial=0.0)
    rows, columns = tangent.coords
    return type(tangent)((tangent.data[large], (rows[large], columns[large])), shape=tangent.shape).tocsr()


def _convert_unit(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Convert positions to another unit and back, which rounds them at their distance from the origin."""
    return right(interface, pairing, z / 3 * 3)


def _add_area(points: CellPoints, view: SlaveView) -> CellPoints:
    return replace(points, weight=points.weight * (1 + 1e-9))


def _skips_faces(right: Any, interface: Any, z: Any) -> Any:
    """Leave out the cells of the last slave face."""
    pairing = right(interface, z)
    here = pairing["slave_face"] < max(len(interface.slave) - 1, 1)
    return Pairing({name: values[here] for name, values in pairing.items()})


def _touches_all_layers(right: Any, interface: Any, z: Any) -> Any:
    """Touch each master face at any distance, whatever lies before it."""
    x, slave, master = np.array(z).reshape(-1, 3), interface.slave.faces, interface.master.faces
    parts = []
    for m in range(len(master)):
        faces, codes = find_cells(x, slave, master[m : m + 1], np.full(len(slave), np.inf), np.array([np.inf]))
        all_codes = np.pad(codes, ((0, 0), (0, MOST_CORNERS - codes.shape[1]), (0, 0)), mode="edge")
        parts.append((faces[:, 0], np.full(len(faces), m), all_codes))
    slave_face, master_face, codes = (np.concatenate(each) for each in zip(*parts, strict=True))
    view = SlaveView.of_corners(x[slave[slave_face]], x[master[master_face]])
    active = right_rule(view, codes).gap < 0
    return Pairing({"slave_face": slave_face, "master_face": master_face, "corners": codes, "active": active})


MUTANTS = (
    Mutant("whole slave face for a part of it", TRANSMISSION, changes_points(_whole_face)),
    Mutant("clip that loses a corner", TRANSMISSION, by_rule(_lose_corner)),
    Mutant("heights of the master in the order of the clip", "patch.tilted.nodal", changes_points(_reverse_gap)),
    Mutant("shape functions of the master one corner on", TRANSMISSION, changes_points(_roll_master)),
    Mutant("force at the middle of the master face", TRANSMISSION, changes_points(_push_middle)),
    Mutant("area too large by 1e-9", RESULTANT, changes_points(_add_area)),
    Mutant("last slave face left out", RESULTANT,
           lambda *, penalty: wrap(penalty, STS, pair=_skips_faces)),
    Mutant("shape functions of the slave one corner on", MOMENT, changes_points(_roll_slave)),
    Mutant("two normals", FORCE, changes_points(_two_normals)),
    Mutant("master loses 1e-9 of its force", FORCE, changes_points(_half_master)),
    Mutant("force along z", MOMENT, changes_points(_vertical)),
    Mutant("force leans by 1e-7", MOMENT, changes_points(_leaning)),
    Mutant("area in the plane z = 0", OBJECTIVITY, changes_points(_flat_area)),
    Mutant("no turn of the normal in the tangent", TANGENT, in_tangent(_frozen("normal"))),
    Mutant("no change of the area in the tangent", TANGENT, in_tangent(_frozen("weight"))),
    Mutant("no slide of the foot in the tangent", TANGENT, in_tangent(_frozen("master_shape"))),
    Mutant("no change of the gap in the tangent", TANGENT, in_tangent(_frozen("gap"))),
    Mutant("tangent of one point a cell", TANGENT, in_tangent(centre_points)),
    Mutant("rows and columns of the tangent exchanged", TANGENT,
           lambda *, penalty: wrap(penalty, STS, tangent=_transpose)),
    Mutant("master block of the tangent left out", TANGENT,
           lambda *, penalty: wrap(penalty, STS, tangent=_loses_blocks)),
    Mutant("penetrations below 1e-9 left open", SCALING, _open_below(1e-9)),
    Mutant("absolute guard against a division by zero", SCALING, changes_points(_guard_length)),
    Mutant("triangles around the first corner of a cell", RENUMBERING, by_rule(_first_corner_fan)),
    Mutant("points near the first corner weigh more", RENUMBERING, changes_points(_first_corner_gap)),
    Mutant("triangles around the first corner, in the mirror", MIRROR, by_rule(_first_corner_fan)),
    Mutant("pairing kept from the first call, on faces", PURITY, _keeps_first_pairing),
    Mutant("one point a cell said to integrate a linear gap", "patch.tilted.nodal",
           says(CELL, integrates_linear_gap=True)),
    Mutant("pressure that falls with the tilt", "patch.tilted.resultant", changes_points(_soften_tilt)),
    Mutant("force said to be along the master's normal", "patch.tilted.resultant",
           says(STS, force_along="master normal")),
    Mutant("master block of the tangent left out, entry by entry", "tangent.sparsity",
           lambda *, penalty: wrap(penalty, STS, tangent=_loses_blocks)),
    Mutant("entries of the tangent below 1e-3 dropped", "tangent.sparsity",
           lambda *, penalty: wrap(penalty, MORTAR, tangent=_drop_entries)),
    Mutant("positions in another unit, forth and back", "stability.translation",
           lambda *, penalty: wrap(penalty, STS, residual=_convert_unit)),
    Mutant("cells said to be symmetric", "symmetric", says(STS, symmetric=True)),
    Mutant("cells said to be unbiased", "swap", says(CELL, unbiased=True)),
    Mutant("quarters said to balance past the border", FORCE, says(QUARTERS, conserves_force=True)),
    Mutant("one point a cell said to be exact on rectangles", TRANSMISSION, by_rule(centre_points)),
    Mutant("layers of the master touched at any distance", "remote",
           lambda *, penalty: wrap(penalty, STS, pair=_touches_all_layers)),
    Mutant("nodes said to pass the patch test", TRANSMISSION,
           says(contactverif_surfaces.nts_ar_3d, flat=True)),
)  # fmt: skip
RIGHT = ("sts-3d", "mortar-3d", "vts-cell-3d", "vts-ppt-3d", "nts-3d", "nts-ar-3d")
