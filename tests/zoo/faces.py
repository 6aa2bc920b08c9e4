"""Mutants of formulations on faces, each with the property that is meant to catch it in space.

Most are segment-to-segment contact with another rule for the points of a cell, so that residual and tangent agree and
only what the rule computes is wrong.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from readable_cells import centre_points

import contactverif_surfaces
from contactverif import Pairing
from contactverif_surfaces.cell_points import CellPoints, SlaveView, gauss_points, unit_vectors
from contactverif_surfaces.face_search import MOST_CORNERS, find_cells
from zoo import making
from zoo.face_multipliers import FaceMultipliers
from zoo.making import SPACE, answers, decides, reports, says, wrap

TRANSMISSION, RESULTANT = "patch.flat.transmission", "patch.flat.resultant"
FORCE, MOMENT, TANGENT = "balance.force", "balance.moment", "tangent.directional"
UNITS, RENUMBERING, LONG, PLACE = "units", "renumbering", "tangent.long", "projection.place"
STS, CELL, PPT, BALANCED, MORTAR, NTS, NTS_AR = (
    getattr(contactverif_surfaces, f"{name}_3d")
    for name in ("sts", "vts_cell", "vts_ppt", "vts_ppt_balanced", "mortar", "nts", "nts_ar")
)
RIGHT = ("sts-3d", "mortar-3d", "vts-cell-3d", "vts-ppt-3d", "vts-ppt-balanced-3d", "nts-3d", "nts-ar-3d")
LONGEST = 100  # More nodes than a random mesh has.


def add(name, caught_by, make):
    making.add(name, caught_by, make, SPACE)


def mutant(name, caught_by, verbs, base=STS, memory=None):
    return making.mutant(name, caught_by, verbs, base, memory=memory, into=SPACE)


def right_rule(view, codes):
    return gauss_points(view, codes, 3)


def by_rule(rule):
    """Return the factory of springs with another rule for residual, tangent, pairing and contact points."""
    return lambda *, penalty: replace(STS(penalty=penalty), rule=rule)


def changes_points(change):
    """Return the factory of springs whose points are those of `change(points, view)`."""
    return by_rule(lambda view, codes: change(right_rule(view, codes), view))


def _in_tangent(rule):
    """Return the factory of springs whose tangent alone follows another rule."""
    return answers("tangent", lambda right, *state: replace(right.__self__, rule=rule).tangent(*state), STS)


def _frozen(name):
    """Return the right rule with a part of the points whose change the tangent forgets."""

    def rule(view, codes):
        points = right_rule(view, codes)
        return replace(points, **{name: getattr(points, name).real + 0j * getattr(points, name)})

    return rule


def _points(name, caught_by):
    """Decorate `change(points, view)`, and register springs with these points."""

    def decorate(change):
        add(name, caught_by, changes_points(change))
        return change

    return decorate


# The points of a cell.


@_points("whole slave face for a part of it", TRANSMISSION)
def _(points, view):
    first = view.slave[..., 1:, :] - view.slave[..., :1, :]
    area = (first[..., 0, 0] * first[..., 1, 1] - first[..., 0, 1] * first[..., 1, 0]) / 2
    whole = points.weight.sum(axis=-1)
    factor = np.where(np.abs(whole) > 0, area / np.where(np.abs(whole) > 0, whole, 1.0), 0.0)
    return replace(points, weight=points.weight * factor[..., None])


def _lose_corner(view, codes):
    """Leave out the last corner of cells with five and more."""
    codes = codes.copy()
    for row in codes:
        n_corners = len(np.unique(row, axis=0))
        if n_corners > 4:
            row[n_corners - 1 :] = row[n_corners - 2]
    return right_rule(view, codes)


def _first_corner_fan(view, codes):
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


@_points("points near the first corner weigh more", RENUMBERING)
def _(points, view):
    """Weigh the points by where they lie towards the first corner of the slave face."""
    return replace(points, weight=points.weight * (1 + (points.slave_shape[..., 0] - 1 / 3) / 8))


@_points("heights of the master in the order of the clip", "patch.tilted.nodal")
def _(points, view):
    gap = (points.master_shape[..., ::-1] * view.master_height[..., None, :]).sum(axis=-1)
    return replace(points, gap=gap - (points.slave_shape * view.slave_height[..., None, :]).sum(axis=-1))


class TwoNormals(CellPoints):
    """Points that push the slave along its own normal, and the master along another one."""

    def push(self, force):
        slave, master = super().push(force)
        tilt = np.zeros_like(self.normal)
        tilt[..., 0] = 1e-6
        return slave, master + np.sqrt((master * master).sum(axis=-1))[..., None] * tilt[..., None, :]


@_points("two normals", FORCE)
def _(points, view):
    names = ("slave_shape", "master_shape", "weight", "gap", "normal")
    return TwoNormals(**{name: getattr(points, name) for name in names})


@_points("force along z", MOMENT)
def _(points, view):
    normal = 0 * points.normal
    normal[..., 2] = np.where(points.normal[..., 2].real < 0, -1.0, 1.0)
    return replace(points, normal=normal)


@_points("absolute guard against a division by zero", UNITS)
def _(points, view):
    size = np.sqrt((view.slave[..., 1, :] ** 2).sum(axis=-1))
    return replace(points, weight=points.weight * (size / (size + 1e-12))[..., None])


@_points("pressure that falls with the tilt", "patch.tilted.resultant")
def _(points, view):
    """Multiply areas by the cosine of the tilt between both faces."""
    first, second = view.master[..., 1, :] - view.master[..., 0, :], view.master[..., 2, :] - view.master[..., 0, :]
    rises = view.master_height[..., 1:3] - view.master_height[..., :1]
    plane = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    by_x = (rises[..., 0] * second[..., 1] - rises[..., 1] * first[..., 1]) / plane
    by_y = (rises[..., 1] * first[..., 0] - rises[..., 0] * second[..., 0]) / plane
    cosine = 1 / np.sqrt(1 + by_x**2 + by_y**2)
    return replace(points, weight=points.weight * cosine[..., None])


@_points("a touch that presses", "hard.touch")
def _(points, view):
    """Take a gap of 1e-12 edges for none."""
    edge = view.slave[..., 1, :] - view.slave[..., 0, :]
    return replace(points, gap=points.gap - 1e-12 * np.sqrt((edge * edge).sum(axis=-1))[..., None])


def _dual_shapes(points, view):
    """Push the slave by shape functions that are negative in places: 4 N − 1, which add up to one on a triangle."""
    return replace(points, slave_shape=4 * points.slave_shape - 1)


# (name, caught by, factory)
for _row in (
    ("clip that loses a corner", TRANSMISSION, by_rule(_lose_corner)),
    ("shape functions of the master one corner on", TRANSMISSION,
     changes_points(lambda p, _: replace(p, master_shape=np.roll(p.master_shape, 1, axis=-1)))),
    ("force at the middle of the master face", TRANSMISSION,
     changes_points(lambda p, _: replace(p, master_shape=0 * p.master_shape + 1 / p.master_shape.shape[-1]))),
    ("area too large by 1e-9", RESULTANT, changes_points(lambda p, _: replace(p, weight=p.weight * (1 + 1e-9)))),
    ("shape functions of the slave one corner on", MOMENT,
     changes_points(lambda p, _: replace(p, slave_shape=np.roll(p.slave_shape, 1, axis=-1)))),
    ("master loses 1e-9 of its force", FORCE,
     changes_points(lambda p, _: replace(p, master_shape=p.master_shape * (1 - 1e-9)))),
    ("force leans by 1e-7", MOMENT,
     changes_points(lambda p, _: replace(p, normal=unit_vectors(p.normal + np.array([0.0, 0.0, 1e-7]))))),
    # Areas measured in the plane z = 0 of the frame in which the state is described.
    ("area in the plane z = 0", "objectivity",
     changes_points(lambda p, _: replace(p, weight=p.weight * np.abs(p.normal[..., 2:].real)))),
    ("no turn of the normal in the tangent", TANGENT, _in_tangent(_frozen("normal"))),
    ("no change of the area in the tangent", TANGENT, _in_tangent(_frozen("weight"))),
    ("no slide of the foot in the tangent", TANGENT, _in_tangent(_frozen("master_shape"))),
    ("no change of the gap in the tangent", TANGENT, _in_tangent(_frozen("gap"))),
    ("tangent of one point a cell", TANGENT, _in_tangent(centre_points)),
    ("triangles around the first corner of a cell", RENUMBERING, by_rule(_first_corner_fan)),
    ("triangles around the first corner, in the mirror", "mirror", by_rule(_first_corner_fan)),
    ("one point a cell said to integrate a linear gap", "patch.tilted.nodal", says(CELL, integrates_linear_gap=True)),
    ("force said to be along the master's normal", "patch.tilted.resultant", says(STS, force_along="master normal")),
    ("cells said to be symmetric", "symmetric", says(STS, symmetric=True)),
    ("cells said to be unbiased", "swap", says(CELL, unbiased=True)),
    ("quarters said to balance past the border", FORCE, says(PPT, conserves_force=True)),
    ("printed areas of faces said to push continuously", "continuity", says(PPT, continuity="C0")),
    ("areas across the normal said to balance", MOMENT, says(BALANCED, conserves_moment=True)),
    ("one point a cell said to be exact on rectangles", TRANSMISSION, by_rule(centre_points)),
    ("nodes said to pass the patch test", TRANSMISSION, says(NTS_AR, flat=True)),
    ("shape functions that pull nodes of a face", "nodal-push", says(changes_points(_dual_shapes), nodes_push=True)),
    ("equal stiffness at nodes said to be that of areas", "patch.flat.normal",
     says(NTS, normal=True, penalty="distributed", area="current")),
    ("nodal areas said to be nodal springs", "patch.flat.nodal", says(NTS_AR, penalty="nodal", area=None)),
    # Decisions and reports.
    ("springs that pull, too", "unilateral", decides(STS, lambda pairing, _: pairing["active"] | True)),
    ("all points of a cell closed with one of them", "unilateral",
     decides(STS, lambda pairing, _: pairing["active"] | pairing["active"].any(axis=1)[:, None])),
    ("all nodes closed with one of them", "unilateral",
     decides(MORTAR, lambda pairing, _: pairing["active"] | pairing["active"].any())),
    ("contact that never begins on faces", "unilateral", decides(STS, lambda pairing, _: pairing["active"] & False)),
    ("all points of a cell decided by the first one", "projection.activity",
     decides(STS, lambda pairing, _: pairing["active"] & pairing["active"][:, :1])),
    ("half the gap reported on faces", "patch.flat.normal", reports(STS, lambda p, *_: {"gap": p.gap / 2})),
    ("gap over the cosine reported", PLACE, reports(STS, lambda p, *_: {"gap": p.gap / np.abs(p.normal[:, 2])})),
    ("foot reported in the middle of its face", PLACE,
     reports(STS, lambda p, *_: {"master_shape": np.full_like(p.master_shape, 1 / 3)})),
    ("normal of the slave reported", PLACE, reports(STS, lambda p, *_: {"normal": -p.normal})),
    ("position reported on the master", PLACE,
     reports(STS, lambda p, *_: {"position": p.position - p.gap[:, None] * p.normal})),
    ("another master face reported", "projection.segment",
     reports(STS, lambda p, interface, x: {"master_segment": (p.master_segment + 1) % len(interface.master)})),
    ("area in the plane z = 0 reported", "projection.area",
     reports(STS, lambda p, *_: {"weight": p.weight * np.abs(p.normal[:, 2])})),
    ("pressure of points reported twice", "projection.forces",
     reports(STS, lambda p, *_: {"pressure": 2 * p.pressure})),
    ("forces of nodes reported twice", "patch.flat.nodal", reports(NTS, lambda p, *_: {"pressure": 2 * p.pressure})),
):  # fmt: skip
    add(*_row)


@mutant("closed points alone reported on faces", "projection.area", "contact_points")
def _(right, *state):
    points = right(*state)
    return points.select(points.active)


# Searches and decisions.


@mutant("last slave face left out", RESULTANT, "pair")
def _(right, interface, z):
    pairing = right(interface, z)
    here = pairing["slave_face"] < max(len(interface.slave) - 1, 1)
    return Pairing({name: values[here] for name, values in pairing.items()})


@mutant("penetrations below 1e-9 left open", UNITS, "pair")
def _(right, interface, z):
    pairing = right(interface, z)
    points = right.__self__.contact_points(interface, pairing, z)
    return Pairing({**pairing, "active": (points.gap < -1e-9).reshape(pairing["active"].shape)})


@mutant("pairing kept from the first call, on faces", "purity", "pair", memory=list)
def _(pairings, right, interface, z):
    pairings.append(right(interface, z))
    first, last = pairings[0], pairings[-1]
    return first if first["active"].shape == last["active"].shape else last


@mutant("layers of the master touched at any distance", "remote", "pair")
def _(right, interface, z):
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


@mutant("node lost on an edge of the master", "hard.node-hit", "pair", NTS_AR)
def _(right, interface, z):
    """Take a foot on an edge of the master for one on neither face."""
    pairing = right(interface, z)
    points = NTS_AR(penalty=1.0).contact_points(interface, pairing, z)
    home = pairing["home"].copy()
    home[np.flatnonzero(home >= 0)[points.master_shape.min(axis=1) < 1e-12]] = -1
    return Pairing({"home": home, "active": pairing["active"] & (home >= 0)})


@mutant("last face taken unchecked for a node that faces none", "hard.free-end", "pair", NTS_AR)
def _(right, interface, z):
    pairing = right(interface, z)
    lost = pairing["home"] < 0
    return Pairing(
        {"home": np.where(lost, len(interface.master) - 1, pairing["home"]), "active": pairing["active"] | lost}
    )


@mutant("a pairing that may not be empty", "hard.free-end", "pair")
def _(right, interface, z):
    pairing = right(interface, z)
    assert len(pairing["slave_face"]) > pairing["slave_face"].argmax()
    return pairing


@mutant("faces at more than 45° to each other left open", "patch.tilted.resultant", "pair")
def _(right, interface, z):
    pairing, x = right(interface, z), z.reshape(-1, 3)
    normals = []
    for side, name in ((interface.slave, "slave_face"), (interface.master, "master_face")):
        corners = x[side.faces[pairing[name]]]
        normals.append(unit_vectors(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])))
    facing = (normals[0] * normals[1]).sum(axis=-1) < -np.sqrt(0.5)
    return Pairing({**pairing, "active": pairing["active"] & facing[:, None]})


@mutant("keys of pairs in 16 bits", "hard.search", "pair")
def _(right, interface, z):
    pairing = right(interface, z)
    keys = (pairing["slave_face"] * len(interface.master) + pairing["master_face"]).astype(np.int16)
    if len(np.unique(keys)) == len(keys):
        return pairing
    first = np.sort(np.unique(keys, return_index=True)[1])
    return Pairing({name: array[first] for name, array in pairing.items()})


@mutant("first layer of the master searched alone", "projection.segment", "pair")
def _(right, interface, z):
    """Search the first half of the master's faces where no edge joins it to the other half."""
    half = len(interface.master) // 2
    pairing, x, slave = right(interface, z), z.reshape(-1, 3), interface.slave.faces
    if half == 0 or (interface.master.neighbours[:half] >= half).any():
        return pairing
    sizes = np.full(len(slave), np.inf), np.full(half, np.inf)
    faces, codes = find_cells(x, slave, interface.master.faces[:half], *sizes)
    codes = np.pad(codes, ((0, 0), (0, MOST_CORNERS - codes.shape[1]), (0, 0)), mode="edge")
    view = SlaveView.of_corners(x[slave[faces[:, 0]]], x[interface.master.faces[faces[:, 1]]])
    active = right_rule(view, codes).gap < 0
    return Pairing({"slave_face": faces[:, 0], "master_face": faces[:, 1], "corners": codes, "active": active})


