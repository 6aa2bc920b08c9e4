"""The options of isolation: a box where there are boxes, what is open in it, and what is said where there are none."""

import os
from pathlib import Path

import pytest

from contactverif.api.plugin_places import Isolation
from contactverif.cli.isolation_options import IsolationOptions, place_line
from contactverif.contract.errors import MisuseError
from contactverif.isolation import box as boxes
from contactverif.isolation import confine, process

FORBIDDEN = "bwrap: setting up uid map: Permission denied; allow user namespaces"


@pytest.fixture
def with_boxes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(boxes, "why_no_box", lambda box=None: "")


@pytest.fixture
def without_boxes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(boxes, "why_no_box", lambda box=None: FORBIDDEN)
    monkeypatch.setattr(confine, "landlock_version", lambda: 0)


@pytest.mark.usefixtures("with_boxes")
def test_plugins_are_in_a_box_unless_the_user_says_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    assert IsolationOptions().limits() is None  # Under pytest.
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    monkeypatch.setattr(process, "adopt_orphans", lambda: None)  # Other tests do not expect orphans of others.
    assert IsolationOptions().settle().isolation is Isolation.BOX
    limits = IsolationOptions().limits([Path("/journal")])
    assert limits is not None
    assert limits.box == boxes.Box(hidden=("/journal",))
    of_process = IsolationOptions(Isolation.PROCESS).limits()
    assert of_process is not None
    assert of_process.box is None
    assert IsolationOptions(Isolation.INLINE).limits() is None


@pytest.mark.usefixtures("without_boxes")
def test_without_boxes_plugins_are_in_a_process_and_the_last_line_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    assert IsolationOptions().settle().isolation is Isolation.PROCESS
    assert place_line("process") == f"The plugins ran in a process without a box: {FORBIDDEN}."
    with pytest.raises(MisuseError, match=r"--isolation: found box, but bwrap: .* denied; .*; needed .*, or process"):
        IsolationOptions(Isolation.BOX).settle()
    with pytest.raises(MisuseError, match=r"--isolation: found landlock, which this system has not; needed Linux with"):
        IsolationOptions(Isolation.LANDLOCK).settle()


@pytest.mark.usefixtures("without_boxes")
def test_where_there_are_rules_of_landlock_they_stand_in_for_a_box(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    monkeypatch.setattr(confine, "landlock_version", lambda: 7)
    assert IsolationOptions().settle().isolation is Isolation.LANDLOCK
    assert IsolationOptions(Isolation.PROCESS).settle().isolation is Isolation.PROCESS
    words = place_line("process (Landlock 7)")
    assert words == f"The plugins ran in a process (Landlock 7) without a box: {FORBIDDEN}."


def test_the_last_line_says_what_the_box_was() -> None:
    assert place_line("box (bubblewrap 0.8.0)") == "The plugins ran in a box (bubblewrap 0.8.0)."
    assert place_line("process") == "The plugins ran in a process without a box: as --isolation says."


@pytest.mark.usefixtures("with_boxes")
def test_what_is_open_comes_from_the_command_or_else_from_the_project(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert IsolationOptions().settle().opened == []
    Path("pyproject.toml").write_text('[tool.contactverif]\nopen = ["data", "network"]\n', encoding="utf-8")
    with pytest.raises(MisuseError, match=r"--open: found .*data, which does not exist; needed a path .*, or network"):
        IsolationOptions().settle()
    Path("data").mkdir()
    assert IsolationOptions().settle().opened == [str(tmp_path / "data"), "network"]
    assert IsolationOptions(opened=[os.devnull]).settle().opened == [os.devnull]
