"""Multipliers: their sign, their scale, whether they are unique, and whether the bodies resist all of them."""

from functools import partial
from typing import Any

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case, Cases, random_source
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.mechanics.inf_sup import inf_sup_constant
from contactverif.mechanics.linear import RANK_ROUNDOFF, scale_factors
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.problems.refined_blocks import refinement_cases, refinement_space_cases, refinements
from contactverif.strategies.solids import block_cases, dead_zone_cases, solid_cases
from contactverif_properties.applicability import refuse_dependent_multipliers, refuse_unstated
from contactverif_properties.newton_method import find_solution, is_untouched, solution_details, solution_floor
from contactverif_properties.patch_solved import exact_solution

COVERED, OVERHANG = "covered", "overhang"
SCALE_RATIO = 8.0  # The first scale c over the second one.
TOLERANCE = "max(1e3 u/cond, 30 u X)/ℓ"
TENSION = Quantity(
    "largest tension of a multiplier",
    TOLERANCE,
    "A negative multiplier is released. It is measured as the length that changes the forces by as much. "
    "The linear system is solved to 1e3 u/cond, and positions are rounded to 30 u X.",
)
CHANGE = Quantity(
    "change with another scale c",
    TOLERANCE,
    "The scale of the decision λ − c g ≥ 0 does not change a solution. "
    "The linear system is solved to 1e3 u/cond, and positions are rounded to 30 u X.",
)
REDUNDANT = Quantity(
    "redundant multipliers",
    "0",
    "A dependent constraint leaves a zero singular value, which is below 8 n u of the largest one for n unknowns.",
)


_define = partial(Property.define, asks=frozenset({"multiplier"}), bodies=True)


@_define(
    id="complementarity",
    rank=450,
    family="multipliers",
    quantities=(TENSION, CHANGE),
    cases=Cases.random(solid_cases),
    promise=lambda traits: (
        True if traits.rules.enforcement == "multiplier" and not refuse_dependent_multipliers(traits) else None
    ),
    applicable=refuse_dependent_multipliers,
)
def complementarity(case: Case, subject: Subject) -> Measurement:
    """All multipliers of a solution press, and the scale of the contact decision does not change the solution.

    **Question.** A tilted block is pressed on another, in many cases so that contact ends inside the interface. In the
    solution, is every multiplier λ ≥ 0? Does the same solution follow with another scale c of the decision λ − c g ≥ 0?

    **Why it matters.** A multiplier that pulls is adhesion, which frictionless contact does not have. A solution that
    depends on c depends on a number that the user sets for the solver's sake.

    **How it is judged.** The first number is the most negative multiplier, the second is how far positions and
    multipliers move if contact is decided with c/8. Both are lengths over ℓ; a multiplier counts as the length that
    changes the forces by as much. The tolerance is max(1e3 u/cond, 30 u X)/ℓ: what the linear system is solved to, and
    what positions are rounded to.

    **Undecided.** Where Newton's method finds no solution, or the matrix has no inverse at the solution.
    """
    scene = scene_of(case)
    system = System(scene, subject.for_case(case))
    trace = find_solution(system)
    details = solution_details(trace)
    if not trace.converged:
        return Measurement(details=details, undecided=f"Newton found no solution: {trace.end.label}")
    solution, n_free = trace.u[-1], scene.n_free
    matrix, _ = system.matrix(solution, trace.pairing)
    condition = system.step(matrix, np.zeros(system.size)).condition
    if condition <= 0:
        return Measurement(details=details, undecided="the matrix has no inverse at the solution")
    units, length = scale_factors(matrix, n_free)[1], case.shortest_segment
    floor = solution_floor(scene, solution, units, condition) / length
    lengths: FloatArray = solution / units / length
    values = {TENSION: float(np.maximum(-lengths[n_free:], 0.0).max(initial=0.0))}
    rescaled = subject.with_penalty(subject.penalty(case) / SCALE_RATIO)
    again = solve(scene, rescaled, start=solution)
    if again.converged:
        values[CHANGE] = float((np.abs(again.u[-1] - solution) / units).max()) / length
    details |= {"converged with another scale": float(again.converged)}
    measurement = Measurement(check_all(values, floor), details=details, idle=is_untouched(trace))
    return measurement.after(f"solved again with c/{SCALE_RATIO:g}", CHANGE)


