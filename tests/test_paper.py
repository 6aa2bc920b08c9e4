"""`contactverif paper`: what is kept under reports/paper is what comes out, and what comes out is right.

Numbers are compared up to rounding, not bitwise. A solved number is a sum of some hundred terms behind a matrix with a
condition below 1e6: 2⁻⁵³ × 1e2 × 1e6 of the largest number of its variable, 1e-8.
"""

from __future__ import annotations

import re
from fractions import Fraction
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from contactverif import MisuseError
from contactverif.cli import app as cli
from contactverif_paper import compute, forces, steps
from contactverif_paper.paper_data import Paper, Said
from contactverif_paper.paper_figures import drawings
from contactverif_paper.paper_page import N_FIGURES, check_folder, page, summary, svg, write
from contactverif_paper.paper_tree import tree_of

KEPT = Path(__file__).parents[1] / "reports" / "paper"
SOLVED = 2.0**-53 * 1e2 * 1e6
# Numbers that are themselves rounding errors where all is right, and need only stay small there.
ROUNDING = {"stress_error": 1e-9, "force": 1e-9, "moment": 1e-9, "jump": 1e-9, "unequal": 1e-9, "error": 1e-12}
COUNTED = {"iterations": 1.0, "from_touching": 1.0}  # rounding decides whether the last step is one more
SLOPES = {"order": 1e-3, "rate": 1e-3, "basic_rate": 1e-3}  # of numbers near roundoff
NOT_COMPARED = {"found", "rounding", "commit"}  # words with numbers in them; a rounding error; where it comes from
LARGEST_FIGURE = 65_000  # bytes


@pytest.fixture(scope="module")
def told() -> list[str]:
    return []


@pytest.fixture(scope="module")
def paper(told: list[str]) -> Paper:
    return compute(told.append, with_study=False)


@pytest.fixture(scope="module")
def tree(paper: Paper, tmp_path_factory: pytest.TempPathFactory) -> xr.DataTree:
    path = tmp_path_factory.mktemp("paper") / "paper.nc"
    tree_of(paper).to_netcdf(path, engine="netcdf4", format="NETCDF4")
    return xr.open_datatree(path).load()


@pytest.fixture(scope="module")
def kept() -> xr.DataTree:
    """Without what takes longest, the study of Example 2, which is not computed again."""
    tree = xr.open_datatree(KEPT / "paper.nc").load()
    groups = {node.path: node.to_dataset(inherit=False) for node in tree.subtree if node.path != "/disk_study"}
    said = groups["/statements"]
    of_study = np.isin(words(said.drawing), ["fig39", "fig39-why"])
    groups["/statements"] = said.isel(statement=~of_study)
    return xr.DataTree.from_dict(groups)


def words(variable: xr.DataArray) -> list[object]:
    return np.vectorize(lambda word: word.decode() if isinstance(word, bytes) else str(word))(variable).tolist()


def difference(name: str, new: xr.DataArray, old: xr.DataArray) -> str:
    """Empty, or how two variables differ by more than rounding."""
    if new.dims != old.dims or (new.shape != old.shape and "iterate" not in new.dims):
        return f"{dict(new.sizes)} for {dict(old.sizes)}"
    if new.dtype.kind not in "fiu":
        return "" if words(new) == words(old) else f"{words(new)} for {words(old)}"
    a, b = (np.asarray(values, dtype=np.float64) for values in (new.values, old.values))
    if name == "residual":  # at the end they are rounding errors, and one step more or less is one too
        least = min(a.shape[-1], b.shape[-1]) - 1
        a, b = a[..., :least], b[..., :least]
        both = np.isfinite(a) & np.isfinite(b)
        floor = 1e-8  # ten times what the file itself calls the floor
        return "" if np.allclose(a[both], b[both], rtol=1e2 * SOLVED, atol=floor) else f"{a} for {b}"
    scale = float(np.max(np.abs(b[np.isfinite(b)]), initial=0.0))
    slack = (ROUNDING | COUNTED | SLOPES).get(name, 0.0) + SOLVED * scale
    same = np.isclose(a, b, rtol=0, atol=slack, equal_nan=True)
    return "" if same.all() else f"{a[~same]} for {b[~same]}"


