"""The disk against a finer mesh: what such a reference can tell apart, and what its own error hides."""

from __future__ import annotations

from functools import cache

import pytest
from subjects import load_subject

from contactverif.mechanics.accuracy import Solution
from contactverif.problems.disk_errors import DiskErrors, disk_errors, solve_disk_for_accuracy

FINE = 2  # The numbers on the site are those of four times. Twice is enough here, and a tenth of the work.


@cache
def solve(name: str, refine: int) -> Solution:
    solution = solve_disk_for_accuracy(load_subject(name), refine)
    assert solution.balanced
    return solution


def errors_of(name: str, refine: int = 1) -> DiskErrors:
    return disk_errors(solve(name, refine), solve("mortar", FINE))


def test_against_itself_a_solution_has_the_error_of_pressures_that_are_forces_over_lengths() -> None:
    errors = errors_of("mortar", FINE)
    assert errors.displacement <= 1e-14
    assert 0 < max(errors.slave, errors.master) <= 3e-3


@pytest.mark.parametrize("name", ["sts", "mortar", "vts-ppt-balanced"])
def test_right_formulations_are_near_the_reference(name: str) -> None:
    errors = errors_of(name)
    assert max(errors.slave, errors.master) <= 6e-3
    assert errors.pressure is not None
    assert errors.pressure <= 5e-3
    assert errors.displacement <= 2e-3


@pytest.mark.parametrize("name", ["nts-ar", "vts-me"])
def test_who_fails_the_patch_test_has_wrong_forces_on_the_foundation(name: str) -> None:
    errors = errors_of(name)
    assert errors.master >= 4e-2
    assert errors.slave <= 1e-2


def test_right_formulations_differ_by_as_much_as_the_mesh_does() -> None:
    """So no verdict can hang on the reference: the displacements of VTS-PPT stay away from those of mortar."""
    assert errors_of("sts", FINE).displacement <= 2e-4
    assert errors_of("vts-ppt-balanced", FINE).displacement >= 8e-4
