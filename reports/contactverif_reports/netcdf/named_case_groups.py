"""The named cases that a formulation fails, whole: once each, however many formulations fail them.

A property with a finite list of cases asks every formulation the same. So a case belongs to its property and not to a
formulation, and the verdicts of all formulations stand in the group of the property.
"""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from contactverif.contract.case import Case
from contactverif.contract.counterexample import named_failures, typeable
from contactverif.contract.result import Run
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.counterexample_groups import case_group, case_of_group
from contactverif_reports.netcdf.stored_groups import Group

_FOLDER = f"/{schema.NAMED_CASES}"
_COMMENT = (
    "the named cases that a formulation fails; to judge one again: contactverif replay REPORT --case "
    "FORMULATION.PROPERTY.CASE"
)


def named_case_groups(run: Run) -> dict[str, xr.Dataset]:
    """Return `named_cases`, and in it a group with the arrays of each case.

    The attribute `property_id` would make a group that of a property, so a case says `case_of` instead.
    """
    groups = {_FOLDER: xr.Dataset(attrs={"comment": _COMMENT})}
    for example in named_failures(run).values():
        name = f"{_FOLDER}/{typeable(f'{example.property_id}.{example.case.name}')}"
        if name not in groups:
            group = case_group(example.case)
            for variable in group.variables.values():  # The filter costs 2 kB for each of these small arrays.
                variable.encoding = {"_FillValue": None} if variable.dtype.kind != "S" else {}
            groups[name] = group.assign_attrs(case_of=schema.text(example.property_id))
    return groups


def read_named_cases(groups: Mapping[str, Group]) -> dict[tuple[str, str], Case]:
    """Return {(property id, name): case} of a report; empty where it stores none."""
    cases = {}
    for path, dataset in groups.items():
        if path.startswith(f"{_FOLDER}/"):
            case = case_of_group(dataset)
            cases[str(dataset.attrs["case_of"]), case.name] = case
    return cases
