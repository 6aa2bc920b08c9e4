"""Ask whether surfaces that just touch give neither a force nor nonsense.

**Question.** Flat surfaces touch: the gap is exactly 0 at 1000 angles, or 1e-16 open or closed at 24. Is the force no
more than roundoff makes it, and is the tangent that of a spring across the surface, or of none?

**Why it matters.** A normal that is computed as the difference of point and foot over their distance is 0/0 in touch,
and has any direction at 1e-16. The force is tiny then, and the tangent is as wrong as can be: Newton's method slides
the bodies.

**How it is judged.** The first number is the largest nodal force over ε̂ h, a length, in units of the largest
coordinate X, h the longest slave segment: at most 4 (8u + |g|/X), since a gap is rounded to 8uX, and springs act in two
passes at most. With an exact tangent, the slave is moved across its surface. It meets between no resistance (open) and
that of all springs, 4 ε̂ L. Near the origin, where the gap is ±1e-16, it is also moved along its surface, with the
slave d = 64 u X deeper. No gap changes, so the derivative of a force is at most that of rounded directions,
64 u X/ℓ + 4(|g| + d)/ℓ, over ε̂ h. At a gap of 0 there is no derivative: the columns of a complex step take the side of
their own rounding there, each for itself. At d every gap has its sign in spite of its rounding of 8 u X, while a normal
that is a difference over a distance still turns by u X/d = 1/64. All multipliers are 0 here.

**Undecided.** Never: contact may be active or not, and the numbers allow for both.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.problems.touching_states import touching_states
from contactverif_properties.shared.finite_lists import unless_given

_DEPTH = 64.0  # The depth over u X. It is eight times what a gap is rounded to, so that each has its sign.
FORCE = Quantity(
    "force in touch", "1", "4 (8u + |g|/X)", "A gap is rounded to 8uX, and springs act in two passes at most."
)
SLIDING = Quantity(
    "stiffness along the surface",
    "1",
    "64 u X/ℓ + 4(|g| + d)/ℓ",
    "Rounding the ends of a segment turns its normal by uX/ℓ. d = 64 u X is the depth of the state.",
)
PRESSING = Quantity(
    "stiffness across the surface", "1", "4", "Springs act in two passes at most, on n + 1 nodes for n segments."
)
PULLING = Quantity("pull across the surface", "1", "64 u X/ℓ + 4|g|/ℓ", "A spring resists, and never helps.")


def measure_touch(case: Case, subject: Subject) -> Measurement:
    """Return force and stiffness of surfaces that touch.

    Parameters
    ----------
    case : Case
        A state of `contactverif.problems.touching_states`.
    subject : Subject
        The formulation; its multipliers, if any, are 0.

    Returns
    -------
    Measurement
        All dimensionless. The largest nodal force over ε̂ h X. With an exact tangent K also n·K n over ε̂ L, n a motion
        of the slave across its surfaces, and its negative. Where the gap is not exactly 0, also the largest entry of
        K t over ε̂ h, 64 u X deeper, t a motion along the surfaces.
    """
    formulation, interface = subject.for_case(case), case.interface
    state = case.with_multipliers(np.zeros(formulation.n_multipliers(interface)))
    pairing = formulation.pair(interface, state.z)
    forces = formulation.residual(interface, pairing, state.z)[: interface.n_unknowns]
    longest = float(interface.slave.lengths(case.positions).max())
    size, gap = case.largest_coordinate, abs(case.parameter("shift"))
    values = {FORCE: float(np.abs(forces).max()) / (case.penalty * longest * size)}
    tolerances = {FORCE: 4 * (8 * UNIT_ROUNDOFF + gap / size)}
    if "tangent" in subject.provides and subject.traits.tangent == "exact":
        n = interface.n_unknowns
        tangent = dense(formulation.tangent(interface, pairing, state.z))[:n, :n]
        along, across = _motions(case)
        resistance = float(across @ tangent @ across) / (case.penalty * case.slave_length)
        values |= {PRESSING: resistance, PULLING: -resistance}
        roundoff = (64 * UNIT_ROUNDOFF * size + 4 * gap) / case.shortest_segment
        tolerances |= {PRESSING: 4.0, PULLING: roundoff}
        if gap:
            depth = _DEPTH * UNIT_ROUNDOFF * size
            z = state.z.copy()
            z[:n] -= depth * across
            tangent = dense(formulation.tangent(interface, formulation.pair(interface, z), z))[:n, :n]
            values[SLIDING] = float(np.abs(tangent @ along).max()) / (case.penalty * longest)
            tolerances[SLIDING] = roundoff + 4 * depth / case.shortest_segment
    return Measurement(check_all(values, tolerances))


def _motions(case: Case) -> tuple[FloatArray, FloatArray]:
    """Return the motions (n_unknowns,) of the slave by a unit along and across its surfaces."""
    along = case.parameters["directions"].copy()
    along[case.interface.n_slave_nodes :] = 0.0
    across = np.column_stack([-along[:, 1], along[:, 0]])
    return along.reshape(-1), across.reshape(-1)


def refuse_barrier_in_touch(traits: Traits) -> str:
    """Return why a barrier method is not asked, or an empty string for other methods."""
    return "a barrier is infinite in touch" if traits.enforcement == "barrier" else ""


def promise_touch(traits: Traits) -> bool:
    """Return True: every law of contact begins with no force in touch."""
    return True


HARD_TOUCH = Property(
    id="hard.touch",
    family="hard",
    summary="Surfaces that touch, or miss each other by 1e-16, give neither a force nor a wrong stiffness.",
    quantities=(FORCE, SLIDING, PRESSING, PULLING),
    cases=unless_given(touching_states),
    measure=measure_touch,
    promise=promise_touch,
    applicable=refuse_barrier_in_touch,
)
