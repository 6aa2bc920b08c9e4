"""`contactverif paper`: what is kept under reports/paper is what comes out, and what comes out is right.

Numbers are compared up to rounding, not bitwise. A solved number is a sum of some hundred terms behind a matrix with a
condition below 1e6: 2⁻⁵³ × 1e2 × 1e6 of the largest number of its variable, 1e-8. A component of a vector is held to
the largest component.
"""

import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from reports.page_reader import Page
from subjects import judge_as, load_property, load_subject

from contactverif import MisuseError, Verdict
from contactverif.cli import app as cli
from contactverif.problems import catalogue
from contactverif_paper import compute, force_transmission, pass_table, steps
from contactverif_paper.figure_style import render_figure
from contactverif_paper.items import ITEMS
from contactverif_paper.paper_item import Agreement, Paper
from contactverif_paper.paper_page import check_folder, page, summary, svg, tree_of, write
from contactverif_reports.netcdf.file_groups import write_tree

STORED = Path(__file__).parents[2] / "reports" / "paper"
SOLVED = 2.0**-53 * 1e2 * 1e6
# Numbers that are themselves rounding errors where all is right, and need only stay small there.
ROUNDING = {
    "stress_error": 1e-9,
    "unequal": 1e-9,
    "error": 1e-12,
    "difference": 1e-12,
    "limit": 0.02,  # A bisection stops within one per cent.
}
COUNTS = {"iterations": 1.0, "from_touching": 1.0}  # Rounding decides whether the last step is one more.
SLOPES = {"order": 1e-3, "rate": 1e-3, "basic_rate": 1e-3}  # Slopes of numbers near roundoff.
HISTORIES = {"residual", "energy", "beyond"}  # Their ends are rounding errors.
NOT_COMPARED = {"result", "condition", "rounding", "commit"}  # Words with numbers in them; rounding errors; origin.
LARGEST_FIGURE = 70_000  # bytes
QUICK = tuple(item for item in ITEMS if not item.slow)
SLOW = {item.name for item in ITEMS if item.slow}
STUDY_FIGURES = {figure.name for item in ITEMS if item.slow for figure in item.figures}


@pytest.fixture(scope="module")
def reported_steps() -> list[str]:
    return []


@pytest.fixture(scope="module")
def paper(reported_steps: list[str]) -> Paper:
    return compute(reported_steps.append, items=QUICK)


@pytest.fixture(scope="module")
def tree(paper: Paper, tmp_path_factory: pytest.TempPathFactory) -> xr.DataTree:
    path = tmp_path_factory.mktemp("paper") / "paper.nc"
    write_tree(tree_of(paper), path)
    return xr.open_datatree(path).load()


@pytest.fixture(scope="module")
def stored_tree() -> xr.DataTree:
    """Return the stored numbers, without measured times and the slow items, which are not computed again."""
    tree = xr.open_datatree(STORED / "paper.nc").load()
    groups = {node.path: node.to_dataset(inherit=False) for node in tree.subtree if node.path.split("/")[1] not in SLOW}
    statements = groups["/statements"]
    of_study = np.isin(words(statements.figure), list(STUDY_FIGURES))
    groups["/statements"] = statements.isel(statement=~of_study)
    figures = groups["/figures"]
    groups["/figures"] = figures.isel(figure=~np.isin(words(figures["name"]), list(STUDY_FIGURES)))
    return xr.DataTree.from_dict(groups)


def words(variable: xr.DataArray) -> list[object]:
    return np.vectorize(lambda word: word.decode() if isinstance(word, bytes) else str(word))(variable).tolist()


def difference(name: str, new: xr.DataArray, old: xr.DataArray, scale: float) -> str:
    """Return how two variables differ by more than rounding of numbers as large as the scale; empty if they do not."""
    if new.dims != old.dims or (new.shape != old.shape and name not in HISTORIES):
        return f"{dict(new.sizes)} for {dict(old.sizes)}"
    if new.dtype.kind not in "fiu":
        return "" if words(new) == words(old) else f"{words(new)} for {words(old)}"
    a, b = (np.asarray(values, dtype=np.float64) for values in (new.values, old.values))
    if name in HISTORIES:  # One step more or less is a rounding error too.
        least = min(a.shape[-1], b.shape[-1]) - 1
        a, b = a[..., :least], b[..., :least]
        both = np.isfinite(a) & np.isfinite(b)
        floor = 1e-8  # Ten times what the file itself calls the floor.
        return "" if np.allclose(a[both], b[both], rtol=1e2 * SOLVED, atol=floor) else f"{a} for {b}"
    slack = (ROUNDING | COUNTS | SLOPES).get(name, 0.0) + SOLVED * scale
    same = np.isclose(a, b, rtol=0, atol=slack, equal_nan=True)
    return "" if same.all() else f"{a[~same]} for {b[~same]}"


