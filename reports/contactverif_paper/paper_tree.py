"""The numbers behind the reproduction of the paper as an `xarray.DataTree`, before they are a file.

Style and units are those of a report (README.md): CF-like attributes, words as characters, codes with meanings, the
same numbers the same bits. Pressures are over the exact one where their unit is 1.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import xarray as xr

from contactverif.contract.arrays import FloatArray
from contactverif.scenes.uniform_stress import CONDITION_TOLERANCE
from contactverif_paper.paper_data import (
    Convergence,
    Curve,
    Defects,
    Disk,
    DiskStudy,
    ForceTable,
    Member,
    MultiplierRow,
    Paper,
    PassTable,
    Patch,
    Said,
    Statement,
    Tangents,
)
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.variables import codes, numbers, words

TITLE = "contactverif: the reference paper, computed again"
REFERENCE = "Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416"
_PER_LENGTH = "m-1"
_WORTH_COMPRESSING = 4096  # bytes


def tree_of(paper: Paper) -> xr.DataTree:
    """All groups; those of parts that could not be computed are absent."""
    groups = {
        "/": xr.Dataset(attrs=_root(paper)),
        "/statements": _statements(paper.statements),
        "/forces": _forces(paper.forces),
        "/patch": _patches(paper.patches),
        "/passes": _passes(paper.passes),
        "/convergence": _convergence(paper.convergence),
        "/tangents": _tangents(paper.tangents),
    }
    if paper.multipliers:
        groups["/multipliers"] = _multipliers(paper.multipliers)
    if paper.disk is not None:
        groups |= _disk(paper.disk)
    groups |= {f"/defects/{name}": series for name, series in _defects(paper.defects).items()}
    return xr.DataTree.from_dict({name: _small_as_they_are(group) for name, group in groups.items()})


def _small_as_they_are(group: xr.Dataset) -> xr.Dataset:
    """Small variables are not compressed, which would cost 2 kB each."""
    for variable in group.variables.values():
        if variable.nbytes < _WORTH_COMPRESSING:
            variable.encoding = {k: v for k, v in variable.encoding.items() if k not in ("zlib", "complevel")}
    return group


def _root(paper: Paper) -> dict[str, str]:
    own = {name: schema.text(value) for name, value in paper.provenance.items()}
    return own | {
        "Conventions": schema.CONVENTIONS,
        "title": TITLE,
        "references": REFERENCE,
        "schema": schema.SCHEMA,
        "comment": schema.UNITS_NOTE,
    }


def _names(members: Sequence[Member]) -> dict[str, xr.Variable]:
    one = ["formulation"]
    return {
        "formulation": words(one, [member.formulation for member in members], "formulation, as on the command line"),
        "legend": words(one, [member.legend for member in members], "its name in the paper's legends"),
    }


def _statements(statements: Sequence[Statement]) -> xr.Dataset:
    one, meanings = ["statement"], {said.mark: int(said) for said in Said}
    table = {
        "figure": words(one, [statement.figure for statement in statements], "where in the paper"),
        "says": words(one, [statement.says for statement in statements], "what the paper says, in our words"),
        "found": words(one, [statement.found for statement in statements], "what was found here"),
        "verdict": codes(one, [statement.verdict for statement in statements], meanings, "how the two agree"),
        "drawing": words(
            one, [statement.drawing for statement in statements], "file name of the figure here", "or none"
        ),
    }
    return xr.Dataset(table, attrs={"comment": "the paper's statements beside what was found"})


def _forces(tables: Sequence[ForceTable]) -> xr.Dataset:
    rows = [(table.exact, *table.rows) for table in tables]
    found = _names([row.member for row in rows[0]])
    found["case"] = words(["case"], [table.case for table in tables], "case of the paper")
    found["figure"] = words(["case"], [table.figure for table in tables], "the paper's figure")
    each = ["case", "formulation"]
    for name, dim, what in (
        ("slave", "slave_node", "transferred by the slave's nodes"),
        ("master", "master_node", "transferred by the master's nodes"),
        ("points", "point", "on the virtual slave nodes"),
        ("printed", "master_node", "on the master's nodes as the paper prints it"),
    ):
        found |= _fractions(name, [*each, dim], [[getattr(row, name) for row in case] for case in rows], what)
    for side in ("slave", "master"):
        lengths = _padded([np.array(getattr(table, side)) for table in tables])
        found[f"{side}_length"] = numbers(
            ["case", f"{side}_segment"], lengths, f"length of the {side}'s segments", schema.LENGTH, fill=np.nan
        )
    rounding = [[row.rounding for row in case] for case in rows]
    found["rounding"] = numbers(each, rounding, "largest difference of a force from its rational", schema.LENGTH)
    comment = "forces of a uniform pressure p = 1, over p, in rationals; the first row is exact; from left to right"
    return xr.Dataset(found, attrs={"comment": comment})


def _fractions(
    name: str, dims: Sequence[str], rows: Sequence[Sequence[tuple[Fraction, ...]]], what: str
) -> dict[str, xr.Variable]:
    """Numerators and denominators, 0 / 0 where there is nothing."""
    parts = np.zeros((2, len(rows), len(rows[0]), max(len(row) for case in rows for row in case)), dtype=np.int32)
    for place, row in ((place, rows[place[0]][place[1]]) for place in np.ndindex(parts.shape[1:3])):
        parts[:, *place, : len(row)] = [[x.numerator for x in row], [x.denominator for x in row]]
    comment = "0 over 0: nothing there"
    return {
        f"{name}_numerator": numbers(dims, parts[0], f"force {what}: numerator", schema.LENGTH, comment),
        f"{name}_denominator": numbers(dims, parts[1], f"force {what}: denominator", "1", comment),
    }


def _patches(patches: Sequence[Patch]) -> xr.Dataset:
    """Scenes × formulations; NaN where a figure does not show a formulation."""
    members = list(dict.fromkeys(curve.member for patch in patches for curve in patch.curves))
    spread: dict[str, list[list[FloatArray]]] = {name: [] for name in ("x", "pressure", "ux", "uy", "one")}
    ends = []
    for patch in patches:
        own = {curve.member: curve for curve in patch.curves}
        for name, row in spread.items():
            row.append([_of_curve(own.get(member), name) for member in members])
        ends.append([own[member].solution.end if member in own else "" for member in members])
    nodes = [np.vstack([body.nodes for body in patch.solved.bodies]) for patch in patches]
    owner = [np.repeat(np.arange(2.0), [len(body.nodes) for body in patch.solved.bodies]) for patch in patches]
    one = np.array([row[:4] for case in spread["one"] for row in case]).reshape(len(patches), len(members), 3)
    dims, scene = ["scene", "formulation"], ["scene"]
    table = _names(members) | {
        "scene": words(scene, [patch.scene for patch in patches], "scene, as on the command line"),
        "figure": words(scene, [f"{patch.meshes}, {patch.pressures}" for patch in patches], "meshes, pressures"),
        "stiffness": numbers(scene, [patch.stiffness for patch in patches], "penalty over E", _PER_LENGTH),
        "exact_pressure": numbers(scene, [patch.exact for patch in patches], "exact contact pressure", schema.STRESS),
        "penalty": numbers(scene, [patch.solved.case.penalty for patch in patches], "penalty", schema.PENALTY),
        "x": _numbers_at([*dims, "point"], spread["x"], "reference coordinate", schema.LENGTH),
        "pressure": _numbers_at([*dims, "point"], spread["pressure"], "contact pressure over the exact one", "1"),
        "at_points": _codes_at(dims, one[..., 2], {"at_nodes": 0, "at_points": 1}, "where pressures are given"),
        "stress_error": numbers(
            dims, one[..., 0], "largest error of a stress at a Gauss point over the pressure", "1", fill=np.nan
        ),
        "iterations": numbers(dims, one[..., 1], "linear systems solved", "1", fill=np.nan),
        "end": words(dims, ends, "how Newton's method ended"),
        "body": numbers(["scene", "node"], _padded(owner), "body of the node; 0 is the slave", "1", fill=np.nan),
        "displacement_x": _numbers_at([*dims, "node"], spread["ux"], "displacement along x", schema.LENGTH),
        "displacement_y": _numbers_at([*dims, "node"], spread["uy"], "displacement along y", schema.LENGTH),
    }
    for axis, name in enumerate("xy"):
        places = _padded([found[:, axis] for found in nodes])
        table[f"node_{name}"] = numbers(["scene", "node"], places, f"reference {name}", schema.LENGTH, fill=np.nan)
    comment = "pressures at virtual slave nodes where at_points, else nodal forces over the nodes' shares"
    return xr.Dataset(table, attrs={"comment": comment})


def _of_curve(curve: Curve | None, name: str) -> FloatArray:
    """One row of a table; `one` is (error, iterations, at_points)."""
    if curve is None:
        return np.full(3 if name == "one" else 0, np.nan)
    if name == "one":
        return np.array([curve.solution.stress_error, len(curve.solution.residuals) - 1, float(curve.at_points)])
    if name in ("ux", "uy"):
        moved: FloatArray = np.vstack(curve.solution.displacements)[:, "xy".index(name[1])]
        return moved
    found: FloatArray = getattr(curve, name)
    return found


def _numbers_at(dims: Sequence[str], rows: Sequence[Sequence[FloatArray]], long_name: str, units: str) -> xr.Variable:
    """Rows of rows of different lengths, NaN behind their ends."""
    flat = _padded([row for case in rows for row in case])
    return numbers(dims, flat.reshape(len(rows), len(rows[0]), -1), long_name, units, "NaN: nothing there", fill=np.nan)


def _codes_at(dims: Sequence[str], values: FloatArray, meanings: dict[str, int], long_name: str) -> xr.Variable:
    return codes(dims, np.where(np.isnan(values), -1, values), meanings, long_name, "missing: not shown", fill=-1)


def _passes(table: PassTable) -> xr.Dataset:
    dims, meanings = ["formulation", "scene"], {"fails": 0, "passes": 1}
    found = _names(table.members) | {
        "scene": words(["scene"], table.scenes, "scene, as on the command line"),
        "stress_error": numbers(
            dims,
            table.errors,
            "largest error of a stress at a Gauss point over the pressure",
            "1",
            "NaN: Newton's method ended at no solution",
            fill=np.nan,
        ),
        "tolerance": numbers(
            ["scene"], table.tolerances, "of roundoff: an error below it passes", "1", CONDITION_TOLERANCE
        ),
        "said": codes(dims, table.said, meanings, "what the paper says", "missing: nothing", fill=-1),
    }
    found["unequal"] = numbers(
        ["bound"],
        np.array(table.unequal),
        "VTS-PPT on Example 1bis, the foundation ten times as stiff: error of the stress, and tolerance",
        "1",
    )
    comment = f"elastic patch tests at the penalty 10 E/h; an error above {table.fails:g} fails"
    return xr.Dataset(found, attrs={"comment": comment})


def _convergence(found: Convergence) -> xr.Dataset:
    rows = [history for histories in found.histories for history in histories]
    shape = len(found.histories), len(found.histories[0])
    residuals = _padded([row.residuals for row in rows]).reshape(*shape, -1)
    dims = ["ratio", "formulation"]
    table = _names([history.member for history in found.histories[0]]) | {
        "ratio": numbers(["ratio"], found.ratios, "E of the master over E of the slave", "1"),
        "residual": numbers(
            [*dims, "iterate"], residuals, "largest entry of the residual", schema.FORCE, "NaN: no such", fill=np.nan
        ),
        "floor": numbers(
            dims,
            np.reshape([row.floor for row in rows], shape),
            "what roundoff alone makes of the residual",
            schema.FORCE,
        ),
        "rate": numbers(
            dims, np.reshape([row.rate for row in rows], shape), "ratio of residuals, late", "1", fill=np.nan
        ),
        "end": words(dims, [[h.end for h in histories] for histories in found.histories], "how Newton's method ended"),
        "stiffness": numbers(["penalty"], found.stiffness, "penalty over E", _PER_LENGTH),
        "radius": numbers(["penalty"], found.radius, "spectral radius of I − K_basic⁻¹ K_consistent", "1"),
        "basic_rate": numbers(["penalty"], found.rate, "rate of the basic version", "1", fill=np.nan),
    }
    return xr.Dataset(table, attrs={"figure": "Fig. 30", "scene": found.scene})


def _tangents(found: Tangents) -> xr.Dataset:
    one = ["formulation"]
    table = _names(found.members) | {
        "error": numbers(one, found.error, "difference of K d from a complex step, over K d", "1"),
        "asymmetry": numbers(one, found.asymmetry, "largest entry of K − Kᵀ over that of K", "1"),
        "order": numbers(one, found.order, "order of one Newton step", "1", "NaN: not decided", fill=np.nan),
        "iterations": numbers(one, found.iterations.astype(np.int32), "linear systems solved", "1"),
    }
    comment = "in the solution, free sides, a master half as stiff as the slave"
    return xr.Dataset(table, attrs={"scene": found.scene, "comment": comment})


def _multipliers(rows: Sequence[MultiplierRow]) -> xr.Dataset:
    one, yes = ["row"], {"fails": 0, "passes": 1}
    table = {
        "formulation": words(one, [row.member.formulation for row in rows], "formulation, as on the command line"),
        "scene": words(one, [row.scene for row in rows], "scene"),
        "end": words(one, [row.end for row in rows], "how Newton's method ended"),
        "stress_error": numbers(one, [row.error for row in rows], "largest error of a stress over p", "1", fill=np.nan),
        "tolerance": numbers(one, [row.tolerance for row in rows], "of roundoff", "1"),
        "low": numbers(one, [row.low for row in rows], "smallest multiplier, as a pressure over p", "1"),
        "high": numbers(one, [row.high for row in rows], "largest multiplier, as a pressure over p", "1"),
        "deficiency": numbers(
            one, np.array([row.deficiency for row in rows], np.int32), "multipliers that are not unique", "1"
        ),
        "said": codes(one, [row.said for row in rows], yes, "what the paper says", "missing: nothing", fill=-1),
    }
    return xr.Dataset(table, attrs={"comment": "patch tests with Lagrange multipliers"})


def _disk(disk: Disk) -> dict[str, xr.Dataset]:
    each, at = ["formulation"], ["formulation", "point"]
    curves = disk.curves
    table = _names([curve.member for curve in curves]) | {
        "x": numbers(at, _padded([c.x for c in curves]), "x along the interface", schema.LENGTH, fill=np.nan),
        "pressure": numbers(at, _padded([c.pressure for c in curves]), "contact pressure", schema.STRESS, fill=np.nan),
        "largest": numbers(each, [c.largest for c in curves], "largest contact pressure", schema.STRESS),
        "half_width": numbers(each, [c.half_width for c in curves], "half-width of the contact", schema.LENGTH),
        "iterations": numbers(each, np.array([c.iterations for c in curves], np.int32), "linear systems solved", "1"),
        "from_touching": numbers(
            each,
            np.array([c.from_touching for c in curves], np.int32),
            "linear systems solved from a disk that just touches",
            "1",
        ),
        "difference_x": numbers(["place"], disk.difference_x, "x along the interface", schema.LENGTH),
        "difference": numbers(["place"], disk.difference, "VTS-PPT minus VTS-ME in contact pressure", schema.STRESS),
        "winkler_x": numbers(["exact_place"], disk.winkler_x, "x along the interface", schema.LENGTH),
        "winkler_pressure": numbers(
            ["exact_place"], disk.winkler_pressure, "Hertz on a layer of springs: pressure", schema.STRESS
        ),
    }
    attributes = {
        "figure": "Figs. 38, 39",
        "scene": disk.scene,
        "hertz": np.array(disk.hertz),
        "winkler": np.array(disk.winkler),
        "comment": f"hertz, winkler: largest pressure ({schema.STRESS}) and half-width ({schema.LENGTH})",
    }
    groups = {"/disk": xr.Dataset(table, attrs=attributes)}
    if (study := disk.study) is not None:
        groups["/disk_study"] = _disk_study(study)
    return groups


def _disk_study(study: DiskStudy) -> xr.Dataset:
    dims = ["formulation", "mesh"]
    what = "largest pressure over that of Hertz on springs, less 1"
    slopes = np.full((len(study.members), len(study.slopes.at)), np.nan)
    for member, values in zip(study.slopes.members, study.slopes.values, strict=True):
        slopes[study.members.index(member)] = values
    table = _names(study.members) | {
        "size": numbers(["mesh"], study.size, "size of an element in the middle", schema.LENGTH),
        "largest": numbers(dims, study.largest, "largest contact pressure", schema.STRESS),
        "half_width": numbers(dims, study.half_width, "half-width of the contact", schema.LENGTH),
        "iterations": numbers(dims, study.iterations.astype(np.int32), "linear systems solved", "1"),
        "slope": numbers(["slope"], study.slopes.at, "a/R over that of the paper", "1"),
        "excess_over_slopes": numbers(["formulation", "slope"], slopes, what, "1", "NaN: not computed", fill=np.nan),
        "foundation": numbers(["foundation"], study.sizes.at, "size of the foundation over the chosen one", "1"),
        "excess_over_sizes": numbers(["foundation"], study.sizes.values[0], f"{what}; VTS-ME", "1"),
        "difference_x": numbers(["place"], study.difference_x, "x along the interface, second mesh", schema.LENGTH),
        "difference": numbers(
            ["place"], study.difference, "VTS-PPT minus VTS-ME in contact pressure, second mesh", schema.STRESS
        ),
    }
    return xr.Dataset(table)


def _defects(defects: Defects) -> dict[str, xr.Dataset]:
    tilt = numbers(["tilt"], defects.force.at, "tilt of the slave", "rad")
    balance = _names(defects.force.members) | {"tilt": tilt}
    for name, series, what in (
        ("force", defects.force, "force that is lost between slave and master over the slave's force"),
        ("moment", defects.moment, "moment that is lost over the slave's force times its length"),
    ):
        balance[name] = numbers(["formulation", "tilt"], series.values, what, "1")
    jump = _names(defects.jump.members) | {
        "tilt": tilt,
        "jump": numbers(["formulation", "tilt"], defects.jump.values, "largest jump over the slave's force", "1"),
        "known": numbers(["tilt"], defects.jump_known, "the jump of the printed algorithm, by formula", "1"),
        "shift": numbers(["shift"], defects.sliding.at, "end of the area past the node over the slave's length", "1"),
        "transmitted": numbers(
            ["formulation", "shift"], defects.sliding.values, "force on the master over that on the slave", "1"
        ),
    }
    ends = _names(defects.free_end.members) | {
        "overhang": numbers(["overhang"], defects.free_end.at, "part of a slave segment that overhangs", "1"),
        "stress_error": numbers(
            ["formulation", "overhang"],
            defects.free_end.values,
            "largest error of a stress over the pressure",
            "1",
            fill=np.nan,
        ),
    }
    return {
        "balance": xr.Dataset(balance),
        "jump": xr.Dataset(jump, attrs={"tilt_of_transmitted": defects.sliding_tilt}),
        "free_end": xr.Dataset(ends),
    }


def _padded(rows: Sequence[FloatArray]) -> FloatArray:
    """(n_rows, longest), NaN behind the end of a row."""
    return np.array(list(itertools.zip_longest(*rows, fillvalue=np.nan))).T
