"""The writer of reports: a file is written whole, or not at all."""

from __future__ import annotations

import os

from contactverif.contract.result import Run
from contactverif_reports.files import check_writable, whole


def write(run: Run, path: str | os.PathLike[str], *, with_named_cases: bool = False) -> None:
    """Write the report of a run, whole or not at all, in place of a file that is there."""
    from contactverif_reports.netcdf.report_tree import tree_of
    from contactverif_reports.netcdf.write_tree import write_tree

    check_writable(path)
    with whole(path) as part:
        write_tree(tree_of(run, with_named_cases=with_named_cases), part)
