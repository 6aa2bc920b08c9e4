"""The keys of journals: where they lie, who may read them, and how long they are kept."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from contactverif.journals.journal import JournalKey, begin_journal, remove_journal, withdraw_journal
from contactverif.journals.keys import make_key, read_key, state_folder
from contactverif.journals.run_plan import Plan


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such modes")
def test_only_its_user_may_read_a_key(state: Path) -> None:
    make_key("1a")
    path = state / "contactverif" / "keys" / "1a"
    assert path.read_bytes() == read_key("1a")
    assert len(read_key("1a")) == 32
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700


def test_a_relative_state_folder_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The standard of these variables says so."""
    monkeypatch.setenv("XDG_STATE_HOME", "here")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    assert state_folder().is_relative_to(tmp_path)


def test_a_key_is_made_once_and_is_whole_or_none(state: Path) -> None:
    make_key("1a")
    first = read_key("1a")
    make_key("1a")
    assert read_key("1a") == first
    (state / "contactverif" / "keys" / "1a").write_bytes(first[:-1])
    assert read_key("1a") == read_key("none") == b""


def test_two_journals_of_one_plan_have_two_keys_which_go_with_them(tmp_path: Path, state: Path) -> None:
    folders = [tmp_path / name for name in ("a", "b", "c")]
    for folder in folders:
        begin_journal(folder, Plan(), [])
    keys = {JournalKey.read(folder) for folder in folders}
    assert len({key.identity for key in keys}) == len({key.key for key in keys} - {b""}) == 3
    begin_journal(folders[0], Plan(), [])  # The earlier one is set aside with its key.
    assert len([*(state / "contactverif" / "keys").iterdir()]) == 4
    remove_journal(folders[0])
    withdraw_journal(folders[1], [])
    assert [path.name for path in (state / "contactverif" / "keys").iterdir()] == [JournalKey.read(folders[2]).identity]


def test_where_no_key_can_be_kept_a_journal_begins_without_one(tmp_path: Path, state: Path) -> None:
    state.write_text("a file")
    begin_journal(tmp_path / "a", Plan(), [])
    assert JournalKey.read(tmp_path / "a").key == b""


def test_a_run_that_was_killed_as_it_made_its_journal_leaves_nothing_for_long(tmp_path: Path, state: Path) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    begin_journal(tmp_path / "r", Plan(), [])
    unfinished, of_another = (tmp_path / f".r.{pid}.part" for pid in (ended.pid, os.getppid()))
    (tmp_path / "r").rename(unfinished)
    of_another.mkdir()  # A process that is alive may be about to finish it.
    key = JournalKey.read(unfinished)
    assert key.key
    begin_journal(tmp_path / "r", Plan(), [])
    assert sorted(path.name for path in tmp_path.glob("*r*")) == [of_another.name, "r"]
    assert not read_key(key.identity)
