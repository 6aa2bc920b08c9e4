"""The command `compare`: tables, exit statuses, files, and one line for each thing that cannot be asked."""

import re
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import netCDF4
import pytest
from asking import Ask, check_mistake
from reports.page_reader import Page

from contactverif import Run, Verdict, load_formulation, load_properties
from contactverif.run import judge as judging
from contactverif.run.run import run
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.write import write

PUNCH = Path(__file__).parents[1] / "data" / "punch.msh"
VTS_ME = "compare vts-me --against vts-ppt"
QUICK = f"{VTS_ME} --examples 12 --seed 1 -p patch.flat.transmission -p balance.force"


def run_properties(names: Sequence[str], *globs: str, examples: int = 12, seed: int = 1) -> Run:
    subjects = [load_formulation(name) for name in names]
    return run(subjects, load_properties(globs or ["patch.flat.transmission"]), examples=examples, seed=seed)


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of reports: `old`, `same`, `worse` (as bad as VTS-ME), `other` (other seed), `nts`, `purity`."""
    folder = tmp_path_factory.mktemp("reports")
    old, other = run_properties(["vts-ppt"]), run_properties(["vts-ppt"], seed=2)
    (promised,), (worse,) = old.rows, run_properties(["vts-me"]).rows
    row = replace(worse, formulation=promised.formulation, promise=promised.promise)
    runs = {
        "old": old,
        "same": old,
        "worse": replace(old, rows=(row,)),
        "other": other,
        "nts": run_properties(["nts"]),
        "purity": run_properties(["vts-ppt"], "purity", examples=2),
    }
    for name, result in runs.items():
        write(result, folder / f"{name}.nc")
    return folder


def read_page(path: Path) -> Page:
    """Read a page, which has no link to another file."""
    page = Page(path.read_text(encoding="utf-8"))
    assert not [link for link in page.links if not link.startswith("#")]
    return page


# ---------------------------------------------------------------------------------------------------------------------
# Formulations


def test_formulations_side_by_side(ask: Ask, tmp_path: Path) -> None:
    answer = ask(f"{QUICK} -v")
    assert answer.status == 0  # vts-me says itself that it fails the patch test
    assert answer.err == ""
    assert re.search(r"vts-me against vts-ppt: profile dev: 12 random cases for each property, seed 1", answer.out)
    assert re.search(r"patch.flat.transmission +pass +≠ fails as stated", answer.out)
    assert re.search(r"balance.force +fails as stated +≠ pass", answer.out)
    assert re.search(r"256 slave segments *\n +vts-ppt .*1\.00 *\n +vts-me ", answer.out)
    assert re.search(
        r"patch.flat.transmission, case \d+\n    vts-me: fail, .* times its tolerance\n    vts-ppt: pass,", answer.out
    )
    assert re.search(
        r"\nvts-me fails \d of \d, the patch test among them, as it states. No promise is broken.$", answer.out
    )


def test_what_differs_takes_few_lines(ask: Ask) -> None:
    """Verdicts that differ, errors of accuracy, iterations and time take 25 lines of 80 columns at most."""
    words = f"{VTS_ME} --examples 3 --seed 1 --isolation inline"
    answer = ask(words, columns=80)
    lines = answer.out.splitlines()
    assert answer.status == 0
    assert len(lines) <= 25
    assert max(map(len, lines)) <= 80
    assert re.search(r"vts-me against vts-ppt: the same verdict in \d\d of \d\d properties", answer.out)
    assert re.search(r"\n  patch.flat.transmission +fails as stated +\S+ pass +\S+ *\n", answer.out)
    assert re.search(r"\n  accuracy.arc +pass +\S+ pass +\S+ *\n", answer.out)
    assert re.search(r"\n  \d+ more differ: ", answer.out)
    assert re.search(r"\nNewton iterations: fewer in \d+ cases, the same in \d+, more in \d+\.\n", answer.out)
    assert re.search(r"\nvts-me: an evaluation takes \d\S* µs on 16 segments, \S+ times vts-ppt;", answer.out)
    assert ask(f"{words} -q -p balance.force").out == "Every promise is kept and every property was judged.\n"


def test_the_verdicts_stay_if_nobody_waits_for_the_times(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def press(*_: object, progress: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("contactverif.cli.compare.measure_costs", press)
    answer = ask(QUICK, "--out", tmp_path / "r.nc", "--out", tmp_path / "r.html")
    assert answer.status == 130
    assert re.search(r"\n  patch.flat.transmission +fails as stated ", answer.out)
    assert "an evaluation takes" not in answer.out
    assert answer.out.splitlines()[-1] == "Stopped before the time of an evaluation was known; all else is above."
    assert "No evaluation was timed." in read_page(tmp_path / "r.html").text
    assert ask(f"{QUICK} -q").status == 0  # Without a page nothing is timed that is not printed.
    assert ask("report", tmp_path / "r.nc").status == 0


def test_a_comparison_draws_all_meshes_on_which_formulations_differ(ask: Ask) -> None:
    answer = ask(f"{QUICK} --show all")
    assert len(re.findall(r"^(\S+), case \d+$", answer.out, flags=re.MULTILINE)) == 2


def test_every_file_that_is_named_is_written(ask: Ask, tmp_path: Path) -> None:
    report, html, pictures = tmp_path / "r.nc", tmp_path / "r.html", tmp_path / "new" / "pictures"
    answer = ask(QUICK, "--out", report, "--out", html, "--pictures", pictures)
    assert answer.status == 0
    write(run_properties(["vts-ppt", "vts-me"], "patch.flat.transmission", "balance.force"), tmp_path / "v.nc")
    # As `verify` writes it, which knows the digests of code from its journal, too.
    assert not [words for words in same_data(report, tmp_path / "v.nc") if "code_of_" not in words]
    assert sorted(path.name for path in pictures.iterdir()) == [
        f"{name}.{id_}.png" for name in ("vts-me", "vts-ppt") for id_ in ("balance.force", "patch.flat.transmission")
    ]
    page = read_page(html)
    assert len(page.ids) == len(set(page.ids))
    # Axis and distributions; two meshes, each with the forces of both.
    assert sum(tag == "svg" for tag, _ in page.tags) == 1 + 4 + 4
    assert "vts-me against vts-ppt" in page.text
    assert "No promise is broken." in page.text


def test_a_broken_promise_of_a_candidate_is_status_1_and_of_the_reference_is_not(
    ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    """VTS-PPT under trial says that it fails `balance.force`; a harness where nothing fails breaks that."""
    judge = judging.judge_case
    monkeypatch.setattr(judging, "judge_case", lambda *result: replace(judge(*result), verdict=Verdict.PASS, reason=""))
    answer = ask("compare vts-ppt --against vts-me --examples 3 --seed 1 -p balance.force")
    assert answer.status == 1
    assert answer.out.rstrip().endswith("1 broken promise: vts-ppt balance.force (stated to fail, but passes).")
    answer = ask(f"{VTS_ME} --examples 3 --seed 1 -p balance.force -v")
    assert (answer.status, "BROKEN PROMISE" in answer.out) == (0, True)


def test_scenes_and_meshes_can_be_compared_on(ask: Ask) -> None:
    answer = ask(f"{VTS_ME} --scene c -p patch.flat.* --examples 1")
    assert answer.status == 0
    assert re.search(r"patch.flat.solve +fail.* pass ", answer.out)
    on_punch = f"--mesh {PUNCH} --slave punch --master base -p balance.force --examples 2 --seed 1"
    assert ask(f"compare nts --against vts-ppt-balanced {on_punch}").status == 0


IN_SPACE = "-p patch.flat.transmission --examples 2 --seed 1"


def test_a_comparison_across_dimensions_says_what_it_cannot_compare(ask: Ask) -> None:
    words = " ".join(ask(f"compare nts-3d --against vts-ppt {IN_SPACE}").out.split())
    assert "nts-3d and vts-ppt are asked on different interfaces, of other dimension or faces: verdicts and" in words
    assert "--show all" not in words  # There is no case on which both were judged.


def test_a_comparison_in_space_draws_the_mesh_in_space(ask: Ask) -> None:
    answer = ask(f"compare nts-3d --against vts-cell-3d --show all {IN_SPACE}")
    assert "different interfaces" not in answer.out
    assert " master triangle" in answer.out


def test_a_formulation_of_other_faces_is_compared_on_equal_cases_alone(ask: Ask) -> None:
    words = " ".join(ask(f"compare vts-cell-3d --against sts-3d {IN_SPACE} -p patch.tilted.nodal").out.split())
    assert "vts-cell-3d and sts-3d are asked on different interfaces" in words
    assert "patch.tilted.nodal" in words  # Both are asked about the same triangles there.


# ---------------------------------------------------------------------------------------------------------------------
# Reports


def test_equal_reports_have_no_regression(ask: Ask, reports: Path) -> None:
    answer = ask("compare", reports / "old.nc", reports / "same.nc")
    assert (answer.status, answer.err) == (0, "")
    assert re.search(r"patch.flat.transmission +pass .* 0 +12 +0 +\d", answer.out)
    assert answer.out.rstrip().endswith("Nothing got worse.")


def test_a_regression_is_status_1_and_named(ask: Ask, reports: Path, tmp_path: Path) -> None:
    html = tmp_path / "r.html"
    answer = ask("compare", reports / "old.nc", reports / "worse.nc", "--out", html)
    assert answer.status == 1
    assert "pass → fail" in answer.out
    words = " ".join(answer.out.split())  # it is long, and wrapped
    assert re.search(
        r" 1 regression vts-ppt, patch.flat.transmission: pass → fail .*; error grew, in tolerances, on", words
    )
    replay = re.search(r"contactverif replay (\S+) --case vts-ppt.patch.flat.transmission", answer.out)
    assert replay
    assert replay[1] == str(reports / "worse.nc")
    page = read_page(html)
    assert "1 regression." in page.text
    assert sum(tag == "svg" for tag, _ in page.tags) == 1 + 2 + 1  # axis, old and new; the mesh
    assert ask("compare", reports / "worse.nc", reports / "old.nc").status == 0


def test_no_number_is_cut_in_80_columns(ask: Ask, reports: Path) -> None:
    tables = ask("compare", reports / "old.nc", reports / "worse.nc", columns=80).out.partition("\nvts-ppt, patch")[0]
    assert "…" not in tables
    assert re.search(r"better +equal +worse +time", tables)
    words = "compare vts-me mortar --against vts-ppt -v -p patch.flat.* --seed 1 --examples 3"
    tables = ask(words, columns=80).out.partition("\npatch.flat.")[0]
    assert "…" not in tables
    assert re.search(r"median +worst +ratio +better +equal +worse *\n", tables)
    assert re.search(r"converged +median +most +fewer +same +more +order *\n", tables)
    assert max(map(len, tables.splitlines())) == 80


def test_other_seeds_are_compared_as_distributions_and_it_is_said(ask: Ask, reports: Path) -> None:
    answer = ask("compare", reports / "old.nc", reports / "other.nc")
    assert answer.status == 0
    assert "all rows have other cases: their errors are compared as distributions" in answer.out


def test_a_report_needs_no_ending_and_a_formulation_is_none(
    ask: Ask, reports: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(reports / "old.nc", tmp_path / "old")
    shutil.copy(reports / "old.nc", tmp_path / "vts-me")
    assert ask("compare old", reports / "same.nc").status == 0
    assert "vts-me against vts-ppt" in ask(f"{VTS_ME} --examples 2 --seed 1 -p balance.force").out


@pytest.mark.parametrize(
    ("new", "options", "message"),
    [
        ("nts.nc", "", r"NEW.nc: found no formulation that OLD.nc has too \(vts-ppt and nts\); needed two reports .*"),
        ("purity.nc", "", r"NEW.nc: found no property that OLD.nc has too \(patch.flat.transmission and purity\); .*"),
        ("old.nc", "-p purity", r"--property: found 'purity'; needed one of patch.flat.transmission"),
        ("old.nc", "--out no/r.html", r"--out: .* is no folder; needed a folder that exists"),
        ("else.nc", "", r"NEW.nc: found .*else.nc, a netCDF file of something else; needed a report .*"),
        ("schema.nc", "", r"NEW.nc: found .*schema.nc of schema 0, which an older .*; needed schema [0-9]+; .*"),
        ("damaged.nc", "", r"NEW.nc: found .*, which cannot be read \(.*\); needed an undamaged report"),
    ],
)
def test_a_mistake_in_a_report_is_one_line(ask: Ask, reports: Path, new: str, options: str, message: str) -> None:
    if not (reports / new).exists():
        shutil.copy(reports / "old.nc", reports / new)
        with netCDF4.Dataset(reports / new, "a") as data:
            if new == "else.nc":
                data.title = "weather"
            elif new == "schema.nc":
                data.schema = "0"
            else:
                data["summary"].renameVariable("row_verdict", "gone")
    check_mistake(ask(f"compare {options}", reports / "old.nc", reports / new), message)
