"""Hard scenes with a name, solved: bodies that differ much, slivers, little overlap, stiff springs, and no load."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case, Cases
from contactverif.contract.property import CheckedNumber, Measurement, Property, Quantity, check_all
from contactverif.contract.subject import SOLVE, EngineSubject, Subject
from contactverif.mechanics.accuracy import solve_by_engine
from contactverif.mechanics.linear import RANK_ROUNDOFF, scale_factors
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import Scene, has_bodies, scene_of
from contactverif.mechanics.system import System
from contactverif.problems import block_scenes, flat_states
from contactverif.problems.blocks import pressure_of
from contactverif.problems.uniform_stress import CONDITION_TOLERANCE, condition_tolerance
from contactverif_properties import patch_solved
from contactverif_properties.applicability import refuse_dependent_multipliers
from contactverif_properties.hard import FLAT_QUANTITIES, flat_forces, measure_flat
from contactverif_properties.newton_method import end_details
from contactverif_properties.states import FrozenState


def _measure_patch(case: Case, subject: Subject) -> Measurement:
    """Return the errors of a flat state (`measure_flat`), or of a solved scene (`measure_once`)."""
    if not has_bodies(case):
        return measure_flat(case, subject)
    measurement, promises = patch_solved.measure_once(case, subject), subject.traits.promises
    if promises.patch.flat and promises.independent_multipliers is False:
        # Newton's method may release a redundant multiplier, and others carry its force: another solution.
        return replace(measurement, undecided="the multipliers are not independent, so the forces are not unique")
    return measurement


_define_solved = partial(Property.define, family="hard", bodies=True)
_define_patch = partial(
    _define_solved,
    quantities=(*FLAT_QUANTITIES, *patch_solved.QUANTITIES, patch_solved.MULTIPLIERS),
    promise=lambda traits: True if traits.promises.patch.flat else None,  # Which of the cases would fail is not stated.
    exact=lambda case: patch_solved.forces_to_draw(case) if has_bodies(case) else flat_forces(case),
)


@_define_patch(id="hard.c", rank=670, cases=Cases.from_list(block_scenes.case_c))
def hard_c(case: Case, subject: Subject) -> Measurement:
    """Cases C and C′ of the reference paper give the exact forces as states, and the exact stress solved.

    **Question.** Two slave segments of 2 and two of 4 lie on four master segments of 3. One area of competence covers
    two master segments, and its virtual slave node is exactly on a master node (C), or beside it (C′). Are the forces
    of a uniform penetration exact, and is the stress of two blocks under a uniform pressure?

    **Why it matters.** It is the smallest mesh on which VTS-ME and its relatives fail the patch test, and the one by
    which the paper shows that VTS-PPT passes. In C roundoff decides between two segments in every iteration of Newton's
    method.

    **How it is judged.** The states have the paper's forces, in rationals, and are judged as in `hard.offset`. The
    scenes have a master three times as stiff, and ε̂ = E and 1e4 E; they are judged as in `patch.flat.solve`, with its
    tolerances. The promise is `patch.flat`.

    **Undecided.** Never: on a flat interface both partners of the kink give the same gap.
    """
    return _measure_patch(case, subject)


@_define_patch(id="hard.contrast", rank=650, cases=Cases.from_list(block_scenes.contrast_scenes), engines=True)
def hard_contrast(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays uniform for any contrast of stiffness and mesh, whichever body is the slave.

    **Question.** A block with 8 segments lies on one with 2. Either is the slave, and either is softer by 1e6, or they
    are equally stiff. Is the stress of a uniform pressure exact at 10 E/h and at 1e5 E/h?

    **Why it matters.** Manuals tell users to take the softer or the finer body as the slave, and warn of locking
    otherwise. A formulation that passes the patch test must pass it for every choice.

    **How it is judged.** As in `patch.flat.solve`, with its tolerances. The promise is `patch.flat`. Whether
    pressures that vary lock is another question, which this one does not answer.

    **Undecided.** Never.
    """
    return _measure_patch(case, subject)


