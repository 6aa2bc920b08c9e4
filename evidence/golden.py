"""Compare two versions of the project bit by bit: drawn cases, values, verdicts, forces, tangents, files, screens.

`golden.py record FOLDER [SET …]` runs the sets with the version of this interpreter; `golden.py compare BEFORE AFTER`
compares two such folders and exits with 1 if they differ; `golden.py list` names the sets.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SUFFIXES = ("nc", "json", "xml", "html")
RENAMED = {"scale": "total-stiffness", "scaling": "units", "engine.scaling": "engine.units"}
SMALL = ("--seed", "1", "--no-memory", "--isolation", "inline", "-j", "1")
# {set: command lines}; OUT is the folder, and `MAKE name` writes a table of numbers that this file computes.
SETS: dict[str, list[str]] = {
    "kernels": ["MAKE kernels"],
    "cases": ["MAKE cases"],
    "quick": [
        "verify vts-ppt mortar-lm -p balance.* -p patch.flat.* -p patch.tilted.* -p tangent.* -p mirror -p swap"
        " -p remote -p renumbering -p projection.* -p unilateral -p objectivity -p multipliers.* -p hard.free-end"
        " -p hard.offset --examples 3 --out OUT/quick.nc --out OUT/quick.json",
        "verify vts-ppt-3d -p balance.* -p patch.flat.* -p tangent.* -p mirror -p projection.* -p hard.deep"
        " --examples 3 --out OUT/quick3.nc",
    ],
    "solved": [
        "verify vts-ppt two-pass/nts-lm --examples 3 --out OUT/solved.nc",
        "verify mortar-3d --examples 3 --out OUT/solved3.nc",
    ],
    "screens": [
        *("list", "list --help", "verify --help", "explain patch.flat.transmission", "explain", "scenes"),
        "verify vts-me --examples 5 -p patch.flat.* --out OUT/me.nc --out OUT/me.json --out OUT/me.xml",
        *("report OUT/me.nc", "report OUT/me.nc --verbose", "replay OUT/me.nc", "audit OUT/me.nc"),
        "verify vts-me --examples 5 -p patch.flat.* --verbose",
        *("verify nothing", "verify vts-ppt -p nothing", "verify vts-ppt --examples 0", "report OUT/none.nc"),
    ],
    "files": [
        "verify vts-ppt-balanced --examples 5 --mesh ROOT/tests/data/punch.msh --slave punch --master base"
        " --out OUT/mesh.nc --out OUT/mesh.json",
        "verify vts-ppt --examples 5 --scene c --out OUT/scene.nc",
        "verify --engine control --examples 3 --out OUT/engine.nc",
    ],
    "shrink": [
        "verify vts-me nts vts-ppt nts-ar --shrink all --examples 20 -p patch.* -p balance.* -p symmetric"
        " --out OUT/shrink.nc --out OUT/shrink.html",
        "verify nts-3d --shrink all --examples 10 --out OUT/shrink3.nc",
    ],
    "compare": [
        "compare vts-me mortar --against vts-ppt --examples 4 -p patch.* -p balance.* -p tangent.* --out OUT/compare.nc"
    ],
    "box": [
        "BOX verify vts-ppt sts --examples 10 -j 2 --out OUT/box.nc",
        "BOX verify vts-me --examples 10 -j 1 --shrink all --out OUT/box1.nc",
    ],
    "plane": ["verify --all --profile ci -j 2 --out OUT/plane.nc --out OUT/plane.json"],
    "paper": ["paper --out OUT/paper.nc"],
    "bench": ["bench vts-ppt sts --quick --instances 1 --processes 1 --out OUT/bench.nc"],
}
QUICK = ("kernels", "cases", "quick", "screens")
CLOCKS = re.compile(
    r"(\d+([.,]\d+)?(e[-+]?\d+)? ?(ms|µs|s|min|MB|%)\b|times=\"[^\"]*\"|time(stamp)?=\"[^\"]*\"|about .* left|seed \d+)"
)


def record(folder: Path, sets: list[str]) -> None:
    """Run the command lines of some sets, and keep what they print and write as text."""
    for name in sets:
        out = folder / name
        out.mkdir(parents=True, exist_ok=True)
        for number, line in enumerate(SETS[name]):
            (out / f"{number}.txt").write_text(_run(line, out))
        for path in sorted(out.glob("*.nc")):
            (out / f"{path.stem}.dump").write_text("\n".join(_dump(path)) + "\n")


def _run(line: str, out: Path) -> str:
    first, *rest = line.replace("OUT", str(out)).replace("ROOT", str(ROOT)).split()
    if first == "MAKE":
        (out / f"{rest[0]}.dump").write_text("\n".join(MAKERS[rest[0]]()) + "\n")
        return ""
    boxed = first == "BOX"
    words = rest if boxed else [first, *rest]
    if words[0] in ("verify", "compare") and "--help" not in words:
        words += ["--seed", "1"] if "--profile" not in words else []
        words += ["--no-memory"] if words[0] == "verify" else []
        words += [] if boxed else ["--isolation", "inline"] + (["-j", "1"] if "-j" not in words else [])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    environment = os.environ | threads | {"COLUMNS": "80", "NO_COLOR": "1", "MPLBACKEND": "Agg"}
    command = [sys.executable, "-m", "contactverif", *words]
    done = subprocess.run(command, capture_output=True, text=True, cwd=out, env=environment, check=False)
    parts = (f"{' '.join([first, *rest])}\nexit {done.returncode}", done.stdout, "--- errors", _errors(done.stderr))
    return "\n".join(parts).replace(str(out), "OUT").replace(str(ROOT), "ROOT")


def _errors(text: str) -> str:
    """Return what went to standard error, without progress."""
    beginnings = ("contactverif:", "Error", "Usage", "Traceback")
    return "\n".join(line for line in text.splitlines() if line.startswith(beginnings))


def _dump(path: Path) -> Iterator[str]:
    """Yield a report line by line: all that a run holds but times and provenance."""
    if path.stem in ("paper", "bench"):
        yield from _dump_groups(path)
        return
    try:
        from contactverif_reports.netcdf.read import read_run
    except ImportError:
        read_run = import_module("contactverif_reports.netcdf").read_run
    run = read_run(path)
    not_loaded = [(item.formulation, item.reason) for item in run.not_loaded]
    yield f"signs {list(run.opposite_signs)} diagnoses {dict(run.diagnoses)} not loaded {not_loaded}"
    for row in run.rows:
        key = f"{row.formulation} {RENAMED.get(row.property_id, row.property_id)}"
        reason = _reason(row.reason)
        yield f"{key}: {row.verdict} {row.promise} {row.promised_by!r} {row.known!r} {reason!r} {row.planned}"
        special = (("witness", row.witness), ("shrunk", row.shrunk), ("first", row.first))
        for name, outcome in [*((str(number), each) for number, each in enumerate(row.outcomes)), *special]:
            if outcome is not None:
                yield f"{key} {name}: {_outcome(outcome)}"
        if row.forces is not None:
            yield f"{key} forces: {_digest(row.forces.of_formulation)} {_digest(row.forces.exact)}"


def _outcome(outcome: Any) -> str:
    case, measurement = outcome.case_or_summary, outcome.measurement
    words = [str(outcome.verdict), repr(_reason(outcome.reason)), str(outcome.breach)]
    words.append(f"name={case.name!r} kind={getattr(case, 'kind', '')!r}")
    if hasattr(case, "interface"):
        words.append(f"case {_digest(case.interface.nodes)} {_digest(case.z)} {float(case.penalty).hex()}")
    if measurement is not None:
        idle = measurement.idle if hasattr(measurement, "idle") else measurement.no_contact
        words.append(f"{measurement.undecided!r} {measurement.broken!r} {idle} {measurement.finding}")
        words += [f"{n.quantity.name}={float(n.value).hex()}/{float(n.tolerance).hex()}" for n in measurement.numbers]
        words += [f"{name}={float(value).hex()}" for name, value in measurement.details.items()]
        words += [f"{name}={_digest(values)}" for name, values in measurement.series.items()]
    return " ".join(words)


def _reason(text: str) -> str:
    return re.sub(r"\d+(\.\d+)? s\b", "# s", text)


def _digest(array: Any) -> str:
    if array is None:
        return "-"
    import numpy as np

    array = np.ascontiguousarray(array)
    if array.dtype.kind == "f":
        array = array + 0.0
    return f"{array.shape}{hashlib.sha1(array.tobytes()).hexdigest()[:12]}"


def _dump_groups(path: Path) -> Iterator[str]:
    """Yield a line for each variable of a file but for those of clocks."""
    import netCDF4
    import numpy as np

    def walk(group: Any, name: str) -> Iterator[str]:
        for key, variable in sorted(group.variables.items()):
            values = variable[:]
            if not re.search(r"second|time|cost|interval|cpu", f"{name}/{key}"):
                numeric = values.dtype.kind in "iufb"
                shown = _digest(np.ma.filled(values, 0)) if numeric else values.tolist()
                yield f"{name}/{key} {values.shape} {shown}"
        for key, child in sorted(group.groups.items()):
            yield from walk(child, f"{name}/{key}")

    with netCDF4.Dataset(path) as file:
        yield from walk(file, "")


def _make_kernels() -> Iterator[str]:
    """Yield forces, tangents, pairings and contact points of all formulations in drawn states."""
    import numpy as np

    from contactverif import load_formulation, load_properties

    names = json.loads(os.environ.get("GOLDEN_NAMES", "null")) or [
        *("nts", "nts-ar", "nts-ar:area=reference", "vts-g", "vts-g:n=3", "vts-me", "vts-me:n=4", "vts-ppt"),
        *(
            "vts-ppt-basic",
            "vts-ppt-balanced",
            "nts-lm",
            "vts-me-lm",
            "vts-ppt-lm",
            "two-pass/nts-ar",
            "two-pass/nts-lm",
            "sts",
            "chen-hisada",
        ),
        *("mortar", "mortar:normals=averaged", "mortar-dual", "mortar-lm", "mortar-dual-lm", "mortar-two-half-pass"),
        *("sts-3d", "mortar-3d", "vts-cell-3d", "vts-ppt-3d", "vts-ppt-balanced-3d", "nts-3d", "nts-ar-3d"),
    ]
    ids = ["balance.force", "patch.flat.transmission", "mirror", "tangent.directional", "stability.sweep"]
    cases = {dim: list(_drawn(load_properties(ids), dim, 32)) for dim in (2, 3)}
    for name in names:
        subject = load_formulation(name)
        for number, case in enumerate(cases[3 if name.endswith("-3d") else 2]):
            formulation = subject.for_case(case)
            count = formulation.n_multipliers(case.interface)
            z = np.concatenate([case.z[: case.interface.n_unknowns], np.linspace(0.5, 1.5, count)]) if count else case.z
            pairing = formulation.pair(case.interface, z)
            items = sorted(pairing.items()) if pairing is not None else []
            words = [f"{key}={_digest(np.asarray(value))}" for key, value in items]
            words.append(f"f={_digest(formulation.residual(case.interface, pairing, z))}")
            tangent = formulation.tangent(case.interface, pairing, z)
            words.append(f"k={_digest(tangent.toarray() if hasattr(tangent, 'toarray') else tangent)}")
            try:
                points = formulation.contact_points(case.interface, pairing, z)
                names_of_points = ("gap", "pressure", "weight", "xi", "position", "normal")
                words += [f"{key}={_digest(getattr(points, key))}" for key in names_of_points]
            except Exception as error:  # Not provided.
                words.append(type(error).__name__)
            yield f"{name} {number}: {' '.join(words)}"


def _drawn(properties: Any, dim: int, examples: int) -> Iterator[Any]:
    for prop in properties:
        for case in _cases_of(prop, dim, examples):
            if getattr(case, "interface", None) is not None and hasattr(case, "z"):
                yield case


def _cases_of(prop: Any, dim: int, examples: int) -> Any:
    """Return the planned cases of a property in 2-D or 3-D."""
    from contactverif import load_formulation

    traits = load_formulation("vts-ppt" if dim == 2 else "vts-ppt-3d").traits
    prop = prop.for_traits(traits)
    if prop.refusal_of(load_formulation("vts-ppt" if dim == 2 else "vts-ppt-3d")):
        return ()
    try:
        sampled = import_module("contactverif.sampling.draw")
    except ImportError:
        sampled = import_module("contactverif.sampling")
    Sampling, draw_cases = sampled.Sampling, getattr(sampled, "draw_cases", None)
    if draw_cases is None:  # It is a helper of the tests now.
        sys.path.append(str(Path(__file__).parents[1] / "tests"))
        draw_cases = import_module("planned_cases").draw_cases
    sampling = Sampling.at(None, examples, 1)
    source = sampling.source(prop)
    if source is None or isinstance(source, tuple):
        return source or ()
    return draw_cases(source, seed=sampling.key(prop), examples=examples).cases


def _make_cases() -> Iterator[str]:
    """Yield the planned cases of every property."""
    from contactverif import load_properties
    from contactverif.plugins.registry import property_ids

    for prop in load_properties(sorted(property_ids(), key=lambda name: RENAMED.get(name, name))):
        for dim in (2, 3):
            for number, case in enumerate(_cases_of(prop, dim, 12)):
                words = [case.name, str(getattr(case, "kind", ""))]
                if getattr(case, "interface", None) is not None:
                    words += [_digest(case.interface.nodes), _digest(case.z), float(case.penalty).hex()]
                yield f"{RENAMED.get(prop.id, prop.id)} {dim} {number}: {' '.join(words)}"


MAKERS = {"kernels": _make_kernels, "cases": _make_cases}


def compare(before: Path, after: Path, *, most: int = 6) -> int:
    """Print how two folders of recorded sets differ, and return the number of files that do."""
    wrong = same = 0
    for path in sorted(after.rglob("*")):
        other = before / path.relative_to(after)
        if path.suffix not in (".txt", ".dump", ".xml"):
            continue
        if not other.exists():
            print(f"only after: {path.relative_to(after)}")
            continue
        old, new = (
            [CLOCKS.sub("#", line).rstrip() for line in file.read_text().splitlines()] for file in (other, path)
        )
        if path.suffix == ".dump":  # Each line names its row and case, and a renamed id stands elsewhere.
            old, new = sorted(old), sorted(new)
        if old == new:
            same += 1
            continue
        wrong += 1
        differing = [(a, b) for a, b in zip(old, new, strict=False) if a != b]
        counts = f"{len(old)} lines before, {len(new)} after; {len(differing)} lines differ"
        print(f"DIFFERS {path.relative_to(after)}: {counts}")
        for a, b in differing[:most]:
            print(f"  - {a[:220]}\n  + {b[:220]}")
    print(f"{same} files are equal, {wrong} differ")
    return wrong


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["record", folder, *sets]:
            record(Path(folder).resolve(), sets or list(QUICK))
        case ["compare", before, after]:
            sys.exit(bool(compare(Path(before), Path(after))))
        case _:
            print("\n".join(f"{name:10}{len(lines)} commands" for name, lines in SETS.items()))
