"""The writer of reports: a file is written whole, or not at all."""

from __future__ import annotations

import os

from contactverif.contract.result import Run
from contactverif_reports.files import check_writable, whole

__all__ = ["check_writable", "write"]


def write(run: Run, path: str | os.PathLike[str]) -> None:
    """Write the report of a run, whole or not at all, in place of a file that is there.

    Raises
    ------
    MisuseError
        If the path cannot be written.
    """
    from contactverif_reports.netcdf.tree import tree_of

    check_writable(path)
    with whole(path) as part:
        tree_of(run).to_netcdf(part, engine="netcdf4", format="NETCDF4")
