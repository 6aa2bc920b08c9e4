"""The contact points of a formulation on triangles in space, beside what is exact at their places."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases, random_source
from contactverif.contract.faces import TRIANGLE
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Interface
from contactverif.contract.subject import Subject
from contactverif.oracle.exact_faces import ExactFacePoints, FaceLattice, FaceView, covered_shares
from contactverif.strategies.surfaces import flat_surface_cases, surface_cases
from contactverif_properties.shared.exact_places import CELLS, CLOSEST, Reported, largest, name_places
from contactverif_properties.shared.passes import Pass

FLAT, TILTED = "flat faces", "tilted and warped faces"


@random_source("contactverif_properties.shared.face_places.projected_faces")
def projected_faces(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | None:
    """Return flat cases in space, and tilted and warped ones."""
    cases = {FLAT: flat_surface_cases(interface), TILTED: surface_cases(interface)}
    if interface is not None and interface.slave.faces.shape[1] + interface.master.faces.shape[1] > 2 * TRIANGLE:
        return None  # A foot on a quadrilateral is a root, and no exact number.
    return {kind: strategy for kind, strategy in cases.items() if strategy is not None}


ON_FACES = Cases.by_kind(projected_faces)


@dataclass(frozen=True, slots=True, eq=False)
class FacePlaces:
    """The points of a pass that name a place on a slave face and a master face, and what is exact there."""

    interface: Interface  # In the roles of the pass.
    lattice: FaceLattice
    reported: ContactPoints
    exact: ExactFacePoints
    view: FaceView  # Of the reported master face, by the rule of the formulation.
    # (n_points,) The length of which rounding is a share: 2 (L + |P − A| + D + |gap| D/h) Π ℓ/h over the cosine. L are
    # the longest edges of both faces, |P − A| is the way from the point to a corner. Rounding the corners of a face at
    # D turns it by D over its height h. Coordinates in a slave face of length ℓ and height h round a place by ℓ/h along
    # it, and the shape functions of the master face change over its own height. So the product is over both faces.
    scale: FloatArray
    carrier_height: FloatArray  # (n_points,) The height of the face whose normal is taken.
    # (n_points,) The weight over the square of the lengths, 1 at most. A corner of a cell is a quotient by the width of
    # the cell. So the error of a place counts by the area that it moves.
    share: FloatArray

    @classmethod
    def from_pass(cls, each: Pass, rule: str | None, distant: float) -> FacePlaces:
        """Return the places of a pass; `rule` is the trait `gap`, `distant` where points may be rounded, a length."""
        named = name_places(each.points) & (each.points.master_segment >= 0)
        points = each.points.select(named & ~each.points.weighted)
        lattice = FaceLattice.from_state(each.interface, each.z)
        exact = ExactFacePoints.at(lattice, points.slave_segment, points.slave_shape)
        view = FaceView.of_faces(lattice, exact, points.master_segment, closest=rule == CLOSEST)
        carriers = each.positions[each.interface.slave.faces[points.slave_segment]]
        slave_height = each.interface.slave.heights(each.positions)[points.slave_segment]
        carrier = view.heights if rule == CLOSEST else slave_height
        edges, gap = _longest_edges(view.corners), np.abs(view.gap.floats())
        slave_edges = _longest_edges(carriers)
        size = edges + slave_edges + np.linalg.norm(view.corners, axis=2).max(axis=1, initial=0.0)
        size += distant * (1 + gap / carrier)
        with np.errstate(divide="ignore"):
            slender = edges / view.heights * slave_edges / slave_height
            scale = 2 * size * slender / np.maximum(view.cosine, 0.0)
        share = np.minimum(np.abs(points.weight) / size**2, 1.0)
        return cls(each.interface, lattice, points, exact, view, scale, carrier, share)

    @property
    def depth_inside(self) -> FloatArray:
        """The depth of each foot (n_points,) inside its face, a length; negative outside."""
        depth: FloatArray = self.view.shape.floats().min(axis=1, initial=np.inf) * self.view.heights
        return depth

    @property
    def beside_border(self) -> BoolArray:
        """True for feet (n_points,) that may lie past the border of the master, by roundoff or more."""
        free = self.interface.master.neighbours[self.reported.master_segment] < 0
        past = self.view.shape.floats() * self.view.heights[:, None] <= 4 * UNIT_ROUNDOFF * self.scale[:, None]
        return np.asarray((np.roll(free, -1, axis=1) & past).any(axis=1))  # Edge b + 1 is opposite corner b.

    def closest_excess(self) -> FloatArray:
        """Return how much farther each point's face (n_points,) is than another one with a foot inside, a length."""
        n_master, n_points = len(self.lattice.master), len(self.reported.gap)
        point, face = np.divmod(np.arange(n_points * n_master), n_master)
        exact = ExactFacePoints(self.exact.place[point], self.exact.weight[point], self.exact.outward[point])
        view = FaceView.of_faces(self.lattice, exact, face, closest=True)
        rounding = 4 * UNIT_ROUNDOFF * self.scale[point] * (1 + _longest_edges(view.corners) / view.heights)
        inside = view.shape.floats().min(axis=1, initial=np.inf) * view.heights > rounding
        gap = np.where(inside, np.abs(view.gap.floats()), np.inf).reshape(n_points, n_master)
        excess: FloatArray = np.abs(self.view.gap.floats()) - gap.min(axis=1, initial=np.inf)
        return np.maximum(excess, 0.0)


def _longest_edges(corners: FloatArray) -> FloatArray:
    """Return the longest edge (n,) of faces with corners (n, n_corners, 3)."""
    longest: FloatArray = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0)
    return longest


