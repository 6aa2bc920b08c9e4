"""The writer of reports: a file is written whole, or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from contactverif.contract.result import Run
from contactverif_reports.files import check_writable, whole

if TYPE_CHECKING:
    import xarray as xr


def write(run: Run, path: str | os.PathLike[str], *, with_named_cases: bool = False) -> None:
    """Write the report of a run, whole or not at all, in place of a file that is there."""
    from contactverif_reports.netcdf.report_tree import tree_of
    from contactverif_reports.netcdf.write_tree import write_tree

    check_writable(path)
    with whole(path) as part:
        write_tree(tree_of(run, with_named_cases=with_named_cases), part)


def as_tree(run: Run) -> xr.DataTree:
    """Return the report of a run as xarray reads it from a file, in memory."""
    import xarray as xr

    with TemporaryDirectory() as folder:
        path = Path(folder) / "report.nc"
        write(run, path)
        with xr.open_datatree(path, engine="netcdf4") as tree:
            for node in tree.subtree:
                for variable in node.variables.values():
                    variable.load()
    return tree
