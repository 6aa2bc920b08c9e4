"""The command line about interfaces in space: lists, explanations, comparisons, files for ParaView."""

from pathlib import Path

import meshio
from asking import Ask, check_mistake

TRANSMISSION = ("-p", "patch.flat.transmission", "--examples", "2", "--seed", "1")


def test_the_list_and_an_explanation_say_dimensions(ask: Ask) -> None:
    words = " ".join(ask("list").out.split())
    assert " nts-3d 3-D fails the flat patch test" in words
    assert " nts 2-D fails the flat patch test" in words
    assert " hard.c 2-D Cases C" in words
    assert " balance.force 2-D, 3-D The forces" in words
    assert "Dimensions: in the plane, and in space, where a segment is a face" in ask("explain", "balance.force").out
    assert "Dimensions: in the plane\n" in ask("explain", "hard.c").out


def test_a_comparison_across_dimensions_says_what_it_cannot_compare(ask: Ask) -> None:
    answer = ask("compare", "nts-3d", "--against", "vts-ppt", *TRANSMISSION)
    words = " ".join(answer.out.split())
    assert "nts-3d and vts-ppt are asked on different interfaces, of other dimension or faces: verdicts and" in words
    assert "--show all" not in words  # There is no case on which both were judged.


def test_a_comparison_in_space_draws_the_mesh_in_space(ask: Ask) -> None:
    answer = ask("compare", "nts-3d", "--against", "vts-cell-3d", "--show", "all", *TRANSMISSION)
    assert "different interfaces" not in answer.out
    assert " master triangle" in answer.out


def test_a_formulation_of_other_faces_is_compared_on_equal_cases_alone(ask: Ask) -> None:
    answer = ask("compare", "vts-cell-3d", "--against", "sts-3d", *TRANSMISSION, "-p", "patch.tilted.nodal")
    words = " ".join(answer.out.split())
    assert "vts-cell-3d and sts-3d are asked on different interfaces" in words
    assert "patch.tilted.nodal" in words  # Both are asked about the same triangles there.


def test_a_stored_case_in_space_is_written_for_paraview(ask: Ask, tmp_path: Path) -> None:
    report, picture = tmp_path / "report.nc", tmp_path / "case.vtu"
    assert ask("verify", "nts-3d", *TRANSMISSION, "--shrink", "none", "--out", report).status == 0
    for command, status in (("replay", 1), ("draw", 0)):
        answer = ask(command, report, "--case", "nts-3d.patch.flat.transmission.witness", "--out", picture)
        assert answer.status == status
        assert f"for ParaView: {picture}\n" in answer.out
        assert "exact_force" in meshio.read(picture).point_data
    plane = tmp_path / "plane.nc"
    ask("verify", "nts", *TRANSMISSION, "--shrink", "none", "--out", plane)
    case = "nts.patch.flat.transmission.witness"
    check_mistake(ask("replay", plane, "--case", case, "--out", picture), r".*a case without bodies; needed a .png.*")
