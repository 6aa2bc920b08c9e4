"""Ask a whole code about hard scenes that formulations are asked as states too, or by Newton's method alone."""

from __future__ import annotations

from functools import partial

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.engine_subject import SOLVE, EngineSubject
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.mechanics.scene import has_bodies, scene_of
from contactverif.mechanics.solving import solve_by_engine
from contactverif.problems import block_scenes
from contactverif.problems.kinked_patch import kinked_patch, patch_of
from contactverif.problems.uniform_stress import condition_tolerance, uniform_forces
from contactverif_properties.hard_solved import check_unloaded
from contactverif_properties.patch_kinked import kink_floor, kink_stress_error, kinked_cases
from contactverif_properties.shared import solved_patch
from contactverif_properties.shared.engine_patch import engine_tolerance

_define = partial(
    Property.define, family="engine", needs=frozenset({SOLVE}), promise=lambda traits: True, bodies=True, engines=True
)
_define_patch = partial(
    _define,
    quantities=(*solved_patch.QUANTITIES, solved_patch.MULTIPLIERS),
    promise=lambda traits: True if traits.promises.patch.flat else None,
    exact=solved_patch.forces_to_draw,
)


def scenes_among(cases: tuple[Case, ...]) -> tuple[Case, ...]:
    """Return the cases that have bodies."""
    return tuple(filter(has_bodies, cases))


@_define_patch(id="engine.c", cases=Cases.from_list(lambda: scenes_among(block_scenes.case_c())))
def engine_c(case: Case, subject: Subject) -> Measurement:
    """Cases C and C′ of the reference paper give the exact stress.

    **Question.** The scenes of `hard.c`: two slave segments of 2 and two of 4 on four master segments of 3. Is the
    stress of a uniform pressure exact?

    **Why it matters.** It is the smallest mesh on which many methods fail the patch test.

    **How it is judged.** As in `patch.flat.solve`.

    **Undecided.** Where the code finds no solution.
    """
    return solved_patch.measure_once(case, subject)


@_define_patch(id="engine.short-segment", cases=Cases.from_list(block_scenes.tiny_segment_scenes))
def engine_short_segment(case: Case, subject: Subject) -> Measurement:
    """One segment of 1.2e-5 in an interface of 12 changes nothing, at ε̂ = 1, 1e4 and 1e8.

    **Question.** The scenes of `hard.short-segment`. Are stress and forces still those of a uniform pressure?

    **Why it matters.** Meshes that were cut or merged have slivers.

    **How it is judged.** As in `patch.flat.solve`. A displacement that is wrong by a U strains the tiny segment, so
    that the tolerance of a code with few digits is wide.

    **Undecided.** Where the code finds no solution.
    """
    return solved_patch.measure_once(case, subject)


TERMS = "64 u (X/ℓ)(1 + ε̂ ℓ/E) + 1e-12 κ S/ℓ + a S/ℓ"
REASON = "Displacements are rounded like coordinates X, and wrong by a S where the bodies move by S."
NO_STRESS, NO_FORCE = (Quantity(f"{name} without a load", TERMS, REASON) for name in ("stress", "force"))


def supported_scenes() -> tuple[Case, ...]:
    """Return the scenes without a load in which both bodies are held; another one would be free to move."""
    return tuple(case for case in block_scenes.unloaded_scenes() if case.name.startswith("held"))


@_define(id="engine.zero-load", quantities=(NO_STRESS, NO_FORCE), cases=Cases.from_list(supported_scenes))
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
    return Measurement(check_unloaded((NO_STRESS, NO_FORCE), case, scene, q, solution.forces, error))


KINK_TERMS = (
    "(g/ℓ) tan(φ/2) (4 + tan(φ/2) tan(φ)/2) + u (8X/g + 4N) + p (1 + ν)(1 − 2ν)/E + a (1 + M U/(ℓ p)) + 1e-12 κ"
)
KINK_REASON = "Penetration moves the kink along a facet, and blocks contract; displacements are wrong by a U."
KINK_STRESS = Quantity("stress error", KINK_TERMS, KINK_REASON)
KINK_FORCES = Quantity("error of a nodal force", KINK_TERMS, KINK_REASON)


@_define(
    id="engine.kinked",
    quantities=(KINK_STRESS, KINK_FORCES),
    cases=Cases.from_list(kinked_cases),
    promise=lambda traits: traits.promises.patch.kinked,
)
def engine_kinked(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact on an interface with a kink.

    **Question.** The scenes of `patch.kinked`: two blocks of one material on a broken line, under the same pressure
    from all sides. Are the stress and the forces on both sides exact?

    **Why it matters.** Corners, chamfers and the facets of any curved mesh are kinks, and many codes average normals
    there.

    **How it is judged.** As the uniform state of `patch.kinked`, with the accuracy of the code in the tolerance. Only a
    code that states `patch.kinked` in its traits promises it.

    **Undecided.** Where the code finds no solution.
    """
    assert isinstance(subject, EngineSubject)
    problem, upper_slave = patch_of(case)
    scene = kinked_patch(problem, upper_slave=upper_slave, penalty=case.penalty)
    solution, _ = solve_by_engine(scene, subject, linear=True)
    if solution.no_solution:
        return Measurement(undecided=solution.no_solution)
    q = np.asarray(scene.transformation.T @ solution.displacements.reshape(-1))
    exact = uniform_forces(scene.interface, problem.pressure)
    errors = np.linalg.norm(solution.forces - exact, axis=1) / np.linalg.norm(exact, axis=1).max()
    tolerance = kink_floor(problem, case, problem.pressure / case.penalty) + problem.contraction
    tolerance += engine_tolerance(scene, solution, subject.engine_traits.accuracy, problem.pressure)
    values = {KINK_STRESS: kink_stress_error(problem, scene, q), KINK_FORCES: float(errors.max())}
    return Measurement(check_all(values, tolerance))
