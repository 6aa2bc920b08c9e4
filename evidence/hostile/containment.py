"""Run `contactverif verify nts BAD vts-ppt` for each hostile plugin, and judge how the harness stands it.

`tox -e hostile` writes `reports/trust/hostile.csv`, a line for each plugin and each way to run it: in a box, in a
process of its own, and in the process of the harness (`inline`). Every answer of the table is looked up outside of the
harness: in the report, in the exit status, and among the processes and files that are there afterwards, some of them
bait (`bait.py`).
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from bait import BAIT, bait
from catalogue import FOLDER, PLUGINS, HostilePlugin, install
from hostile_kit import CAUGHT, IMPURE, LIKE_NTS, STOPS

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import NotLoaded, Run
from contactverif.isolation.box import why_no_box
from contactverif.plugins.registry import load_formulation, load_properties
from contactverif.run.run import run
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write

OTHERS = ("nts", "vts-ppt")
PROPERTY = "balance.force"  # It asks for a pairing and a residual, and everybody promises it.
# A further property for plugins of some kinds, and for those that act in some verbs.
FOR_KINDS = {"process": "patch.flat.nodal", "cheats": "patch.flat.transmission", "inputs": "purity"}
FOR_VERBS = {"tangent": "tangent.directional", "contact_points": "projection.place"}
EXAMPLES = 4
MODES = {
    "box": ("--isolation", "box", "--time-limit", "2", "--memory-limit", "1024"),
    "process": ("--isolation", "process", "--time-limit", "2", "--memory-limit", "1024"),
    "inline": ("--isolation", "inline"),
}
SECONDS = 300.0  # The longest run; one without a hostile plugin takes a few seconds.
INLINE_SECONDS = 60.0  # The longest run in the process of the harness, where nothing ends a plugin that hangs.
GROUP = 8  # Plugins of one run.
ALONE = ("memory", "leaves", "says")  # Plugins of these kinds run alone.
MEGABYTES = 4000  # The address space of a whole run, plugins included.
MOST_OUTPUT = 100_000  # Bytes that the command may print.
PURE_IN_A_BOX = ("inputs-by-process",)  # There the number of its process is always the same.
EXPECTED = {"report.nc", ".contactverif"}  # The report, and what failed for the next run.
CHECKS = ("goes on", "others unchanged", "report complete", "exit status right", "nothing left", "output clean")
HEADS = ("mode/plugin", "seconds", "status", *CHECKS, "result", "remarks")
CONTROL = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]|\xc2[\x80-\x9f]")
MAIN = "from contactverif.cli import main; main()"


@dataclass(frozen=True)
class Finish:
    """The end of a command."""

    status: int | None  # None if the command did not end in time
    seconds: float
    output: bytes
    errors: bytes
    left: tuple[str, ...]  # The processes and files that it left behind
    report: Path  # The file that it was to write


def run_command(folder: Path, *arguments: str, seconds: float = SECONDS) -> Finish:
    """Run `contactverif` in an empty folder, with all hostile plugins installed."""
    here, temporary = folder / "here", folder / "tmp"
    here.mkdir(parents=True)
    temporary.mkdir()
    variables = os.environ | {
        "PYTHONPATH": install(folder / "site"),
        "TMPDIR": str(temporary),
        "NO_COLOR": "1",
        "COLUMNS": "140",
    }
    shared = set(Path("/dev/shm").glob("hostile-*"))
    facts_file = folder / "facts.json"
    reaper = [sys.executable, str(FOLDER.parent / "reaper.py"), str(facts_file), str(seconds), str(MEGABYTES)]
    with (folder / "out").open("wb") as out, (folder / "err").open("wb") as err, bait(folder / "bait") as beside:
        command = [*reaper, sys.executable, "-c", MAIN, *arguments]
        variables[BAIT] = str(beside.folder)
        subprocess.run(command, cwd=here, env=variables, stdout=out, stderr=err, check=True)
        changes = beside.changes()
    facts: dict[str, Any] = json.loads(facts_file.read_text())
    left = [f"process {line}" for line in facts["left"]]
    left += [f"file {path.name}" for path in sorted(temporary.iterdir())]
    left += [f"file {path.name}" for path in sorted(here.iterdir()) if path.name not in EXPECTED]
    blocks = set(Path("/dev/shm").glob("hostile-*")) - shared
    left += [f"shared memory {path.name}" for path in sorted(blocks)]
    for path in blocks:
        path.unlink()
    left += changes
    output, errors = ((folder / name).read_bytes() for name in ("out", "err"))
    return Finish(facts["status"], facts["seconds"], output, errors, tuple(left), here / "report.nc")


@contextmanager
def scratch() -> Iterator[Path]:
    """Yield a folder that is deleted afterwards, whatever rights a plugin took from its parts."""
    folder = Path(tempfile.mkdtemp(prefix="hostile-"))
    try:
        yield folder
    finally:
        for path, names, _ in os.walk(folder):
            for name in names:
                os.chmod(os.path.join(path, name), 0o700)
        shutil.rmtree(folder, ignore_errors=True)


def questions(plugin: HostilePlugin) -> tuple[str, ...]:
    """Return the properties that a plugin is asked."""
    more = {FOR_KINDS.get(plugin.kind), FOR_VERBS.get(plugin.verb)} - {None}
    return PROPERTY, *sorted(str(name) for name in more)


def verify(
    folder: Path, mode: str, properties: tuple[str, ...], *names: str, examples: int, seconds: float = SECONDS
) -> Finish:
    """Verify some formulations with few cases."""
    globs = [word for name in properties for word in ("-p", name)]
    sampling = ["--examples", str(examples), "--seed", "1", "--jobs", "1"]
    options = (*globs, *sampling, "--keep-going", "--out", "report.nc", *MODES[mode])
    return run_command(folder, "verify", *names, *options, seconds=seconds)


def only(run: Run, formulation: str, name: str) -> Run:
    """Return the part of a run about one formulation, under another name."""
    rows = tuple(replace(row, formulation=name) for row in run.rows if row.formulation == formulation)
    signs = tuple(name for other in run.opposite_signs if other == formulation)
    return Run(rows=rows, provided={name: dict(run.provided.get(formulation, {}))}, opposite_signs=signs)


def differences(a: Run, b: Run) -> list[str]:
    """Return the differences of two parts of runs, bit by bit, but for seconds."""
    with scratch() as folder:
        for run, name in ((a, "a.nc"), (b, "b.nc")):
            write(run, folder / name)
        return same_data(folder / "a.nc", folder / "b.nc")


@cache
def reference(mode: str, properties: tuple[str, ...], examples: int) -> Run:
    """Return the run of the others alone."""
    if mode != "inline":  # This compiles the kernels, for which a hostile plugin has no time.
        run(list(map(load_formulation, OTHERS)), load_properties(properties), examples=examples, seed=1)
    with scratch() as folder:
        finish = verify(folder, mode, properties, *OTHERS, examples=examples)
        assert finish.status == 0, (finish.status, finish.seconds, finish.errors[-1000:])
        assert not finish.left, finish.left
        return read_run(finish.report)


def _read(finish: Finish) -> tuple[Run | None, str]:
    if not finish.report.exists():
        return None, "no report"
    try:
        return read_run(finish.report), ""
    except MisuseError as error:
        return None, f"the report cannot be read: {error}"


def _is_complete(run: Run, plugin: str, properties: tuple[str, ...]) -> bool:
    """Return whether every row is there, the plugin's too, and every planned case has an outcome."""
    loaded = all(item.formulation != plugin for item in run.not_loaded)
    expected = {*OTHERS, plugin} if loaded else set(OTHERS)
    rows = {(row.formulation, row.property_id) for row in run.rows if row.formulation in expected}
    planned = all(len(row.outcomes) == row.planned for row in run.rows)
    return planned and rows == {(name, question) for name in expected for question in properties}


