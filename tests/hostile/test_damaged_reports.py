"""A damaged report is read or refused in one line. `damaged_reports.py` makes many more, and runs whole commands."""

from __future__ import annotations

import random
from pathlib import Path

import netCDF4
import pytest
from damage import BYTES
from damaged_reports import TREES, Campaign, lie_about_sizes, write_report

from contactverif.contract.counterexample import counterexamples
from contactverif.contract.errors import MisuseError
from contactverif_reports.netcdf import stored_groups
from contactverif_reports.netcdf.read import read_run

N_CHANGED, N_WRITTEN = 15, 5  # Files of each kind of damage, to the bytes and to the contents.
# Small damage may hit what nobody reads, such as a comment or the space between two arrays.
HARMLESS = ("one bit", "one byte", "another attribute", "an attribute is missing", "other numbers")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    return Campaign(
        tmp_path_factory.mktemp("damaged"), lambda path: write_report(path, ["patch.flat.transmission", "unilateral"])
    )


@pytest.mark.parametrize("kind", [*BYTES, *TREES])
def test_a_damaged_report_is_read_or_refused_in_one_line(campaign: Campaign, kind: str) -> None:
    refused = 0
    for number in range(N_CHANGED if kind in BYTES else N_WRITTEN):
        path = campaign.damaged_file(kind, random.Random(f"{kind}/{number}"))
        reason = read_everything(path)
        refused += bool(reason)
        assert "\n" not in reason
        assert len(reason) < 1000
    assert refused or kind in HARMLESS


def read_everything(path: Path) -> str:
    """Return why a report is refused; empty if it is not, and what nobody asked for yet is there too."""
    try:
        run = read_run(path)
    except MisuseError as error:
        return str(error)
    for row in run.rows:
        assert len(list(row.outcomes)) == sum(row.tally.verdicts.values())
    assert all(example.case.diameter > 0 for example in counterexamples(run).values())
    return ""


def test_a_size_that_lies_takes_no_memory(campaign: Campaign) -> None:
    for number in range(N_WRITTEN):
        lie_about_sizes(campaign.folder / "lie.nc", random.Random(number))
        with pytest.raises(MisuseError, match=r"which is damaged \(with .* of shape .* it holds more than"):
            read_run(campaign.folder / "lie.nc")


def test_the_limits_of_the_child_hold_for_reports(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stored_groups, "LIMITS", stored_groups.Limits(0.0, 500))
    with pytest.raises(MisuseError, match="takes longer than 0 s"):
        read_run(campaign.good)


def test_counts_that_contradict_each_other_are_damage(campaign: Campaign) -> None:
    path = campaign.folder / "contradiction.nc"
    for change, words in {
        "count": "are not those that the summary counts",
        "n_passed": "n_passed is 99, and the rows say",
    }.items():
        path.write_bytes(campaign.whole)
        with netCDF4.Dataset(path, "a") as file:
            if change == "count":
                file["summary/count"][0, 0, 0] += 1
            else:
                file.setncattr(change, 99)
        with pytest.raises(MisuseError, match=words):
            read_run(path)
