"""A property has cases by dimension: one without cases in space is not asked there, and plane ones stay."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from subjects import load_property, load_subject

import contactverif_surfaces
from contactverif import Interface, MisuseError, Property, Subject, Traits, Verdict, load_properties, named_case
from contactverif.contract.case import name_of_source
from contactverif.run.run import run

IN_SPACE = Traits().revise(dimensions=(3,))


def loaded_properties() -> list[Property]:
    return [question for question in load_properties() if isinstance(question, Property)]


@pytest.mark.parametrize("dimensions", [(2,), (2, 3)])
def test_a_plane_formulation_gets_the_property_itself(dimensions: tuple[int, ...]) -> None:
    traits = Traits().revise(dimensions=dimensions)
    assert all(question.for_traits(traits) is question for question in loaded_properties())


def test_a_formulation_in_space_gets_the_same_question_with_other_cases() -> None:
    question = load_property("balance.force")
    there = question.for_traits(IN_SPACE)
    assert there is question.for_traits(IN_SPACE)
    assert there is there.for_traits(IN_SPACE)
    assert there.cases is question.cases_in_space
    assert (there.id, there.measure, there.info.quantities) == (question.id, question.measure, question.info.quantities)
    copy = pickle.loads(pickle.dumps(there))
    assert name_of_source(copy.cases) == name_of_source(there.cases) != name_of_source(question.cases)


def test_quadrilaterals_have_a_source_of_their_own() -> None:
    question, triangles = load_property("balance.force"), load_property("balance.force").for_traits(IN_SPACE)
    quadrilaterals = question.for_traits(IN_SPACE.revise(faces=(4,)))
    assert quadrilaterals.for_traits(IN_SPACE.revise(faces=(4,))) is quadrilaterals
    assert quadrilaterals.cases != triangles.cases
    copy = pickle.loads(pickle.dumps(quadrilaterals))
    assert copy.cases == quadrilaterals.cases
    assert name_of_source(copy.cases).startswith(name_of_source(triangles.cases))
    assert name_of_source(copy.cases) != name_of_source(triangles.cases)  # A run draws the cases of a name once.


def test_cases_in_space_have_stored_names_of_their_own() -> None:
    random = [question for question in loaded_properties() if not question.cases.is_list]
    both = [question for question in random if question.cases is not question.cases_in_space]
    plane = {name_of_source(question.cases) for question in both}
    space = {name_of_source(question.cases_in_space) for question in random if question.cases_in_space}
    assert "" not in space
    assert not plane & space


def test_lists_in_space_are_asked_beside_those_of_the_plane() -> None:
    questions = [load_property(name) for name in ("hard.deep", "hard.search")]
    rows = run([load_subject("vts-ppt"), load_subject("vts-cell-3d")], questions, examples=1, seed=1).rows
    assert {(row.formulation, row.property_id): row.judged for row in rows} == {
        ("vts-ppt", "hard.deep"): 6,
        ("vts-ppt", "hard.search"): 20,
        ("vts-cell-3d", "hard.deep"): 6,
        ("vts-cell-3d", "hard.search"): 19,
    }


def test_a_question_about_the_plane_alone_is_not_applicable_in_space() -> None:
    question = load_property("hard.c")
    assert question.cases_in_space is None
    assert question.for_traits(IN_SPACE) is question
    assert "plane" in question.refusal(IN_SPACE)
    assert "triangles" in load_property("projection.place").refusal(IN_SPACE.revise(faces=(4,)))
    barrier = IN_SPACE.revise(enforcement="barrier", activation=0.1)
    assert "barrier" in load_property("balance.force").refusal(barrier)


def test_a_run_asks_each_formulation_in_its_own_dimension() -> None:
    subjects = [load_subject("sts"), load_subject("nts-3d")]
    questions = [load_property(name) for name in ("balance.force", "hard.c", "patch.flat.transmission")]
    result = run(subjects, questions, examples=4, seed=3, shrink="none")
    rows = {(row.formulation, row.property_id): row for row in result.rows}
    assert len(rows) == 6
    assert rows["nts-3d", "hard.c"].verdict is Verdict.NOT_APPLICABLE
    assert rows["nts-3d", "patch.flat.transmission"].verdict is Verdict.FAIL
    for name, dim in (("sts", 2), ("nts-3d", 3)):
        assert {outcome.case.interface.dim for outcome in rows[name, "balance.force"].outcomes} == {dim}
    alone = run(subjects[:1], questions, examples=4, seed=3, shrink="none")
    for row in alone.rows:
        beside = rows["sts", row.property_id]
        assert [each.measurement.values for each in row.outcomes if each.measurement] == [
            each.measurement.values for each in beside.outcomes if each.measurement
        ]


def test_a_flat_failure_in_space_shrinks_to_squares() -> None:
    (row,) = run([load_subject("nts-3d")], [load_property("patch.flat.transmission")], examples=10, seed=1).rows
    assert row.witness is not None
    assert row.witness.verdict is Verdict.FAIL
    wrong = replace(load_property("patch.flat.transmission"), promise=lambda traits: True)
    (row,) = run([load_subject("nts-3d")], [wrong], examples=10, seed=1, shrink="all").rows
    assert row.shrunk is not None
    interface = row.shrunk.case.interface
    assert len(interface.slave) + len(interface.master) <= 6


@pytest.mark.parametrize(("name", "case", "dimension"), [("sts-3d", "a1", 2), ("sts", "crossed-diagonals", 3)])
def test_an_interface_of_another_dimension_is_refused_before_a_plugin_sees_it(
    name: str, case: str, dimension: int
) -> None:
    state = named_case(case)
    with pytest.raises(
        MisuseError, match=f"interface: found nodes with {dimension} coordinates; needed {5 - dimension}"
    ):
        load_subject(name).for_case(state).pair(state.interface, state.z)


def test_faces_that_a_formulation_does_not_take_are_refused_before_a_kernel_reads_past_their_corners() -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    interface = Interface.from_faces(square - [0, 0, 0.1], [[3, 2, 1, 0]], square, [[0, 1, 2, 3]])
    cells = load_subject("vts-cell-3d").with_penalty(1.0)
    with pytest.raises(MisuseError, match="interface: found faces with 4 corners; needed 3, which the formulation"):
        cells.pair(interface, interface.nodes.reshape(-1))
    with pytest.raises(MisuseError, match="interface: found faces with 4 corners; needed triangles"):
        contactverif_surfaces.vts_cell_3d(penalty=1.0).pair(interface, interface.nodes.reshape(-1))


def test_a_witness_of_another_dimension_is_refused_by_its_name() -> None:
    inner = load_subject("nts-3d")
    traits = inner.traits.revise(witnesses={"patch": "a1"})
    wrong = Subject("wrong", lambda *, penalty: replace(inner.with_penalty(penalty).plugin, traits=traits))
    (row,) = run([wrong], [load_property("patch.flat.transmission")], examples=1, seed=1).rows
    assert row.unexpected
    assert "witness of patch.flat.transmission: found 'a1', whose interface has 2 coordinates" in row.reason


def test_two_passes_in_space_keep_their_promises_and_report_points() -> None:
    subject = load_subject("two-pass/nts-3d")
    names = ("balance.force", "patch.flat.transmission", "patch.flat.resultant", "purity", "swap")
    result = run([subject], [load_property(name) for name in names], examples=6, seed=2, shrink="none")
    assert result.promises_kept
    assert {row.property_id: row.verdict for row in result.rows}["patch.flat.transmission"] is Verdict.FAIL
    case = named_case("crossed-diagonals")
    formulation = subject.for_case(case)
    points = formulation.contact_points(case.interface, formulation.pair(case.interface, case.z), case.z)
    assert points.on_master.tolist() == [False] * 4 + [True] * 4