def _result(run: Run, plugin: str) -> str:
    """Return what the report says of the plugin, in few words."""
    for item in run.not_loaded:
        if isinstance(item, NotLoaded) and item.formulation == plugin:
            return f"not loaded: {item.reason}"
    counts: dict[str, int] = {}
    for row in run.rows_of(plugin):
        counts[str(row.result)] = counts.get(str(row.result), 0) + 1
    reason = next((row.reason for row in run.rows_of(plugin) if row.unexpected), "")
    return ", ".join(f"{word} {count}" for word, count in counts.items()) + (f": {reason}" if reason else "")


def _status_is_right(plugin: HostilePlugin, run: Run, finish: Finish, alone: Run, mode: str) -> str:
    """Return what is wrong with exit status and verdict; empty if both are right."""
    like_nts = not differences(only(run, plugin.name, "nts"), only(alone, "nts", "nts"))
    kept = finish.status == 0
    pure = mode == "box" and plugin.name in PURE_IN_A_BOX
    if finish.status not in (0, 1) or kept != run.promises_kept:
        return f"exit status {finish.status}, but the report says {'kept' if run.promises_kept else 'broken'}"
    if plugin.ends == LIKE_NTS and not (like_nts and kept):
        return "not judged as nts"
    impure = [row for row in run.rows_of(plugin.name) if row.property_id == "purity" and row.unexpected]
    if plugin.ends == IMPURE and not impure and not pure:
        return "purity does not fail"
    accused = any(item.formulation == plugin.name for item in run.not_loaded) or any(
        row.unexpected for row in run.rows_of(plugin.name)
    )
    if plugin.ends in (CAUGHT, IMPURE) and (kept or not accused) and not pure:
        return "not caught"
    if kept and accused:
        return "exit status 0, but the plugin is accused"
    return ""


