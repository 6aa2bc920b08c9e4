"""The exact forces of a uniform pressure on a flat interface, and of a linear gap on a straight slave; the worst force.

A formulation measures the gap along the master's normal or along the slave's, and pushes along one of them. Its traits
`gap` and `force_along` say which. Gaps are computed in rationals from the stored nodes.
"""

from fractions import Fraction
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import PLANE, QUADRILATERAL, Interface, Surface
from contactverif.contract.property import Finding, Measurement, Quantity
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.contract.traits import Traits
from contactverif.oracle.flat_answers import uniform_pressure_weights, uniform_surface_weights
from contactverif.problems.flat_states import overhangs
from contactverif_properties.roundoff import COORDINATE_ROUNDING, gap_quantity, gap_tolerance
from contactverif_properties.states import FrozenState

COMPONENTS = {2: "x and y", 3: "x, y and z"}  # The components of a vector in words, by their number.
_ASIDE = 2.0**-20  # The part of a force that may point aside by roundoff if both lie on one line.


def worst_force(
    interface: Interface, forces: FloatArray, exact: FloatArray, names: tuple[str, str] = ("force", "exact")
) -> Finding:
    """Return the force at the node where it errs most, beside the exact one, in the words of `names`.

    The forces (n, dim) push all nodes, or those of the slave alone. If both lie on one line, the finding has two
    numbers, counted along the exact force, with their ratio; else the components of both.
    """
    node = int(np.linalg.norm(forces - exact, axis=1).argmax())
    return show_force(describe_node(interface, node), forces[node], exact[node], names)


def show_force(
    place: str, force: FloatArray, right: FloatArray, names: tuple[str, str] = ("force", "exact")
) -> Finding:
    """Return a force beside the one that is right: one number of each, and their ratio, if they lie on one line."""
    line = right if right.any() else force
    direction = line / np.linalg.norm(line)
    aside = distance_from_line(force, direction)
    if not aside <= _ASIDE * float(np.abs(np.stack([force, right])).max()):
        return Finding(f"{place}, {COMPONENTS[len(force)]}", tuple(force), tuple(right), "N", *names)
    along, size = float(force @ direction), float(right @ direction)
    remark = f"ratio {along / size:.4g}" if size else ""
    if remark == "ratio 1" and along != size:  # Four digits do not say by how much they differ.
        difference = (along - size) / size
        remark = f"{remark} {'+' if difference > 0 else '−'} {abs(difference):.2g}"
    return Finding(place, (along,), (size,), "N", *names, remark)


def distance_from_line(force: FloatArray, direction: FloatArray) -> float:
    """Return the part of a force (dim,) across a unit vector (dim,)."""
    if len(force) == PLANE:
        return abs(float(force[0] * direction[1] - force[1] * direction[0]))
    return float(np.linalg.norm(np.cross(force, direction)))


def describe_node(interface: Interface, node: int) -> str:
    """Return the side and the number of a node in words, and whether it is at a free end."""
    on_slave = node < interface.n_slave_nodes
    surface = interface.slave if on_slave else interface.master
    at_border = surface.neighbours < 0
    if interface.dim != PLANE:  # A border edge runs from its corner to the next one.
        at_border = at_border | np.roll(at_border, 1, axis=1)
    border = "(free end)" if interface.dim == PLANE else "(border)"
    return f"{'slave' if on_slave else 'master'} node {node}{f' {border}' if node in surface.faces[at_border] else ''}"


def normal_of(case: Case) -> FloatArray:
    """Return the unit normal (dim,) out of the master of a flat case: in the plane, to the left of the slave's way."""
    if case.interface.dim != PLANE:
        return case.parameters["normal"]
    along = case.parameters["direction"]
    return np.array([-along[1], along[0]])


def gap_error(case: Case, penetration: float, size: float) -> float:
    """Return by how much a node departs from a plane slave at `penetration` below a plane master, over `size`.

    A slave node beside the master stands for the place opposite the master's end, since what overhangs may bend.
    """
    heights = case.positions @ normal_of(case)
    n_slave = case.interface.n_slave_nodes
    if case.interface.dim == PLANE:
        slave, master = np.split(case.parameters["along"], [n_slave])
        order, places = np.argsort(slave), np.clip(slave, master.min(), master.max())
        heights[:n_slave] = np.interp(places, slave[order], heights[:n_slave][order])
    level = heights[n_slave:].mean()
    errors = np.abs(heights - level + np.where(np.arange(len(heights)) < n_slave, penetration, 0.0))
    return float(errors.max() / size)


