"""Random command lines, and what comes of them: `python evidence/hostile/command_lines.py 5000 --seed 1`.

Options, nonsense, huge numbers, foreign names, files that are missing, damaged or loops, closed streams: every command
gets them, in a forked process of its own with a limit on its time. A line may end with 0, 1, 2, or 130 after Ctrl-C. A
traceback, a signal, another status, a line that does not end and a control character on the screen are counted as such
and printed with what repeats them; then the script ends with status 1.

Expensive work is kept out: a command that would take minutes always gets one value that it must refuse.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))  # Where the script runs, not pytest.
from foreign_texts import TEXTS, hidden_characters

TIME_LIMIT = 60.0  # Seconds of a line; one of those here takes a few at most.
GOOD = ("0", "1", "2", "130")
BAD = ("traceback", "hang", "crash", "control character", "several lines")
_WHOLE = ("0", "1", "2", "3", "-1", "-0", "1e3", "ten", "", "1_0", "٣", str(10**9), str(2**63), str(10**40), "9" * 5000)
_BROKEN_NUMBERS = ("nan", "inf", "-inf", "1e999", "ten", "", "-1", "0", "1", "0.5")
_EXPENSIVE = ("paper", "bench")  # Commands that take minutes if nothing is wrong.
_POISON = ("--no-such-option", "--jobs=-1", "--out=no/such/folder/a.nc", "--out=a.wrong", f"--jobs={10**12}", "--out=")
_COLUMNS = ("1", "2", "20", "80", "400", "0", "-3", "wide", "99999999")


class Line(NamedTuple):
    """A command line, and the circumstances in which it runs."""

    arguments: tuple[str, ...]
    columns: str | None
    streams: str  # "", or which stream is closed or full.
    without_folder: bool


class Ending(NamedTuple):
    """The end of a line, in one of the words of GOOD and BAD, and the last words that it wrote to standard error."""

    word: str
    last_words: str


@dataclass(frozen=True)
class Files:
    """A folder with files of every kind."""

    folder: Path

    @classmethod
    def make(cls, folder: Path) -> Files:
        """Write the files: a report, parts of it, a mesh, loops, names of strangers."""
        from contactverif.contract.case import Case
        from contactverif.contract.interface import Interface
        from contactverif_reports.netcdf.write import write

        sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "cli"))
        from handmade_run import run_with

        interface = Interface.from_chains(slave=[[0, 0], [1, 0]], master=[[2, 0], [-1, 0]])
        case = Case(interface, np.array([0, -0.1, 1, -0.1, 2, 0, -1, 0]), penalty=100.0)
        write(run_with(case, "nts", "balance.force"), folder / "good.nc")
        content = (folder / "good.nc").read_bytes()
        (folder / "half.nc").write_bytes(content[: len(content) // 2])
        (folder / "noise.nc").write_bytes(random.Random(0).randbytes(4096))
        (folder / "empty.nc").write_bytes(b"")
        (folder / "text.txt").write_text("no report\n")
        (folder / "loop.nc").symlink_to("loop.nc")
        (folder / "folder.nc").mkdir()
        (folder / TEXTS["escape"].replace("/", "")).write_text("a stranger's file\n")
        mesh = Path(__file__).parents[2] / "tests" / "data" / "punch.msh"
        if mesh.exists():
            (folder / "punch.msh").write_bytes(mesh.read_bytes())
        return cls(folder)

    def names(self) -> list[str]:
        """Return names of files that are there, and of some that are not."""
        there = sorted(file.name for file in self.folder.iterdir())
        others = ["absent.nc", "no/such/a.nc", "", ".", "/", "/dev/null", "/dev/full", "~", "x" * 300 + ".nc", "-"]
        return [*there, *others, *(text.replace("\0", "") + ".nc" for text in TEXTS.values())]


def draw_line(rng: random.Random, files: Files) -> Line:
    """Draw a command line."""
    commands = _commands()
    name = rng.choice([*commands, rng.choice(["", "verfy", "--version", "--help", *_texts()])])
    arguments = [name]
    if name in commands:
        for option in commands[name].params:
            arguments += _draw_option(rng, option, files, name)
        if name in _EXPENSIVE:
            arguments.append(rng.choice(_POISON[:2] if name == "paper" else _POISON))
        if name in ("verify", "compare") and rng.random() < 0.9:
            arguments += ["-p", rng.choice(["balance.force", "units"]), "--examples", rng.choice(["1", "2"])]
        if any("--isolation" in option.opts for option in commands[name].params) and rng.random() < 0.95:
            arguments += ["--isolation", "inline"]  # Else each line would start a process for the plugin.
        if rng.random() < 0.05:
            arguments.insert(rng.randrange(len(arguments) + 1), rng.choice(_texts()))
    return Line(
        tuple(arguments),
        columns=rng.choice(_COLUMNS) if rng.random() < 0.3 else None,
        streams=rng.choice(["stdout closed", "stderr closed", "both closed", "stdout full"])
        if rng.random() < 0.1
        else "",
        without_folder=rng.random() < 0.03,
    )


def _commands() -> dict[str, Any]:
    """Return {name: command of click}."""
    import typer.main

    from contactverif.cli.app import app

    return dict(typer.main.get_command(app).commands)  # type: ignore[attr-defined]


def _texts() -> list[str]:
    return [text.replace("\0", "") for text in TEXTS.values()]  # No argument holds the character zero.


def _draw_option(rng: random.Random, option: Any, files: Files, command: str) -> list[str]:
    """Draw an option with its value, or an argument; often nothing."""
    is_argument = option.param_type_name == "argument"
    if rng.random() > (0.85 if is_argument else 0.25):
        return []
    if is_argument:
        return [_draw_value(rng, option, files, command) for _ in range(rng.choice([1, 1, 1, 2, 3]))]
    flag = rng.choice(option.opts)
    if getattr(option, "is_flag", False):
        return [flag]
    value = _draw_value(rng, option, files, command)
    return [f"{flag}={value}"] if flag.startswith("--") and rng.random() < 0.5 else [flag, value]


def _draw_value(rng: random.Random, option: Any, files: Files, command: str) -> str:
    """Draw a value that fits the option, or one that does not."""
    if rng.random() < 0.1:
        return rng.choice(_texts())
    name = option.name
    if name in ("names", "formulation", "against") and command != "bench":
        return rng.choice([*_formulations(), "good.nc"])
    if name == "scene":
        return rng.choice(["c", "c-prime", "b:refine=2", "c:refine=1e9", "c:penalty=nan", "c:degrees=1e308", "x", "c:"])
    if name in ("examples", "seed", "jobs", "number", "repeats"):
        return rng.choice(_WHOLE)
    if name in ("properties", "known"):
        return rng.choice(["balance.force", "units", "nope", "[", "*?[!]", "balance.force=why", "=", "**" * 50 + "x"])
    if name in ("case_id", "case", "slave", "master", "profile"):
        return rng.choice(["nts.balance.force", "ci", "dev", "punch", "base", "", "*", "é"])
    return rng.choice(files.names())


def _formulations() -> list[str]:
    nested = "two-pass/" * 12 + "nts"
    plain = ["nts", "nts", "nts-ar:area=reference", "mortar", "two-pass/nts-ar", "vts-me:n=4"]
    wrong = [
        "vts-me:n=1000000000",
        "vts-me:n=1e9",
        "vts-me:n=0",
        "nts:tau=nan",
        "nts:tau=-1",
        "nts:penalty=1",
        "vts-pt",
    ]
    return [*plain, *wrong, nested, "two-pass", "nts/nts", "two-pass/", "/nts", ":", "nts:", "nts:a", "nts:tau=1,tau=2"]


def run_line(line: Line, files: Files, limit: float = TIME_LIMIT) -> Ending:
    """Run a line in a forked process; the parent has imported what it needs."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = os.fork()
        if process == 0:
            _become(line, files, out.fileno(), err.fileno())
        status = _wait(process, limit)
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read(2_000_000).decode("utf-8", "replace"))
    return Ending(_judge(status, *texts), texts[1][-400:])