@mutant("deep nodes taken for the other side", "hard.deep", "pair", NTS_AR)
def _(right, interface, z):
    """Take a penetration of two fifths of an edge or more for the other side of the body."""
    pairing = right(interface, z)
    points = NTS_AR(penalty=1.0).contact_points(interface, pairing, z)
    corners = z.reshape(-1, 3)[interface.slave.faces]
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    active = pairing["active"].copy()
    active[np.flatnonzero(pairing["home"] >= 0)] &= points.gap > -0.4 * edge
    return Pairing({"home": pairing["home"], "active": active})


@mutant("faces sought at the nearest node alone", "hard.search", "pair")
def _(right, interface, z):
    """Keep a cell only if its master face has the node that is nearest to the middle of the slave face."""
    pairing, x = right(interface, z), z.reshape(-1, 3)
    middles = x[interface.slave.faces].mean(axis=1)
    nodes = np.unique(interface.master.faces)
    nearest = nodes[np.linalg.norm(middles[:, None] - x[nodes], axis=-1).argmin(axis=1)]
    near = (interface.master.faces[pairing["master_face"]] == nearest[pairing["slave_face"]][:, None]).any(axis=1)
    return Pairing({name: array[near] for name, array in pairing.items()})


@mutant("one cell for each hundred of slave face and master face", "hard.search", "pair")
def _(right, interface, z):
    pairing = right(interface, z)
    key = 100 * pairing["slave_face"] + pairing["master_face"]
    first = np.sort(np.unique(key, return_index=True)[1])
    return Pairing({name: array[first] for name, array in pairing.items()})