def push_apart(case: Case, weights: FloatArray, pressure: float) -> FloatArray:
    """Return the forces (n_nodes, dim) of a pressure over weights (n_nodes,), which push the two bodies apart."""
    sides = np.where(np.arange(len(weights)) < case.interface.n_slave_nodes, 1.0, -1.0)
    return pressure * (sides * weights)[:, None] * normal_of(case)


def consistent_forces(case: Case, pressure: float) -> FloatArray:
    """Return the forces (n_nodes, dim) by which a uniform pressure pushes the nodes of a flat case, exactly.

    They are p ∫N_i over the part of the line that both surfaces cover, in rationals. The parameters `along` (n_nodes,)
    and `direction` (2,) say where the nodes lie on the line. In space `plane` (n_nodes, 2) says where they lie, and
    `domain` is what both surfaces cover.
    """
    if case.interface.dim != PLANE:
        plane, domain = case.parameters["plane"], case.parameters["domain"]
        return push_apart(case, uniform_surface_weights(case.interface, plane, domain), pressure)
    return push_apart(case, uniform_pressure_weights(case.interface, case.parameters["along"]), pressure)


def forces_of_penetration(case: Case) -> FloatArray:
    """Return the consistent forces (n_nodes, dim) of the pressure ε̂ |g| of a flat case with a uniform penetration."""
    return consistent_forces(case, case.penalty * case.parameter("penetration"))


def uniform_state(case: Case, subject: Subject, pressure: float | None = None) -> FrozenState:
    """Return the formulation in the state of a case; multipliers, if any, are all the pressure, ε̂ |g| by default."""
    if pressure is None:
        pressure = case.penalty * case.parameter("penetration")
    return FrozenState.with_multiplier(subject.for_case(case), case, pressure)


def pushing_forces(state: FrozenState) -> FloatArray:
    """Return the forces (n_nodes, dim) that push the nodes; of multipliers, if there are any, theirs alone."""
    if state.case.n_multipliers:
        return -(unit_forces(state) @ state.case.multipliers).reshape(state.case.interface.nodes.shape)
    return -state.forces


def forces_of_gap(case: Case, subject: Subject, exact: FloatArray) -> tuple[FloatArray, float]:
    """Return the forces (n_nodes, dim) of a state that penetrates uniformly, to be compared with the exact ones.

    With multipliers only the distribution of the forces can be right or wrong, and not their size. Uniform multipliers
    count if they are pressures, scaled to the exact total. If they are nodal forces, those count that come nearest to
    the exact forces. The second number is the largest multiplier over the mean one, by which roundoff grows; it is 1
    without nodal multipliers. Of a barrier, whose law is its own, the forces are scaled to the exact total, too.
    """
    state = uniform_state(case, subject)
    n = case.interface.n_slave_nodes
    if subject.traits.rules.enforcement == "barrier":
        return _scale_to_total(-state.forces, exact, n), 1.0
    if not state.case.n_multipliers:
        return -state.forces, 1.0
    transfer = -unit_forces(state)
    if subject.traits.rules.penalty == "nodal":
        multipliers = np.linalg.lstsq(transfer, exact.reshape(-1), rcond=None)[0]
        mean = float(np.abs(multipliers).mean())
        largest = float(np.abs(multipliers).max()) / mean if mean > 0 else 1.0
        return (transfer @ multipliers).reshape(exact.shape), largest
    return _scale_to_total((transfer @ state.case.multipliers).reshape(exact.shape), exact, n), 1.0


def _scale_to_total(forces: FloatArray, exact: FloatArray, n_slave: int) -> FloatArray:
    """Return forces (n_nodes, dim) times the factor with which those on the slave press as the exact ones do."""
    total, exact_total = forces[:n_slave].sum(axis=0), exact[:n_slave].sum(axis=0)
    projection = float(total @ exact_total)
    return forces * (float(exact_total @ exact_total) / projection if projection > 0 else 1.0)


MOMENT = gap_quantity("error of the first moments")
MOST_SKEWED = 1e-2
SKEWED = Quantity(
    "error of a nodal force on a skewed quadrilateral",
    f"{MOST_SKEWED:g}",
    "Shape functions are no polynomials there. A rule of degree 2 on each cell errs by less, whatever the angles.",
)


