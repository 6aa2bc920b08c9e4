"""Outcomes and cases in a report, written and read: of random cases, witnesses and counterexamples.

A report may hold millions of cases. Made all at once, they would take a hundred times the memory of the arrays, so each
outcome is made from the arrays of its group when somebody asks for it. A case is rebuilt to the last bit. Some stored
reports hold the named cases of a property, too, which are read but no longer written.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import BODIES, Case, CaseSummary
from contactverif.contract.counterexample import Counterexample, counterexamples, distinct, typeable
from contactverif.contract.interface import PLANE, SPACE
from contactverif.contract.property import (
    Finding,
    Measurement,
    Outcome,
    Outcomes,
    PropertyInfo,
    Quantity,
    Role,
    Verdict,
)
from contactverif.contract.result import NodalForces, Run
from contactverif.contract.schema import Axes, Group, StoredColumns, Variable, codes, numbers, to_variables, words

Table = dict[str, Variable]
_OF_NODES = ("nodes", "fixed", "imposed", "load")  # Arrays (n_nodes, dim).
_OF_BODIES = ("count", "is_slave", "young", "poisson")  # Arrays (n_bodies,).
ARRAY_NAME = "case_array"  # The attribute that names the array of Case.to_arrays().
_ARRAYS = {  # {array: (dimensions, long name, unit)}
    "nodes": (("node", "dim"), "reference positions, slave nodes first", schema.LENGTH),
    "slave_segments": (("slave_segment", "two"), "first and second node of each slave segment", "1"),
    "master_segments": (("master_segment", "two"), "first and second node of each master segment", "1"),
    "z": (("unknown",), "current positions, flat: x and y of each node in turn", schema.LENGTH),
    "penalty": ((), schema.PENALTY_MEANING, schema.PENALTY),
    "seed": ((), "seed of anything random that the property does with the case", "1"),
    "name": ((), "name of the case, empty if it has none", ""),
    "kind": ((), "kind of situation of the case, empty if it has none", ""),
}
_FACES = {  # {array: (dimensions, long name)} in space.
    "slave_segments": (("slave_face", "slave_corner"), "corners of each slave face"),
    "master_segments": (("master_face", "master_corner"), "corners of each master face"),
}


def common_unit(units: Iterable[str], otherwise: str) -> str:
    """Return the unit that all numbers have, else where their units stand."""
    different = set(units)
    return different.pop() if len(different) == 1 else otherwise


def outcome_axes(info: PropertyInfo, outcomes: Iterable[Outcome]) -> Axes:
    """Return what stands along the dimensions of a group, so that random cases and witnesses have the same ones.

    Details and parameters are in the order in which they first occur; the kinds of the property come before others.
    """
    details, parameters = dict[str, None](), dict[str, None]()
    kinds, n_iterates, n_components = set[str](), 0, 0
    for outcome in outcomes:
        case, measurement = outcome.case_or_summary, outcome.measurement
        kinds.add(case.kind)
        parameters |= dict.fromkeys(name for name, values in case.parameters.items() if np.size(values) == 1)
        if measurement is not None:
            details |= dict.fromkeys(measurement.details)
            n_iterates = max([n_iterates, *map(len, measurement.series.values())])
            n_components = max(n_components, len(measurement.finding.found) if measurement.finding else 0)
    return {
        "quantity": [quantity.name for quantity in info.quantities],
        "detail": list(details),
        "series": list(info.series),
        "iterate": range(n_iterates),
        "component": range(n_components),
        "parameter": list(parameters),
        "kind": list(dict.fromkeys([*info.kinds, *sorted(kinds - {""})])),
    }


def _parameter_units(axes: Axes) -> list[str]:
    return [schema.PARAMETER_UNITS.get(name, schema.UNKNOWN) for name in axes["parameter"]]


def coordinates(info: PropertyInfo, axes: Axes) -> Table:
    """Return what stands along `quantity`, `detail`, `series`, `kind` and `parameter`: names, units, reasons."""
    table: Table = {}
    if info.quantities:
        table |= to_variables(schema.QUANTITY, info.quantities, {"quantity": len(info.quantities)}, {})
    if axes["detail"]:
        table["detail"] = words(["detail"], axes["detail"], "name of the further number")
    if info.series:
        table["series"] = words(["series"], list(info.series), "name of the numbers by iterate")
        table["series_units"] = words(["series"], list(info.series.values()), "unit of the numbers by iterate")
    if axes["kind"]:
        comment = "n_declared: so many of them, the first ones, the property declares"
        table["kind"] = words(["kind"], axes["kind"], "kind of situation that cases are of", comment)
        table["kind"].attrs["n_declared"] = np.int32(len(info.kinds))
    if axes["parameter"]:
        table["parameter"] = words(["parameter"], axes["parameter"], "name of the parameter")
        table["parameter_units"] = words(["parameter"], _parameter_units(axes), "unit of the parameter")
    return table


def outcome_variables(
    info: PropertyInfo,
    outcomes: Sequence[Outcome | None],
    dims: Mapping[str, int],
    axes: Axes,
    prefix: str = "",
    *,
    with_cases: bool = True,
) -> Table:
    """Return the variables of flat outcomes along some dimensions; None is no outcome."""
    unit = common_unit((quantity.unit for quantity in info.quantities), "see quantity_units")
    units = {
        "value": unit,
        "tolerance": unit,
        "series_value": common_unit(info.series.values(), "see series_units"),
        "parameter_value": common_unit(_parameter_units(axes), "see parameter_units"),
    }
    table = schema.OUTCOME + (schema.CASE_COLUMNS if with_cases else ())
    summaries = [outcome and replace(outcome, case_or_summary=outcome.summary) for outcome in outcomes]  # Made once.
    return to_variables(table, summaries, dims, axes, prefix=prefix, units=units)


class OutcomeArrays:
    """The outcomes of a group along some dimensions, by flat number; names of variables begin with `prefix`."""

    def __init__(self, group: Group, info: PropertyInfo, dims: Sequence[str], prefix: str = "") -> None:
        self._info = info
        axes: Axes = {
            "quantity": [quantity.name for quantity in info.quantities],
            "detail": group.labels("detail"),
            "series": list(info.series) if f"{prefix}series_value" in group else [],
            "parameter": group.labels("parameter"),
            "kind": group.labels("kind"),
            **{axis: range(group.sizes.get(axis, 0)) for axis in ("iterate", "component")},
        }
        # The whole case of a single outcome stands elsewhere.
        table = schema.OUTCOME + (schema.CASE_COLUMNS if dims else ())
        self._columns = StoredColumns(table, group, dims, axes, prefix=prefix)
        arrays = self._columns.arrays
        self.verdicts = arrays["verdict"]
        values, tolerances, found, right = (
            arrays.get(f"measurement.{name}", np.empty(0)) == schema.NOT_MEASURED
            for name in ("values", "tolerances", "finding.found", "finding.right")
        )
        if (~values & tolerances).any():
            raise ValueError(f"a value of {prefix}verdict has no tolerance")
        if (found != right).any():
            raise ValueError(f"what was found of {prefix}verdict is not as much as what is right")

    def outcome(self, number: int, case: Case | None = None, seconds: float = 0.0) -> Outcome | None:
        """Return an outcome, with the whole case if it is given; None where there is none."""
        if not self._columns.present[number]:
            return None
        values = self._columns.at(number)
        return Outcome(
            CaseSummary(**_fields_of("summary", values)) if case is None else case,
            Verdict(values["verdict"]),
            values.get("reason", ""),
            self._measurement(values) if values["measurement"] else None,
            seconds=seconds,
            breach=values["breach"],
        )

    def _measurement(self, values: Mapping[str, Any]) -> Measurement:
        fields = _fields_of("measurement", values)
        measured, tolerances = fields.pop("values", {}), fields.pop("tolerances", {})
        finding = {"unit": "", "found_name": "", "right_name": "", **_fields_of("measurement.finding", values)}
        quantities = (each for each in self._info.quantities if each.name in measured)
        return Measurement(
            [each.check(measured[each.name], tolerances[each.name]) for each in quantities],
            finding=Finding(**finding) if finding.get("place") else None,
            **fields,
        )


def _fields_of(owner: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return {attribute: value} of the attributes of one record in the record."""
    return {path[len(owner) + 1 :]: value for path, value in values.items() if path.rpartition(".")[0] == owner}