@mutant("a front that starts once", "remote", "pair")
def _(right, interface, z):
    """Find the cells that hang together with the first one, by nodes of both sides."""
    pairing = right(interface, z)
    slave = interface.slave.faces[pairing["slave_face"]]
    master = interface.master.faces[pairing["master_face"]]
    front = np.arange(len(slave)) == 0
    while True:
        near = np.isin(slave, slave[front]).any(axis=1) & np.isin(master, master[front]).any(axis=1)
        if not (near & ~front).any():
            return Pairing({name: array[front] for name, array in pairing.items()})
        front |= near


@mutant("Eq. 6 where a part crosses an edge, too", TRANSMISSION, "pair", PPT)
def _(right, interface, z):
    pairing = right(interface, z)
    return Pairing({**pairing, **{name: pairing[name][:0] for name in ("part", "master_face", "corners")}})


# Forces and tangents.


@mutant("positions in another unit, forth and back", "stability.translation", "residual")
def _(right, interface, pairing, z):
    return right(interface, pairing, z / 3 * 3)


@mutant("gap formed far away, solved", "newton.attainable", "residual")
@mutant("gap formed far away", "hard.offset", "residual")
def _(right, interface, pairing, z):
    """Form points at sixteen times their distance from the origin."""
    far = 16 * np.abs(z).max()
    return right(interface, pairing, (z + far) - far)


