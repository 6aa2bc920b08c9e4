"""The groups of a netCDF file, written and read.

All variables are declared first, and filled afterwards: in turns, the netCDF library would write the description of
all variables again at each turn. A child process opens the file that is read and sends its groups as bytes, so that a
damaged file can harm only the child; the process that shows a report never opens it with the netCDF library.
"""

import math
import os
from collections.abc import Iterator, Mapping
from typing import Any

import msgspec
import netCDF4
import numpy as np

from contactverif.contract.errors import MisuseError
from contactverif.contract.schema import Group, Variable
from contactverif.isolation.file_reader import ReadError, check_ordinary, limits_for, read_in_child
from contactverif.isolation.wire import PackedArray

# zlib makes nothing smaller than a 1032nd. A file that says that it holds more lies; the rest is for small files.
MOST_EXPANSION, LEAST_ALLOWANCE = 1032, 1 << 20
LONGEST_TEXT = 1 << 20  # Characters of an attribute. The longest that we write say what each formulation provides.
_WORTH_COMPRESSING = 4096  # The bytes from which on a variable is compressed, which costs 2 kB of bookkeeping.
# What the child sends: attributes, a variable, and all groups.
_Attributes = dict[str, str | PackedArray]
_PackedVariable = tuple[tuple[str, ...], PackedArray, _Attributes]
_PackedGroups = dict[str, tuple[_Attributes, dict[str, _PackedVariable]]]
_MAGIC = b"\x89HDF\r\n\x1a\n"  # The first bytes of each netCDF-4 file.


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
    values, dims, attributes = variable.values, variable.dims, dict(variable.attrs)
    compressed = values.ndim > 0 and values.nbytes >= _WORTH_COMPRESSING
    if values.dtype.kind == "S":
        width = values.dtype.itemsize
        values = np.ascontiguousarray(values)[..., np.newaxis].view("S1").reshape(*values.shape, width)
        dims = (*dims, f"string{width}")
    for dim, size in zip(dims, values.shape, strict=True):
        above = group
        while above is not None and not (dim in above.dimensions and len(above.dimensions[dim]) == size):
            above = above.parent
        if above is None:  # Neither the group nor one above has that dimension.
            group.createDimension(dim, size)
    fill = attributes.pop("_FillValue", None)
    target = group.createVariable(name, values.dtype, dims, zlib=compressed, complevel=4, fill_value=fill)
    target.set_auto_maskandscale(False)
    target.set_auto_chartostring(False)
    target.setncatts(attributes)
    return target, values


def read_groups(path: str | os.PathLike[str], argument: str, needed: str, *, decode: bool = True) -> dict[str, Group]:
    """Return all groups of a netCDF-4 file by path."""
    name = os.fspath(path)
    size = check_ordinary(path, argument, needed).st_size
    with open(path, "rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            reason = "is empty" if not size else "is no netCDF file, or one that is damaged at its beginning"
            raise MisuseError(argument, f"{name}, which {reason}", needed)
    try:
        packed = read_in_child(f"{__name__}:pack_groups", os.path.abspath(name), limits_for(size))
        groups = {}
        for path_of_group, (attributes, packed_variables) in msgspec.msgpack.decode(packed, type=_PackedGroups).items():
            variables = {key: _unpack_variable(*parts, decode) for key, parts in packed_variables.items()}
            groups[path_of_group] = Group(variables, _unpack_attributes(attributes))
        return groups
    except (ReadError, msgspec.DecodeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise MisuseError(argument, f"{name}, which is damaged ({reason})", needed) from error


def _unpack_variable(dims: tuple[str, ...], packed: PackedArray, attributes: _Attributes, decode: bool) -> Variable:
    values = packed.unpack()
    if decode and values.dtype.kind == "S":  # Characters (..., width) become words (...,).
        *shape, width = values.shape
        joined = values.view(f"S{width * values.itemsize}").reshape(shape) if values.size else np.zeros(shape, "S1")
        values, dims = np.strings.decode(joined, "utf-8"), dims[:-1]
    if len(dims) != values.ndim:
        raise ValueError(f"{len(dims)} dimensions of an array of shape {values.shape}")
    return Variable(dims, values, _unpack_attributes(attributes))


def _unpack_attributes(attributes: _Attributes) -> dict[str, Any]:
    values = {name: value if isinstance(value, str) else value.unpack() for name, value in attributes.items()}
    return {name: value if isinstance(value, str) or value.ndim else value[()] for name, value in values.items()}


def pack_groups(path: str) -> bytes:
    """Return all groups of a netCDF file as bytes; this runs in a child process, and asks for all sizes first."""
    try:
        file = netCDF4.Dataset(path)
    except OSError as error:  # Its words repeat the path.
        raise ValueError(error.strerror) from error
    groups = dict(_walk(file))
    _check_sizes(groups, os.path.getsize(path))
    packed = {}
    for name, group in groups.items():
        variables = {
            key: (tuple(each.dimensions), PackedArray.pack(each[...], key), _pack_attributes(each))
            for key, each in group.variables.items()
        }
        packed[name] = _pack_attributes(group), variables
    return msgspec.msgpack.encode(packed)


def _walk(group: Any) -> Iterator[tuple[str, Any]]:
    group.set_auto_mask(False)
    group.set_auto_scale(False)
    group.set_auto_chartostring(False)
    yield group.path, group
    for child in group.groups.values():
        yield from _walk(child)


def _check_sizes(groups: Mapping[str, Any], size: int) -> None:
    most = LEAST_ALLOWANCE + MOST_EXPANSION * size
    total = 0
    for path, group in groups.items():
        for name, variable in group.variables.items():
            place = f"{path.rstrip('/')}/{name}"
            if not isinstance(variable.datatype, np.dtype):
                raise ValueError(f"{place} is of a type that no report has")
            total += math.prod(variable.shape) * variable.datatype.itemsize
            if total > most:
                raise ValueError(f"with {place} of shape {variable.shape} it holds more than {size} bytes can")


def _pack_attributes(owner: Any) -> _Attributes:
    attributes: _Attributes = {}
    for name in owner.ncattrs():
        value = owner.getncattr(name)
        if isinstance(value, list):  # Of strings.
            value = " ".join(map(str, value))
        attributes[name] = value if isinstance(value, str) else PackedArray.pack(value, name)
        length = len(value) if isinstance(value, str) else np.size(value)
        if length > LONGEST_TEXT:
            raise ValueError(f"the attribute {name} is {length} long")
    return attributes
