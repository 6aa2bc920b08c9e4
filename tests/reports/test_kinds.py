"""The report says how many cases of each kind were planned, judged, failed, undecided and idle."""

from pathlib import Path

import pytest
import xarray as xr
from handmade_report import run_with_kinds

from contactverif.cli.run_screen import counterexample_text, coverage_text
from contactverif.contract.counterexample import failing_examples
from contactverif.contract.result import CaseCounts, coverage_of, percent
from contactverif_reports.html.report_page import report_page
from contactverif_reports.netcdf.write import write

TABLES = """\
Undecided cases, and idle ones (nothing in contact), 2 formulations together
  property            cases  undecided     idle
  projection.place        8     25.0 %   25.0 %
      2 undecided: a tie of … segments
  balance.force           2        0 %   50.0 %
  In all other properties every case was decided, and something was in contact.

Cases of each kind in projection.place, 2 formulations together
  kind                 planned  judged  failed  undecided  idle
  inside a segment           4       2       1          2     0
  from behind                2       2       0          0     2
  second body behind         0       0       0          0     0
  of another strategy        1       1       0          0     0
  other                      1       1       0          0     0
  all                        8       6       1          2     2

Cases of each kind in balance.force
  kind              planned  judged  failed  undecided  idle
  from behind             1       1       0          0     1
  inside a segment        1       1       0          0     0
  all                     2       2       0          0     1
"""


def test_cases_are_counted_by_kind_in_the_order_of_the_property() -> None:
    place, force, scaling = coverage_of(run_with_kinds())
    assert dict(place.kinds) == {
        "inside a segment": CaseCounts(judged=2, failed=1, undecided=2),
        "from behind": CaseCounts(judged=2, idle=2),
        "second body behind": CaseCounts(),
        "of another strategy": CaseCounts(judged=1),
        "": CaseCounts(judged=1),
    }
    assert place.counts == CaseCounts(judged=6, failed=1, undecided=2, idle=2)
    assert (place.n_formulations, force.n_formulations) == (2, 1)
    assert scaling.kinds == {}


def test_reasons_that_differ_in_a_number_count_as_one() -> None:
    assert coverage_of(run_with_kinds())[0].reasons == {"a tie of … segments": 2}


def test_the_tables_fit_into_80_columns() -> None:
    table = "\n".join(map(str, coverage_text(run_with_kinds(), 80)))
    assert table.strip() == TABLES.strip()
    assert max(map(len, table.splitlines())) <= 80


def test_the_netcdf_file_holds_the_counts(tmp_path: Path) -> None:
    write(run_with_kinds(), tmp_path / "report.nc")
    with xr.open_datatree(tmp_path / "report.nc") as report:
        group = report["projection/place"].to_dataset()
        counts = group.kind_count.sel(formulation="mine", kind="inside a segment")
        assert dict(zip(group.counted.values.tolist(), counts.values.tolist(), strict=True)) == {
            "planned": 3, "judged": 1, "failed": 0, "undecided": 2, "idle": 0,
        }  # fmt: skip
        kinds = group.kind.values[group.case_kind.sel(formulation="mine").dropna("case").astype(int)]
        assert kinds.tolist() == ["inside a segment"] * 3 + ["from behind"] * 2 + ["of another strategy"]
        assert report["summary"].idle.sel(formulation="mine").values.tolist() == [2, 1, 0]


def test_the_page_shows_the_counts() -> None:
    page = report_page(run_with_kinds(), "report.nc")
    assert "What the cases were worth" in page
    assert "<td>2: a tie of … segments</td>" in page
    cells = "".join(f'<td class="n">{count}</td>' for count in (4, 2, 1, 2, 0))
    assert f'<tr><th scope="row">inside a segment</th>{cells}</tr>' in page


def test_a_counterexample_says_its_kind() -> None:
    (example,) = failing_examples(run_with_kinds())
    words = "the smallest case found (inside a segment)"
    assert words in str(counterexample_text(example, None))
    assert f"projection.place, {words}</h4>" in report_page(run_with_kinds(), "report.nc")


@pytest.mark.parametrize(
    ("share", "words"), [(0.0, "0 %"), (1e-6, "0.1 %"), (0.1234, "12.3 %"), (0.9999, "99.9 %"), (1.0, "100 %")]
)
def test_a_share_looks_like_none_or_all_only_if_it_is(share: float, words: str) -> None:
    assert percent(share) == words