def place_errors(case: Case, subject: Subject) -> tuple[list[float], bool]:
    """Return the largest errors of gap, foot, normal and position, and whether no point is active."""
    reported = Reported.from_case(case, subject)
    values = np.zeros(4)
    for each in reported.passes:
        places = FacePlaces.from_pass(each, subject.traits.rules.gap, reported.distant)
        points, view, facing = places.reported, places.view, np.isfinite(places.scale)
        edges = _longest_edges(view.corners)
        turned = 1 + reported.distant / places.carrier_height
        foot = np.abs(view.shape.errors(points.master_shape)).max(axis=1, initial=0.0) * edges
        normal = np.linalg.norm(view.normal.errors(points.normal), axis=1)
        errors = np.abs(view.gap.errors(points.gap)) / places.scale, foot / places.scale, normal / turned
        on_faces = [largest(_of_active(error, points)[facing]) for error in errors]
        values = np.maximum(values, [*on_faces, largest(_position_errors(each) / reported.state.largest_coordinate)])
    return values.tolist(), not reported.points.active.any()


def _position_errors(each: Pass) -> FloatArray:
    """Return the errors of the reported positions (n_points,) of all points that name a place, a length."""
    points = each.points.select(name_places(each.points))
    lattice = FaceLattice.from_state(each.interface, each.z)
    exact = ExactFacePoints.at(lattice, points.slave_segment, points.slave_shape)
    place = replace(exact.positions, below=exact.positions.below * lattice.scale)
    return _of_active(np.abs(place.errors(points.position)).max(axis=1, initial=0.0), points)


def _of_active(errors: FloatArray, points: ContactPoints) -> FloatArray:
    """Return errors, with 0 in place of NaN where a point is idle."""
    return np.where(np.isnan(errors) & ~points.active, 0.0, errors)


def face_errors(case: Case, subject: Subject) -> tuple[float, str, bool]:
    """Return the largest excess of a distance over its scale, how the contract is broken, and whether all is idle."""
    reported = Reported.from_case(case, subject)
    rule, value, broken = subject.traits.rules.gap, 0.0, ""
    for each in reported.passes:
        places = FacePlaces.from_pass(each, rule, reported.distant)
        counted = places.view.faces_it
        if rule == CLOSEST:
            excess = places.closest_excess()
        else:
            excess = np.where(places.beside_border, 0.0, np.maximum(-places.depth_inside, 0.0)) * places.share
        value = max(value, largest((excess / places.scale)[counted]))
        if (places.reported.active & ~counted & (places.share > 4 * UNIT_ROUNDOFF)).any():
            broken = "a master face does not face the slave face of its point"
    return value, broken, not reported.points.active.any()


def count_decisions(reported: Reported) -> tuple[int, int]:
    """Return how many decisions for contact are wrong in a state, and how many points are decided."""
    wrong = decided = 0
    for each in reported.passes:
        places = FacePlaces.from_pass(each, reported.traits.rules.gap, reported.distant)
        points, gap = places.reported, places.view.gap.floats()
        certain = places.view.faces_it & (points.weight != 0) & (np.abs(gap) > 4 * UNIT_ROUNDOFF * places.scale)
        certain &= places.depth_inside > 4 * UNIT_ROUNDOFF * places.scale
        weighted = each.points.select(each.points.weighted)
        sure = np.abs(weighted.gap) > 4 * UNIT_ROUNDOFF * (reported.state.diameter + reported.distant)
        wrong += int((certain & (points.active != (gap < 0))).sum())
        wrong += int((sure & (weighted.active != (weighted.gap < 0))).sum())
        decided += int(certain.sum()) + int(sure.sum())
    return wrong, decided


def area_error(each: Pass, rule: str | None, areas: FloatArray, distant: float) -> float:
    """Return the error of the sums of weights over the scale of areas, face by face where points lie on one.

    The slave faces have the areas (n_faces,) in the configuration of the trait `area`. An area is a product of lengths
    of which each is rounded at D, so its scale is L D; on needles the longest edge is more than √A.
    """
    points, whole = each.points.select(name_places(each.points)), float(areas.sum())
    length = max(sqrt(whole), float(_longest_edges(each.positions[each.interface.slave.faces]).max()))
    scale = len(areas) * length * (length + distant)
    if rule is None:
        return (float(points.weight.sum()) - whole) / scale
    if rule == CLOSEST:
        return _missing_or_excess(points, whole, covered=_are_all_nodes(each, points)) / scale
    shares = np.array([float(share) for share in covered_shares(FaceLattice.from_state(each.interface, each.z))])
    if (shares > 1).any():  # Master faces lie behind one another.
        return 0.0
    if rule not in CELLS:
        return _missing_or_excess(points, whole, covered=bool((shares == 1).all())) / scale
    expected, sums = shares * areas, np.bincount(points.slave_segment, points.weight, len(areas))
    errors = sums - expected
    return abs(float(errors.sum())) / scale if points.weighted.any() else float(np.abs(errors).max()) / scale


def _missing_or_excess(points: ContactPoints, area: float, *, covered: bool) -> float:
    """Return how much weights (n_points,) are more than an area, or also less where all of it is covered."""
    excess = float(points.weight.sum()) - area
    return abs(excess) if covered else max(excess, 0.0)


def _are_all_nodes(each: Pass, points: ContactPoints) -> bool:
    """Return whether the points are the slave nodes, all of them."""
    corners = each.interface.slave.faces[points.slave_segment, points.slave_shape.argmax(axis=1)]
    whole = (points.slave_shape == 1).any(axis=1).all()
    return bool(whole) and len(np.unique(corners)) == each.interface.n_slave_nodes