def largest(group: xr.Dataset, name: str) -> float:
    """Return the largest number of a variable, or of both components where it is one of a vector's."""
    both = {name, re.sub("_x$", "_y", name), re.sub("_y$", "_x", name)}
    numbers = [group[each].values for each in sorted(both) if each in group and group[each].dtype.kind in "fiu"]
    return max((float(np.max(np.abs(part[np.isfinite(part)]), initial=0.0)) for part in numbers), default=0.0)


def compare(new: xr.DataTree, old: xr.DataTree) -> list[str]:
    """Return every difference, a line each."""
    lines = []
    for group in sorted({*new.groups, *old.groups}):
        if group.endswith("/timing"):
            continue
        if group not in new.groups or group not in old.groups:
            lines.append(f"{group}: only in {'the stored file' if group in old.groups else 'what was computed'}")
            continue
        ours, theirs = new[group].to_dataset(inherit=False), old[group].to_dataset(inherit=False)
        converged = solved_cells(theirs)
        for name in sorted({*map(str, ours.variables), *map(str, theirs.variables)} - NOT_COMPARED):
            if name not in ours or name not in theirs:
                lines.append(f"{group}/{name}: only in one")
                continue
            pair = (ours[name], theirs[name])
            if converged is not None and {"scene", "formulation"} <= set(pair[0].dims) and pair[0].dtype.kind == "f":
                shape = converged.shape + (1,) * (pair[0].ndim - 2)
                pair = tuple(values.where(converged.values.reshape(shape)) for values in pair)
            if text := difference(name, *pair, largest(theirs, name)):
                lines.append(f"{group}/{name}: {text}")
    return lines


def solved_cells(group: xr.Dataset) -> xr.DataArray | None:
    """Return where Newton's method ended at a solution: rounding decides which state of a 2-cycle comes last."""
    if "end" not in group or group["end"].dims != ("scene", "formulation"):
        return None
    return xr.DataArray(np.array(words(group["end"])) == "converged", dims=group["end"].dims)


def test_what_is_stored_is_what_comes_out(tree: xr.DataTree, stored_tree: xr.DataTree) -> None:
    assert not (lines := compare(tree, stored_tree)), "\n".join(lines)


@pytest.mark.parametrize(
    ("group", "name", "place"),
    [
        ("case_b/patch", "pressure", (0, 1, 0)),
        ("case_b/forces", "master_numerator", (1, 0)),
        ("case_c/vts_me", "end", (0, 1)),
        ("pass_table", "stress_error", (0, 0)),
        ("fig30_convergence", "radius", (1,)),
        ("fig30_convergence", "beyond", (0, 1, 0)),
        ("section_6_2", "asymmetry", (2,)),
        ("section_6_3/terms", "terms", (2, 1)),
        ("section_7_1", "departure", (0, 1)),
        ("appendix_a", "difference", (4,)),
        ("statements", "agreement", (0,)),
    ],
)
def test_another_number_is_noticed(
    tree: xr.DataTree, stored_tree: xr.DataTree, group: str, name: str, place: tuple
) -> None:
    changed = stored_tree.copy(deep=True)
    values = changed[group][name].values
    values[place] = values[place] + 1 if values.dtype.kind != "f" else values[place] * (1 + 1e-4) + 1e-7
    lines = compare(tree, changed)
    assert [line.partition(":")[0] for line in lines] == [f"/{group}/{name}"]


def test_every_step_is_reported(paper: Paper, reported_steps: list[str]) -> None:
    assert len(reported_steps) == steps(QUICK) - len(paper.figures)


