"""The command line, called in the process of the test."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from contactverif.cli import app as cli


class Answer(NamedTuple):
    """The exit status of a command, and its output."""

    status: int
    out: str
    err: str


Ask = Callable[..., Answer]


def asking(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Ask:
    """Return a function that runs `contactverif`, with 140 columns if the test does not say how many."""
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.delenv("FORCE_COLOR", raising=False)

    def run_command(*arguments: str | Path, columns: int | None = None) -> Answer:
        if columns is None:
            monkeypatch.delenv("COLUMNS", raising=False)
        else:
            monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setattr(sys, "argv", ["contactverif", *map(str, arguments)])
        with pytest.raises(SystemExit) as exit_info:
            cli.main()
        out, err = capsys.readouterr()
        assert isinstance(exit_info.value.code, int)
        return Answer(exit_info.value.code, out, err)

    return run_command