@random_source("contactverif_properties.multipliers.covered_and_overhanging_cases")
def covered_and_overhanging_cases(scene: Case | None = None) -> dict[str, SearchStrategy[Case]]:
    """Return blocks under a uniform pressure: half on a master as wide, half with slave nodes that see nothing."""
    kinds = {COVERED: block_cases(scene), OVERHANG: dead_zone_cases(scene)}
    return {kind: cases for kind, cases in kinds.items() if cases is not None}


@_define(
    id="multipliers.rank",
    rank=480,
    quantities=(REDUNDANT,),
    cases=Cases.random(covered_and_overhanging_cases),
    kinds=(COVERED, OVERHANG),
    promise=lambda traits: traits.promises.independent_multipliers,
)
def multiplier_rank(case: Case, subject: Subject) -> Measurement:
    """The constraints are independent, so that the multipliers are unique.

    **Question.** In the exact solution of two blocks under a uniform pressure, how many multipliers are redundant? In
    half of the cases the slave overhangs the master, by one node or more that see nothing.

    **Why it matters.** A redundant constraint makes the matrix singular. A solver then stops, or returns multipliers
    (the contact pressures) that are arbitrary. A node that sees nothing needs a row that sets its multiplier to 0: if
    the row is 0 = 0, the first interface with an overhang cannot be solved.

    **How it is judged.** The measured number counts the zero singular values of the saddle-point matrix. The tolerance
    is 0. A singular value counts as zero below 8 n u times the largest one, for n unknowns. A slave of which no point
    sees the master may move freely, which is no fault of a multiplier: motions that no row resists are not counted.

    **Undecided.** Never.

    **Source.** Section 6.3 of Zavarise & De Lorenzis (2009) leaves the question open for VTS-PPT. With eight slave
    segments on two master segments, seven of its sixteen multipliers are redundant.
    """
    scene, formulation = scene_of(case), subject.for_case(case)
    system, u = System(scene, formulation, use_tangent=False), exact_solution(scene, case, subject, formulation)
    matrix, floor = system.matrix(u, system.pair(u))
    step = system.step(matrix, np.zeros(system.size), floor)
    redundant = step.deficiency - (_count_free_motions(matrix, scene.n_free) if step.deficiency else 0)
    details = {"multipliers": float(system.n_multipliers)}
    return Measurement([REDUNDANT.check(float(redundant), 0.0)], details=details)


def _count_free_motions(matrix: Any, n_positions: int) -> int:
    """Return how many motions of the bodies no row (n,) of a saddle-point matrix resists, neither force nor gap."""
    rows, columns = scale_factors(matrix, n_positions)
    scaled = rows[:, None] * dense(matrix) * columns
    least = RANK_ROUNDOFF * len(scaled) * UNIT_ROUNDOFF * np.linalg.norm(scaled, 2)
    return int((np.linalg.svd(scaled[:, :n_positions], compute_uv=False) <= least).sum())


MOST_SLOPE = 0.1
# The names of the series, which have a number for each mesh.
CONSTANT, SEGMENT, ZERO_COUNT, MULTIPLIER_COUNT = "inf-sup constant", "slave segment", "zero eigenvalues", "multipliers"
N_FITTED = 3  # The finest meshes: on coarse ones the ends of the interface count as much as its inside.
ZEROS = Quantity(
    "pressures that move nothing",
    "0",
    "Of such a pressure nothing says how large it is. A singular value below √u of the largest one counts as zero.",
)
SLOPE = Quantity(
    "slope of log β against log h",
    "0.1",
    "A constant has a slope of 0, and constraints that a mesh cannot follow have a slope of 1.",
)