def test_every_item_has_its_own_name_and_every_figure(paper: Paper) -> None:
    assert len({item.name for item in ITEMS}) == len(ITEMS)
    names = [figure.name for item in ITEMS for figure in item.figures]
    assert len(set(names)) == len(names)
    assert {row.figure for row in paper.statements} - {""} <= set(names)


def test_force_tables_are_the_printed_ones(paper: Paper) -> None:
    for name in ("a1", "b", "c"):
        table = paper.data(f"case_{name}").forces
        rows = {row.formulation.name: row for row in table.rows}
        assert table.exact.printed == table.exact.master
        assert all(row.printed == row.master for row in table.rows if row.printed)
        assert rows["vts-ppt"].master == rows["vts-ppt-balanced"].master == table.exact.master
        assert (rows["nts-ar"].master == table.exact.master) == (table.case == "a1")
        assert (rows["vts-me"].master == table.exact.master) == (table.case != "c")
        assert all(sum(row.slave) == sum(row.master) for row in table.rows)
        assert all(not row.points or sum(row.points) == sum(row.slave) for row in table.rows)


def test_a_float_that_is_no_rational_is_refused() -> None:
    assert force_transmission.rationals([1 / 3, 17 / 6], 3.0)[0] == (Fraction(1, 3), Fraction(17, 6))
    with pytest.raises(ArithmeticError, match="no rationals"):
        force_transmission.rationals([1 / 3 + 1e-9], 3.0)


def test_what_differs_from_the_paper_is_known(paper: Paper) -> None:
    differing = [(row.place, row.claim) for row in paper.statements if row.agreement is Agreement.DIFFERS]
    assert {place for place, _ in differing} == {"Figs. 21, 22", "Section 6.3"}
    for words_ in ("segment-to-segment", "inf-sup"):
        assert any(words_ in claim for _, claim in differing)


def test_what_holds_under_a_condition_says_which(paper: Paper) -> None:
    conditions = {row.place: row.condition for row in paper.statements if row.agreement is Agreement.CONDITIONAL}
    assert set(conditions) == {"Fig. 30", "Section 5.1.3", "Section 6.3", "Section 7.1", "Section 7.2"}
    assert all(conditions.values())


# Who passes on (A1 and both A2), (B, Example 1), (C, C′, Example 1bis), as `formulations.md` of this project's design
# restores it from Sections 4, 5 and 7.1. A stress error is at roundoff or above 1e-2 of the pressure.
GROUPS = (("a1", "a2-uniform", "a2-graded"), ("b", "example-1"), ("c", "c-prime", "example-1bis"))
VERDICTS = {
    "nts": (False, False, False),
    "nts-ar": (True, False, False),
    "two-pass/nts-ar": (False, False, False),
    "vts-g": (True, False, False),
    "vts-me": (True, True, False),
    **dict.fromkeys(("vts-ppt-basic", "vts-ppt", "vts-ppt-balanced"), (True, True, True)),
    **dict.fromkeys(("chen-hisada", "sts", "mortar", "mortar-dual"), (True, True, True)),
    "nts-lm": (True, False, False),
    **dict.fromkeys(("two-pass/nts-lm", "vts-ppt-lm", "mortar-lm", "mortar-dual-lm"), (True, True, True)),
}


def test_who_passes_the_patch_test(paper: Paper) -> None:
    table, tests = paper.data("pass_table"), paper.data("lagrange_multipliers")
    words_ = {True: "pass", False: "fail"}
    for formulation, verdicts in zip(table.formulations, table.verdicts.tolist(), strict=True):
        groups = zip(GROUPS, VERDICTS[formulation.name], strict=True)
        expected = {scene: words_[passes] for group, passes in groups for scene in group}
        assert dict(zip(table.scene, verdicts, strict=True)) == expected, formulation.name
    for test in tests:
        groups = zip(GROUPS, VERDICTS.get(test.formulation.name, (None,) * 3), strict=True)
        for passes in (passes for group, passes in groups if test.scene in group and passes is not None):
            assert test.passes == passes, test.title
            assert passes or test.error > pass_table.FAILS, test.title
            if test.formulation.name in ("vts-ppt-lm", "mortar-lm", "mortar-dual-lm"):
                assert max(abs(test.low - 1), abs(test.high - 1)) <= 100 * test.tolerance, test.title
    names = {row.name for row in table.formulations} | {test.formulation.name for test in tests}
    assert names - {"vts-me-lm"} == VERDICTS.keys()  # Its multipliers are looked at below.


