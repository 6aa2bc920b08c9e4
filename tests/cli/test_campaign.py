"""A campaign: a run in shards gives the report of one run, and a campaign that is not whole gives none."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from asking import Ask, check_mistake
from forged_records import forge_header

from contactverif import Property, load_properties
from contactverif.run.run_options import Isolation, RunOptions
from contactverif.run.store import Plan, Store
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import read_run

IDS = ("patch.flat.resultant", "patch.flat.transmission", "hard.deep")  # One strategy for two, and a list.
NAMES = ("nts", "vts-ppt")
WORDS = f"{' '.join(NAMES)} -p {' -p '.join(IDS)} --examples 43 --seed 1"
N = 3


@pytest.fixture
def ask(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> Ask:
    """Return a function that runs `contactverif` with blocks of ten cases."""
    for module in ("sampling.draw", "run.run"):
        monkeypatch.setattr(f"contactverif.{module}.BLOCK", 10)
    return ask


def judge_shard(ask: Ask, folder: Path, number: int, more: str = "") -> str:
    answer = ask(f"campaign {WORDS} {more} --shard {number}/{N} --out", folder)
    assert (answer.status, answer.err) == (0, "")
    return answer.out


def name(number: int) -> str:
    return f"shard-{number}-of-{N}"


def cut_in_half(journal: Path) -> None:
    """Leave a journal as if its process had been killed."""
    (path,) = journal.glob("*.outcomes")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def count(folder: Path) -> tuple[int, int]:
    """Return the numbers of judged cases and of further outcomes of the same cases."""
    store = Store(Plan(options=RunOptions(names=NAMES, properties=IDS)), None, sorted(folder.glob("shard-*")))
    return store.n_outcomes, store.n_records - store.n_outcomes


@pytest.mark.parametrize("in_blocks", [True, False])
def test_the_merged_report_is_that_of_one_run(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, in_blocks: bool
) -> None:
    """It is so, too, where hypothesis' engine draws all cases at once, and for a shard that was killed."""
    monkeypatch.setattr(
        "contactverif.sampling.hypothesis_draws.find_difference", lambda: "" if in_blocks else "another version"
    )
    single = ask(f"verify {WORDS} --out", tmp_path / "single.nc")
    shards = tmp_path / "shards"
    for number in (3, 1, 2):
        judge_shard(ask, shards, number)
    (shards / name(1) / "done").unlink()
    cut_in_half(shards / name(1))
    judge_shard(ask, shards, 1)
    assert len([*(shards / name(1)).glob("*.outcomes")]) == 2
    merged = ask("merge", shards, "--out", tmp_path / "merged.nc", "--out", tmp_path / "merged.html")
    assert merged.status == single.status
    assert merged.err == ""
    assert same_data(tmp_path / "single.nc", tmp_path / "merged.nc") == []
    rows = read_run(tmp_path / "merged.nc").rows
    n_cases = sum(len(row.outcomes) + (row.witness is not None and row.property_id != "hard.deep") for row in rows)
    assert count(shards) == (n_cases, 0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["merged.html", "merged.nc", "shards", "single.nc"]


def test_the_exit_status_of_a_broken_promise_is_that_of_verify(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The harness is told that `nts` promises what it cannot keep."""
    question = next(iter(load_properties(["patch.flat.single"])))
    monkeypatch.setattr(
        "contactverif.cli.verify.load_properties",
        lambda globs, **others: [replace(question, promise=lambda traits: True)],
    )
    assert isinstance(question, Property)
    assert ask("campaign nts -p patch.flat.single --examples 4 --shard 1/1 --out", tmp_path).status == 0
    assert ask("merge", tmp_path, "--out", tmp_path / "r.nc").status == 1


@pytest.fixture(scope="module")
def campaign_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an empty folder, in which the first test that needs a campaign makes one."""
    return tmp_path_factory.mktemp("campaign") / "shards"


@pytest.fixture
def shards(ask: Ask, campaign_folder: Path, tmp_path: Path) -> Path:
    """Return the folder of a finished campaign, which a test may damage."""
    if not campaign_folder.exists():
        for number in range(1, N + 1):
            judge_shard(ask, campaign_folder, number)
    return Path(shutil.copytree(campaign_folder, tmp_path / "shards"))


def test_a_shard_that_is_done_is_skipped(ask: Ask, shards: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactverif.plugins.registry.load_formulation", None)
    assert judge_shard(ask, shards, 2) == "shard 2/3 is done already\n"


def refusal(ask: Ask, shards: Path) -> str:
    """Return what `merge` says to shards that do not belong together; it writes nothing."""
    answer = ask("merge --out", shards.parent / "r.nc", shards)
    check_mistake(answer, "FOLDER: found .*")
    assert [path.name for path in shards.parent.iterdir()] == ["shards"]
    return answer.err.removeprefix("contactverif: FOLDER: found ").rstrip()


def test_shards_that_are_missing_unfinished_copied_or_of_two_counts_are_refused_by_name(ask: Ask, shards: Path) -> None:
    (shards / "shard-1-of-4").mkdir()
    assert refusal(ask, shards) == "shard-1-of-3 and shard-1-of-4; needed shards of one campaign"
    (shards / "shard-1-of-4").rmdir()
    (shards / name(2) / "done").unlink()
    needed = "needed its end: the same campaign with --shard 2/3 goes on"
    assert refusal(ask, shards) == f"shard-2-of-3, which is not finished; {needed}"
    shutil.rmtree(shards / name(2))
    assert refusal(ask, shards) == "no shard-2-of-3; needed all 3 shards"
    shutil.copytree(shards / name(1), shards / name(2))
    assert refusal(ask, shards).startswith("shard-2-of-3, whose header says 1/3; needed shard 2/3")
    for each in (1, 2, 3):
        shutil.rmtree(shards / name(each))
    assert refusal(ask, shards) == f"no shard in {shards}; needed the folder that campaign --out made"


def test_a_damaged_shard_is_refused_by_name_and_can_be_mended(ask: Ask, shards: Path) -> None:
    whole = count(shards)
    cut_in_half(shards / name(2))
    assert refusal(ask, shards).startswith("shard-2-of-3, damaged: ")
    judge_shard(ask, shards, 2)
    assert count(shards) == whole
    (shards / name(2) / "header").write_bytes(b"")
    assert refusal(ask, shards).startswith("shard-2-of-3 with a damaged header")


def test_a_shard_of_another_plan_is_refused_by_name(ask: Ask, shards: Path) -> None:
    shutil.rmtree(shards / name(2))
    judge_shard(ask, shards, 2, "--seed 2")
    flaw = "shard-2-of-3 with another plan than that of shard-1-of-3 (seed)"
    assert refusal(ask, shards) == f"{flaw}; needed shards of one campaign"
    answer = ask(f"campaign {WORDS} --shard 2/3 --out", shards)
    assert answer.status == 2
    assert "found shard-2-of-3 of another plan (seed); needed the same plan, or another folder" in answer.err


def test_plugins_of_another_shard_may_live_elsewhere(ask: Ask, shards: Path, tmp_path: Path) -> None:
    """The place where a plugin lives changes no number, and a machine may have no box."""
    shutil.rmtree(shards / name(2))
    judge_shard(ask, shards, 2, "--isolation process")
    assert judge_shard(ask, shards, 2) == "shard 2/3 is done already\n"
    merged = ask("merge", shards, "--out", tmp_path / "merged.nc")
    assert (merged.status, merged.err) == (0, "")


def test_a_shard_chooses_nothing_that_a_run_may_reach_write_or_excuse(ask: Ask, shards: Path, tmp_path: Path) -> None:
    outside, report = tmp_path / "outside", tmp_path / "r.nc"
    limits = {"isolation": Isolation.INLINE, "opened": ("/etc",), "time_limit": 0.0, "memory_limit": 1}
    excuse = {"patch.flat.transmission": "as ever"}
    for number in range(1, N + 1):
        forge_header(shards / name(number), **limits, pictures=outside, known=excuse)
    answer = ask(f"merge {shards} --isolation process --out {report}")
    known = "--known 'patch.flat.transmission=as ever'"
    words = f"{known} --pictures {outside} --isolation inline --time-limit 0.0 --memory-limit 1 --open /etc"
    line = f"contactverif: FOLDER asks for {words}, and does not get it; type it to allow it\n"
    assert (answer.status, answer.err.startswith(line)) == (0, True)
    assert read_run(report).provenance["isolation"].startswith("process")
    assert {row.known for row in read_run(report).rows} == {""}
    assert not outside.exists()
    answer = ask(f"merge {shards} {words.replace('0.0', '60').replace(' 1 ', ' 4096 ')} --out {report}")
    assert "asks for --time-limit 0.0 --memory-limit 1, and" in answer.err
    assert {row.known for row in read_run(report).rows} == {"", "as ever"}
    assert outside.exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mesh": Path("/x.msh"), "slave": "a", "master": "b"}, "a journal with --mesh /x.msh --slave a --master b"),
        ({"scene_file": "/x.py:f"}, "a journal with --scene-file /x.py:f, and here none; needed one on random cases"),
        ({"names": ("nts", "c:file=/x.so")}, "c:file=/x.so, which loads a file; needed c:file=/x.so typed behind it"),
        (
            {
                "names": (
                    "nts",
                    "engine/calculix:program=reboot",
                )
            },
            "engine/calculix:program=reboot, which loads a file",
        ),
        ({"names": ("nts", "mine:table=../x")}, "mine:table=../x, which loads a file"),
        ({"examples": 2**62}, "shard-1-of-3 with 6 rows of 4611686018427387904 cases"),
        ({"names": ("nts",) * 2**12, "properties": ("x",) * 2**12}, "shard-1-of-3 with 16777216 rows of 43 cases"),
    ],
)
def test_a_shard_that_names_a_file_or_has_no_end_is_refused(
    ask: Ask, shards: Path, options: dict[str, Any], words: str
) -> None:
    for number in range(1, N + 1):
        forge_header(shards / name(number), **options)
    assert refusal(ask, shards).startswith(words)
    answer = ask(f"merge {shards} nts nowhere --out r.nc")
    assert answer.status == 2


def test_a_plugin_that_does_not_load_is_no_shard_that_is_done(ask: Ask, tmp_path: Path) -> None:
    answer = ask("campaign vts-me:n=x -p balance.force --shard 1/1 --out", tmp_path)
    assert answer.status in (1, 2)
    assert len(answer.err.splitlines()) == 1
    assert not [*tmp_path.rglob("done")]