class StoredOutcomes(Outcomes):
    """The outcomes of one row, in the order of the run.

    `first` is the flat number of the first, and `named` has the cases that the report stores whole, by their names.
    """

    def __init__(
        self, arrays: OutcomeArrays, first: int, n_cases: int, seconds: FloatArray, named: Mapping[str, Case]
    ) -> None:
        self._arrays, self._first, self._n_cases, self._seconds, self._named = arrays, first, n_cases, seconds, named

    def __len__(self) -> int:
        return self._n_cases

    def at(self, number: int) -> Outcome:
        """Return an outcome, with its case if the report stores that whole."""
        outcome = self._arrays.outcome(self._first + number, seconds=float(self._seconds[number]))
        assert outcome is not None
        case = self._named.get(outcome.summary.name)
        return outcome if case is None else replace(outcome, case_or_summary=case)


def read_info(group: Group) -> PropertyInfo:
    """Return the property of a group."""
    columns = {column.path: group.words(column.name) for column in schema.QUANTITY}
    needs = str(group.attrs["needs"])
    group.labels("quantity")
    strangers = set(group.words("sense")) - {"at most", "at least"}
    if strangers:
        raise ValueError(f"the sense of a quantity is {strangers.pop()!r}")
    roles = [role for role in get_args(Role) if (role or schema.NONE) == str(group.attrs["role"])]
    if not roles:
        raise ValueError(f"the role of a property is {group.attrs['role']!r}")
    return PropertyInfo(
        str(group.attrs["property_id"]),
        str(group.attrs["family"]),
        str(group.attrs["summary"]),
        tuple(Quantity(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)),
        needs=frozenset() if needs == schema.NONE else frozenset(needs.split(", ")),
        series=dict(zip(group.labels("series"), group.words("series_units"), strict=True)),
        kinds=tuple(group.labels("kind")[: int(group["kind"].attrs["n_declared"])]) if "kind" in group else (),
        least_contact=float(group.attrs["least_contact"]),
        usual_undecided=float(group.attrs["usual_undecided"]),
        rank=float(group.attrs["rank"]),
        role=roles[0],
    )