def test_multipliers_that_are_not_unique_or_not_uniform(paper: Paper) -> None:
    tests = {(test.formulation.name, test.scene): test for test in paper.data("lagrange_multipliers")}
    assert tests["vts-ppt-lm", "eight on two"].deficiency == 7
    for name, least, most in (("c", 0, 2), ("c-prime", 13 / 45, 77 / 45)):
        test = tests["vts-me-lm", name]
        assert test.deficiency == 0  # There are no other multipliers: forces are exact by those that are not uniform.
        assert (test.low, test.high) == pytest.approx((least, most), abs=1e-10)
        case = catalogue.make_scene(name).case()
        outcome = judge_as(Verdict.FAIL, load_property("patch.flat.solve"), case, load_subject("vts-me-lm"))
        values, tolerances = outcome.measurement.values, outcome.measurement.tolerances
        assert {key for key, value in values.items() if value > tolerances[key]} == {"multiplier error"}


def test_every_stored_figure_belongs_to_an_item() -> None:
    names = {f"{figure.name}.svg" for item in ITEMS for figure in item.figures}
    assert names == {path.name for path in STORED.glob("*.svg")}
    assert max(path.stat().st_size for path in STORED.glob("*.svg")) < LARGEST_FIGURE
    assert (STORED / "paper.nc").stat().st_size < 400_000


def test_the_page_needs_nothing_else_and_says_everything(paper: Paper) -> None:
    text = page(paper, dict.fromkeys([figure.name for figure in paper.figures], "<i>figure</i>"))
    reader = Page(text)
    assert not [attrs for tag, attrs in reader.tags if tag == "link" or {"src", "srcset"} & set(attrs)]
    assert len(set(reader.ids)) == len(reader.ids)
    assert not re.search(r"url\(['\"]?https?:", text)
    assert {f"#{name}" for name in reader.ids} >= set(re.findall(r'href="(#[^"]+)"', text))
    for formulation in pass_table.FORMULATIONS:
        assert formulation.legend in text
    assert text.count("&lt;i&gt;figure") == len(paper.figures)  # A figure is escaped unless it is markup.
    for agreement in Agreement:
        assert agreement.words in text
    lines = summary(paper).splitlines()
    statements = [row for row in paper.statements if row.agreement is not Agreement.SILENT]
    assert len(lines) == len(statements) > 10
    for line, row in zip(lines, statements, strict=True):
        assert row.agreement.words in line
        assert f"{row.place}: {row.result}" in line
        assert line.endswith(row.condition or row.result)


def test_all_is_written_and_a_figure_is_the_same_again(paper: Paper, tmp_path: Path) -> None:
    reported: list[str] = []
    written = write(paper, tmp_path / "one", reported.append)
    assert len(reported) == len(paper.figures) == len(written) - 2
    assert {path.name for path in written} == {path.name for path in (tmp_path / "one").iterdir()}
    (result,) = [row for row in paper.results if row.item.name == "case_a1"]
    again = render_figure(result.item.figures[1], result.data)
    assert svg(again) == (tmp_path / "one" / "fig10.svg").read_text(encoding="utf-8")


def test_the_command_refuses_such_a_folder_before_it_computes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr("sys.argv", ["contactverif", "paper", "--out", str(tmp_path / "file")])
    with pytest.raises(SystemExit) as end:
        cli.main()
    lines = capsys.readouterr().err.splitlines()
    assert end.value.code == 2
    assert len(lines) == 1
    assert lines[0].startswith("contactverif: --out: found ")


def test_a_folder_that_cannot_be_written_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(MisuseError, match=r"--out: found .*file.* needed a folder"):
        check_folder(tmp_path / "file")
    with pytest.raises(MisuseError, match=r"--out: found .*needed a folder"):
        check_folder(tmp_path / "file" / "below")
    (tmp_path / "paper" / "paper.nc").mkdir(parents=True)
    with pytest.raises(MisuseError, match=r"--out: found .*paper\.nc, a folder"):
        check_folder(tmp_path / "paper")
    check_folder(tmp_path / "new" / "folder")
    assert not list((tmp_path / "new" / "folder").iterdir())
