"""Kill runs of the command line with SIGKILL at random moments, resume them, and count what was lost.

`python evidence/hostile/sigkills.py 100` kills 100 times; `… 3 verify` kills `verify` three times. The moments come
from a seed. Half of the kills hit the whole process group, half the first process alone.

Cases that are asked again after a kill were lost. A plugin notes the states that it is asked about, so that they are
counted without a look into the journal: each job may lose the chunk that it was judging.
"""

import csv
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import xarray as xr
from catalogue import install
from containment import scratch
from reaper import adopt_orphans, descendants, kill_descendants

from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import read_run

SEED = 14
MAIN = "from contactverif.cli import main; main()"
GRACE = 5.0  # Seconds in which workers must see that the first process is gone.
LINE = 32  # Bytes of a line of the plugin `counting`.
HEADS = ("command", "kills", "resumed", "cases lost", "reports broken", "files left", "processes left", "seconds")
# `counting` notes what it is asked in a file, which a box has if it is opened.
_COUNTING = ("counting", "--open", "../noted", "-p", "purity")
_FLAT = ("-p", "patch.flat.transmission", "--examples", "250", "--seed", "1")
_COUNTED = ("verify", *_COUNTING, *_FLAT, "--out", "report.nc")


@dataclass(frozen=True)
class Command:
    """A command that is killed."""

    words: tuple[str, ...]
    resume: tuple[str, ...] = ()  # The command line that goes on, if there is one
    after: tuple[str, ...] = ()  # A command line that makes the report from what is there, if one is needed
    jobs: int = 1  # Processes that judge; each may lose one chunk.
    share: float = 0.2  # The share of the kills that hit this command
    read: Callable[[Path], object] = read_run  # It raises if a file of the results is broken.
    # The differences of two folders, one of them from a run that was never killed.
    compare: Callable[[Path, Path], list[str]] = field(default=lambda a, b: _same_reports(a, b))


def _same_reports(a: Path, b: Path) -> list[str]:
    """Return the differences of the reports in two folders, but for what was open to plugins: each has its own file."""
    return [line for line in same_data(a / "report.nc", b / "report.nc") if not line.startswith("/:opened")]


def _same_files(a: Path, b: Path) -> list[str]:
    """Return the names of files that are not the same in both folders; a number of seconds in a page may differ."""
    names = {path.relative_to(folder) for folder in (a, b) for path in folder.rglob("*.svg")}
    return [str(name) for name in sorted(names) if not _equal(a / name, b / name)]


def _equal(a: Path, b: Path) -> bool:
    return a.exists() and b.exists() and a.read_bytes() == b.read_bytes()


def _read_data(path: Path) -> None:
    """Read all data of a file that is no report of a run."""
    with xr.open_datatree(path, engine="netcdf4") as tree:
        tree.load()


def _same_bench(a: Path, b: Path) -> list[str]:
    """Return why two benches differ in anything but seconds, which stand in the group `timing`."""
    trees = [xr.open_datatree(folder / "report.nc", engine="netcdf4") for folder in (a, b)]
    with trees[0] as left, trees[1] as right:
        same = left.to_dataset().drop_attrs().identical(right.to_dataset().drop_attrs())
    return [] if same else ["results of the bench"]


_SHARDED = ("campaign", *_COUNTING, *_FLAT, "--shard", "1/1", "--out", "shards")
COMMANDS = {
    "verify": Command((*_COUNTED, "--jobs", "1"), ("verify", "--resume", "report.nc"), share=0.3),
    "verify -j2": Command(
        (*_COUNTED, "--jobs", "2"), ("verify", "--resume", "report.nc"), jobs=2, share=0.2
    ),
    "compare": Command(
        ("compare", "nts-ar", "--against", "vts-ppt", "-p", "patch.flat.*", "--examples", "60", "--seed", "1",
         "--out", "report.nc"), ("compare", "--resume", "report.nc"), share=0.1,
    ),
    "bench": Command(
        ("bench", "nts-ar", "--scene", "wavy", "--quick", "--instances", "1", "--out", "report.nc"),
        ("bench", "nts-ar", "--scene", "wavy", "--quick", "--instances", "1", "--out", "report.nc"),
        share=0.1, read=_read_data, compare=_same_bench,
    ),
    "paper": Command(
        ("paper", "--out", "paper", "--jobs", "2"), jobs=2, share=0.1, read=_read_data, compare=_same_files
    ),
    "campaign": Command(_SHARDED, _SHARDED, ("merge", "shards", "--out", "report.nc"), share=0.2),
}  # fmt: skip


def start(folder: Path, words: Sequence[str], notes: str) -> subprocess.Popen[bytes]:
    """Start `contactverif` in a folder; the plugin `counting` notes what it is asked in the file `notes`."""
    (folder / "tmp").mkdir(exist_ok=True)
    here, noted = folder / "here", folder / "noted"
    here.mkdir(exist_ok=True)
    noted.mkdir(exist_ok=True)
    variables = os.environ | {
        "PYTHONPATH": install(folder / "site", {"counting": "counting:make"}),
        "CASES_ASKED": str(noted / notes),
        "TMPDIR": str(folder / "tmp"),
        "NO_COLOR": "1",
    }
    with (folder / f"{notes}.log").open("wb") as log:
        return subprocess.Popen(
            [sys.executable, "-c", MAIN, *words],
            cwd=here,
            env=variables,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )


def states(file: Path) -> list[bytes]:
    """Return the states that a plugin noted, in order."""
    data = file.read_bytes() if file.exists() else b""
    return [data[at : at + LINE] for at in range(0, len(data) - LINE + 1, LINE)]