# Cases: counterexamples with a mesh that others can draw, and named cases that fail.


def counterexample_groups(run: Run) -> dict[str, Group]:
    """Return `counterexamples`, and for each one a group with its mesh and in it a group with its arrays."""
    examples = counterexamples(run)
    folder = f"/{schema.COUNTEREXAMPLES}"
    comment = (
        "one case of each failure, each a UGRID mesh with the verdict on it; `origin` says whether it was shrunk, and "
        "its group `case` rebuilds it exactly. To judge one again: contactverif replay REPORT --case ID"
    )
    groups = {folder: Group(attrs={"comment": comment, "ids": " ".join(examples) or schema.NONE})}
    for id_, example in examples.items():
        groups[f"{folder}/{id_}"] = _mesh(example)
        groups[f"{folder}/{id_}/{schema.CASE}"] = case_group(example.case)
    return groups


def _mesh(example: Counterexample) -> Group:
    """Return the case as a UGRID-1.0 topology, of edges in the plane and of faces in space, with the outcome on it."""
    case, info = example.case, example.row.info
    table = _topology(case) | _forces(example.row.forces)
    axes = {**outcome_axes(info, [example.outcome]), "parameter": (), "kind": ()}  # These are among the arrays.
    table |= coordinates(info, axes)
    table |= outcome_variables(info, [example.outcome], {}, axes, with_cases=False)
    attributes = {
        "title": f"{example.formulation}, {info.id}: {example.verdict}",
        "formulation": example.formulation,
        "property_id": info.id,
        "summary": info.summary,
        "reason": example.reason or schema.NONE,
        "origin": example.origin,
        "case_name": case.name or schema.NONE,
        "case_kind": case.kind or schema.NONE,
        "replay": f"contactverif replay REPORT --case {example.id}",
    }
    return Group(table, {key: schema.text(value) for key, value in attributes.items()})