def judge(plugins: Sequence[HostilePlugin], mode: str, examples: int = EXAMPLES) -> dict[str, list[str]]:
    """Run some plugins in one run, between the others; return {plugin: cells of its line}."""
    properties = questions(plugins[0])
    alone, seconds = reference(mode, properties, examples), INLINE_SECONDS if mode == "inline" else SECONDS
    names = ("nts", *(plugin.name for plugin in plugins), "vts-ppt")
    with scratch() as folder:
        finish = verify(folder, mode, properties, *names, examples=examples, seconds=seconds)
        run, remark = _read(finish)
        text = finish.output + finish.errors
        clean = len(text) < MOST_OUTPUT * len(plugins) and not CONTROL.search(text.replace(b"\r\n", b"\n"))
        ended = finish.status in (0, 1) and b"Traceback" not in finish.errors
        remarks = [remark] if remark else []
        if finish.status is None:
            remarks.append(f"no end within {seconds:g} s")
        if not ended:
            remarks.append(finish.errors.decode(errors="replace").strip()[-100:])
        lines = {}
        for plugin in plugins:
            more: list[str] = []
            answers, result = (False, False, False), ""
            if run is not None:
                answers, result, more = _look(plugin, run, finish, alone, properties, mode)
            elif plugin.ends == STOPS:  # Nobody can go on without the parent; what counts is that no report is broken.
                ended, answers = finish.status is not None, (True, True, finish.status not in (0, None))
            verdicts = (ended, *answers, not finish.left, clean)
            status = "" if finish.status is None else str(finish.status)
            words = [plain(result)[:120], plain("; ".join([*remarks, *more, *finish.left[:2]]))[:200]]
            seconds = f"{finish.seconds / len(plugins):.1f}"
            lines[plugin.name] = [seconds, status, *("yes" if verdict else "no" for verdict in verdicts), *words]
        return lines


def _look(
    plugin: HostilePlugin, run: Run, finish: Finish, alone: Run, properties: tuple[str, ...], mode: str
) -> tuple[tuple[bool, bool, bool], str, list[str]]:
    """Return what the report says: (others unchanged, report complete, exit status right), the verdict, remarks."""
    changes = [line for name in OTHERS for line in differences(only(run, name, name), only(alone, name, name))]
    complete = _is_complete(run, plugin.name, properties)
    wrong = _status_is_right(plugin, run, finish, alone, mode)
    return (not changes, complete, not wrong), _result(run, plugin.name), [*changes[:1], *([wrong] if wrong else [])]


@cache
def groups() -> dict[str, tuple[HostilePlugin, ...]]:
    """Return {plugin: the plugins that run together with it}: those that must end alike and are asked the same.

    Whatever one of a group does to the run, all of them are blamed for; then each runs alone. So a group without a
    blame says as much as its plugins one by one.
    """
    alike: dict[tuple[object, ...], list[HostilePlugin]] = {}
    for plugin in PLUGINS.values():
        alone = plugin.name if plugin.kind in ALONE or plugin.ends == STOPS else ""
        alike.setdefault((plugin.ends, questions(plugin), alone), []).append(plugin)
    chunks = [tuple(same[at : at + GROUP]) for same in alike.values() for at in range(0, len(same), GROUP)]
    return {plugin.name: chunk for chunk in chunks for plugin in chunk}


@cache
def _judged_together(names: tuple[str, ...], mode: str) -> dict[str, list[str]]:
    return judge([PLUGINS[name] for name in names], mode)


def cells(key: str) -> list[str]:
    """Return the cells of a key such as `process/dies-exit-0`."""
    mode, _, name = key.partition("/")
    if mode != "inline":
        names = tuple(plugin.name for plugin in groups()[name])
        lines = _judged_together(names, mode)
        if len(names) > 1 and all(set(line[2 : 2 + len(CHECKS)]) == {"yes"} for line in lines.values()):
            return lines[name]
    return judge([PLUGINS[name]], mode)[name]


def plain(text: str) -> str:
    """Return a text in one line, without paths and control characters."""
    text = re.sub(r"(/[\w.+-]+){2,}/", "…/", text.encode("ascii", "backslashreplace").decode())
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


if __name__ == "__main__":
    from tables import fill

    processes = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    modes = [mode for mode in MODES if mode != "box" or not why_no_box()]
    names = [name for chunk in dict.fromkeys(groups().values()) for name in (plugin.name for plugin in chunk)]
    fill("hostile.csv", HEADS, [f"{mode}/{name}" for mode in modes for name in names], cells, processes=processes)
