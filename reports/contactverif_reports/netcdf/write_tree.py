"""The writing of groups into a netCDF file: all variables are declared first, and filled afterwards.

In turns, the netCDF library would write the description of all variables again at each turn, so that the time grows
with the square of their number. xarray does so, and a report with 1900 variables took 20 s.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import netCDF4
import numpy as np

from contactverif_reports.netcdf.groups import Group, Variable

_WORTH_COMPRESSING = 4096  # The bytes from which on a variable is compressed, which costs 2 kB of bookkeeping.


def write_tree(groups: Mapping[str, Group], path: str | os.PathLike[str]) -> None:
    """Write groups {path: group}, ``"/"`` first, into a file; one that is there is replaced.

    A dimension of a group is that of a group above if it has its length.
    """
    with netCDF4.Dataset(os.fspath(path), "w", format="NETCDF4") as file:
        declared = []
        for name, group in groups.items():
            target = file.createGroup(name)  # "/" is the file itself.
            target.setncatts(group.attrs)
            declared += [_declare(target, name, variable) for name, variable in group.items()]
        for variable, values in declared:
            variable[...] = values


def _declare(group: Any, name: str, variable: Variable) -> tuple[Any, np.ndarray[Any, Any]]:
    """Return a new, empty variable of a group, and the values that belong into it."""
    values, dims, attributes = variable.values, variable.dims, dict(variable.attrs)
    compressed = values.ndim > 0 and values.nbytes >= _WORTH_COMPRESSING
    if values.dtype.kind == "S":
        width = values.dtype.itemsize
        values = np.ascontiguousarray(values)[..., np.newaxis].view("S1").reshape(*values.shape, width)
        dims = (*dims, f"string{width}")
    for dim, size in zip(dims, values.shape, strict=True):
        _declare_dimension(group, dim, size)
    fill = attributes.pop("_FillValue", None)
    target = group.createVariable(name, values.dtype, dims, zlib=compressed, complevel=4, fill_value=fill)
    target.set_auto_maskandscale(False)
    target.set_auto_chartostring(False)
    target.setncatts(attributes)
    return target, values


def _declare_dimension(group: Any, dim: str, size: int) -> None:
    """Add a dimension to a group, unless it or a group above has that dimension."""
    above = group
    while above is not None:
        if dim in above.dimensions and len(above.dimensions[dim]) == size:
            return
        above = above.parent
    group.createDimension(dim, size)
