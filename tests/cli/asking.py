"""The command line, called in the process of the test."""

import re
import shlex
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from importlib.metadata import EntryPoint, entry_points
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from contactverif.cli import app as cli
from contactverif.plugins import registry


class Answer(NamedTuple):
    """The exit status of a command, and its output, without the rows on standard error."""

    status: int
    out: str
    err: str


Ask = Callable[..., Answer]
_ROW = re.compile(
    r"^(\S+ [a-z0-9.-]*: ([A-Za-z ]+(, \d+/\d+ judged| again)(: .*)?|[a-z ()]+ \d+/\d+)"
    r"|.*; [\d,]+ of some [\d,]+ in all.*|first round: .*)\n",
    re.MULTILINE,
)


def without_rows(err: str) -> str:
    """Return what a command said on standard error besides the rows of its run."""
    return _ROW.sub("", err)


def run_inline(line: str, *arguments: str | Path) -> Answer:
    """Run `contactverif` in this process, and return all that it says; fixtures that tests share call it."""
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        patch.setattr(sys, "argv", ["contactverif", *shlex.split(line), *map(str, arguments)])
        with pytest.raises(SystemExit) as exit_info:
            cli.main()
    assert isinstance(exit_info.value.code, int)
    return Answer(exit_info.value.code, out.getvalue(), err.getvalue())


@pytest.fixture
def ask(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Ask:
    """Return a function that runs `contactverif` with the words of a line, then with arguments as they are.

    The terminal has 140 columns if the test does not say how many.
    """
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.delenv("FORCE_COLOR", raising=False)

    def run_command(line: str = "", *arguments: str | Path, columns: int | str | None = None) -> Answer:
        if columns is None:
            monkeypatch.delenv("COLUMNS", raising=False)
        else:
            monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setattr(sys, "argv", ["contactverif", *shlex.split(line), *map(str, arguments)])
        with pytest.raises(SystemExit) as exit_info:
            cli.main()
        out, err = capsys.readouterr()
        assert isinstance(exit_info.value.code, int)
        return Answer(exit_info.value.code, out, without_rows(err))

    return run_command


def check_mistake(answer: Answer, message: str) -> None:
    """Check that a command refused a mistake of the user with this line (a pattern) and nothing else."""
    assert (answer.status, answer.out) == (2, "")
    assert re.fullmatch(f"contactverif: {message}\n", answer.err), answer.err


def install_formulations(monkeypatch: pytest.MonkeyPatch, **factories: Callable[..., Any] | str) -> None:
    """Install formulations {name: factory, or "module:factory"} beside those that are there."""

    class Entry(EntryPoint):
        def load(self) -> Any:
            make = factories[self.name]
            return super().load() if isinstance(make, str) else make

    more = [
        Entry(name, make if isinstance(make, str) else f"{make.__module__}:{name}", registry.FORMULATIONS)
        for name, make in factories.items()
    ]

    def list_entry_points(*, group: str) -> list[EntryPoint]:
        return [*entry_points(group=group), *(more if group == registry.FORMULATIONS else [])]

    monkeypatch.setattr(registry, "entry_points", list_entry_points)