def _become(line: Line, files: Files, out: int, err: int) -> None:
    """Turn this process into the command, and end it."""
    status = 70
    try:
        os.setsid()
        os.chdir(files.folder)
        if line.without_folder:
            deleted = Path(tempfile.mkdtemp())
            os.chdir(deleted)
            deleted.rmdir()
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(err, 2)
        closed = {"stdout closed": (1,), "stderr closed": (2,), "both closed": (1, 2)}.get(line.streams, ())
        for number in closed:
            os.close(number)
        if line.streams == "stdout full":
            os.dup2(os.open("/dev/full", os.O_WRONLY), 1)
        for number, name in ((1, "stdout"), (2, "stderr")):
            setattr(sys, name, None if number in closed else open(number, "w", encoding="utf-8", closefd=False))  # noqa: SIM115
        os.environ.pop("COLUMNS", None)
        if line.columns is not None:
            os.environ["COLUMNS"] = line.columns
        sys.argv = ["contactverif", *line.arguments]
        from contactverif.cli.app import main

        main()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 71
    except BaseException:
        import traceback

        traceback.print_exc()
        status = 72
    finally:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError, AttributeError):
                stream.flush()
        os._exit(status)


def _wait(process: int, limit: float) -> int | None:
    """Return the status of a process, negative for a signal; None if it did not end. Nothing of it is left behind."""
    end = time.monotonic() + limit
    while time.monotonic() < end:
        finished, status = os.waitpid(process, os.WNOHANG)
        if finished:
            _kill_group(process)
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.005)
    _kill_group(process)
    os.waitpid(process, 0)
    return None


