"""The judges of accuracy clear right formulations of other kinds, and tell those that do not converge or that lock."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from subjects import Changed, judge_as, load_subject
from wave_strangers import Heights

import contactverif_nts
from contactverif import Case, Promises, Property, Subject, Traits, Verdict, judge_case
from contactverif.mechanics.solving import solve_for_accuracy
from contactverif.problems.problem import PRESSURE
from contactverif.problems.wavy import LOWER, MESHES, UPPER, WAVY_STUDIES, WavyStudy
from contactverif.run.run import run
from contactverif_properties.convergence import accuracy_wavy, accuracy_wavy_curved, promise_without_locking

NAMES = ("upper slave, 10 E/h", "upper slave, 1000 E/h", "lower slave, 10 E/h", "lower slave, 1000 E/h")
CONTRAST_NAMES = ("finer slave, 10 E/h", "coarser slave, 10 E/h")
CURVED_NAMES = tuple(name.replace("1000", "100") for name in NAMES)


def _case(question: Property, name: str) -> Case:
    return next(case for case in question.cases(None) if case.name == name)


@pytest.mark.parametrize(
    ("question", "names"), [(accuracy_wavy, NAMES + CONTRAST_NAMES), (accuracy_wavy_curved, CURVED_NAMES)]
)
def test_there_are_these_studies_and_none_on_a_given_interface(question: Property, names: tuple[str, ...]) -> None:
    cases = question.cases(None)
    assert tuple(case.name for case in cases) == names
    assert question.cases(None) is cases
    assert question.cases(cases[0].interface) is None


def test_a_stored_case_is_the_same_study() -> None:
    case = _case(accuracy_wavy_curved, "lower slave, 100 E/h")
    study = WavyStudy.from_case(Case.from_arrays(case.to_arrays()))
    assert study == WavyStudy(LOWER, 100.0, 1e-6)
    assert study.penalty(1) == pytest.approx(100 * 6 / 4)


def test_a_coarser_slave_has_a_quarter_of_the_segments_and_none_of_the_inner_nodes() -> None:
    case = _case(accuracy_wavy, CONTRAST_NAMES[1])
    study = WavyStudy.from_case(Case.from_arrays(case.to_arrays()))
    assert study == WavyStudy(LOWER, 10.0, contrast=True)
    for refine in study.meshes:
        interface = study.pose(refine, Traits()).scene.interface
        assert 4 * len(interface.slave) == len(interface.master) == 4 * refine
        assert study.penalty(refine) == pytest.approx(10 * refine / 4)
        slave, master = (np.unique(side.segments) for side in (interface.slave, interface.master))
        distances = np.abs(interface.nodes[slave, 0] - interface.nodes[master, :1])
        assert (distances < 1e-3).sum() == 2, "the ends"


RIGHT: dict[str, Callable[..., Any]] = {
    "linear pressures, nothing reported": lambda *, penalty: Heights(penalty, constant=False),
    "linear pressures at points": lambda *, penalty: Heights(penalty, constant=False, reports="points"),
    "constant pressures at points": lambda *, penalty: Heights(penalty, constant=True, reports="points"),
    "constant pressures, one point a segment": lambda *, penalty: Heights(penalty, constant=True, reports="segments"),
}


@cache
def _right(name: str) -> Subject:
    return Subject(name, RIGHT[name])


@pytest.mark.parametrize("case", NAMES[::2] + CONTRAST_NAMES)
@pytest.mark.parametrize("name", RIGHT)
def test_a_right_formulation_of_another_kind_is_cleared(name: str, case: str) -> None:
    judge_as(Verdict.PASS, accuracy_wavy, _case(accuracy_wavy, case), _right(name))


@pytest.mark.parametrize("name", ["nts-ar", "vts-me", "vts-me:n=12"])
def test_a_slave_coarser_than_the_master_tells_who_fails_the_patch_test(name: str) -> None:
    """Many points hide the error of VTS-ME where meshes are alike, and not here."""
    measurement = accuracy_wavy.measure(_case(accuracy_wavy, CONTRAST_NAMES[1]), load_subject(name))
    assert measurement.values["rate of forces"] < 0.1


def test_constant_pressures_have_the_error_that_the_bound_is_made_of() -> None:
    case = _case(accuracy_wavy, NAMES[0])
    measurement = accuracy_wavy.measure(case, _right("constant pressures at points"))
    error = WavyStudy(UPPER, 10.0).pose(MESHES[-1], Traits()).best[PRESSURE]
    assert measurement.values["pressure error on the finest mesh"] == pytest.approx(error, rel=0.02)
    assert measurement.tolerances["pressure error on the finest mesh"] == 2 * error
    assert measurement.values["rate of pressures"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("name", "question", "case"), [
    ("nts-ar", accuracy_wavy, NAMES[0]),
    ("vts-me", accuracy_wavy, NAMES[0]),
    ("sts", accuracy_wavy_curved, CURVED_NAMES[1]),
    ("vts-ppt", accuracy_wavy_curved, CURVED_NAMES[1]),
])  # fmt: skip
def test_the_errors_of_all_meshes_are_kept_and_a_witness_fails_clearly(
    name: str, question: Property, case: str
) -> None:
    outcome = judge_as(Verdict.FAIL, question, _case(question, case), load_subject(name))
    assert outcome.measurement.series.keys() == WAVY_STUDIES.series.keys()
    assert {values.shape for values in outcome.measurement.series.values()} == {(len(MESHES),)}
    error = "pressure error on the finest mesh"
    assert outcome.measurement.values[error] > 1.1 * outcome.measurement.tolerances[error]


def test_a_solution_with_multipliers_is_the_one_without_springs() -> None:
    """The penalty is the scale of the contact decision alone, so both cases measure the same."""
    mortar = load_subject("mortar-lm")
    soft, stiff = (accuracy_wavy.measure(_case(accuracy_wavy, name), mortar) for name in NAMES[:2])
    np.testing.assert_allclose(list(soft.values.values()), list(stiff.values.values()), rtol=1e-6)


def test_pressures_that_two_passes_share_are_not_judged() -> None:
    measurement = accuracy_wavy.measure(_case(accuracy_wavy, NAMES[0]), load_subject("two-pass/nts-ar"))
    assert "pressure error" not in measurement.series
    assert "pressure error on the finest mesh" not in measurement.values


def test_no_solution_is_undecided() -> None:
    class Wanderer:
        """A formulation whose forces have no zero: they change sign at random with the last digit."""

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return 1e-6 * np.sin(1e9 * z)

    outcome = judge_case(accuracy_wavy, _case(accuracy_wavy, NAMES[0]), Subject("w", lambda *, penalty: Wanderer()))
    assert outcome.verdict is Verdict.UNDECIDED
    assert "finds no solution on mesh" in outcome.reason


@pytest.mark.parametrize(("converges", "locks", "promise"), [
    (True, False, True), (True, True, False), (True, None, None),
    (False, False, False), (False, None, False), (None, False, None), (None, True, False), (None, None, None),
])  # fmt: skip
def test_who_converges_and_does_not_lock_promises_the_curved_interface(
    converges: bool | None, locks: bool | None, promise: bool | None
) -> None:
    assert promise_without_locking(Traits(promises=Promises(converges=converges, locks=locks))) is promise


def test_who_locks_and_reports_no_pressure_is_not_held_to_fail() -> None:
    """Its pressures alone show it here, so that "stated to fail, but passes" accused a right formulation."""
    silent = Subject(
        "silent", lambda *, penalty: Changed(contactverif_nts.vts_ppt(penalty=penalty), contact_points=None)
    )
    row = run([silent], [accuracy_wavy_curved], shrink="none").rows[0]
    assert accuracy_wavy_curved.promise(silent.traits) is False
    assert (row.verdict, row.promise, row.unexpected) == (Verdict.PASS, None, "")


def test_pressures_of_one_point_a_segment_alternate_on_a_finer_slave_so_their_convergence_is_not_promised() -> None:
    """The inf-sup constant falls as h. Forces and the means of two neighbours converge."""
    case, subject = _case(accuracy_wavy, CONTRAST_NAMES[0]), load_subject("vts-ppt-lm:n=1")
    outcome = judge_as(Verdict.FAIL, accuracy_wavy, case, subject)
    assert outcome.reason.startswith("rate of pressures")
    assert subject.traits.promises.converges is None
    study, errors = WAVY_STUDIES.read(case), []
    for mesh in study.meshes[-3:]:
        instance = study.pose(mesh, subject.traits)
        points = solve_for_accuracy(instance.scene, subject, instance.start, instance.step).points
        assert points is not None
        error = (points.pressure - instance.pressure(points.position)) / instance.pressure_scale
        errors.append([np.sqrt(np.mean(each**2)) for each in (error, (error[1:] + error[:-1]) / 2)])
    alternating, means = np.transpose(errors)
    assert (alternating > 0.02).all()
    assert means[-1] < 0.3 * means[0] < 0.003