def measure_transmission(quantity: Quantity, case: Case, subject: Subject) -> Measurement:
    """Measure the largest |F − F_exact| of a uniform penetration over the force on the slave.

    In space it counts over the largest exact force on a node, which is the larger share of meshes with more nodes.
    The tolerance is `GAP_TOLERANCE`, times the largest nodal multiplier over the mean one. On quadrilaterals that are
    no parallelograms it is `MOST_SKEWED`, and the moments Σ N_i x_i are measured, which are exact for every rule.
    """
    exact = forces_of_penetration(case)
    if case.interface.dim == PLANE:
        size = float(np.linalg.norm(exact[: case.interface.n_slave_nodes].sum(axis=0)))
    else:
        size = float(np.linalg.norm(exact, axis=1).max())
    forces, largest = forces_of_gap(case, subject, exact)
    error = float(np.linalg.norm(forces - exact, axis=1).max())
    tolerance = gap_tolerance(case, case.parameter("penetration")) * largest
    numbers = [quantity.check(error / size, tolerance)]
    if case.interface.dim != PLANE and is_skewed(case):
        numbers = [MOMENT.check(_moment_error(case, forces), tolerance), SKEWED.check(error / size, MOST_SKEWED)]
    failed = any(number.ratio > 1 for number in numbers)
    return Measurement(numbers, finding=worst_force(case.interface, forces, exact) if failed else None)


def is_skewed(case: Case) -> bool:
    """Return whether a quadrilateral of a flat case is no parallelogram."""
    sides = (case.parameters["plane"][side.faces] for side in (case.interface.slave, case.interface.master))
    return any((at[:, 0] + at[:, 2] != at[:, 1] + at[:, 3]).any() for at in sides if at.shape[1] == QUADRILATERAL)


def _moment_error(case: Case, forces: FloatArray) -> float:
    """Return the largest error of ΣF and ΣF x on either side, over the total and the size of the domain.

    Shape functions add up to 1 and interpolate the place, so that both are exact wherever areas and centroids are.
    """
    domain, n_slave = case.parameters["domain"], case.interface.n_slave_nodes
    places = (case.parameters["plane"] - domain.mean(axis=0)) / np.ptp(domain, axis=0)
    total = case.penalty * case.parameter("penetration") * np.prod(np.ptp(domain, axis=0))
    pushes = forces @ normal_of(case) / total
    pushes[n_slave:] *= -1
    sums = np.column_stack([np.ones(len(places)), places]) * pushes[:, None]
    errors = (np.abs(part.sum(axis=0) - [1, 0, 0]).max() for part in np.split(sums, [n_slave]))
    return float(max(errors))


def unit_forces(state: FrozenState) -> FloatArray:
    """Return what a unit of each multiplier adds to the position rows of the residual (n_unknowns, n_multipliers).

    On a frozen pairing the residual is affine in the multipliers. What it holds without any multiplier, as that of an
    augmented Lagrangian does, is subtracted. The formulation is asked with multipliers as large as those of the case,
    rounded to a power of two: roundoff would hide a unit beside a large penalty force.
    """
    case = state.case
    n, count = case.interface.n_unknowns, case.n_multipliers
    largest = float(np.abs(case.multipliers).max(initial=0.0))
    size = 2.0 ** round(np.log2(largest)) if largest > 0 else 1.0
    multipliers = np.vstack([size * np.eye(count), np.zeros(count)])
    states = np.hstack([np.broadcast_to(case.z[:n], (count + 1, n)), multipliers])
    forces = state.residual_at(states)[:, :n]
    return np.asarray((forces[:-1] - forces[-1]).T / size)


def exact_multipliers(case: Case, subject: Subject, formulation: CheckedFormulation, pressure: float) -> FloatArray:
    """Return the multipliers (n_multipliers,) that stand for a uniform pressure in the exact state of the case.

    They are the pressure itself where it gives the exact forces. Else they are the multipliers ≥ 0 that come nearest to
    those. A multiplier that transmits nothing, as that of a node that faces nothing, is 0.
    """
    state = FrozenState.with_multiplier(formulation, case, pressure)
    uniform, transfer = state.case.multipliers.copy(), -unit_forces(state)
    exact = consistent_forces(case, pressure).reshape(-1)
    from scipy.optimize import nnls  # It takes long to import, and the first rows of a run do not need it.

    nearest: FloatArray = nnls(transfer, exact)[0]  # The formulation would release one below 0.
    if subject.traits.rules.penalty != "nodal":
        uniform[~transfer.any(axis=0)] = 0.0
        errors = [float(np.abs(transfer @ candidate - exact).max()) for candidate in (uniform, nearest)]
        if errors[0] <= max(2 * errors[1], 1e-12 * float(np.abs(exact).max())):
            return uniform
    return nearest