def compared(new: xr.DataTree, old: xr.DataTree) -> list[str]:
    """Every difference, a line each."""
    found = []
    for group in sorted({*new.groups, *old.groups}):
        if group not in new.groups or group not in old.groups:
            found.append(f"{group}: only in {'the file kept' if group in old.groups else 'what was computed'}")
            continue
        ours, theirs = new[group].to_dataset(), old[group].to_dataset()
        ended = _ended(theirs)
        for name in sorted({*map(str, ours.variables), *map(str, theirs.variables)} - NOT_COMPARED):
            if name not in ours or name not in theirs:
                found.append(f"{group}/{name}: only in one")
                continue
            pair = (ours[name], theirs[name])
            if ended is not None and {"scene", "formulation"} <= set(pair[0].dims) and pair[0].dtype.kind == "f":
                pair = tuple(
                    values.where(ended.values.reshape(ended.shape + (1,) * (values.ndim - 2))) for values in pair
                )
            if said := difference(name, *pair):
                found.append(f"{group}/{name}: {said}")
    return found


def _ended(group: xr.Dataset) -> xr.DataArray | None:
    """Where Newton's method ended at a solution: which state of a 2-cycle comes last, rounding decides."""
    if "end" not in group or group["end"].dims != ("scene", "formulation"):
        return None
    return xr.DataArray(np.array(words(group["end"])) == "converged", dims=group["end"].dims)


def test_what_is_kept_is_what_comes_out(tree: xr.DataTree, kept: xr.DataTree) -> None:
    assert not (found := compared(tree, kept)), "\n".join(found)


@pytest.mark.parametrize(
    ("group", "name", "place"),
    [
        ("patch", "pressure", (3, 1, 0)),
        ("forces", "master_numerator", (1, 1, 0)),
        ("passes", "stress_error", (0, 0)),
        ("convergence", "radius", (1,)),
        ("tangents", "asymmetry", (2,)),
        ("defects/jump", "known", (3,)),
        ("statements", "verdict", (0,)),
    ],
)
def test_another_number_is_noticed(tree: xr.DataTree, kept: xr.DataTree, group: str, name: str, place: tuple) -> None:
    changed = kept.copy(deep=True)
    values = changed[group][name].values
    values[place] = values[place] + 1 if values.dtype.kind != "f" else values[place] * (1 + 1e-4) + 1e-7
    found = compared(tree, changed)
    assert [line.partition(":")[0] for line in found] == [f"/{group}/{name}"]


def test_every_step_is_told(paper: Paper, told: list[str]) -> None:
    assert paper is not None
    assert len(told) == steps(with_study=False)


def test_force_tables_are_the_printed_ones(paper: Paper) -> None:
    assert [table.case for table in paper.forces] == ["a1", "b", "c"]
    for table in paper.forces:
        rows = {row.member.formulation: row for row in table.rows}
        assert table.exact.printed == table.exact.master
        assert all(row.printed == row.master for row in table.rows if row.printed)
        assert rows["vts-ppt"].master == rows["vts-ppt-balanced"].master == table.exact.master
        assert (rows["nts-ar"].master == table.exact.master) == (table.case == "a1")
        assert (rows["vts-me"].master == table.exact.master) == (table.case != "c")
        assert all(sum(row.slave) == sum(row.master) for row in table.rows)
        assert all(not row.points or sum(row.points) == sum(row.slave) for row in table.rows)


def test_a_float_that_is_no_rational_is_refused() -> None:
    assert forces.rationals([1 / 3, 17 / 6], 3.0)[0] == (Fraction(1, 3), Fraction(17, 6))
    with pytest.raises(ArithmeticError, match="no rationals"):
        forces.rationals([1 / 3 + 1e-9], 3.0)


def test_rates_of_the_basic_version_are_the_known_ones(paper: Paper) -> None:
    found = paper.convergence
    assert np.abs(found.rate / found.radius - 1).max() < 0.06  # 0.03 a step leaves few residuals to measure it by
    assert (np.diff(found.radius) > 0).all()
    for histories in found.histories:
        counts = {one.member.formulation: one.n_iterations for one in histories}
        assert 13 <= counts["vts-ppt-basic"] <= 17
        assert counts["vts-ppt"] <= 5


def test_defects_are_the_known_ones_and_the_balanced_version_has_none(paper: Paper) -> None:
    found = paper.defects
    values = {
        name: {member.formulation: row for member, row in zip(series.members, series.values, strict=True)}
        for name, series in (("force", found.force), ("jump", found.jump), ("free end", found.free_end))
    }
    lost = 1 - np.cos(found.force.at)
    assert values["force"]["vts-ppt"] == pytest.approx(lost, abs=1e-14)
    assert values["jump"]["vts-ppt"] == pytest.approx(found.jump_known, abs=1e-10)
    for name in values:
        assert values[name]["vts-ppt-balanced"].max() < 1e-10
    assert values["free end"]["vts-ppt"].max() > 0.1


