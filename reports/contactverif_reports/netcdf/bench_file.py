"""The file of a bench, written and read: everything that `BenchResults` holds, repeat by repeat.

Rule for the next editor: all that depends on a clock is in the group `timing`, so that the rest of two benches with the
same plan is identical.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif_reports.bench.results import COUNTS, ERRORS, PARTS, BenchResults, Cell, Outcome
from contactverif_reports.files import check_writable, whole
from contactverif_reports.netcdf.groups import Group
from contactverif_reports.netcdf.schema import NONE, RATIO, SECONDS, text
from contactverif_reports.netcdf.stored_groups import read_groups
from contactverif_reports.netcdf.variables import codes, numbers, words
from contactverif_reports.netcdf.write_tree import write_tree

TITLE = "contactverif: speed against error of contact formulations"
BENCH_SCHEMA = "1"
_RUN = ["formulation", "cell"]


def write_bench(results: BenchResults, path: str | os.PathLike[str]) -> None:
    """Write the file of a bench, whole or not at all."""
    check_writable(path)
    with whole(path) as part:
        write_tree(bench_tree(results), part)


def bench_tree(results: BenchResults) -> dict[str, Group]:
    """Return the groups of the file: the root, and `timing`."""
    attributes = {name: text(value) or NONE for name, value in results.provenance.items()}
    attributes |= {"title": TITLE, "bench_schema": BENCH_SCHEMA, "Conventions": "CF-1.11"}
    not_loaded = [f"{name}: {text(reason)}" for name, reason in results.not_loaded.items()]
    attributes["not_loaded"] = "\n".join(not_loaded) or NONE
    return {"/": Group(_labels(results) | _runs(results), attributes), "/timing": _timing(results)}


def read_bench(path: str | os.PathLike[str]) -> BenchResults:
    """Return what `write_bench` wrote."""
    needed = "a file that `contactverif bench --out FILE.nc` wrote"
    name = os.fspath(path)
    groups = read_groups(path, "FILE", needed)
    if groups["/"].attrs.get("bench_schema") != BENCH_SCHEMA:
        raise MisuseError("FILE", f"{name}, another file", needed)
    try:
        results = _results(groups["/"], groups["/timing"])
        _check_shapes(results)
        _check_codes(results)
    except (AssertionError, AttributeError, LookupError, TypeError, ValueError) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise MisuseError("FILE", f"{name}, which is damaged ({reason})", needed) from error
    return results


def _check_shapes(results: BenchResults) -> None:
    """Check that all arrays have the shapes and types that their names ask for."""
    n_formulations, n_cells, n_repeats = len(results.formulations), len(results.cells), results.yardstick.shape[-1]
    runs = (n_formulations, n_cells)
    for name, shape in {
        "segments": (n_cells,),
        "unknowns": (n_cells,),
        "outcomes": runs,
        "errors": (*runs, len(ERRORS)),
        "counts": (*runs, len(COUNTS)),
        "seconds": (*runs, len(PARTS), n_repeats),
        "wall": (*runs, n_repeats),
        "yardstick": (n_cells, n_repeats),
    }.items():
        values = getattr(results, name)
        if values.shape != shape:
            raise ValueError(f"{name} has the shape {values.shape}, and the names ask for {shape}")
        whole = name in ("segments", "unknowns", "outcomes", "counts")
        if values.dtype != (np.int64 if whole else np.float64) or (whole and (values < 0).any()):
            raise ValueError(f"{name} holds what it must not")


def _check_codes(results: BenchResults) -> None:
    """Check that codes have a meaning, names are different, and there is something to show."""
    n_formulations, n_repeats = len(results.formulations), results.yardstick.shape[-1]
    if not n_repeats or len(set(results.formulations)) != n_formulations:
        raise ValueError("there are no repeats, or two formulations have one name")
    if not np.isin(results.outcomes, list(Outcome)).all():
        raise ValueError("outcome holds a code without a meaning")
    if not all(np.isfinite(cell.stiffness) and cell.stiffness > 0 for cell in results.cells):
        raise ValueError("a penalty is no finite number > 0")


def _labels(results: BenchResults) -> dict[str, Any]:
    """Return the names along the dimensions, and what a cell is."""
    cells = results.cells
    scenes = {scene: number for number, scene in enumerate(dict.fromkeys(cell.scene for cell in cells))}
    labels, units = ([texts.get(scene, "") for scene in scenes] for texts in (results.labels, results.units))
    return {
        "formulation": words(["formulation"], list(results.formulations), "formulation, as on the command line"),
        "scene": codes(["cell"], [scenes[cell.scene] for cell in cells], scenes, "scene of the cell"),
        "mesh": numbers(["cell"], [cell.mesh for cell in cells], "fineness of the mesh, as the scene counts it", RATIO),
        "stiffness": numbers(["cell"], [cell.stiffness for cell in cells], "penalty in the unit of the scene", RATIO),
        "scene_label": words(["scene_name"], labels, "what a scene is"),
        "scene_unit": words(["scene_name"], units, "unit of penalty; none for itself"),
        "slave_segments": numbers(["cell"], results.segments, "number of slave segments", RATIO),
        "unknowns": numbers(["cell"], results.unknowns, "number of unknowns of the scene", RATIO),
        "error_kind": words(["error_kind"], list(ERRORS), "kind of error", "; ".join(map(": ".join, ERRORS.items()))),
        "count_kind": words(["count_kind"], list(COUNTS), "what is counted", "; ".join(map(": ".join, COUNTS.items()))),
    }


def _runs(results: BenchResults) -> dict[str, Any]:
    remarks = [
        [results.remarks.get((name, cell), "") for cell in range(len(results.cells))] for name in results.formulations
    ]
    comment = "NaN without a solution, or where nothing is reported"
    outcomes = {outcome.word.replace(" ", "_"): int(outcome) for outcome in Outcome}
    return {
        "outcome": codes(_RUN, results.outcomes, outcomes, "how the run ended"),
        "remark": words(_RUN, remarks, "how the run ended, where it gave no solution"),
        "error": numbers([*_RUN, "error_kind"], results.errors, "error", RATIO, comment),
        "count": numbers([*_RUN, "count_kind"], results.counts, "count", RATIO),
    }


def _timing(results: BenchResults) -> Group:
    parts = "; ".join(map(": ".join, PARTS.items()))
    table = {
        "part": words(["part"], list(PARTS), "part of the time", parts),
        "seconds": numbers(
            [*_RUN, "part", "repeat"], results.seconds, "processor time of each repeat", SECONDS, "NaN where it crashed"
        ),
        "wall_seconds": numbers(
            [*_RUN, "repeat"], results.wall, "time of each repeat by the wall clock", SECONDS, "NaN where it crashed"
        ),
        "yardstick_seconds": numbers(
            ["cell", "repeat"], results.yardstick, "time of a fixed piece of work in the same repeats", SECONDS
        ),
    }
    return Group(table, {"comment": "the only numbers that depend on a clock"})


def _results(root: Group, timing: Group) -> BenchResults:
    formulations = tuple(map(str, root["formulation"].values))
    scenes = str(root["scene"].attrs["flag_meanings"]).split()
    if (root["scene"].values < 0).any():
        raise ValueError("scene holds a code without a meaning")
    columns = (root[name].values.tolist() for name in ("scene", "mesh", "stiffness"))
    cells = tuple(Cell(scenes[scene], mesh, stiffness) for scene, mesh, stiffness in zip(*columns, strict=True))
    outcomes, remarks = root["outcome"].values.astype(np.int64), root["remark"].values
    unsolved = np.argwhere(outcomes != Outcome.SOLVED).tolist()
    attributes = {str(name): str(value) for name, value in root.attrs.items()}
    not_loaded = attributes["not_loaded"]
    structure = ("title", "bench_schema", "Conventions", "not_loaded")
    return BenchResults(
        formulations=formulations,
        cells=cells,
        labels=_texts(root, "scene_label", scenes),
        units=_texts(root, "scene_unit", scenes),
        segments=root["slave_segments"].values.astype(np.int64),
        unknowns=root["unknowns"].values.astype(np.int64),
        outcomes=outcomes,
        errors=root["error"].values,
        counts=root["count"].values.astype(np.int64),
        seconds=timing["seconds"].values,
        wall=_wall(timing),
        yardstick=timing["yardstick_seconds"].values,
        remarks={(formulations[row], cell): str(remarks[row, cell]) for row, cell in unsolved},
        not_loaded={} if not_loaded == NONE else dict(_split(line) for line in not_loaded.splitlines()),
        provenance={name: value for name, value in attributes.items() if name not in structure},
    )


def _texts(root: Group, name: str, scenes: list[str]) -> dict[str, str]:
    """Return the text of each scene that has one; a file of an earlier version has none."""
    texts = root[name].values if name in root else [""] * len(scenes)
    return {scene: str(text) for scene, text in zip(scenes, texts, strict=True) if str(text)}


def _wall(timing: Group) -> FloatArray:
    """Return the times by the wall clock; NaN from a file whose only clock it was."""
    nothing = np.full_like(timing["seconds"].values[:, :, -1], np.nan)
    return timing["wall_seconds"].values if "wall_seconds" in timing else nothing


def _split(line: str) -> tuple[str, str]:
    name, _, reason = line.partition(": ")
    return name, reason