ALONG_MASTER = ("closest point", "cells and nodes")  # The rules `gap` that measure along the master's normal.


def knows_linear_total(traits: Traits) -> bool:
    """Return whether the traits say what the total force of a linear gap is."""
    stated = traits.rules.penalty == "distributed" and None not in (traits.rules.area, traits.rules.force_along)
    stated = stated and not traits.rules.own_law
    return stated and (traits.rules.gap is not None or traits.rules.enforcement == "multiplier")


def slave_forces(case: Case, subject: Subject) -> FloatArray:
    """Return the forces (n_slave_nodes, dim) that push the slave; multipliers are all `uniform_multiplier`."""
    return pushing_forces(uniform_state(case, subject, uniform_multiplier(case)))[: case.interface.n_slave_nodes]


def uniform_multiplier(case: Case) -> float:
    """Return the pressure of a mean gap along the master's normal, ε̂ |g|."""
    return case.penalty * abs(float(node_gaps(case).mean()))


def node_gaps(case: Case) -> FloatArray:
    """Return the gaps (n_slave_nodes,) of the slave's nodes along the master's normal, each rounded once."""
    corners = _largest_part(case, case.interface.master)
    normal = _normal(corners)  # All master segments or faces lie on its line or plane.
    heights = (_exact(case.positions[: case.interface.n_slave_nodes]) - corners[0]) @ normal
    return np.array([float(height) for height in heights]) / sqrt(normal @ normal)


def directions(case: Case) -> tuple[FloatArray, FloatArray]:
    """Return the unit normals (dim,) along the master's and along the slave's, both out of the master."""
    slave, in_plane = case.interface.slave, case.interface.dim == PLANE
    on_slave = _exact(case.positions[slave.segments[0]]) if in_plane else _largest_part(case, slave)
    normals = map(_normal, (_largest_part(case, case.interface.master), on_slave))
    of_master, of_slave = (np.array([float(entry) for entry in each]) / sqrt(each @ each) for each in normals)
    return of_master, -of_slave


def exact_slave_forces(case: Case, traits: Traits) -> FloatArray:
    """Return the exact integrals ε̂ ∫N_i |g| ds n (n_slave_nodes, dim) that push the slave's nodes.

    The traits `gap` and `force_along` name the normals, `area` the configuration of ds. With multipliers the pressure
    is `uniform_multiplier` everywhere. The sum is the total of every formulation with these traits.
    """
    depths, direction = _depths(case, traits)
    pressures = case.penalty * depths
    if traits.rules.enforcement == "multiplier":
        pressures = np.full_like(pressures, uniform_multiplier(case))
    return np.outer(shape_integrals(case, traits) @ pressures, direction)