def test_verdicts_of_the_pass_table(paper: Paper) -> None:
    table = paper.passes
    found = {(member.formulation, name): table.word(row, column) for row, member in enumerate(table.members)
              for column, name in enumerate(table.scenes)}  # fmt: skip
    assert set(found.values()) == {"pass", "fail"}
    assert all(found["vts-ppt", name] == "pass" for name in table.scenes)
    assert all(found["nts", name] == "fail" for name in table.scenes)
    assert found["vts-me", "b"] == "pass"
    assert found["vts-me", "c"] == "fail"


def test_tangents(paper: Paper) -> None:
    found = paper.tangents
    rows = {member.formulation: row for row, member in enumerate(found.members)}
    exact = [rows[name] for name in ("vts-me", "vts-ppt", "sts")]
    assert found.error[exact].max() <= 1e-14
    assert found.error[rows["vts-ppt-basic"]] > 1e-2
    assert found.order[exact] == pytest.approx(2, abs=0.02)
    assert found.order[rows["vts-ppt-basic"]] < 1.1
    assert found.asymmetry.min() > 1e-3


def test_what_differs_from_the_paper_is_known(paper: Paper) -> None:
    differing = [one.says for one in paper.statements if one.verdict is Said.DIFFERS]
    assert len(differing) == 2
    assert "segment-to-segment" in differing[0]
    assert "inf-sup" in differing[1]


def test_multipliers(paper: Paper) -> None:
    rows = {(row.member.formulation, row.scene): row for row in paper.multipliers}
    assert not rows["nts-lm", "example-1"].stress
    assert rows["two-pass/nts-lm", "example-1"].stress
    assert rows["vts-ppt-lm", "c"].uniform
    assert rows["vts-me-lm", "c-prime"].stress
    assert not rows["vts-me-lm", "c-prime"].uniform
    assert rows["vts-ppt-lm", "eight on two"].deficiency == 7


def test_every_figure_is_kept_and_no_other(paper: Paper) -> None:
    names = {f"{drawing.name}.svg" for drawing in drawings(paper)}
    if paper.disk is not None:
        names.add("fig39-why.svg")
    assert names == {path.name for path in KEPT.glob("*.svg")}
    assert len(names) == N_FIGURES  # which the progress bar counts on
    assert max(path.stat().st_size for path in KEPT.glob("*.svg")) < LARGEST_FIGURE
    assert (KEPT / "paper.nc").stat().st_size < 300_000


class Reader(HTMLParser):
    """Collects ids, tags and what is loaded from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.tags: list[str] = []
        self.loaded: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        given = dict(attrs)
        self.ids += [given["id"] or ""] if "id" in given else []
        self.loaded += [value for name, value in attrs if name in ("src", "srcset") and value]
        if tag == "link":
            self.loaded.append(given.get("href") or "")


def test_the_page_needs_nothing_else_and_says_everything(paper: Paper) -> None:
    text = page(paper, dict.fromkeys([drawing.name for drawing in drawings(paper)], "<i>figure</i>"))
    reader = Reader()
    reader.feed(text)
    assert not reader.loaded
    assert len(set(reader.ids)) == len(reader.ids)
    assert not re.search(r"url\(['\"]?https?:", text)
    assert {f"#{name}" for name in reader.ids} >= set(re.findall(r'href="(#[^"]+)"', text))
    for member in paper.passes.members:
        assert member.legend in text
    assert text.count("&lt;i&gt;figure") == len(drawings(paper))  # escaped unless it is markup
    for verdict in Said:
        assert verdict.mark in text
    lines = summary(paper).splitlines()
    told = [one for one in paper.statements if one.verdict is not Said.SILENT]
    assert len(lines) == len(told) > 10
    for line, one in zip(lines, told, strict=True):
        assert one.verdict.mark in line
        assert line.endswith(f"{one.figure}: {one.found}")


def test_all_is_written_and_a_figure_is_the_same_again(paper: Paper, tmp_path: Path) -> None:
    told: list[str] = []
    written = write(paper, tmp_path / "one", told.append)
    assert len(told) == len(drawings(paper)) == len(written) - 2
    assert {path.name for path in written} == {path.name for path in (tmp_path / "one").iterdir()}
    again = {drawing.name: drawing for drawing in drawings(paper)}["fig10"]
    assert svg(again.drawn()) == (tmp_path / "one" / "fig10.svg").read_text(encoding="utf-8")


def test_the_command_refuses_such_a_folder_before_it_computes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr("sys.argv", ["contactverif", "paper", "--out", str(tmp_path / "file")])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    said = capsys.readouterr().err.splitlines()
    assert ended.value.code == 2
    assert len(said) == 1
    assert said[0].startswith("contactverif: --out: found ")


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
