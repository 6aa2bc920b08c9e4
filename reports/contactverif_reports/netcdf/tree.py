"""The whole report as an `xarray.DataTree`, before it is a file."""

from __future__ import annotations

import xarray as xr

from contactverif.contract.result import Run
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.counterexample_groups import counterexample_groups
from contactverif_reports.netcdf.named_case_groups import named_case_groups
from contactverif_reports.netcdf.property_group import property_group
from contactverif_reports.netcdf.summary_group import root_attributes, summary_group, timing_group


def tree_of(run: Run, *, with_named_cases: bool = False) -> xr.DataTree:
    """Return all groups of the report of a run, if wanted with each named case that a formulation fails."""
    groups = {"/": xr.Dataset(attrs=root_attributes(run)), f"/{schema.SUMMARY}": summary_group(run)}
    properties = run.properties
    for id_, name in schema.group_names(properties).items():
        *folders, _ = name.removeprefix("/").split("/")
        for depth in range(1, len(folders) + 1):
            comment = {"comment": f"properties whose ids begin with {'.'.join(folders[:depth])}"}
            groups.setdefault(f"/{'/'.join(folders[:depth])}", xr.Dataset(attrs=comment))
        rows = {row.formulation: row for row in run.rows if row.property_id == id_}
        groups[name] = property_group(properties[id_], rows, run.formulations)
    groups |= counterexample_groups(run)
    if with_named_cases:
        groups |= named_case_groups(run)
    groups[f"/{schema.TIMING}"] = timing_group(run)
    return xr.DataTree.from_dict(groups)