def _topology(case: Case) -> dict[str, Variable]:
    """Return the mesh of a case with the reference and the current positions of its nodes."""
    interface = case.interface
    axes, in_plane = "xyz"[: interface.dim], interface.dim == PLANE
    cell, part = ("edge", "segment") if in_plane else ("face", "face")
    sides = [surface.faces for surface in (interface.slave, interface.master)]
    most = max(faces.shape[1] for faces in sides)
    nodes = np.vstack([np.pad(faces, ((0, 0), (0, most - faces.shape[1])), constant_values=-1) for faces in sides])
    corners = "corners of each face, counter-clockwise seen from outside its body, then −1"
    meaning = "first and second node of each segment, body on the left" if in_plane else corners
    side = [0] * len(interface.slave) + [1] * len(interface.master)
    table = {
        "mesh": numbers([], np.int32(0), "topology of the two surfaces", "1"),
        f"{cell}_nodes": numbers([cell, "two" if in_plane else "corner"], nodes, meaning, "1"),
        "side": codes([cell], side, schema.SIDES, f"surface of each {part}"),
    }
    for name, state, places in (("node", "reference", interface.nodes), ("current", "current", case.positions)):
        for number, axis in enumerate(axes):
            meaning = f"{state} position, {axis}"
            table[f"{name}_{axis}"] = numbers(["node"], places[:, number], meaning, schema.LENGTH)
    coordinates_of_nodes = " ".join(f"node_{axis}" for axis in axes)
    table["mesh"].attrs.update(
        cf_role="mesh_topology",
        topology_dimension=np.int32(interface.dim - 1),
        node_coordinates=coordinates_of_nodes,
        **{f"{cell}_node_connectivity": f"{cell}_nodes", f"{cell}_dimension": cell},
    )
    table[f"{cell}_nodes"].attrs.update(cf_role=f"{cell}_node_connectivity", start_index=np.int64(0))
    table["side"].attrs.update(mesh="mesh", location=cell)
    for axis in axes:
        table[f"current_{axis}"].attrs.update(mesh="mesh", location="node", coordinates=coordinates_of_nodes)
    return table


def _forces(forces: NodalForces | None) -> dict[str, Variable]:
    kinds = [] if forces is None else [("", "force", forces.of_formulation), ("exact_", "exact force", forces.exact)]
    table = {}
    for prefix, words_of_name, values in kinds:
        for axis, along in zip("xyz", () if values is None else values.T, strict=False):
            variable = numbers(["node"], along, f"{words_of_name} that pushes the node, {axis}", schema.FORCE)
            variable.attrs.update(mesh="mesh", location="node")
            table[f"{prefix}force_{axis}"] = variable
    return table


def read_forces(dataset: Group, case: Case) -> NodalForces | None:
    """Return the forces that `_mesh` stored beside a case; None where there are none."""
    kinds = [
        np.column_stack([dataset[f"{prefix}force_{axis}"].values for axis in "xyz"[: case.interface.dim]])
        for prefix in ("", "exact_")
        if f"{prefix}force_x" in dataset
    ]
    if any(forces.shape != case.interface.nodes.shape for forces in kinds):
        raise ValueError("forces on other nodes than those of the case")
    return NodalForces(*kinds) if kinds else None


