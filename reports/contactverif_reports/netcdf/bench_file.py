"""The file of a bench, written and read: everything that `BenchResults` holds, instance by instance.

All that depends on a clock is in the group `timing`, so that the rest of two benches with the same plan is identical.
"""

import os
from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np

from contactverif.contract import schema
from contactverif.contract.errors import MisuseError
from contactverif.contract.schema import NONE, RATIO, Group, ReportColumn, Variable, codes, numbers, text, words
from contactverif_reports.bench_results import COUNTS, ERRORS, VARIANTS, WORK, BenchResults, Cell, Outcome
from contactverif_reports.files import check_writable, whole
from contactverif_reports.netcdf.file_groups import read_groups, write_tree

TITLE = "contactverif: speed against error of contact formulations"
BENCH_SCHEMA = "2"
_NEEDED = "a file that `contactverif bench --out FILE.nc` wrote"
_STRUCTURE = ("title", "bench_schema", "Conventions", "not_loaded")
_RUN = ("formulation", "cell")
_SOLUTION = (*_RUN, "variant")
_OUTCOMES = {outcome.word.replace(" ", "_"): int(outcome) for outcome in Outcome}
_NO_SOLUTION = "NaN without a solution, or where nothing is reported"
# The arrays of `BenchResults`, by their attribute: what a file holds, reads and checks of them.
_ARRAYS = (
    ReportColumn("slave_segments", "segments", "count", "number of slave segments", axes=("cell",)),
    ReportColumn("unknowns", "unknowns", "count", "number of free unknowns of all bodies", axes=("cell",)),
    ReportColumn(
        "best_pressure_error", "best_pressure", "real",
        "error of the best continuous pressure that is linear between the slave's nodes", axes=("cell",),
    ),
    ReportColumn("outcome", "outcomes", "code", "how the run ended", axes=_SOLUTION, meanings=_OUTCOMES),
    ReportColumn("error", "errors", "real", "error", _NO_SOLUTION, axes=(*_SOLUTION, "error_kind")),
    ReportColumn("count", "counts", "count", "count", axes=(*_SOLUTION, "count_kind")),
    ReportColumn("work", "work", "count", "work", "entries are 0 without a solution", axes=(*_RUN, "work_kind")),
)  # fmt: skip
_TIMES = (
    ReportColumn(
        "evaluation_seconds", "evaluation", "real", "least time of one evaluation: search, forces and tangent",
        "by the clock of the plugin's process; NaN where it crashed", schema.SECONDS, (*_RUN, "process"),
    ),
    ReportColumn(
        "factorisation_seconds", "factorisation", "real", "least time of one factorisation of the whole system",
        "NaN without one", schema.SECONDS, _RUN,
    ),
)  # fmt: skip


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
    runs = product(results.formulations, range(len(results.cells)), range(len(VARIANTS)))
    remarks = np.array([results.remarks.get(run, "") for run in runs], dtype=object).reshape(results.outcomes.shape)
    table = _labels(results) | {column.name: _variable(column, results) for column in _ARRAYS}
    table["remark"] = words(_SOLUTION, remarks.tolist(), "how the run ended, where it gave no solution")
    times = {column.name: _variable(column, results) for column in _TIMES}
    comment = {"comment": "the only numbers that depend on a clock"}
    return {"/": Group(table, attributes), "/timing": Group(times, comment)}


def _variable(column: ReportColumn, results: BenchResults) -> Variable:
    values = getattr(results, column.path)
    if column.meanings is not None:
        return codes(column.axes, values, column.meanings, column.meaning)
    return numbers(column.axes, values, column.meaning, column.units, column.comment)


def _labels(results: BenchResults) -> dict[str, Variable]:
    cells, scenes = results.cells, {scene: number for number, scene in enumerate(results.scenes)}
    n_targets = max(map(len, results.targets.values()))
    targets = [[*results.targets[scene], *[np.nan] * (n_targets - len(results.targets[scene]))] for scene in scenes]
    instance = "number of the variation, the same on all meshes"
    kinds = (
        ("error_kind", ERRORS, "kind of error"),
        ("count_kind", COUNTS, "what is counted"),
        ("work_kind", WORK, "work of one evaluation and of one linear system"),
    )
    return {
        "formulation": words(["formulation"], list(results.formulations), "formulation, as on the command line"),
        "scene": codes(["cell"], [scenes[cell.scene] for cell in cells], scenes, "scene of the cell"),
        "mesh": numbers(["cell"], [cell.mesh for cell in cells], "fineness of the mesh, as the scene counts it", RATIO),
        "instance": numbers(["cell"], [cell.instance for cell in cells], instance, RATIO),
        "penalty": numbers(["variant"], [variant.penalty for variant in VARIANTS], "penalty in E/h", RATIO),
        "start": words(["variant"], [variant.start for variant in VARIANTS], "start of Newton's method"),
        "scene_label": words(["scene_name"], [results.label(scene) for scene in scenes], "what a scene is"),
        "target": numbers(["scene_name", "target_number"], targets, "errors that cost is measured at", RATIO),
        **{
            name: words([name], list(table), meaning, "; ".join(map(": ".join, table.items())))
            for name, table, meaning in kinds
        },
    }


