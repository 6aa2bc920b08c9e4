"""The file of a bench, written and read: everything that `BenchResults` holds, instance by instance.

Rule for the next editor: all that depends on a clock is in the group `timing`, so that the rest of two benches with the
same plan is identical.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif_reports.bench.results import COUNTS, ERRORS, VARIANTS, WORK, BenchResults, Cell, Outcome
from contactverif_reports.files import check_writable, whole
from contactverif_reports.netcdf.groups import Group
from contactverif_reports.netcdf.schema import NONE, RATIO, SECONDS, text
from contactverif_reports.netcdf.stored_groups import read_groups
from contactverif_reports.netcdf.variables import codes, numbers, words
from contactverif_reports.netcdf.write_tree import write_tree

TITLE = "contactverif: speed against error of contact formulations"
BENCH_SCHEMA = "2"
_RUN = ["formulation", "cell"]
_SOLUTION = [*_RUN, "variant"]


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
    n_cells, n_processes = len(results.cells), results.evaluation.shape[-1]
    runs = (len(results.formulations), n_cells)
    solutions = (*runs, len(VARIANTS))
    for name, shape in {
        "segments": (n_cells,),
        "unknowns": (n_cells,),
        "best_pressure": (n_cells,),
        "outcomes": solutions,
        "errors": (*solutions, len(ERRORS)),
        "counts": (*solutions, len(COUNTS)),
        "work": (*runs, len(WORK)),
        "evaluation": (*runs, n_processes),
        "factorisation": runs,
    }.items():
        values = getattr(results, name)
        if values.shape != shape:
            raise ValueError(f"{name} has the shape {values.shape}, and the names ask for {shape}")
        whole = name in ("segments", "unknowns", "outcomes", "counts", "work")
        if values.dtype != (np.int64 if whole else np.float64) or (whole and (values < 0).any()):
            raise ValueError(f"{name} holds what it must not")


def _check_codes(results: BenchResults) -> None:
    """Check that codes have a meaning, names are different, and there is something to show."""
    if not results.evaluation.shape[-1] or len(set(results.formulations)) != len(results.formulations):
        raise ValueError("there are no processes, or two formulations have one name")
    if not np.isin(results.outcomes, list(Outcome)).all():
        raise ValueError("outcome holds a code without a meaning")
    _check_scenes(results)


def _check_scenes(results: BenchResults) -> None:
    """Check that a scene has all its instances on all its meshes, and targets that fall."""
    for scene in results.scenes:
        cells = [cell for cell in results.cells if cell.scene == scene]
        instances = {cell.instance for cell in cells}
        if len(set(cells)) != len(cells) or len(cells) != len(instances) * len(results.meshes_of(scene)):
            raise ValueError("an instance is not there on every mesh")
        targets = results.targets[scene]
        if not targets or not (np.diff([1.0, *targets, 0.0]) < 0).all():
            raise ValueError("a scene has no targets, or none that fall")


def _labels(results: BenchResults) -> dict[str, Any]:
    """Return the names along the dimensions, and what a cell is."""
    cells, scenes = results.cells, {scene: number for number, scene in enumerate(results.scenes)}
    n_targets = max(map(len, results.targets.values()))
    targets = [[*results.targets[scene], *[np.nan] * (n_targets - len(results.targets[scene]))] for scene in scenes]
    instance = "number of the variation, the same on all meshes"
    size = "number of free unknowns of all bodies"
    best = "error of the best continuous pressure that is linear between the slave's nodes"
    return {
        "formulation": words(["formulation"], list(results.formulations), "formulation, as on the command line"),
        "scene": codes(["cell"], [scenes[cell.scene] for cell in cells], scenes, "scene of the cell"),
        "mesh": numbers(["cell"], [cell.mesh for cell in cells], "fineness of the mesh, as the scene counts it", RATIO),
        "instance": numbers(["cell"], [cell.instance for cell in cells], instance, RATIO),
        "penalty": numbers(["variant"], [variant.penalty for variant in VARIANTS], "penalty in E/h", RATIO),
        "start": words(["variant"], [variant.start for variant in VARIANTS], "start of Newton's method"),
        "scene_label": words(["scene_name"], [results.label(scene) for scene in scenes], "what a scene is"),
        "target": numbers(["scene_name", "target_number"], targets, "errors that cost is measured at", RATIO),
        "slave_segments": numbers(["cell"], results.segments, "number of slave segments", RATIO),
        "unknowns": numbers(["cell"], results.unknowns, size, RATIO),
        "best_pressure_error": numbers(["cell"], results.best_pressure, best, RATIO),
        **{
            f"{kind}_kind": words([f"{kind}_kind"], list(table), meaning, "; ".join(map(": ".join, table.items())))
            for kind, table, meaning in (
                ("error", ERRORS, "kind of error"),
                ("count", COUNTS, "what is counted"),
                ("work", WORK, "work of one evaluation and of one linear system"),
            )
        },
    }


def _runs(results: BenchResults) -> dict[str, Any]:
    places = range(len(results.cells)), range(len(VARIANTS))
    remarks = [
        [[results.remarks.get((name, cell, variant), "") for variant in places[1]] for cell in places[0]]
        for name in results.formulations
    ]
    comment = "NaN without a solution, or where nothing is reported"
    outcomes = {outcome.word.replace(" ", "_"): int(outcome) for outcome in Outcome}
    return {
        "outcome": codes(_SOLUTION, results.outcomes, outcomes, "how the run ended"),
        "remark": words(_SOLUTION, remarks, "how the run ended, where it gave no solution"),
        "error": numbers([*_SOLUTION, "error_kind"], results.errors, "error", RATIO, comment),
        "count": numbers([*_SOLUTION, "count_kind"], results.counts, "count", RATIO),
        "work": numbers([*_RUN, "work_kind"], results.work, "work", RATIO, "entries are 0 without a solution"),
    }


def _timing(results: BenchResults) -> Group:
    table = {
        "evaluation_seconds": numbers(
            [*_RUN, "process"],
            results.evaluation,
            "least time of one evaluation: search, forces and tangent",
            SECONDS,
            "by the clock of the plugin's process; NaN where it crashed",
        ),
        "factorisation_seconds": numbers(
            _RUN,
            results.factorisation,
            "least time of one factorisation of the whole system",
            SECONDS,
            "NaN without one",
        ),
    }
    return Group(table, {"comment": "the only numbers that depend on a clock"})


def _results(root: Group, timing: Group) -> BenchResults:
    formulations, scenes = (
        tuple(map(str, root["formulation"].values)),
        str(root["scene"].attrs["flag_meanings"]).split(),
    )
    cells = _cells(root, scenes)
    outcomes, remarks = root["outcome"].values.astype(np.int64), root["remark"].values
    unsolved = np.argwhere(outcomes != Outcome.SOLVED).tolist()
    attributes = {str(name): str(value) for name, value in root.attrs.items()}
    not_loaded = attributes["not_loaded"]
    structure = ("title", "bench_schema", "Conventions", "not_loaded")
    targets = [tuple(row[np.isfinite(row)].tolist()) for row in root["target"].values]
    return BenchResults(
        formulations=formulations,
        cells=cells,
        labels=dict(zip(scenes, map(str, root["scene_label"].values), strict=True)),
        targets=dict(zip(scenes, targets, strict=True)),
        segments=root["slave_segments"].values.astype(np.int64),
        unknowns=root["unknowns"].values.astype(np.int64),
        best_pressure=_best_pressure(root),
        outcomes=outcomes,
        errors=root["error"].values,
        counts=root["count"].values.astype(np.int64),
        work=root["work"].values.astype(np.int64),
        evaluation=timing["evaluation_seconds"].values,
        factorisation=timing["factorisation_seconds"].values,
        remarks={(formulations[row], cell, run): str(remarks[row, cell, run]) for row, cell, run in unsolved},
        not_loaded={} if not_loaded == NONE else dict(_split(line) for line in not_loaded.splitlines()),
        provenance={name: value for name, value in attributes.items() if name not in structure},
    )


def _best_pressure(root: Group) -> FloatArray:
    """Return the errors of the best pressures, NaN in an older file."""
    name = "best_pressure_error"
    return root[name].values if name in root else np.full(len(root["slave_segments"].values), np.nan)


def _cells(root: Group, scenes: list[str]) -> tuple[Cell, ...]:
    """Return the cells of a file, whose variants must be those of this version."""
    if (root["scene"].values < 0).any():
        raise ValueError("scene holds a code without a meaning")
    variants = list(zip(root["penalty"].values.tolist(), map(str, root["start"].values), strict=True))
    if variants != [(variant.penalty, variant.start) for variant in VARIANTS]:
        raise ValueError("its penalties and starts are others")
    columns = (root[name].values.tolist() for name in ("scene", "mesh", "instance"))
    return tuple(Cell(scenes[scene], mesh, instance) for scene, mesh, instance in zip(*columns, strict=True))


def _split(line: str) -> tuple[str, str]:
    name, _, reason = line.partition(": ")
    return name, reason