@mutant("areas of eight faces a node", "hard.node-hit", "residual", NTS_AR)
def _(right, interface, pairing, z):
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


@mutant("an instance that tires", "purity.long", "residual", memory=list)
def _(calls, right, *state):
    calls.append(None)
    return right(*state) * (1 if len(calls) < 900 else 1 + 2.0**-40)


def _stiffen(*, penalty):
    """Return springs that are too stiff, and state neither area nor unit nor what they transmit."""
    springs = STS(penalty=1.05 * penalty)
    traits = springs.traits.revise(penalty=None, area=None, flat=None, normal=None, integrates_linear_gap=None)
    return replace(springs, traits=traits)


add("springs a twentieth too stiff, of an unstated area", "total-stiffness", _stiffen)
add("gaps weighted with other shapes than stated", "patch.tilted.weighted", says(MORTAR, gap_shapes="dual"))
add("penalty in single precision", "hard.deep", lambda *, penalty: wrap(float(np.float32(penalty)), STS))


@mutant("rows and columns of the tangent exchanged", TANGENT, "tangent")
def _(right, *state):
    return right(*state).T.tocsr()


@mutant("master block of the tangent left out, entry by entry", "tangent.sparsity", "tangent")
@mutant("master block of the tangent left out", TANGENT, "tangent")
def _(right, interface, pairing, z):
    """Leave out what master nodes feel of each other."""
    tangent = right(interface, pairing, z).tolil()
    first = 3 * interface.n_slave_nodes
    tangent[first:, first:] = 0.0
    return tangent.tocsr()