def read_bench(path: str | os.PathLike[str]) -> BenchResults:
    """Return what `write_bench` wrote."""
    name = os.fspath(path)
    groups = read_groups(path, "FILE", _NEEDED)
    if groups["/"].attrs.get("bench_schema") != BENCH_SCHEMA:
        raise MisuseError("FILE", f"{name}, another file", _NEEDED)
    try:
        results = _results(groups["/"], groups["/timing"])
        _check(results)
    except (AssertionError, AttributeError, LookupError, TypeError, ValueError) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise MisuseError("FILE", f"{name}, which is damaged ({reason})", _NEEDED) from error
    return results


def _results(root: Group, timing: Group) -> BenchResults:
    formulations = tuple(map(str, root["formulation"].values))
    scenes = str(root["scene"].attrs["flag_meanings"]).split()
    arrays = {column.path: (timing if column in _TIMES else root)[column.name].values for column in (*_ARRAYS, *_TIMES)}
    arrays |= {column.path: arrays[column.path].astype(np.int64) for column in _ARRAYS if column.kind != "real"}
    remarks = root["remark"].values
    unsolved = np.argwhere(arrays["outcomes"] != Outcome.SOLVED).tolist()
    attributes = {str(name): str(value) for name, value in root.attrs.items()}
    not_loaded = attributes["not_loaded"]
    targets = [tuple(row[np.isfinite(row)].tolist()) for row in root["target"].values]
    split = (line.partition(": ") for line in not_loaded.splitlines())
    if (root["scene"].values < 0).any():
        raise ValueError("scene holds a code without a meaning")
    variants = list(zip(root["penalty"].values.tolist(), map(str, root["start"].values), strict=True))
    if variants != [(variant.penalty, variant.start) for variant in VARIANTS]:
        raise ValueError("its penalties and starts are others")
    columns = (root[name].values.tolist() for name in ("scene", "mesh", "instance"))
    return BenchResults(
        formulations=formulations,
        cells=tuple(Cell(scenes[scene], mesh, instance) for scene, mesh, instance in zip(*columns, strict=True)),
        labels=dict(zip(scenes, map(str, root["scene_label"].values), strict=True)),
        targets=dict(zip(scenes, targets, strict=True)),
        **arrays,
        remarks={(formulations[row], cell, run): str(remarks[row, cell, run]) for row, cell, run in unsolved},
        not_loaded={} if not_loaded == NONE else {plugin: reason for plugin, _, reason in split},
        provenance={name: value for name, value in attributes.items() if name not in _STRUCTURE},
    )


def _check(results: BenchResults) -> None:
    lengths: Mapping[str, int] = {
        "formulation": len(results.formulations),
        "cell": len(results.cells),
        "variant": len(VARIANTS),
        "error_kind": len(ERRORS),
        "count_kind": len(COUNTS),
        "work_kind": len(WORK),
        "process": results.evaluation.shape[-1],
    }
    for column in (*_ARRAYS, *_TIMES):
        values: np.ndarray[Any, Any] = getattr(results, column.path)
        shape, whole_numbers = tuple(lengths[axis] for axis in column.axes), column.kind != "real"
        if values.shape != shape:
            raise ValueError(f"{column.path} has the shape {values.shape}, and the names ask for {shape}")
        if values.dtype != (np.int64 if whole_numbers else np.float64) or (whole_numbers and (values < 0).any()):
            raise ValueError(f"{column.path} holds what it must not")
    if not lengths["process"] or len(set(results.formulations)) != len(results.formulations):
        raise ValueError("there are no processes, or two formulations have one name")
    if not np.isin(results.outcomes, list(Outcome)).all():
        raise ValueError("outcome holds a code without a meaning")
    for scene in results.scenes:
        cells = [cell for cell in results.cells if cell.scene == scene]
        instances = {cell.instance for cell in cells}
        if len(set(cells)) != len(cells) or len(cells) != len(instances) * len(results.meshes_of(scene)):
            raise ValueError("an instance is not there on every mesh")
        if not (targets := results.targets[scene]) or not (np.diff([1.0, *targets, 0.0]) < 0).all():
            raise ValueError("a scene has no targets, or none that fall")