@_define_patch(
    id="hard.short-segment",
    rank=640,
    cases=Cases.from_list(lambda: flat_states.tiny_segment_states() + block_scenes.tiny_segment_scenes()),
)
def hard_short_segment(case: Case, subject: Subject) -> Measurement:
    """One segment of 1.2e-5 in an interface of 12 changes nothing, at ε̂ = 1, 1e4 and 1e8.

    **Question.** An interface of length 12 has a segment of 1.2e-5 on the slave, on the master, on both facing each
    other, or at the end. Are forces and stresses still those of a uniform pressure, at ε̂ = 1, 1e4 and 1e8?

    **Why it matters.** Meshes that were cut or merged have slivers. A formulation fails there if it divides by a
    length, or compares it with an absolute number.

    **How it is judged.** As states, with the penalties as they are: as in `hard.offset`. Solved, with E = 1 in both
    blocks: as in `patch.flat.solve`, whose tolerances have the term 5e-15/r for the ratio r = 4e-6 of the shortest to
    the longest segment. The promise is `patch.flat`.

    **Undecided.** A scene that fails is undecided for multipliers that are not independent: Newton's method may release
    one that is redundant on the tiny segment, and others carry its force.
    """
    return _measure_patch(case, subject)


@_define_patch(id="hard.stiff", rank=630, cases=Cases.from_list(block_scenes.stiff_scenes), engines=True)
def hard_stiff(case: Case, subject: Subject) -> Measurement:
    """Springs of ε̂h/E = 1e10 on bodies whose stiffness differs by 1e6 leave a uniform pressure uniform.

    **Question.** The penalty is 1e4 or 1e10 E/h, E that of the softer body, and E of the master is 1e-6, 1 or 1e6 times
    that of the slave. Is the stress of a uniform pressure still as exact as the condition of the matrix allows?

    **Why it matters.** Users raise the penalty until the penetration is small, and press rubber on steel. A tangent
    that subtracts large numbers, or a pressure that is computed from a gap near roundoff, then gives noise in place of
    stress.

    **How it is judged.** As in `patch.flat.solve`. Its tolerances contain the condition κ of the matrix and the
    rounding X ε̂/p of gaps, so they are wide at 1e10: up to 1 part in 10 for pressures. What is asked there is that
    nothing is worse than conditioning, that Newton's method comes near a solution, and that all numbers are finite. The
    promise is `patch.flat`.

    **Undecided.** Never.
    """
    return _measure_patch(case, subject)


POINTWISE = (patch_solved.GAP.name, patch_solved.PRESSURE.name)


def _divide_by_share(quantity: Quantity) -> Quantity:
    term = " + 64 u X ε̂/(p s)" if quantity.name in POINTWISE else ""
    tolerance = f"{quantity.tolerance}{term}; with multipliers X/s in place of X"
    reason = "s is the share of the slave segment that the master covers, by which roundoff of its gap grows."
    return replace(quantity, tolerance=tolerance, reason=f"{quantity.reason} {reason}")