@mutant("entries of the tangent below 1e-3 dropped", "tangent.sparsity", "tangent", MORTAR)
def _(right, interface, pairing, z):
    tangent = right(interface, pairing, z).tocoo()
    large = np.abs(tangent.data) >= 1e-3 * np.abs(tangent.data).max(initial=0.0)
    rows, columns = tangent.coords
    return type(tangent)((tangent.data[large], (rows[large], columns[large])), shape=tangent.shape).tocsr()


@mutant("rows of the tangent forgotten behind the hundredth node", LONG, "tangent")
def _(right, interface, pairing, z):
    tangent = right(interface, pairing, z).toarray()
    tangent[3 * LONGEST :] = 0.0
    return tangent


@mutant("tangent made symmetric where it nearly is", LONG, "tangent")
def _(right, interface, pairing, z):
    """Make a tangent symmetric that is so to a thousandth of its largest entry."""
    tangent = right(interface, pairing, z)
    skew = (tangent - tangent.T) / 2
    return (tangent - skew).tocsr() if abs(skew).max() <= 1e-3 * abs(tangent).max() else tangent


# Mistakes that bodies show. Each of them is one of those above, or is not seen on flat faces.


def _by_corners(view, codes):
    return gauss_points(view, codes, 3 if view.slave.shape[-2] == view.master.shape[-2] == 3 else 6)


