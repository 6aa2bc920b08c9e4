"""Run the same seed in all ways that there are, and compare the reports bit by bit.

`python evidence/hostile/ways.py EXAMPLES KILLS` prints a table: how many arrays the report of each way has, and which
differ from those of the first. Times stand in a group that is left out; where plugins lived, and how many outcomes have
a proof, is an attribute of the file. Without isolation there is no second process that `purity` could ask: one of its
numbers is missing there, and the table says so.
"""

import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import xarray as xr

from contactverif.isolation.box import why_no_box
from contactverif.isolation.confine import landlock_version
from contactverif_reports.netcdf.differences import same_data

NAMES = ("nts", "nts-ar", "vts-ppt", "vts-ppt-lm", "mortar-dual-lm", "two-pass/nts")
SEED = "7"
SHARDS = 3
OF_PLACES = ("/:isolation", "/:opened", "/:stored", "/:libraries")  # Attributes that say where plugins lived.
MAIN = "from contactverif.cli import main; main()"


def start(folder: Path, *words: str) -> subprocess.Popen[bytes]:
    """Start `contactverif` in a folder."""
    folder.mkdir(exist_ok=True)
    with (folder / "log").open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-c", MAIN, *words], cwd=folder, stdout=log, stderr=log, start_new_session=True
        )


def finish(folder: Path, *words: str) -> None:
    """Run `contactverif` to its end, with all promises kept or not."""
    status = start(folder, *words).wait()
    if status not in (0, 1):
        raise SystemExit(f"{' '.join(words)}: exit status {status}: {(folder / 'log').read_text()[-500:]}")


class Ways:
    """The ways to run one seed, each a function that writes `report.nc` into a folder."""

    def __init__(self, examples: str, kills: int) -> None:
        self.words = (*NAMES, "--examples", examples, "--seed", SEED)
        self.kills, self.seconds = kills, 0.0

    def verify(self, *more: str) -> Callable[[Path], None]:
        """Return the way of one command."""
        return lambda folder: finish(folder, "verify", *self.words, "--out", "report.nc", *more)

    def kill_again_and_again(self, folder: Path) -> None:
        """Kill the command again and again at random moments, and go on each time."""
        chance, words = random.Random(SEED), ("verify", *self.words, "--out", "report.nc")
        for _ in range(self.kills):
            process = start(folder, *words)
            with suppress(subprocess.TimeoutExpired):
                process.wait(2 + 2 * chance.random() * self.seconds / self.kills)
            if process.returncode is not None:
                return
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            if (folder / "report.nc.journal").exists():
                words = ("verify", "--resume", "report.nc")
        finish(folder, *words)

    def merge_shards(self, folder: Path) -> None:
        """Judge a campaign in shards, in different places, and merge them."""
        places = ("inline", "process", "process" if why_no_box() else "box")
        for number, place in enumerate(places, 1):
            options = ("--shard", f"{number}/{SHARDS}", "--out", "shards", "--isolation", place)
            finish(folder, "campaign", *self.words, *options)
        finish(folder, "merge", "shards", "--out", "report.nc")

    def __iter__(self) -> Iterator[tuple[str, Callable[[Path], None]]]:
        places = ["process", "inline"]
        places += ["landlock"] if landlock_version() else []
        places += [] if why_no_box() else ["box"]
        for place in places:
            for jobs in ("1", "2"):
                yield f"{place}, --jobs {jobs}", self.verify("--isolation", place, "--jobs", jobs)
        yield f"killed up to {self.kills} times, and resumed", self.kill_again_and_again
        yield f"{SHARDS} shards, merged", self.merge_shards


def count_arrays(report: Path) -> int:
    """Return the number of arrays of a report, without those of times."""
    with xr.open_datatree(report, engine="netcdf4", decode_times=False) as tree:
        return sum(len(node.to_dataset(inherit=False).variables) for node in tree.subtree if node.name != "timing")


def is_missing_number(name: str, a: Path, b: Path) -> bool:
    """Return whether two reports differ in an array of `purity` in nothing but numbers that one of them lacks."""
    if not re.fullmatch("/purity_?/(value|tolerance)", name):
        return False
    with xr.open_datatree(a, engine="netcdf4") as left, xr.open_datatree(b, engine="netcdf4") as right:
        values, others = left[name].values, right[name].values
    return bool(((values == others) | np.isnan(values) | np.isnan(others)).all())


def main(examples: int = 40, kills: int = 30) -> int:
    """Print the table; return 1 if an array differs."""
    ways, first, bad = Ways(str(examples), kills), None, 0
    print("| way | arrays | other arrays | remarks | seconds |\n|---|---:|---|---|---:|", flush=True)
    with tempfile.TemporaryDirectory(prefix="ways-") as folder:
        ways.verify("--isolation", "inline", "--jobs", "1")(Path(folder) / "warm")  # It compiles.
        for number, (title, run) in enumerate(ways):
            here, begin = Path(folder) / str(number), time.monotonic()
            run(here)
            seconds, report = time.monotonic() - begin, here / "report.nc"
            first, ways.seconds = first or report, ways.seconds or seconds
            others = [line.partition(": ")[0] for line in same_data(first, report)]
            attributes = [name for name in others if name in OF_PLACES]
            missing = [name for name in others if is_missing_number(name, first, report)]
            arrays = [name for name in others if name not in (*OF_PLACES, *missing)]
            bad += len(arrays)
            words = (
                ", ".join(arrays[:3]) or "none",
                ", ".join([name[2:] for name in attributes] + ["no second process of `purity`"] * bool(missing)),
            )
            print(f"| {title} | {count_arrays(report)} | {' | '.join(words)} | {seconds:.0f} |", flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
