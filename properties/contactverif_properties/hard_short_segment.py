"""Ask whether one tiny segment among ordinary ones spoils forces or stresses.

**Question.** An interface of length 12 has a segment of 1.2e-5 on the slave, on the master, on both facing each other,
or at the end. Are forces and stresses still those of a uniform pressure, at ε̂ = 1, 1e4 and 1e8?

**Why it matters.** Meshes that were cut or merged have slivers. Whoever divides by a length, or compares it with an
absolute number, finds out there.

**How it is judged.** As states, with the penalties as they are: as in `hard.offset`. Solved, with E = 1 in both blocks:
as in `patch.flat.solve`, whose tolerances have the term 5e-15/r for the ratio r = 4e-6 of the shortest to the longest
segment. The promise is `passes_flat_patch`.

**Undecided.** A scene that fails is undecided for multipliers that are not independent: Newton's method may release one
that is redundant on the tiny segment, and others carry its force.
"""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.property import Property
from contactverif.problems.hard_flat_states import tiny_segment_states
from contactverif.problems.hard_scenes import tiny_segment_scenes
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.hard_patch import PATCH_QUANTITIES, measure_patch, patch_forces, promise_patch


def tiny_segment_cases() -> tuple[Case, ...]:
    """Return the states and the scenes with a tiny segment."""
    return tiny_segment_states() + tiny_segment_scenes()


HARD_SHORT_SEGMENT = Property(
    id="hard.short-segment",
    family="hard",
    summary="One segment of 1.2e-5 in an interface of 12 changes nothing, at ε̂ = 1, 1e4 and 1e8.",
    quantities=PATCH_QUANTITIES,
    cases=unless_given(tiny_segment_cases),
    measure=measure_patch,
    promise=promise_patch,
    applicable=refuse_barrier,
    bodies=True,
    exact=patch_forces,
)
