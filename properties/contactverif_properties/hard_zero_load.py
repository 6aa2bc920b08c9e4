"""Ask whether two bodies that touch without a load stay at rest.

**Question.** Two blocks touch each other and carry no load. They start in touch, pushed into each other, or lifted.
Does Newton's method end in a state without stress, and is rest in touch a solution?

**Why it matters.** Every assembly begins like this: gap zero, force zero. The active set hangs on the sign of a gap of
1e-16 there. A normal that is computed as a difference over a distance is 0/0.

**How it is judged.** Without a load the exact answer is no stress, wherever the upper block rests. The first number is
the largest stress over E of the stiffer body, the second the largest contact force over E H. Both are at most 64 u
(X/ℓ)(1 + ε̂ ℓ/E), since displacements and gaps are rounded like coordinates X on the shortest segment ℓ, and what the
condition of the matrix leaves of a start that is S away. The iterate with the least residual counts: against terms that
all vanish, no residual is small. Where Newton's method does not end by itself, as in touch it may not, the state of
rest itself is judged: nothing is strained there, so the formulation must give no force.

**Undecided.** Never.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import scene_of
from contactverif.problems.hard_scenes import unloaded_scenes
from contactverif.problems.uniform_stress import CONDITION_TOLERANCE, condition_tolerance
from contactverif_properties.shared.applicability import refuse_dependent_multipliers
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.newton_solution import end_details

_TOLERANCE = f"({CONDITION_TOLERANCE}) S/ℓ + 64 u (X/ℓ)(1 + ε̂ ℓ/E)"
_REASON = (
    "Displacements and gaps are rounded like coordinates X, which strains the shortest segment ℓ. "
    "The step from a start that is S away is solved as exactly as the condition of the matrix allows."
)
STRESS = Quantity("stress without a load", "1", _TOLERANCE, _REASON)
FORCE = Quantity("force without a load", "1", _TOLERANCE, _REASON)
ITERATIONS = 10  # From touch, Newton's method ends at once or wanders; then rest itself is judged.


def measure_unloaded(case: Case, subject: Subject) -> Measurement:
    """Solve a scene without any load and return what stress and force are left.

    Parameters
    ----------
    case : Case
        A scene of two blocks without a load.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The largest stress over E, and the largest contact force on a node over E H, both dimensionless.
    """
    scene, formulation = scene_of(case), subject.for_case(case)
    trace = solve(scene, formulation, iterations=ITERATIONS, use_tangent=False, keep_matrix=True)
    u = trace.u[int(np.argmin(trace.residuals))] if trace.converged else np.zeros(trace.u.shape[1])
    q = u[: scene.n_free]
    z = np.append(scene.positions(q), u[scene.n_free :])
    forces = formulation.residual(case.interface, formulation.pair(case.interface, z), z)[: case.interface.n_unknowns]
    young = max(body.young for body in scene.bodies)
    height = float(np.ptp(scene.bodies[0].nodes, axis=0).max())
    stress = max(float(np.abs(part).max(initial=0.0)) for part in scene.stresses(q))
    tolerance = 64 * UNIT_ROUNDOFF * case.largest_coordinate / case.shortest_segment
    tolerance *= 1 + case.penalty * case.shortest_segment / young
    tolerance += condition_tolerance(scene, case.penalty) * float(np.abs(scene.start).max()) / case.shortest_segment
    values = {STRESS: stress / young, FORCE: float(np.abs(forces).max()) / (young * height)}
    return Measurement(check_all(values, tolerance), details=end_details(trace))


def promise_rest(traits: Traits) -> bool:
    """Return True: no law of contact gives a force to bodies that only touch."""
    return True


HARD_ZERO_LOAD = Property(
    id="hard.zero-load",
    family="hard",
    summary="Two bodies that touch without a load stay without stress, wherever Newton's method starts.",
    quantities=(STRESS, FORCE),
    cases=unless_given(unloaded_scenes),
    measure=measure_unloaded,
    promise=promise_rest,
    applicable=refuse_dependent_multipliers,
    bodies=True,
)
