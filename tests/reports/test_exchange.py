"""Other programs read of a run: JSON with its schema, and JUnit's XML."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import msgspec
import numpy as np
import pytest
from handmade_report import run_with_kinds

from contactverif import Run, load_formulation, load_properties, verify
from contactverif.contract.result import NotLoaded, Outcome
from contactverif_reports.exchange.junit import write_junit
from contactverif_reports.exchange.run_document import SCHEMA, RunDocument, document_of, schema, write_json

IDS = ["patch.flat.single", "patch.flat.transmission", "hard.dead-zone", "complementarity", "balance.force"]


@pytest.fixture(scope="module")
def run() -> Run:
    """Return a run with rows of all kinds: kept, stated to fail, failed without a promise, broken, not loaded."""
    result = verify([load_formulation("nts"), load_formulation("vts-ppt")], load_properties(IDS), examples=3, seed=1)
    rows = result.row_of
    rows["nts", "patch.flat.single"] = replace(
        rows["nts", "patch.flat.single"], promise=True, promised_by="patch.flat.single=True"
    )
    absent = NotLoaded("gone", "no \x1b[31mmodule")
    return replace(result, rows=tuple(rows.values()), not_loaded=(absent,), opposite_signs=("vts-ppt",))


def test_the_document_says_what_the_run_says(run: Run, tmp_path: Path) -> None:
    write_json(run, tmp_path / "run.json")
    document = msgspec.json.decode((tmp_path / "run.json").read_bytes(), type=RunDocument)
    assert document == document_of(run)
    assert not document.promises_kept
    rows = {(row.formulation, row.property): row for row in document.rows}
    assert len(rows) == len(run.rows) == 2 * len(IDS)
    broken = rows["nts", "patch.flat.single"]
    assert broken.breaks == "promised to pass, but fails"
    assert broken.counterexample is not None
    assert len(broken.counterexample.nodes) == len(broken.counterexample.positions) >= 4
    assert broken.counterexample.slave[0] == [0, 1]
    assert [number.name for number in broken.counterexample.numbers]
    assert document.not_loaded[0].name == "gone"
    assert document.opposite_signs == ["vts-ppt"]


def test_a_property_that_says_idle_with_a_truth_of_numpy_has_a_document(tmp_path: Path) -> None:
    """`hard.c` said so of a formulation without forces: `size == 0 and bounds[0] > 0`."""
    run = run_with_kinds()
    rows = [replace(row, outcomes=tuple(map(_idle_by_numpy, row.outcomes))) for row in run.rows]
    write_json(replace(run, rows=tuple(rows)), tmp_path / "run.json")
    document = msgspec.json.decode((tmp_path / "run.json").read_bytes(), type=RunDocument)
    assert sum(row.idle for row in document.rows) > 0


def _idle_by_numpy(outcome: Outcome) -> Outcome:
    if outcome.measurement is None:
        return outcome
    return replace(outcome, measurement=replace(outcome.measurement, idle=np.bool_(True)))


def test_the_schema_in_the_repository_is_that_of_the_document() -> None:
    """`python tests/reports/test_exchange.py` writes it anew."""
    assert SCHEMA.read_bytes() == schema()


def test_a_number_that_is_not_finite_is_null(run: Run, tmp_path: Path) -> None:
    number = document_of(run.only(["hard.dead-zone"])).rows[0].closest
    assert number is not None
    encoded = msgspec.json.encode(msgspec.structs.replace(number, value=float("inf")))
    assert msgspec.json.decode(encoded)["value"] is None


def test_each_row_is_a_test_case_that_ends_as_the_row_does(run: Run, tmp_path: Path) -> None:
    write_junit(run, tmp_path / "run.xml")
    by_name = {str(suite.get("name")): suite for suite in ElementTree.parse(tmp_path / "run.xml").getroot()}
    nts = by_name["nts"]
    assert {"tests": "5", "failures": "1", "errors": "0", "skipped": "3"}.items() <= nts.attrib.items()
    assert {str(case.get("name")): [each.tag for each in case] for case in nts} == {
        "patch.flat.single": ["failure"], "patch.flat.transmission": ["skipped"], "complementarity": ["skipped"],
        "hard.dead-zone": ["skipped"], "balance.force": [],
    }  # fmt: skip
    failure = nts.find("testcase[@name='patch.flat.single']/failure")
    assert failure is not None
    assert str(failure.text).startswith("promised to pass, but fails: ")
    assert "slave" in str(failure.text)  # The drawing
    assert [case.get("name") for case in by_name["vts-ppt"].findall("testcase[failure]")] == ["sign"]
    assert by_name["gone"].get("errors") == "1"


if __name__ == "__main__":
    (Path(__file__).parents[2] / "reports" / "contactverif_reports" / "exchange" / SCHEMA.name).write_bytes(schema())
