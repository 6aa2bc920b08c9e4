"""Hertz' contact as a question: who converges, who does not, and strangers who compute it in other ways."""

import numpy as np
import pytest
from subjects import judge_as, load_subject, measure_case, with_promises
from textbook_cells import ClippedCells, WeightedGaps

from contactverif import Case, Subject, Traits, Verdict, judge_case
from contactverif.mechanics.solving import solve_for_accuracy
from contactverif.problems.hertz_box import COARSEST, mesh_lines
from contactverif.problems.hertz_studies import BOX, HERTZ_STUDIES, PENALTIES, HertzStudy, hertz_cases
from contactverif.problems.problem import FORCES, Errors
from contactverif_properties.convergence import accuracy_hertz

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
    assert accuracy_hertz.exact is not None
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
