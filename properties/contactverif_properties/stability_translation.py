"""Ask whether a part far from the origin gets the same forces as the same part at the origin.

**Question.** State and reference are moved by up to 2^20, while segments have lengths of 1 to 4. The move is exact: no
coordinate is rounded. Do forces and tangent stay what they were?

**Why it matters.** Assemblies, bridges and maps have coordinates of 10⁵ to 10⁷ and penetrations of 10⁻⁶. A formulation
that forms a point of a segment there rounds it at its distance from the origin. What it subtracts afterwards is lost:
forces are wrong by 10⁻⁴, and Newton's method stops at that.

**How it is judged.** The forces are compared on the pairing of the state at the origin. The difference is counted in
roundings (ω): how many times more it is than rounding all positions relative to their centroid, to 53 bits, would make
it. A kernel that takes differences of nodes first gives 0, or a few where it centres its coordinates. The tolerance is
16, at any distance and any gap. A kernel that rounds points far away has 10⁵ and more at 2^20. The tangent may differ
by 16 u D max(max|K|/ℓ, max|dK/dx|): a rounding turns a segment by u D/ℓ, and changes the stiffness of a law that is not
linear. The state's own pairing at the far place must give these forces too. Without a promise (trait
`translation_stable`), a failure is shown and breaks nothing: kernels that form points first are common, and right near
the origin.

**Undecided.** Never, if the plugin has a pairing. Without one, or with the far state's own pairing, a case is undecided
where a decision hangs on less than 64 u D: there a right search may decide otherwise.
"""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, check_all
from contactverif.contract.subject import Subject
from contactverif.strategies.translations import translated_cases
from contactverif_properties.shared.any_state import move_state, prepare_state
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.conditioning import (
    MOST_ROUNDINGS,
    count_tangent_roundings,
    forces_quantity,
    measure_conditioning,
    measure_tangent_slope,
    tangent_quantity,
)
from contactverif_properties.shared.forces_and_tangents import ask_forces_and_tangents
from contactverif_properties.shared.kinks import explain_by_rounded_decision

FORCES = forces_quantity("change of the forces in roundings")
TANGENT = tangent_quantity("change of the tangent in roundings")
SEARCH = forces_quantity("change of the forces with a new pairing in roundings")


def measure_translation(case: Case, subject: Subject) -> Measurement:
    """Compare forces and tangent of a state far from the origin with those of the same state at the origin.

    Parameters
    ----------
    case : Case
        A state at the origin with the parameter "shift" (2,), a translation that rounds no coordinate.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        Numbers ω of the forces on the pairing of the state at the origin, and on that of the far state; the change of
        the tangent in units of u D max(max|K|/ℓ, max|dK/dx|). All are dimensionless.
    """
    formulation, near = prepare_state(case, subject)
    far = move_state(near, case.parameters["shift"])
    pairing = formulation.pair(near.interface, near.z)
    states = (near.interface, pairing, near.z), (far.interface, pairing, far.z)
    (forces, forces_there), tangents = ask_forces_and_tangents(formulation, *states)
    change = forces_there - forces
    conditioning = measure_conditioning(near, formulation, pairing, forces)
    values = {FORCES: conditioning.count_roundings(change)}
    if tangents:
        here, there = tangents
        slope = measure_tangent_slope(near, formulation, pairing, here)
        values[TANGENT] = count_tangent_roundings(near, here, there, slope)
    excusable = pairing is None  # A plugin without a pairing decides anew in each residual.
    if pairing is not None:
        excusable = max(values.values()) <= MOST_ROUNDINGS  # The frozen pairing decides the same in both places.
        change = formulation.residual(far.interface, formulation.pair(far.interface, far.z), far.z) - forces
        values[SEARCH] = conditioning.count_roundings(change)
    undecided = ""
    if excusable and max(values.values()) > MOST_ROUNDINGS:
        undecided = explain_by_rounded_decision(near, formulation, pairing)
    idle = not forces[: near.interface.n_unknowns].any()
    return Measurement(check_all(values, MOST_ROUNDINGS), undecided, idle=idle)


STABILITY_TRANSLATION = Property(
    id="stability.translation",
    family="stability",
    summary="A part far from the origin gets the same forces as the same part at the origin.",
    quantities=(FORCES, TANGENT, SEARCH),
    cases=translated_cases,
    measure=measure_translation,
    promise=lambda traits: traits.translation_stable,
    applicable=refuse_barrier,
)
