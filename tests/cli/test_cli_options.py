"""The options of a run: what is typed, what the project's settings say, and the place where plugins live."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from asking import Ask

from contactverif import MisuseError
from contactverif.cli.verify import print_isolation
from contactverif.isolation import box as boxes
from contactverif.isolation import confine, process
from contactverif.run.journal import read_record, write_record
from contactverif.run.run_options import Isolation, RunOptions, read_settings
from contactverif.run.store import Plan

FORBIDDEN = "bwrap: setting up uid map: Permission denied; allow user namespaces"
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


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def with_boxes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(boxes, "why_no_box", lambda box=None: "")


@pytest.fixture
def without_boxes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(boxes, "why_no_box", lambda box=None: FORBIDDEN)
    monkeypatch.setattr("contactverif.cli.verify.why_no_box", lambda: FORBIDDEN)
    monkeypatch.setattr(confine, "landlock_version", lambda: 0)


def write_table(text: str) -> None:
    Path("pyproject.toml").write_text(text, encoding="utf-8")


def isolation_of(wanted: Isolation | None = None, opened: tuple[str, ...] | None = None) -> Any:
    return RunOptions(isolation=wanted, opened=opened).settled_isolation()


def test_options_are_what_the_plan_of_a_journal_says() -> None:
    options = RunOptions(names=("nts",), out=(Path("r.nc"),), known={"mirror": "why"}, isolation=Isolation.BOX)
    write_record(Path("plan"), Plan(options=options))
    assert read_record(Path("plan"), Plan) == Plan(options=options)
    assert options.from_folder("/elsewhere").out == (Path("/elsewhere/r.nc"),)
    write_record(Path("plan"), Plan(options=replace(options, names=3)))  # type: ignore[arg-type]
    assert read_record(Path("plan"), Plan) is None


def test_without_a_table_all_is_left_to_the_command_line() -> None:
    assert read_settings() == RunOptions()
    write_table("[project]\nname = 'mine'\n")
    assert read_settings() == RunOptions()


def test_a_run_takes_the_settings_where_nothing_is_typed() -> None:
    write_table(TABLE)
    options = RunOptions(names=("nts",)).with_settings()
    assert options.properties == ("patch.flat.*", "balance.force")
    assert options.known == {"patch.flat.single": "issue 12"}  # `mirror` is not asked.
    assert (options.profile, options.jobs) == ("ci", 1)
    assert isolation_of() == (Isolation.INLINE, ("/dev/null",))


def test_what_is_typed_counts_more() -> None:
    write_table(TABLE)
    properties, known = ("patch.flat.single", "mirror"), {"patch.flat.single": "mine"}
    typed = RunOptions(names=("nts",), properties=properties, profile="dev", known=known, jobs=2)
    options = typed.with_settings()
    assert options.properties == properties
    assert options.known == {"patch.flat.single": "mine", "mirror": "issue 13"}
    assert (options.profile, options.jobs) == ("dev", 2)
    assert isolation_of(Isolation.PROCESS, (os.devnull,)) == (Isolation.PROCESS, (os.devnull,))


def test_the_command_takes_them_and_a_known_failure_is_no_news(ask: Ask) -> None:
    write_table(f'[tool.contactverif]\nproperties = ["{DEAD_ZONE}"]\nknown = {{"{DEAD_ZONE}" = "no dead zone yet"}}\n')
    answer = ask("verify", "vts-ppt")
    assert answer.status == 0
    assert f"{DEAD_ZONE}" in answer.out
    assert "no dead zone yet" in answer.out
    assert "patch.flat" not in answer.out


@pytest.mark.parametrize(
    ("words", "examples"),
    [
        ({}, 7),
        ({"examples": 3}, 3),
        ({"profile": "nightly"}, 2000),
        ({"quick": True}, 5),
        ({"examples": 9, "quick": True}, 9),
    ],
)
def test_the_number_of_cases_is_that_of_the_project_unless_something_else_is_typed(
    words: dict[str, Any], examples: int
) -> None:
    write_table('[tool.contactverif]\nprofile = "ci"\nexamples = 7\n')
    assert RunOptions(names=("nts",), **words).with_settings().settle().examples == examples


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[tool.contactverif]\nopen = 3", "open in [tool.contactverif] of pyproject.toml: found 3; needed a list of"),
        ("[tool.contactverif]\njobs = '2'", "jobs in [tool.contactverif] of pyproject.toml: found '2'; needed a whole"),
        ("[tool.contactverif]\nexamples = '2'", "examples in [tool.contactverif] of pyproject.toml: found '2'; needed"),
        ("[tool.contactverif]\nisolation = 'jail'", "found 'jail'; needed box, landlock, process or inline"),
        ("[tool.contactverif]\nknown = {a = 1}", "found {'a': 1}; needed a table of properties and reasons"),
        ("[tool.contactverif]\ntraits = 1", "found 1; needed a table of libraries and their traits"),
        ("[tool]\ncontactverif = 3", "tool.contactverif of pyproject.toml: found 3; needed a table"),
        ("[tool.contactverif]\nprofiles = 'ci'", "found 'profiles'; needed a name that exists; the nearest: profile"),
        ("[tool.contactverif.known]\n'mirrors' = 'why'", "'mirrors'; needed a name that exists; the nearest: mirror"),
        ("[tool", "pyproject.toml: found "),
        ("tool = 1", "tool.contactverif of pyproject.toml: found 1; needed a table"),
        (f"x = {'[' * 1200}", "pyproject.toml: found maximum recursion depth exceeded"),
    ],
)
def test_wrong_settings_are_one_line(text: str, message: str) -> None:
    write_table(text)
    with pytest.raises(MisuseError) as caught:
        RunOptions(names=("nts",)).with_settings()
    assert message in str(caught.value)
    Path("pyproject.toml").unlink()
    Path("pyproject.toml").symlink_to("/dev/zero")
    with pytest.raises(MisuseError, match="which is a device; needed a file of settings"):
        RunOptions(names=("nts",)).with_settings()


@pytest.mark.usefixtures("with_boxes")
def test_plugins_are_in_a_box_unless_the_user_says_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    assert RunOptions().limits() is None  # Under pytest.
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    monkeypatch.setattr(process, "adopt_orphans", lambda: None)  # Other tests do not expect orphans of others.
    assert isolation_of()[0] is Isolation.BOX
    limits = RunOptions().limits([Path("/journal")])
    assert limits is not None
    assert limits.box == boxes.Box(hidden=limits.box.hidden)
    assert "/journal" in limits.box.hidden
    of_process = RunOptions(isolation=Isolation.PROCESS).limits()
    assert of_process is not None
    assert of_process.box is None
    assert RunOptions(isolation=Isolation.INLINE).limits() is None


@pytest.mark.usefixtures("without_boxes")
def test_without_boxes_plugins_are_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    assert isolation_of()[0] is Isolation.PROCESS
    with pytest.raises(MisuseError, match=r"--isolation: found box, but bwrap: .* denied; .*; needed .*, or process"):
        isolation_of(Isolation.BOX)
    with pytest.raises(MisuseError, match=r"--isolation: found landlock, which this system has not; needed Linux with"):
        isolation_of(Isolation.LANDLOCK)
    monkeypatch.setattr(confine, "landlock_version", lambda: 7)
    assert isolation_of()[0] is Isolation.LANDLOCK
    assert isolation_of(Isolation.PROCESS)[0] is Isolation.PROCESS


@pytest.mark.usefixtures("without_boxes")
def test_the_last_line_says_what_the_box_was_or_why_there_is_none(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for place in ("box (bubblewrap 0.8.0)", "process (Landlock 7)", "inline"):
        print_isolation({"isolation": place})
    monkeypatch.setattr("contactverif.cli.verify.why_no_box", lambda: "")
    print_isolation({"isolation": "process"})
    assert capsys.readouterr().out.splitlines() == [
        "The plugins ran in a box (bubblewrap 0.8.0).",
        f"The plugins ran in a process (Landlock 7) without a box: {FORBIDDEN}.",
        "The plugins ran in a process without a box: as --isolation says.",
    ]


@pytest.mark.usefixtures("with_boxes")
def test_what_is_open_comes_from_the_command_or_else_from_the_project(tmp_path: Path) -> None:
    assert isolation_of()[1] == ()
    write_table('[tool.contactverif]\nopen = ["data", "network"]\n')
    with pytest.raises(MisuseError, match=r"--open: found .*data, which does not exist; needed a path .*, or network"):
        isolation_of()
    Path("data").mkdir()
    assert isolation_of()[1] == (str(tmp_path / "data"), "network")
    assert isolation_of(opened=(os.devnull,))[1] == (os.devnull,)