def _kill_group(process: int) -> None:
    try:
        os.killpg(process, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        return


def _judge(status: int | None, out: str, err: str) -> str:
    if status is None:
        return "hang"
    if "Traceback (most recent call last)" in err:
        return "traceback"
    if str(status) not in GOOD:
        return "crash"
    if hidden_characters(out) or hidden_characters(err):
        return "control character"
    others = [line for line in err.splitlines() if " judged" not in line]  # The rows of a run are no refusal.
    return "several lines" if status == 2 and len(others) > 1 else str(status)


def run_lines(number: int, seed: int, folder: Path, *, limit: float = TIME_LIMIT) -> Iterator[tuple[Line, Ending]]:
    """Yield random lines and their endings; the same number and seed give the same lines."""
    files = Files.make(folder)
    _import_all()
    for place in range(number):
        line = draw_line(random.Random(f"{seed}/{place}"), files)
        yield line, run_line(line, files, limit)


def _import_all() -> None:
    """Import once what forked processes share."""
    for name in ("cli.app", "cli.compare", "cli.run_screen", "cli.replay", "run.run"):
        importlib.import_module(f"contactverif.{name}")
    importlib.import_module("contactverif_reports.html.report_page")
    from contactverif.plugins import registry

    registry.load_properties(["balance.*", "units"])
    registry.load_formulation("nts")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the lines and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("number", type=int, nargs="?", default=5000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    counts: Counter[str] = Counter()
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        for place, (line, ending) in enumerate(run_lines(options.number, options.seed, Path(folder))):
            counts[ending.word] += 1
            if ending.word in BAD:
                print(f"{ending.word}, line {place}: {ascii(line)[:1500]}\n    {ending.last_words!a}", flush=True)
    print(", ".join(f"{word}: {counts[word]}" for word in (*GOOD, *BAD)), f"in {time.monotonic() - start:.0f} s")
    return int(any(counts[word] for word in BAD))


if __name__ == "__main__":
    sys.exit(main())