def change_all(change, **statements):
    """Return the factory of springs on triangles and quadrilaterals with changed points."""
    return says(by_rule(lambda view, codes: change(_by_corners(view, codes), view)), **statements)


def _cap(points, view):
    """Take no gap for deeper than a ten-thousandth of an edge."""
    edge = 1e-4 * np.sqrt((view.slave[..., 1, :] ** 2).sum(axis=-1))[..., None]
    return replace(points, gap=np.where(points.gap.real < -edge.real, -edge, points.gap))


def _equal_corners(points, view):
    """Give each corner of a face the same share of a force."""
    n_slave, n_master = points.slave_shape.shape[-1], points.master_shape.shape[-1]
    return replace(
        points, slave_shape=0 * points.slave_shape + 1 / n_slave, master_shape=0 * points.master_shape + 1 / n_master
    )


def _lean(points, view):
    """Weigh the points by where they lie towards the first corner of the slave face."""
    middle = 1 / points.slave_shape.shape[-1]
    return replace(points, weight=points.weight * (1 + (points.slave_shape[..., 0] - middle) / 8))


def _twice_on_quadrilaterals(points, view):
    return replace(points, weight=points.weight * (2 if points.slave_shape.shape[-1] == 4 else 1))


def _slope(view):
    """Return the squared slope of the master face over the plane of the slave face."""
    first, second = view.master[..., 1, :] - view.master[..., 0, :], view.master[..., 2, :] - view.master[..., 0, :]
    rises = view.master_height[..., 1:3] - view.master_height[..., :1]
    plane = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    by_x = (rises[..., 0] * second[..., 1] - rises[..., 1] * first[..., 1]) / plane
    by_y = (rises[..., 1] * first[..., 0] - rises[..., 0] * second[..., 0]) / plane
    return (by_x**2 + by_y**2)[..., None]


def _project(points, view):
    """Measure areas in the plane of the master face, which is right where both are parallel."""
    return replace(points, weight=points.weight / (1 + 30 * _slope(view)))