def case_group(case: Case) -> Group:
    """Return `Case.to_arrays()`; the attribute `case_array` of each variable names the array."""
    arrays = case.to_arrays()
    table: dict[str, Variable] = {}
    for safe, (name, values) in zip(distinct(map(typeable, arrays)), arrays.items(), strict=True):
        parameter = name.removeprefix("parameter_")
        axes = tuple(f"{safe}_axis_{axis}" for axis in range(values.ndim))
        unit = schema.PARAMETER_UNITS.get(parameter, schema.UNKNOWN)
        of_parameter = axes, schema.text(f"parameter of the case: {parameter}"), unit
        dims, long_name, units = _ARRAYS.get(name, of_parameter)
        if name in _FACES and values.shape[1] != 2:
            dims, long_name = _FACES[name]
        if values.dtype.kind in "OU":  # Words, and integers beyond 64 bits.
            table[safe] = words(dims, values.astype(np.str_).tolist(), long_name)
        else:
            table[safe] = numbers(dims, values, long_name, units)
        table[safe].attrs[ARRAY_NAME] = schema.text(name)
    return Group(table, {"comment": "contactverif.Case.from_arrays makes the case of these"})


def case_of_group(dataset: Group) -> Case:
    """Return the case that `case_group` made a group of."""
    arrays = {str(variable.attrs[ARRAY_NAME]): variable.values for variable in dataset.variables.values()}
    case = Case.from_arrays(arrays | {"seed": int(np.asarray(arrays["seed"]).item())})
    check_bodies(case.parameters)
    return case


def read_named_cases(groups: Mapping[str, Group]) -> dict[tuple[str, str], Case]:
    """Return {(property id, name): case} of a report; empty where it stores none."""
    cases = {}
    for path, dataset in groups.items():
        if path.startswith(f"/{schema.NAMED_CASES}/"):
            case = case_of_group(dataset)
            cases[str(dataset.attrs["case_of"]), case.name] = case
    return cases


def check_bodies(parameters: Mapping[str, NDArray[Any]]) -> None:
    """Check shapes, finite numbers and node numbers of the bodies of a case, if it holds any."""
    packed = {name.removeprefix(BODIES): values for name, values in parameters.items() if name.startswith(BODIES)}
    if not packed:
        return
    n_nodes, n_bodies = len(np.atleast_1d(packed["nodes"])), packed["count"].size
    dim = SPACE if packed["nodes"].shape[1:] == (SPACE,) else PLANE
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(_OF_NODES, (n_nodes, dim))
    shapes |= dict.fromkeys(_OF_BODIES, (n_bodies,))
    shapes |= {"axis": (n_bodies, 2, 3) if dim == SPACE else (n_bodies, 2), "start": (n_bodies, dim)}
    widths = {"cells": 2**dim, "contact": 2 ** (dim - 1)}
    shapes |= {name: (len(np.atleast_1d(packed[name])), width) for name, width in widths.items()}
    for name, shape in shapes.items():
        if packed[name].shape != shape or not np.isfinite(packed[name]).all():
            raise ValueError(f"{BODIES}{name} has the shape {packed[name].shape} or NaN; needed {shape}")
    for name, low, high in (("cells", -1, n_nodes - 1), ("contact", -1, n_nodes - 1), ("count", 1, n_nodes)):
        numbers = packed[name]
        if (numbers != np.round(numbers)).any() or not ((numbers >= low) & (numbers <= high)).all():
            raise ValueError(f"{BODIES}{name} holds a number that no node has")
    missing = any((packed[name][:, :corners] < 0).any() for name, corners in (("cells", dim + 1), ("contact", dim)))
    if packed["count"].sum() != n_nodes or missing:
        raise ValueError(f"the nodes of {BODIES}count, {BODIES}cells or {BODIES}contact are not those that are there")