def weighted_forces(case: Case, traits: Traits) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return ∫φ_j |g| (n_slave_nodes,), p_j = ε̂ ∫φ_j |g| / ∫φ_j, and the forces ∫N_i Σ ψ_j p_j n on slave nodes.

    The traits `gap_shapes` and `pressure_shapes` say what φ_j and ψ_j are; all else is as for `exact_slave_forces`.
    """
    standard, (depths, direction) = shape_integrals(case, traits), _depths(case, traits)
    areas = standard.sum(axis=1)
    integrals = {"standard": standard, "dual": np.diag(areas)}  # ∫ψ_i N_j ds is 0 for i ≠ j.
    gaps = integrals[traits.rules.gap_shapes or ""] @ depths
    pressures = case.penalty * gaps / areas
    return gaps, pressures, np.outer(integrals[traits.rules.pressure_shapes or ""] @ pressures, direction)


# ∫N_i N_j over a parallelogram of area 1. Over a segment it is 1/6, over a triangle 1/12, and twice that for i = j.
_IN_PARALLELOGRAM = np.array([[4, 2, 1, 2], [2, 4, 2, 1], [1, 2, 4, 2], [2, 1, 2, 4]]) / 36


def shape_integrals(case: Case, traits: Traits) -> FloatArray:
    """Return ∫N_i N_j ds of the linear shapes of slave nodes; the trait `area` names the configuration of ds."""
    interface = case.interface
    measures = interface.slave.measures(interface.nodes if traits.rules.area == "reference" else case.positions)
    faces, corners = interface.slave.faces, interface.slave.faces.shape[1]
    shares = _IN_PARALLELOGRAM if corners == QUADRILATERAL else (1 + np.eye(corners)) / (corners * (corners + 1))
    integrals = np.zeros((interface.n_slave_nodes, interface.n_slave_nodes))
    np.add.at(integrals, (faces[:, :, None], faces[:, None]), measures[:, None, None] * shares)
    return integrals


def _depths(case: Case, traits: Traits) -> tuple[FloatArray, FloatArray]:
    """Return |g| (n_slave_nodes,) along the stated normal, and the direction (dim,) in which contact pushes."""
    of_master, of_slave = directions(case)
    cosine = 1.0 if traits.rules.gap in ALONG_MASTER else float(of_master @ of_slave)
    return -node_gaps(case) / cosine, of_master if traits.rules.force_along == "master normal" else of_slave


def _largest_part(case: Case, surface: Surface) -> NDArray[Any]:
    """Return the exact ends or corners (n_corners, dim) of the longest segment, or the largest face, of a surface."""
    return _exact(case.positions[surface.faces[int(np.argmax(surface.measures(case.positions)))]])


def _normal(corners: NDArray[Any]) -> NDArray[Any]:
    """Return an exact normal (dim,) of a segment or of a flat face, of any length, out of its body."""
    if corners.shape[1] != PLANE:
        return np.cross(*(corners[1:3] - corners[0]))
    x, y = corners[1] - corners[0]
    return np.array([y, -x])


def _exact(points: FloatArray) -> NDArray[Any]:
    return np.array([Fraction(value) for value in points.reshape(-1).tolist()], dtype=object).reshape(points.shape)


def point_errors(state: FrozenState, penalty: float, pressure: float) -> tuple[float, float]:
    """Return the largest error of a reported gap over p/ε̂, and of a reported pressure over p.

    Idle points do not count if they have no weight, no master segment, or lie beside the master. The error of the
    pressure is infinite if no point counts.
    """
    points = state.points
    in_contact = points.active | (points.master_segment >= 0) & ~_beside_master(state.case, points)
    counted = (points.weight != 0) & in_contact
    gaps = np.where(counted, points.gap, -pressure / penalty)  # A gap is NaN where it is meaningless.
    gap = float(np.nanmax(np.abs(gaps * penalty / pressure + 1), initial=0.0))
    pressures = np.where(points.active, points.pressure, 0.0)[counted]
    return gap, float(np.abs(pressures - pressure).max(initial=0.0) / pressure) if len(pressures) else np.inf


def _beside_master(case: Case, points: ContactPoints) -> BoolArray:
    """Return which points (n_points,) lie beside the other surface, or within roundoff of its end; none in space."""
    beside = np.zeros(len(points.c), bool)
    if case.interface.dim != PLANE:
        return beside
    covered = not overhangs(case)
    rounding = COORDINATE_ROUNDING * case.largest_coordinate
    interface, along = case.interface, case.parameters["along"]
    for surface, other, second in (
        (interface.slave, interface.master, False),
        (interface.master, interface.slave, True),
    ):
        here = (points.on_master == second) & (points.slave_segment >= 0)
        if here.any() and (second or not covered):
            ends, c = along[surface.segments[points.slave_segment[here]]], points.c[here]
            place = (1 - c) / 2 * ends[:, 0] + (1 + c) / 2 * ends[:, 1]
            beside[here] = ~_faces(place, other, along, rounding)
    return beside


def _faces(place: FloatArray, surface: Surface, along: FloatArray, rounding: float) -> BoolArray:
    """Return which places (n,) along the interface a surface covers, up to `rounding` from its free ends."""
    ends = along[surface.segments]  # (n_segments, 2)
    inwards = np.sign(ends[:, ::-1] - ends)
    ends = ends + np.where(surface.neighbours < 0, rounding, -rounding) * inwards
    low, high = ends.min(axis=1), ends.max(axis=1)
    return np.asarray(((place[:, None] >= low) & (place[:, None] <= high)).any(axis=1))