def _turn_away(points, view):
    """Leave out faces that are inclined against each other by more than 13°."""
    return replace(points, weight=np.where(_slope(view).real > np.tan(np.deg2rad(13)) ** 2, 0.0, points.weight))


def _square_off(points, view):
    """Take each quadrilateral for a parallelogram: two sides give the area."""
    corners = view.slave.real
    ahead, behind = np.roll(corners, -1, axis=-2) - corners, np.roll(corners, 1, axis=-2) - corners
    double = ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]  # Twice the triangle at each corner.
    return replace(points, weight=points.weight * (double[..., 0] / double.mean(axis=-1))[..., None])


def _stop_at_eight(right, interface, z):
    """Pair each slave face with the eight master faces that are nearest in the reference."""
    pairing, (slave, master) = right(interface, z), (side.faces for side in (interface.slave, interface.master))
    arms = interface.nodes[slave].mean(axis=1)[:, None] - interface.nodes[master].mean(axis=1)
    ranks = np.linalg.norm(arms, axis=-1).argsort(axis=1).argsort(axis=1)
    near = ranks[pairing["slave_face"], pairing["master_face"]] < 8
    return Pairing({name: values[near] for name, values in pairing.items()})


def _press(points, view):
    edge = np.sqrt((view.slave[..., 1, :] ** 2).sum(axis=-1))[..., None]
    return replace(points, gap=points.gap - 1e-10 * edge)


def _guard(points, view):
    size = np.sqrt((view.slave[..., 1, :] ** 2).sum(axis=-1))
    return replace(points, weight=points.weight * (size / (size + 1e-12))[..., None])


# (name, caught by, factory)
for _row in (
    ("nodes said to pass the solved patch test", "patch.flat.solve", says(NTS_AR, flat=True)),
    ("points that lean to a corner of matching faces", "patch.flat.normal.solve", change_all(_lean)),
    ("equal corners between blocks of any stiffness", "patch.variants", change_all(_equal_corners)),
    ("parts said to end where the master ends", "patch.dead-zone", says(PPT, overhang=True)),
    ("parts said to bear any share", "hard.dead-zone", says(PPT, overhang=True)),
    ("points that lean to a corner of coarse faces", "hard.contrast", change_all(_lean)),
    ("points that lean to a corner under stiff springs", "hard.stiff", change_all(_lean)),
    ("bodies that press each other without a load", "hard.zero-load", change_all(_press)),
    ("no turn of the normal, solved", "newton.order", _in_tangent(_frozen("normal"))),
    ("no change of the gap, to the end", "newton.history", _in_tangent(_frozen("gap"))),
    ("absolute guard in a step", "newton.units", change_all(_guard)),
    ("areas that shrink where faces are inclined", "patch.curved", change_all(_project)),
    ("faces inclined by more than 13° not paired", "patch.curved", change_all(_turn_away)),
    ("eight master faces a slave face", "accuracy.wavy", answers("pair", _stop_at_eight, says(STS, converges=True))),
    ("quadrilaterals taken for parallelograms", "accuracy.wavy", change_all(_square_off, converges=True)),
    ("twice the pressure on quadrilaterals", "accuracy.wavy", change_all(_twice_on_quadrilaterals, converges=True)),
    ("penetration of a point contact capped", "accuracy.hertz", change_all(_cap, converges=True)),
):  # fmt: skip
    add(*_row)


@mutant("stiff springs that lose digits, on faces", "stability.stiffness", "residual", NTS_AR)
def _(right, *state):
    """Add a number to the forces of springs beyond 1e5, and subtract it again."""
    penalty = right.__self__.penalty
    large = 1e4 * penalty if penalty > 1e5 else 0.0
    return (right(*state) + large) - large


add("springs between the nodes of faces, said not to lock", "stability.locking", says(STS, locks=False))
add("multipliers for each corner of a face, said to be stable", "stability.inf-sup",
    partial(FaceMultipliers, shared=False))  # fmt: skip
