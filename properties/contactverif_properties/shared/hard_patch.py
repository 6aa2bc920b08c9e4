"""The patch test on a named case, which is a state of an interface or a scene to solve."""

from __future__ import annotations

from dataclasses import replace

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.scene import has_bodies
from contactverif_properties.shared.flat_forces import FLAT_QUANTITIES, exact_forces, measure_flat
from contactverif_properties.shared.solved_patch import MULTIPLIERS, QUANTITIES, forces_to_draw, measure_once

PATCH_QUANTITIES = (*FLAT_QUANTITIES, *QUANTITIES, MULTIPLIERS)


def measure_patch(case: Case, subject: Subject) -> Measurement:
    """Return the errors of a flat state (`measure_flat`), or of a solved scene (`measure_once`)."""
    if not has_bodies(case):
        return measure_flat(case, subject)
    measurement, traits = measure_once(case, subject), subject.traits
    if traits.passes_flat_patch and traits.independent_multipliers is False:
        # Newton's method may release a redundant multiplier, and others carry its force: another solution.
        return replace(measurement, undecided="the multipliers are not independent, so the forces are not unique")
    return measurement


def promise_patch(traits: Traits) -> bool | None:
    """Return True where the patch test is promised, else None: which named cases would fail is not stated."""
    return True if traits.passes_flat_patch else None


def patch_forces(case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, 2) of a state or a scene, for pictures."""
    return forces_to_draw(case) if has_bodies(case) else exact_forces(case)
