"""The properties `continuity` and `symmetric`: jumps are found, and smooth formulations are not accused."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from planned_cases import draw_cases
from subjects import judge_as, load_property, load_subject, with_promises
from textbook_cells import ClippedCells, WeightedGaps
from zoo.at_points import SlaveNormalAtGaussPoints

import contactverif_surfaces
from contactverif import Case, Promises, Subject, Traits, Verdict, named_case
from contactverif.contract.arrays import FloatArray
from contactverif.strategies.surfaces import sliding_surface_cases
from contactverif.strategies.translations import _opens_at_once, sliding_cases
from contactverif_properties.balance import N_STEPS, continuity, find_jumps


def cases(examples: int) -> tuple[Case, ...]:
    return draw_cases(sliding_cases(), seed="sliding", examples=examples).cases


class Cloud:
    """Gauss points of both sides repel one another by a smooth law, so that nothing ever jumps; it has no pairing."""

    traits = Traits(promises=Promises(continuity="C1", conserves_force=True))

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, forces = z.reshape(-1, 2), np.zeros((interface.n_nodes, 2))
        size = interface.slave.lengths(interface.nodes).mean()
        middles = [x[side.segments].mean(axis=1) for side in (interface.slave, interface.master)]
        apart = (middles[0][:, None] - middles[1]) / size
        pushes = self.penalty * size * np.exp(-(apart**2).sum(axis=-1))[..., None] * apart
        for side, sign, axis in ((interface.slave, -1, 1), (interface.master, 1, 0)):
            for end in (0, 1):
                np.add.at(forces, side.segments[:, end], sign * pushes.sum(axis=axis) / 2)
        return forces.reshape(-1)


def test_a_smooth_formulation_without_a_pairing_is_not_accused() -> None:
    for case in cases(12):
        judge_as(Verdict.PASS, continuity, case, Subject("cloud", Cloud))


def test_far_from_the_origin_positions_are_rounded_whoever_measures_gaps() -> None:
    symmetry, subject = load_property("symmetric"), load_subject("vts-g:area=reference")
    assert subject.traits.promises.symmetric
    assert subject.traits.promises.translation_stable
    for case in draw_cases(symmetry.cases(None), seed="symmetric", examples=6).cases:
        far = replace(case, z=case.z + 2.0 ** (12 + np.ceil(np.log2(case.diameter))))
        judge_as(Verdict.PASS, symmetry, far, subject)


@pytest.mark.parametrize("make", [SlaveNormalAtGaussPoints, ClippedCells, WeightedGaps])
def test_a_stranger_that_pushes_along_the_slave_is_continuous(make: Callable[..., Any]) -> None:
    for case in cases(4):
        judge_as(Verdict.PASS, continuity, case, with_promises(make, continuity="C0"))


@pytest.mark.parametrize("name", ["sts_3d", "mortar_3d", "vts_cell_3d", "nts_ar_3d"])
def test_a_force_that_crosses_edges_of_a_flat_master_is_continuous(name: str) -> None:
    smooth = with_promises(getattr(contactverif_surfaces, name), continuity="C0")
    for case in draw_cases(sliding_surface_cases(), seed="sliding", examples=6).cases:
        judge_as(Verdict.PASS, continuity, case, smooth)


def test_a_part_that_crosses_an_edge_changes_to_projected_areas() -> None:
    """The first edge of the slave enters the second face at 1/4 of its way, and its last one at 3/4."""
    measurement = continuity.measure(named_case("sliding-faces"), load_subject("vts-ppt-3d"))
    assert measurement.values["jump of a force"] == pytest.approx(0.034, abs=1e-3)
    assert measurement.details["place of the largest jump"] == pytest.approx(0.75, abs=1e-6)


def test_the_size_and_the_place_of_a_jump_are_found() -> None:
    """The middle node of the slave passes the roof at 2.25 after 0.39 of its way: its force turns by both slopes."""
    measurement = continuity.measure(named_case("sliding"), load_subject("nts"))
    middle, roof, depth = 1.5, 2.25, 0.375 + 0.5
    angles = np.arctan([0.5 / 1.5, -0.5 / 2.0])
    bisector = angles.mean()
    place = (roof + depth * np.tan(bisector) - middle) / 2
    assert measurement.details["jumps"] == 2  # The other one is that of the last node, in a valley.
    assert measurement.details["place of the largest jump"] == pytest.approx(place, abs=0.02)
    assert measurement.values["jump of a force"] > 0.1


def test_jumps_of_a_function_are_told_from_its_slope() -> None:
    def function(places: FloatArray) -> FloatArray:
        steep = np.sin(2 * places) / 2 + abs(places - 0.61) / 4
        return np.stack([steep + 2e-2 * (places > 0.3) - 4e-2 * (places > 0.77), places], axis=-1)

    samples = function(np.linspace(0, 1, N_STEPS + 1))
    jumps = find_jumps(function, samples, 20, 2.0**-12)
    sizes = {round(place, 4): size for place, size in jumps if size > 1e-3}
    assert sizes == {0.77: pytest.approx(4e-2, rel=1e-2), 0.3: pytest.approx(2e-2, rel=1e-2)}


@pytest.mark.parametrize(("depth", "opens"), [(1 / 16, 1), (1 / 2, 0), (-1 / 16, 0)])
def test_a_length_that_leaves_the_master_in_one_moment_opens(depth: float, opens: int) -> None:
    """The slave is parallel to the second facet, and slides down its slope, by 1/4 in all."""
    line = np.array([[-3.0, 0.0], [0.0, 0.75], [6.0, -0.75]])
    slave = np.array([[1.0, 0.5 - depth], [3.0, -depth]])
    assert _opens_at_once(slave, line, 1.0) == opens


def test_the_slope_is_asked_on_most_ways() -> None:
    cases = draw_cases(sliding_cases(), seed="1", examples=100).cases
    opening = [case for case in cases if case.parameter("opens")]
    assert 2 < len(opening) < 25
    smooth = Subject("cloud", Cloud)
    measured = [continuity.measure(case, smooth) for case in (opening[0], *cases[:8])]
    with_slope = [len(measurement.numbers) == 2 for measurement in measured]
    assert not with_slope[0]
    assert sum(with_slope) >= 6
