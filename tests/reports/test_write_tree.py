"""A tree is written as xarray writes it, in another order."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from handmade_report import small_run

from contactverif_reports.netcdf.report_tree import tree_of
from contactverif_reports.netcdf.write_tree import write_tree


def small_tree() -> xr.DataTree:
    """Return groups with all kinds of variables: numbers, words, no dimension, no value, an inherited dimension."""
    root = xr.Dataset(
        {
            "word": ("run", np.array([b"one", b"three"])),
            "number": xr.Variable((), 3.5, {"units": "m"}),
            "code": xr.Variable("run", np.array([1, -1], np.int8), {"_FillValue": np.int8(-1)}),
        },
        coords={"run": [4, 5], "place": ("run", [0.5, np.nan])},
        attrs={"title": "ε", "counts": np.array([1, 2])},
    )
    inner = xr.Dataset(
        {"matrix": (("run", "column"), np.eye(2), {}, {"zlib": True, "complevel": 4, "_FillValue": None})}
    )
    return xr.DataTree.from_dict({"/": root, "/inner": inner, "/inner/nothing": xr.Dataset({"empty": ("none", [])})})


def everything(group: Any) -> Iterator[tuple[Any, ...]]:
    """Yield all that a group and those below it say and hold."""
    yield group.path, _attributes(group), {name: len(dim) for name, dim in group.dimensions.items()}
    for name, variable in group.variables.items():
        variable.set_auto_maskandscale(False)
        variable.set_auto_chartostring(False)
        facts = (variable.dtype, variable.dimensions, variable.shape, variable.filters(), variable.chunking())
        yield name, facts, _attributes(variable), variable[...].tobytes()
    for inner in group.groups.values():
        yield from everything(inner)


def _attributes(owner: Any) -> dict[str, str]:
    return {name: repr(owner.getncattr(name)) for name in owner.ncattrs()}


@pytest.mark.parametrize("make", [small_tree, lambda: tree_of(small_run(), with_named_cases=True)])
def test_a_file_is_the_one_that_xarray_writes(make: Any, tmp_path: Path) -> None:
    write_tree(make(), tmp_path / "ours.nc")
    make().to_netcdf(tmp_path / "xarray.nc", engine="netcdf4", format="NETCDF4")
    with netCDF4.Dataset(tmp_path / "ours.nc") as ours, netCDF4.Dataset(tmp_path / "xarray.nc") as theirs:
        assert list(everything(ours)) == list(everything(theirs))
