"""`accuracy.hertz`, `accuracy.wavy` and `accuracy.wavy-curved` with right and wrong formulations."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from subjects import judge_as, load_subject, measure_case, with_promises, with_verbs
from textbook_cells import ClippedCells, WeightedGaps
from wave_strangers import Heights

from contactverif import Case, Promises, Property, Subject, Traits, Verdict, judge_case
from contactverif.mechanics.accuracy import solve_for_accuracy
from contactverif.problems.hertz_boxes import (
    BOX,
    COARSEST,
    HERTZ_STUDIES,
    PENALTIES,
    HertzStudy,
    hertz_cases,
    mesh_lines,
)
from contactverif.problems.problem import FORCES, PRESSURE, Errors
from contactverif.problems.wavy import LOWER, MESHES, UPPER, WAVY_STUDIES, WavyStudy
from contactverif.run.run import run
from contactverif_properties.convergence import (
    accuracy_hertz,
    accuracy_wavy,
    accuracy_wavy_curved,
    promise_without_locking,
)

CASES = {case.name: case for case in hertz_cases()}


def test_each_body_is_the_slave_at_each_penalty() -> None:
    assert list(CASES) == [f"{slave}-{word}" for slave in ("parabola", "flat") for word in PENALTIES]
    groups = {HertzStudy(slave, *penalty).group(Traits()) for slave in (True, False) for penalty in PENALTIES.values()}
    assert groups == {"layer", "soft", "parabola stiff", "flat stiff"}
    assert all(bound.limit(group) > 0 for bound in HERTZ_STUDIES.bounds if not bound.rate for group in groups)
    assert CASES["parabola-layer"].penalty == BOX.young[0]
    assert CASES["flat-stiff"].penalty == pytest.approx(100 * CASES["flat-soft"].penalty)


def test_a_case_that_was_stored_is_the_same_study() -> None:
    case = CASES["flat-soft"]
    again = Case.from_arrays(case.to_arrays())
    subject = load_subject("sts")
    values = [accuracy_hertz.measure(each, subject).values for each in (case, again)]
    assert values[0] == values[1]


def test_the_forces_of_a_picture_are_those_of_the_exact_pressure() -> None:
    case = CASES["parabola-soft"]
    forces = accuracy_hertz.exact(case)
    assert forces.sum(axis=0) == pytest.approx(0, abs=1e-12)
    total = BOX.pressure(case.penalty).force
    assert forces[: case.interface.n_slave_nodes].sum(axis=0) == pytest.approx([0, total], rel=1e-12)


@pytest.mark.parametrize("name", ["nts", "vts-g:n=3", "vts-me:n=4", "two-pass/nts"])
def test_the_master_forces_of_others_are_far_from_the_best_even_at_a_fixed_penalty(name: str) -> None:
    """More points a segment make the error smaller; with four it is still twice what is allowed."""
    outcome = judge_as(Verdict.FAIL, accuracy_hertz, CASES["parabola-layer"], load_subject(name))
    (number,) = (each for each in outcome.measurement.numbers if each.quantity.name == "error of master forces")
    assert number.value > 2 * number.tolerance


@pytest.mark.parametrize("name", ["vts-ppt:n=1", "vts-ppt-balanced:n=1"])
def test_one_point_a_segment_is_right_although_its_rate_is_low(name: str) -> None:
    """On a flat slave at E/h its forces have the rate 0.82 on four meshes, and 0.6 of the error of two points."""
    subject, case = load_subject(name), CASES["flat-soft"]
    outcome = judge_as(Verdict.PASS, accuracy_hertz, case, subject)
    others = measure_case(accuracy_hertz, case, load_subject("vts-ppt")).values
    assert all(outcome.measurement.values[f"error of {side}"] < 0.7 * others[f"error of {side}"] for side in FORCES)


@pytest.mark.parametrize(("name", "length"), [("mortar-lm", 1), ("vts-g:n=8", 5), ("vts-g:n=3", 1)])
def test_coarser_meshes_are_solved_where_the_error_alone_does_not_decide(name: str, length: int) -> None:
    """Eight Gauss points a segment have 1.8 P1 on the layer; three have 14."""
    measurement = measure_case(accuracy_hertz, CASES["parabola-layer"], load_subject(name))
    assert {len(values) for values in measurement.series.values()} == {length}
    assert any("rate" in quantity for quantity in measurement.values) == (length > 1)


@pytest.mark.parametrize("penalty", [None, 8.0])
def test_the_error_of_the_best_pressures_falls_like_the_segments(penalty: float | None) -> None:
    """Constant pressures have the rate 1; linear ones have that of the edge, a root or a kink."""
    pressure = BOX.pressure(penalty)
    errors = np.array([[best(mesh_lines(0, across)[2]) for across in (33, 66, 132)]
                       for best in (pressure.linear_error, pressure.constant_error)])  # fmt: skip
    linear, constant = np.log2(errors[:, :-1] / errors[:, 1:])
    assert linear == pytest.approx(1.0, abs=0.06) if penalty is None else (linear > 1.0).all()
    assert constant == pytest.approx(0.95, abs=0.1)


@pytest.mark.parametrize(("make", "name"), [(ClippedCells, "sts"), (WeightedGaps, "mortar")])
def test_a_stranger_who_clips_cells_has_the_same_errors(make: type, name: str) -> None:
    def errors_of(subject: Subject) -> Errors:
        instance = HertzStudy(parabola_is_slave=False, stiffness=1.0).pose(COARSEST, subject.traits)
        solution = solve_for_accuracy(instance.scene, subject, instance.start)
        assert solution.balanced
        return instance.errors(solution)

    theirs, ours = errors_of(Subject(make.__name__, make)), errors_of(load_subject(name))
    assert len(theirs) == 6
    assert theirs == {kind: pytest.approx(error, rel=0.15) for kind, error in ours.items()}


def test_half_of_a_balance_is_found_at_a_stiff_penalty() -> None:
    """Two half passes push both bodies with different forces where these are not parallel."""
    subject = load_subject("mortar-two-half-pass")
    verdicts = [judge_case(accuracy_hertz, CASES[f"parabola-{word}"], subject).verdict for word in PENALTIES]
    assert verdicts == [Verdict.PASS, Verdict.PASS, Verdict.FAIL]


def test_what_has_no_solution_is_not_asked() -> None:
    assert "no solution" in accuracy_hertz.refusal(load_subject("vts-ppt-lm").traits)
    assert "barrier" in accuracy_hertz.refusal(with_promises(ClippedCells, enforcement="barrier").traits)


def test_the_penalty_is_that_of_its_word() -> None:
    assert HertzStudy(True, 2.0, fixed=True).penalty(16) == HertzStudy(True, 2.0, fixed=True).penalty(48) == 2.0
    assert HertzStudy(True, 2.0).penalty(48) / HertzStudy(True, 2.0).penalty(16) == pytest.approx(145 / 49)


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
    silent = with_verbs("vts-ppt", contact_points=None)
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
        error = (points.pressure - instance.pressure(points.position)) / instance.pressure_scale
        errors.append([np.sqrt(np.mean(each**2)) for each in (error, (error[1:] + error[:-1]) / 2)])
    alternating, means = np.transpose(errors)
    assert (alternating > 0.02).all()
    assert means[-1] < 0.3 * means[0] < 0.003