@_define(
    id="stability.inf-sup",
    rank=490,
    quantities=(ZEROS, SLOPE),
    series={CONSTANT: "1", SEGMENT: "length", ZERO_COUNT: "1", MULTIPLIER_COUNT: "1"},
    cases=Cases.from_list(refinement_cases),
    cases_in_space=Cases.from_list(refinement_space_cases),
    promise=lambda traits: traits.promises.inf_sup,
    applicable=lambda traits: refuse_unstated(traits, "penalty"),
)
def inf_sup(case: Case, subject: Subject) -> Measurement:
    """The bodies resist every pressure of the multipliers, as much on a fine mesh as on a coarse one.

    **Question.** Two blocks touch. How much does a pressure of unit size move them, if it is the one that moves them
    least? Does that number β stay above zero as both meshes are refined?

    **Why it matters.** Existence, uniqueness and convergence of the pressures rest on it: it is the inf-sup condition
    of Ladyzhenskaya, Babuška and Brezzi. Where β falls, pressures oscillate from point to point, and a finer mesh makes
    it worse. Where β is zero, there is a pressure that moves nothing, and so nothing decides how large it is. With a
    penalty in place of multipliers, the same constraints lock as the penalty grows (`stability.locking`).

    **How it is judged.** B are the rows of the formulation where both bodies touch, S the condensed stiffness of both,
    A the areas of the multipliers, and h the mean slave segment: B S⁻¹ Bᵀ λ = β² h A λ / E. There are three families of
    five meshes each: a slave that is coarser than the master (2:3), a finer one (3:2), and nodes on nodes. Rows of
    forces and rows of gaps are derived from the residual. Where they differ, the smaller β counts.

    The first number counts the eigenvalues that are zero; the tolerance is 0. They are then left out. The second number
    is the slope of log β against log h, fitted to the three finest meshes. β falls with h if it is positive. The
    tolerance is 0.1: a constant has a slope of 0, and constraints that a mesh cannot follow have a slope of 1. NTS,
    mortar and dual mortar have less than 0.001 on all families.

    In space h is the root of the mean slave face. Each family has three meshes of cubes, or of cubes cut into
    tetrahedra, as wide as two faces of the coarser side. The sides do not move sideways and so mirror the blocks: what
    moves nothing here moves nothing in a wide block. Mortar and dual mortar have slopes of −0.04 to 0.004. A pressure
    for each corner of each face has zeros on all families, and a slope of 0.87 on a coarser slave.

    **Undecided.** Never.

    **Source.** Section 6.3 of Zavarise & De Lorenzis (2009) leaves open whether VTS-PPT satisfies the condition. It
    does not: with two virtual slave nodes a segment, β falls like h on a coarser slave, and a third of all pressures
    move nothing on a finer one. The numerical test is that of Chapelle & Bathe, Computers & Structures 47 (1993)
    537–545.
    """
    nodal = subject.traits.rules.penalty == "nodal"
    meshes = [inf_sup_constant(scene, subject.for_case(scene.case()), nodal=nodal) for scene in refinements(case)]
    parts = {CONSTANT: "constant", SEGMENT: "segment", ZERO_COUNT: "n_zero", MULTIPLIER_COUNT: "n_multipliers"}
    series = {
        name: np.array([getattr(mesh, part) for mesh in meshes], dtype=np.float64) for name, part in parts.items()
    }
    segments, constants = series[SEGMENT], series[CONSTANT]
    values = {ZEROS: float(series[ZERO_COUNT].max())}
    if (constants > 0).all():
        values[SLOPE] = float(np.polyfit(np.log(segments[-N_FITTED:]), np.log(constants[-N_FITTED:]), 1)[0])
    tolerances = {ZEROS: 0.0, SLOPE: MOST_SLOPE}
    details = {"β on the finest mesh": float(constants[-1])}
    measurement = Measurement(check_all(values, tolerances), details=details, series=series)
    return measurement.after(f"on meshes with slave segments of {segments[0]:.3g} to {segments[-1]:.3g}")