@dataclass(frozen=True)
class Unbroken:
    """A run that was never killed: its folder, its seconds, and its exit status."""

    folder: Path
    seconds: float
    status: int


@cache
def unbroken(name: str) -> Unbroken:
    """Run a command to its end, once."""
    folder = Path(tempfile.mkdtemp(prefix="kills-"))
    start(folder, COMMANDS[name].words, "asked").wait()  # The first run compiles.
    shutil.rmtree(folder)
    folder.mkdir()
    begin = time.monotonic()
    status = start(folder, COMMANDS[name].words, "asked").wait()
    if status not in (0, 1):
        raise SystemExit(f"{name}: exit status {status}: {(folder / 'asked.log').read_text(errors='replace')[-500:]}")
    seconds = time.monotonic() - begin
    return Unbroken(folder, seconds, _make_report(folder, COMMANDS[name], status))


def _make_report(folder: Path, command: Command, status: int) -> int:
    """Make the report of what is there, if that is a command of its own; return the exit status of the last command."""
    return start(folder, command.after, "report").wait() if command.after and status == 0 else status


@cache
def common_states() -> frozenset[bytes]:
    """Return the states that every run asks about before its first case: those of two runs with other seeds."""
    with scratch() as folder:
        sets = []
        for seed in ("2", "3"):
            words = ("verify", *_COUNTING, "--examples", "5", "--seed", seed, "--jobs", "1")
            start(folder, words, seed).wait()
            sets.append(set(states(folder / "noted" / seed)))
        return frozenset(sets[0] & sets[1])


@dataclass
class Count:
    """The results of some kills of a command."""

    kills: int = 0
    resumed: int = 0
    n_lost: int = 0
    broken: int = 0
    files: int = 0
    processes: int = 0
    seconds: float = 0.0
    remarks: list[str] = field(default_factory=list)


def _broken_reports(folder: Path, read: Callable[[Path], object]) -> list[str]:
    """Return why reports cannot be read; a report that is not there is not broken."""
    reasons = []
    for path in folder.rglob("*.nc"):
        if ".journal" in str(path.relative_to(folder)):
            continue
        try:
            read(path)
        except Exception as error:
            reasons.append(f"{path.name}: {type(error).__name__}: {error}")
    return reasons


def kill_once(name: str, moment: float, group: bool, count: Count) -> None:
    """Kill a command or its process group at a moment, look at what is there, resume it, and look again.

    The moment is a share of the time of an unbroken run. The counts are raised.
    """
    command, whole = COMMANDS[name], unbroken(name)
    with scratch() as folder:
        process = start(folder, command.words, "first")
        with suppress(subprocess.TimeoutExpired):
            process.wait(moment * whole.seconds)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL) if group else process.kill()
        process.wait()
        count.kills += 1
        end = time.monotonic() + GRACE
        while descendants() and time.monotonic() < end:
            time.sleep(0.05)
        left = kill_descendants()
        count.processes += len(left)
        broken = _broken_reports(folder / "here", command.read)
        count.remarks += [f"left: {line}" for line in left] + broken
        count.broken += len(broken)
        if command.resume:
            _resume(name, folder, count)
        elif process.returncode == whole.status:
            count.broken += bool(command.compare(folder / "here", whole.folder / "here"))


def _resume(name: str, folder: Path, count: Count) -> None:
    """Go on with a run that was killed, and compare what comes out with an unbroken run."""
    command, whole = COMMANDS[name], unbroken(name)
    words = command.resume
    if "--resume" in words and not (folder / "here" / "report.nc.journal").exists():
        words = command.words  # It was killed before it began, or after it had ended.
    status = _make_report(folder, command, start(folder, words, "second").wait())
    count.resumed += 1
    twice = (set(states(folder / "noted" / "first")) & set(states(folder / "noted" / "second"))) - common_states()
    # A case of `purity` asks about four states and one of the patch test about one. Each job may lose the chunk of 25
    # cases that it was judging, and of each row three of 250 cases are judged again.
    n_lost = max(0, len(twice) - 5 * (25 * command.jobs + 3)) if words == command.resume else 0
    count.n_lost += n_lost
    differs = ["no report"] if status != whole.status else command.compare(folder / "here", whole.folder / "here")
    count.broken += bool(differs)
    files = {path.name for path in (folder / "here").iterdir()} - {
        path.name for path in (whole.folder / "here").iterdir()
    }
    count.files += len(files)
    log = (folder / "second.log").read_text(errors="replace").strip()[-200:]
    if n_lost or differs or files:
        count.remarks.append(f"status {status}, {n_lost} lost, {differs[:1]}, {sorted(files)}: {log}")


def main(kills: int, names: Sequence[str]) -> int:
    """Kill, print the table, and return the exit status: 1 if anything was lost, broken or left behind."""
    adopt_orphans()
    chance = random.Random(SEED)
    shares = {name: COMMANDS[name].share for name in names}
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(HEADS)
    bad = 0
    for name in names:
        count, begin = Count(), time.monotonic()
        for number in range(max(1, round(kills * shares[name] / sum(shares.values())))):
            kill_once(name, chance.random(), group=bool(number % 2), count=count)
        seconds = f"{time.monotonic() - begin:.0f}"
        table.writerow(
            (name, count.kills, count.resumed, count.n_lost, count.broken, count.files, count.processes, seconds)
        )
        sys.stdout.flush()
        for remark in count.remarks:
            print(f"  {remark}", file=sys.stderr)
        bad += count.n_lost + count.broken + count.files + count.processes
        shutil.rmtree(unbroken(name).folder, ignore_errors=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), sys.argv[2:] or list(COMMANDS)))
