"""A damaged report is read or refused in one line. `damaged_reports.py` makes many more, and runs whole commands."""

import random
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from damage import BYTES
from damaged_reports import TREES, Damage, lie_about_sizes, write_tree

from contactverif import MisuseError, load_scene
from contactverif.contract.counterexample import counterexamples
from contactverif.isolation.limits import Limits
from contactverif_reports.netcdf import bench_file, file_groups
from contactverif_reports.netcdf.bench_file import read_bench
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.stored_outcomes import check_bodies

BENCH = Path(__file__).parents[2] / "reports" / "bench" / "bench.nc"
N_CHANGED, N_WRITTEN = 15, 5  # Files of each kind of damage, to the bytes and to the contents.
# Small damage may hit what nobody reads, such as a comment or the space between two arrays.
HARMLESS = ("one bit", "one byte", "another attribute", "an attribute is missing", "other numbers")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Damage:
    return Damage(tmp_path_factory.mktemp("damaged"), ["patch.flat.transmission", "unilateral"])


@pytest.mark.parametrize("kind", [*BYTES, *TREES])
def test_a_damaged_report_is_read_or_refused_in_one_line(campaign: Damage, kind: str) -> None:
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


def test_a_size_that_lies_takes_no_memory(campaign: Damage) -> None:
    for number in range(N_WRITTEN):
        lie_about_sizes(campaign.folder / "lie.nc", random.Random(number))
        with pytest.raises(MisuseError, match=r"which is damaged \(with .* of shape .* it holds more than"):
            read_run(campaign.folder / "lie.nc")


def test_the_limits_of_the_child_hold_for_reports(campaign: Damage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_groups, "limits_for", lambda size: Limits(1e-6, 500))
    with pytest.raises(MisuseError, match="takes longer than"):
        read_run(campaign.good)


def test_counts_that_contradict_each_other_are_damage(campaign: Damage) -> None:
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


def test_a_report_without_its_numbers_of_segments_is_damage(campaign: Damage) -> None:
    tree = dict(campaign.tree)
    place = next(place for place, (variables, _) in tree.items() if "n_slave_segments" in variables)
    variables, attributes = tree[place]
    tree[place] = {name: entry for name, entry in variables.items() if name != "n_slave_segments"}, attributes
    write_tree(tree, campaign.folder / "without.nc")
    with pytest.raises(MisuseError, match=r"which cannot be read \('n_slave_segments' is missing\)"):
        read_run(campaign.folder / "without.nc")


@pytest.mark.parametrize("kind", BYTES)
def test_a_damaged_file_of_a_bench_is_read_or_refused_in_one_line(kind: str, tmp_path: Path) -> None:
    whole = BENCH.read_bytes()
    for number in range(3):
        (tmp_path / "a.nc").write_bytes(BYTES[kind](whole, random.Random(f"{kind}/{number}")))
        try:
            results = read_bench(tmp_path / "a.nc")
        except MisuseError as error:
            reason = str(error)
        else:
            reason = f"FILE: {len(results.cells)} cells"
        assert reason.startswith("FILE: ")
        assert "\n" not in reason


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("outcome", lambda values: values + 7, "a code without a meaning"),
        ("scene", lambda values: values - 9, "a code without a meaning"),
        ("penalty", lambda values: 2 * values, "its penalties and starts are others"),
        ("instance", lambda values: values // 2, "an instance is not there on every mesh"),
        ("target", lambda values: -values, "a scene has no targets, or none that fall"),
        ("formulation", lambda values: np.full_like(values, values[0]), "two formulations have one name"),
        ("error", lambda values: values[:, :, :1], "errors has the shape"),
    ],
)
def test_a_bench_that_contradicts_itself_is_damage(
    name: str, change: Callable[[np.ndarray], np.ndarray], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    groups = bench_file.read_groups(BENCH, "FILE", "a bench")
    variable = groups["/"][name]
    variables = {**groups["/"], name: replace(variable, values=change(variable.values))}
    monkeypatch.setattr(
        bench_file, "read_groups", lambda *_: {**groups, "/": replace(groups["/"], variables=variables)}
    )
    with pytest.raises(MisuseError, match=f"which is damaged .*{words}"):
        read_bench(BENCH)


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("contact", lambda values: values * 1e300, "holds a number that no node has"),
        ("cells", lambda values: values + 0.5, "holds a number that no node has"),
        ("cells", lambda values: np.full_like(values, -1.0), "are not those that are there"),
        ("count", lambda values: values + 1, "are not those that are there"),
        ("nodes", lambda values: values[:, 0], "has the shape"),
        ("young", lambda values: values * np.nan, "has the shape .* or NaN"),
    ],
)
def test_bodies_are_checked_before_they_are_drawn(
    name: str, change: Callable[[np.ndarray], np.ndarray], words: str
) -> None:
    parameters = dict(load_scene("c-prime").case().parameters)
    check_bodies(parameters)
    parameters[f"bodies_{name}"] = change(np.array(parameters[f"bodies_{name}"]))
    with np.errstate(all="ignore"), pytest.raises(ValueError, match=words):
        check_bodies(parameters)
    check_bodies({"penetration": np.array(1.0)})
