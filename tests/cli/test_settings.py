"""The table `[tool.contactverif]` of a project: what a run takes from it, and what is wrong with it in one line."""

import os
from pathlib import Path

import pytest
from asking import Ask, asking

from contactverif.api.plugin_places import Isolation
from contactverif.api.settings import Settings, read_settings
from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.shared_options import SamplingOptions, WorkerOptions
from contactverif.cli.verify_job import VerifyOptions
from contactverif.contract.errors import MisuseError

TABLE = """
[tool.contactverif]
profile = "ci"
properties = ["patch.flat.*", "balance.force"]
isolation = "inline"
jobs = 1
open = ["/dev/null"]

[tool.contactverif.known]
"patch.flat.single" = "issue 12"
"mirror" = "issue 13"
"""
DEAD_ZONE = "hard.dead-zone"


def write_table(folder: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "pyproject.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(folder)


def test_without_a_table_all_is_left_to_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert read_settings() == Settings()
    write_table(tmp_path, "[project]\nname = 'mine'\n", monkeypatch)
    assert read_settings() == Settings()


def test_a_run_takes_the_settings_where_nothing_is_typed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_table(tmp_path, TABLE, monkeypatch)
    options = VerifyOptions(("nts",)).with_settings(read_settings())
    assert options.properties == ("patch.flat.*", "balance.force")
    assert options.known == ("patch.flat.single=issue 12",)  # Nobody asks `mirror`.
    assert (options.sampling.profile, options.workers.jobs) == ("ci", 1)
    settled = IsolationOptions().settle()
    assert (settled.isolation, settled.opened) == (Isolation.INLINE, ["/dev/null"])


def test_what_is_typed_counts_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_table(tmp_path, TABLE, monkeypatch)
    typed = VerifyOptions(
        ("nts",),
        ("patch.flat.single", "mirror"),
        SamplingOptions(profile="dev"),
        known=("patch.flat.single=mine",),
        workers=WorkerOptions(jobs=2),
    )
    options = typed.with_settings(read_settings())
    assert options.properties == ("patch.flat.single", "mirror")
    assert options.known == ("patch.flat.single=mine", "mirror=issue 13")
    assert (options.sampling.profile, options.workers.jobs) == ("dev", 2)
    settled = IsolationOptions(isolation=Isolation.PROCESS, opened=[os.devnull]).settle()
    assert settled.isolation is Isolation.PROCESS


def test_the_command_takes_them_and_a_known_failure_is_no_news(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ask: Ask = asking(monkeypatch, capsys)
    table = f'[tool.contactverif]\nproperties = ["{DEAD_ZONE}"]\nknown = {{"{DEAD_ZONE}" = "no dead zone yet"}}\n'
    write_table(tmp_path, table, monkeypatch)
    answer = ask("verify", "vts-ppt")
    assert answer.status == 0
    assert f"{DEAD_ZONE}" in answer.out
    assert "no dead zone yet" in answer.out
    assert "patch.flat" not in answer.out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[tool.contactverif]\nopen = 3",
            "open in [tool.contactverif] of pyproject.toml: found 3; needed a list of",
        ),
        ("[tool.contactverif]\njobs = '2'", "jobs in [tool.contactverif] of pyproject.toml: found '2'; needed a whole"),
        ("[tool.contactverif]\nisolation = 'jail'", "found 'jail'; needed box, landlock, process or inline"),
        ("[tool.contactverif]\nknown = {a = 1}", "found {'a': 1}; needed a table of properties and reasons"),
        ("[tool]\ncontactverif = 3", "tool.contactverif of pyproject.toml: found 3; needed a table"),
        ("[tool.contactverif]\nprofiles = 'ci'", "found 'profiles'; needed a name that exists; the nearest: profile"),
        ("[tool", "pyproject.toml: found "),
    ],
)
def test_wrong_settings_are_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, message: str) -> None:
    write_table(tmp_path, text, monkeypatch)
    with pytest.raises(MisuseError) as caught:
        read_settings()
    assert message in str(caught.value)


def test_a_known_failure_of_no_property_suggests_the_nearest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_table(tmp_path, '[tool.contactverif.known]\n"mirrors" = "why"\n', monkeypatch)
    with pytest.raises(MisuseError, match="'mirrors'; needed a name that exists; the nearest: mirror"):
        VerifyOptions(("nts",)).with_settings(read_settings())
