"""Groups are written as xarray writes them, in another order."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from handmade_report import small_run

from contactverif.contract.schema import Group, codes, numbers, words
from contactverif_reports.netcdf.file_groups import write_tree
from contactverif_reports.netcdf.write import tree_of


def small_groups() -> dict[str, Group]:
    """Return groups with all kinds of variables: numbers, words, no dimension, no value, an inherited dimension."""
    root = {
        "word": words(["run"], ["one", "three"], "a word"),
        "number": numbers([], 3.5, "a number", "m"),
        "code": codes(["run"], [1, -1], {"good": 1}, "a code", fill=-1),
        "place": numbers(["run"], [0.5, np.nan], "a place", "m", fill=np.nan),
        "run": numbers(["run"], [4, 5], "a run", "1"),
    }
    inner = {"matrix": numbers(["run", "column"], np.ones((2, 300)), "a large one", "1")}
    nothing = {"empty": numbers(["none"], np.zeros(0), "an empty one", "1")}
    attributes = {"title": "ε", "counts": np.array([1, 2])}
    return {"/": Group(root, attributes), "/inner": Group(inner), "/inner/nothing": Group(nothing)}


def as_xarray(group: Group) -> xr.Dataset:
    """Return a group for xarray, with what is compressed."""
    table = {}
    for name, variable in group.items():
        large = variable.values.nbytes >= 4096
        encoding = ({"zlib": True, "complevel": 4} if large else {}) | (
            {} if "_FillValue" in variable.attrs or variable.values.dtype.kind == "S" else {"_FillValue": None}
        )
        table[name] = xr.Variable(variable.dims, variable.values, variable.attrs, encoding)
    return xr.Dataset(table, attrs=group.attrs)


def everything(group: Any) -> Iterator[tuple[Any, ...]]:
    """Yield all that a group and those below it say and hold."""
    yield group.path, _attributes(group), {name: len(dim) for name, dim in group.dimensions.items()}
    for name, variable in sorted(group.variables.items()):
        variable.set_auto_maskandscale(False)
        variable.set_auto_chartostring(False)
        facts = (variable.dtype, variable.dimensions, variable.shape, variable.filters(), variable.chunking())
        yield name, facts, _attributes(variable), variable[...].tobytes()
    for _, inner in sorted(group.groups.items()):
        yield from everything(inner)


def _attributes(owner: Any) -> dict[str, str]:
    return {name: repr(owner.getncattr(name)) for name in owner.ncattrs()}


@pytest.mark.parametrize("make", [small_groups, lambda: tree_of(small_run(), with_named_cases=True)])
def test_a_file_is_the_one_that_xarray_writes(make: Any, tmp_path: Path) -> None:
    write_tree(make(), tmp_path / "ours.nc")
    tree = xr.DataTree.from_dict({path: as_xarray(group) for path, group in make().items()})
    tree.to_netcdf(tmp_path / "xarray.nc", engine="netcdf4", format="NETCDF4")
    with netCDF4.Dataset(tmp_path / "ours.nc") as ours, netCDF4.Dataset(tmp_path / "xarray.nc") as theirs:
        assert list(everything(ours)) == list(everything(theirs))