@_define_solved(
    id="hard.dead-zone",
    rank=600,
    quantities=tuple(map(_divide_by_share, patch_solved.patch_dead_zone.quantities)),
    cases=Cases.from_list(block_scenes.vanishing_overlap_scenes),
    promise=lambda traits: True if traits.promises.patch.overhang else None,
    exact=patch_solved.forces_to_draw,
    engines=True,
)
def hard_dead_zone(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact where the master covers 1e-1 to 1e-12 of a slave segment.

    **Question.** The master ends inside a slave segment, of which it covers 1e-1 to 1e-12. Is the stress of a uniform
    pressure exact?

    **Why it matters.** As a body slides off an edge, every such share occurs. A nodal gap is then an integral over the
    share, divided by another one. A multiplier has next to nothing to act on, and the matrix loses rank.

    **How it is judged.** As in `patch.dead-zone`, and promised by the same trait, `patch.overhang`. Where the master
    covers a share s of a segment, roundoff of a gap there grows by 1/s. So what is measured at single points (gaps and
    pressures) has the rounding term 64 u X ε̂/(p s) more, and with multipliers all that is measured has X/s in place of
    X: a force that no gap holds is known no better. Details say what the matrix of the exact solution is like: its
    reciprocal condition, with multipliers scaled to the bodies, and how many of its singular values are 0 to roundoff.
    Nobody promises anything about these two. A rank that falls by one is what an overlap of 0 means for a method with
    multipliers.

    **Undecided.** Never.
    """
    measurement = patch_solved.patch_dead_zone.measure(case, subject)
    if isinstance(subject, EngineSubject):  # It states how accurate it is, and has no matrix.
        return measurement
    rounding = 64 * UNIT_ROUNDOFF * case.largest_coordinate * case.penalty / pressure_of(case, case.penalty)
    more = rounding / covered_share(case)
    if subject.traits.rules.enforcement == "multiplier":  # All tolerances are multiples of that of the stress.
        growth = 1 + more / measurement.tolerances[patch_solved.STRESS.name]
        tolerances = [growth * number.tolerance for number in measurement.numbers]
    else:
        tolerances = [
            number.tolerance + (more if number.quantity.name in POINTWISE else 0.0) for number in measurement.numbers
        ]
    numbers = [replace(each, tolerance=new) for each, new in zip(measurement.numbers, tolerances, strict=True)]
    # What the matrix of the exact solution is like.
    scene, formulation = scene_of(case), subject.for_case(case)
    system = System(scene, formulation, use_tangent=False)
    u = patch_solved.exact_solution(scene, case, subject, formulation)
    matrix = system.matrix(u, system.pair(u))[0]
    rows, columns = scale_factors(matrix, scene.n_free)
    sizes = linalg.svdvals(rows[:, None] * matrix * columns)
    floor = RANK_ROUNDOFF * len(sizes) * UNIT_ROUNDOFF * sizes[0]
    rank = {"reciprocal condition": float(sizes[-1] / sizes[0]), "lack of rank": float((sizes <= floor).sum())}
    return replace(measurement, numbers=numbers, details={**measurement.details, **rank})


def covered_share(case: Case) -> float:
    """Return the least share of a slave segment that the master covers, of those of which it covers something."""
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    ends = np.sort(slave[case.interface.slave.segments], axis=1)
    covered = np.minimum(ends[:, 1], master.max()) - np.maximum(ends[:, 0], master.min())
    shares = covered / (ends[:, 1] - ends[:, 0])
    return float(shares[shares > 0].min())


ITERATIONS = 10  # From touch, Newton's method ends at once or wanders; then rest itself is judged.
NO_STRESS = Quantity(
    "stress without a load",
    f"({CONDITION_TOLERANCE}) S/ℓ + 64 u (X/ℓ)(1 + ε̂ ℓ/E)",
    "Displacements and gaps are rounded like coordinates X, which strains the shortest segment ℓ. "
    "The step from a start that is S away is solved as exactly as the condition of the matrix allows.",
)
NO_FORCE = replace(NO_STRESS, name="force without a load")


def _check_unloaded(
    quantities: tuple[Quantity, Quantity], case: Case, scene: Scene, q: FloatArray, forces: FloatArray, error: float
) -> tuple[CheckedNumber, ...]:
    """Judge the largest stress at the unknowns q (n_free,) over E of the stiffer body, and the largest force over E H.

    `error` is by how much displacements may be wrong besides the rounding of coordinates, a length.
    """
    young, shortest = max(body.young for body in scene.bodies), case.shortest_segment
    height = float(np.ptp(scene.bodies[0].nodes, axis=0).max())
    stress = max(float(np.abs(part).max(initial=0.0)) for part in scene.stresses(q))
    tolerance = 64 * UNIT_ROUNDOFF * case.largest_coordinate / shortest * (1 + case.penalty * shortest / young)
    sizes = stress / young, float(np.abs(forces).max()) / (young * height)
    return check_all(dict(zip(quantities, sizes, strict=True)), tolerance + error / shortest)


@_define_solved(
    id="hard.zero-load",
    rank=690,
    quantities=(NO_STRESS, NO_FORCE),
    cases=Cases.from_list(block_scenes.unloaded_scenes),
    promise=lambda traits: True,
    applicable=refuse_dependent_multipliers,
)
def hard_zero_load(case: Case, subject: Subject) -> Measurement:
    """Two bodies that touch without a load stay without stress, wherever Newton's method starts.

    **Question.** Two blocks touch each other and carry no load. They start in touch, pushed into each other, or lifted.
    Does Newton's method end in a state without stress, and is rest in touch a solution?

    **Why it matters.** Every assembly begins like this: gap zero, force zero. The active set hangs on the sign of a gap
    of 1e-16 there. A normal that is computed as a difference over a distance is 0/0.

    **How it is judged.** Without a load the exact answer is no stress, wherever the upper block rests. The first number
    is the largest stress over E of the stiffer body, the second the largest contact force over E H. Both are at most 64
    u (X/ℓ)(1 + ε̂ ℓ/E), since displacements and gaps are rounded like coordinates X on the shortest segment ℓ, and what
    the condition of the matrix leaves of a start that is S away. The iterate with the least residual counts: against
    terms that all vanish, no residual is small. Where Newton's method does not end by itself, as in touch it may not,
    the state of rest itself is judged: nothing is strained there, so the formulation must give no force.

    **Undecided.** Never.
    """
    scene, formulation = scene_of(case), subject.for_case(case)
    trace = solve(scene, formulation, iterations=ITERATIONS, use_tangent=False, solution_only=True)
    u = trace.u[int(np.argmin(trace.residuals))] if trace.converged else np.zeros(trace.u.shape[1])
    q = u[: scene.n_free]
    end = replace(case, z=scene.positions(q)).with_multipliers(u[scene.n_free :])
    forces = FrozenState.at(formulation, end).forces
    error = condition_tolerance(scene, case.penalty) * float(np.abs(scene.start).max())
    numbers = _check_unloaded((NO_STRESS, NO_FORCE), case, scene, q, forces, error)
    return Measurement(numbers, details=end_details(trace))


_define_for_codes = partial(
    Property.define, family="engine", needs=frozenset({SOLVE}), promise=lambda traits: True, bodies=True
)
_define_patch_for_codes = partial(
    _define_for_codes,
    quantities=(*patch_solved.QUANTITIES, patch_solved.MULTIPLIERS),
    promise=lambda traits: True if traits.promises.patch.flat else None,
    exact=patch_solved.forces_to_draw,
)


@_define_patch_for_codes(id="engine.c", cases=Cases.from_list(lambda: tuple(filter(has_bodies, block_scenes.case_c()))))
def engine_c(case: Case, subject: Subject) -> Measurement:
    """Cases C and C′ of the reference paper give the exact stress.

    **Question.** The scenes of `hard.c`: two slave segments of 2 and two of 4 on four master segments of 3. Is the
    stress of a uniform pressure exact?

    **Why it matters.** It is the smallest mesh on which many methods fail the patch test.

    **How it is judged.** As in `patch.flat.solve`.

    **Undecided.** Where the code finds no solution.
    """
    return patch_solved.measure_once(case, subject)


@_define_patch_for_codes(id="engine.short-segment", cases=Cases.from_list(block_scenes.tiny_segment_scenes))
def engine_short_segment(case: Case, subject: Subject) -> Measurement:
    """One segment of 1.2e-5 in an interface of 12 changes nothing, at ε̂ = 1, 1e4 and 1e8.

    **Question.** The scenes of `hard.short-segment`. Are stress and forces still those of a uniform pressure?

    **Why it matters.** Meshes that were cut or merged have slivers.

    **How it is judged.** As in `patch.flat.solve`. A displacement that is wrong by a U strains the tiny segment, so
    that the tolerance of a code with few digits is wide.

    **Undecided.** Where the code finds no solution.
    """
    return patch_solved.measure_once(case, subject)


CODE_TERMS = "64 u (X/ℓ)(1 + ε̂ ℓ/E) + 1e-12 κ S/ℓ + a S/ℓ"
CODE_REASON = "Displacements are rounded like coordinates X, and wrong by a S where the bodies move by S."
CODE_STRESS, CODE_FORCE = (Quantity(f"{name} without a load", CODE_TERMS, CODE_REASON) for name in ("stress", "force"))


def _supported_scenes() -> tuple[Case, ...]:
    """Return the scenes without a load in which both bodies are held; another one would be free to move."""
    return tuple(case for case in block_scenes.unloaded_scenes() if case.name.startswith("held"))


@_define_for_codes(
    id="engine.zero-load", quantities=(CODE_STRESS, CODE_FORCE), cases=Cases.from_list(_supported_scenes)
)
def engine_zero_load(case: Case, subject: Subject) -> Measurement:
    """Two bodies that touch without a load stay without stress.

    **Question.** The scenes of `hard.zero-load` in which both bodies are held: two blocks touch and carry no load. Is
    there no stress and no force?

    **Why it matters.** Every assembly begins like this. A test of convergence that is relative to the load divides 0 by
    0, and a normal that is a difference over a distance is 0/0.

    **How it is judged.** The first number is the largest stress over E of the stiffer body, the second the largest
    force over E H. The tolerance is that of `hard.zero-load`, and a S/ℓ more: S is how far the start lies from touch,
    or how far the bodies moved.

    **Undecided.** Where the code finds no solution.
    """
    assert isinstance(subject, EngineSubject)
    scene = scene_of(case)
    solution, _ = solve_by_engine(scene, subject)
    if solution.no_solution:
        return Measurement(undecided=solution.no_solution)
    q = np.asarray(scene.transformation.T @ solution.displacements.reshape(-1))
    moved = max(float(np.abs(scene.start).max()), float(np.abs(solution.displacements).max()))
    error = (condition_tolerance(scene, case.penalty) + subject.engine_traits.accuracy) * moved
    return Measurement(_check_unloaded((CODE_STRESS, CODE_FORCE), case, scene, q, solution.forces, error))
