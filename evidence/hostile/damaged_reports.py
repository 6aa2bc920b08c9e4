"""Damage reports in every way, and count how the commands that read them end.

`python evidence/hostile/damaged_reports.py COUNT SEED` makes that many damaged files and prints the table; a file that
does harm is kept in the folder damaged/. An ending is good if the file is read, or refused in one line with exit status
2.
"""

import importlib
import os
import random
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from damage import BYTES, Campaign, Ending, main, run_command

Entry = tuple[tuple[str, ...], np.ndarray, dict[str, Any]]  # Dimensions, values and attributes of a variable.
Tree = dict[str, tuple[dict[str, Entry], dict[str, Any]]]  # {group: (variables, attributes)}


PROPERTIES = ("patch.flat.transmission", "patch.flat.solve", "newton.history", "unilateral")


def write_report(path: Path, properties: Sequence[str] = PROPERTIES) -> str:
    """Write a small report of some properties; return the id of a counterexample."""
    from contactverif.contract.counterexample import counterexamples
    from contactverif.contract.schema import NAMED_CASES, Group
    from contactverif.plugins.registry import load_formulation, load_properties
    from contactverif.problems.named_states import named_case
    from contactverif.run.run import run
    from contactverif_reports.netcdf import file_groups
    from contactverif_reports.netcdf.stored_outcomes import case_group
    from contactverif_reports.netcdf.write import tree_of

    subjects = [load_formulation(name) for name in ("nts", "vts-ppt")]
    questions = load_properties(list(properties))
    result = run(subjects, questions, examples=8, seed=3)
    # Old reports hold named cases.
    named = Group(case_group(named_case("c-prime")), {"case_of": properties[0]})
    file_groups.write_tree(tree_of(result) | {f"/{NAMED_CASES}/c_prime": named}, path)
    return next(iter(counterexamples(result)))


def read_tree(path: Path) -> Tree:
    """Return everything in a netCDF file."""
    tree: Tree = {}

    def walk(group: Any) -> None:
        group.set_auto_maskandscale(False)
        group.set_auto_chartostring(False)
        variables = {
            name: (each.dimensions, np.array(each[...]), {key: each.getncattr(key) for key in each.ncattrs()})
            for name, each in group.variables.items()
        }
        tree[group.path] = variables, {key: group.getncattr(key) for key in group.ncattrs()}
        for child in group.groups.values():
            walk(child)

    with netCDF4.Dataset(path) as file:
        walk(file)
    return tree


def write_tree(tree: Tree, path: Path) -> None:
    """Write such a tree, with dimensions as the values have them."""
    with netCDF4.Dataset(path, "w") as file:
        for place, (variables, attributes) in tree.items():
            group = file if place == "/" else file.createGroup(place)
            for name, (dims, values, attrs) in variables.items():
                names = []
                for axis, size in enumerate(values.shape):
                    dim = dims[axis] if axis < len(dims) else f"{name}_{axis}"
                    if dim in group.dimensions and len(group.dimensions[dim]) != size:
                        dim = f"{dim}_{size}_{name}"
                    if dim not in group.dimensions:
                        group.createDimension(dim, size)
                    names.append(dim)
                kind = str if values.dtype.kind in "OU" else values.dtype
                target = group.createVariable(name, kind, names, fill_value=attrs.get("_FillValue"))
                target.set_auto_maskandscale(False)
                target.set_auto_chartostring(False)
                target.setncatts({key: value for key, value in attrs.items() if key != "_FillValue"})
                target[...] = values
            group.setncatts(attributes)


def _write_in_fork(tree: Tree, path: Path) -> None:
    """Write a tree in a child process: what the library refuses to write is left as it is, half a file."""
    child = os.fork()
    if child == 0:
        try:
            write_tree(tree, path)
        finally:
            os._exit(0)
    os.waitpid(child, 0)


def _any_variable(tree: Tree, chance: random.Random) -> tuple[dict[str, Entry], str]:
    variables = chance.choice([variables for variables, _ in tree.values() if variables])
    return variables, chance.choice(list(variables))


def lose_variable(tree: Tree, chance: random.Random) -> None:
    """Remove a variable."""
    variables, name = _any_variable(tree, chance)
    del variables[name]


def lose_group(tree: Tree, chance: random.Random) -> None:
    """Remove a group with all below it."""
    place = chance.choice([place for place in tree if place != "/"])
    for each in [each for each in tree if each == place or each.startswith(f"{place}/")]:
        del tree[each]


def lose_attribute(tree: Tree, chance: random.Random) -> None:
    """Remove an attribute."""
    attributes = _any_attributes(tree, chance)
    del attributes[chance.choice(list(attributes))]


def _any_attributes(tree: Tree, chance: random.Random) -> dict[str, Any]:
    every = [attributes for _, attributes in tree.values()]
    every += [attrs for variables, _ in tree.values() for _, _, attrs in variables.values()]
    return chance.choice([attributes for attributes in every if attributes])


def change_attribute(tree: Tree, chance: random.Random) -> None:
    """Give an attribute another type or another length."""
    attributes = _any_attributes(tree, chance)
    value = chance.choice(["", "x" * 70000, "\x1b[31m\x07", "é¿\u202e", 1, -1.5, float("nan"), np.arange(9), 2**62])
    attributes[chance.choice([name for name in attributes if name != "_FillValue"] or ["comment"])] = value


def change_numbers(tree: Tree, chance: random.Random) -> None:
    """Put numbers that mean nothing into a variable."""
    variables, name = _any_variable(tree, chance)
    dims, values, attrs = variables[name]
    values = values.copy()
    if values.size:
        place = np.unravel_index(chance.randrange(values.size), values.shape)
        if values.dtype.kind == "f":
            values[place] = chance.choice(
                [np.nan, np.inf, -np.inf, 1e308, -1e300, 5e-324, 0.0, -1.0, 9.969209968386869e36]
            )
        elif values.dtype.kind in "iu":
            limits = np.iinfo(values.dtype)
            values[place] = chance.choice([limits.min, limits.max, -1, 0, 1, 7, 8, 100])
        else:
            values[place] = chance.choice([b"\xff", b"\x00", b"\x1b", b"9", b"/"])
    variables[name] = dims, values, attrs


def change_type(tree: Tree, chance: random.Random) -> None:
    """Give a variable another type."""
    variables, name = _any_variable(tree, chance)
    dims, values, attrs = variables[name]
    attrs = {key: value for key, value in attrs.items() if key != "_FillValue"}
    if values.dtype.kind == "S":
        changed = values.view(np.uint8)
    else:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            changed = values.astype(chance.choice([np.float64, np.int64, np.int8, np.float32, np.uint16, object]))
    if changed.dtype == object:
        changed = np.array([str(value) for value in values.reshape(-1)], dtype=object).reshape(values.shape)
    variables[name] = dims, changed, attrs


def change_shape(tree: Tree, chance: random.Random) -> None:
    """Make a variable longer, shorter, empty, flat or transposed."""
    variables, name = _any_variable(tree, chance)
    dims, values, attrs = variables[name]
    change = chance.choice(["longer", "shorter", "empty", "flat", "turned", "one"])
    if values.ndim == 0:
        values, dims = np.array([values, values]), ("more",)
    elif change == "longer":
        values = np.concatenate([values, values[:1]])
    elif change == "shorter":
        values = values[:-1]
    elif change == "empty":
        values = values[:0]
    elif change == "flat":
        values, dims = values.reshape(-1), dims[:1]
    elif change == "turned":
        values, dims = values.T, dims[::-1]
    else:
        values = values[..., :1]
    variables[name] = dims, values, attrs


def exchange_variables(tree: Tree, chance: random.Random) -> None:
    (first, name), (second, other) = _any_variable(tree, chance), _any_variable(tree, chance)
    first[name], second[other] = second[other], first[name]


def repeat_names(tree: Tree, chance: random.Random) -> None:
    """Give all that stands along a dimension one name, or none."""
    words = [
        (variables, name)
        for variables, _ in tree.values()
        for name, (_, values, _) in variables.items()
        if values.dtype.kind == "S" and values.ndim == 2 and len(values)
    ]
    variables, name = chance.choice(words)
    dims, values, attrs = variables[name]
    same = np.repeat(values[:1], len(values), axis=0)
    variables[name] = dims, chance.choice([same, np.zeros_like(values), np.full_like(values, b"A")]), attrs


TREES: dict[str, Callable[[Tree, random.Random], None]] = {
    "a variable is missing": lose_variable,
    "a group is missing": lose_group,
    "an attribute is missing": lose_attribute,
    "another attribute": change_attribute,
    "other numbers": change_numbers,
    "another type": change_type,
    "another shape": change_shape,
    "variables exchanged": exchange_variables,
    "names repeated": repeat_names,
}


def lie_about_sizes(path: Path, chance: random.Random) -> None:
    """Write a report with a variable that is said to be huge and was never filled."""
    from contactverif.contract import schema

    with netCDF4.Dataset(path, "w") as file:
        file.title, file.schema = schema.TITLE, schema.SCHEMA
        group = chance.choice([file, file.createGroup("summary"), file.createGroup("timing")])
        n_dims = chance.choice([1, 2, 3])
        for axis in range(n_dims):
            group.createDimension(f"d{axis}", chance.choice([2**31 - 1, 2**31, 2**40]) if axis == 0 else 2**16)
        dims = [f"d{axis}" for axis in range(n_dims)]
        group.createVariable("row_verdict", "f8", dims, zlib=True, chunksizes=[1] * n_dims)


def strange_files(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield names that are no reports at all, with a word for each."""
    names = {name: folder / f"{name}.nc" for name in ("text", "empty", "folder", "pipe", "loop", "absent", "classic")}
    names["text"].write_text("title: contactverif\n" * 100)
    names["empty"].write_bytes(b"")
    names["folder"].mkdir(exist_ok=True)
    if not names["pipe"].exists():
        os.mkfifo(names["pipe"])
        os.symlink(names["loop"], names["loop"])
    for format_ in ("NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA"):
        with netCDF4.Dataset(names["classic"], "w", format=format_) as file:
            file.title = "contactverif: what a verification of contact formulations found"
    yield from names.items()
    yield "a device", Path("/dev/zero")
    yield "another device", Path("/dev/null")
    yield "a long name", Path("x" * 300 + ".nc")


def commands(good: Path, file: Path, case: str, chance: random.Random) -> list[list[str]]:
    """Return the command lines to be tried: always the table, and one more."""
    folder, report = file.parent, str(file)
    more = [
        ["report", report, "--out", str(folder / "page.html")],
        ["compare", str(good), report],
        ["compare", report, str(good)],
        ["replay", report],
        ["replay", report, "--case", case],
        ["replay", report, "--case", case, "--out", str(folder / "case.svg")],
        ["draw", report, "--case", case, "--out", str(folder / "case.svg")],
        ["bench", report],
    ]
    return [["report", report], chance.choice(more)]


class Damage(Campaign):
    """Damaged reports, and the commands that read them."""

    kinds = (*BYTES, *TREES, "a size that lies")

    def __init__(self, folder: Path, properties: Sequence[str] = PROPERTIES) -> None:
        super().__init__(folder)
        import_everything()
        self.good = folder / "good.nc"
        self.case = write_report(self.good, properties)
        self.whole, self.tree = self.good.read_bytes(), read_tree(self.good)
        self._undamaged: dict[tuple[str, ...], Ending] = {}

    def damaged_file(self, kind: str, chance: random.Random) -> Path:
        """Return the path of a file with that kind of damage."""
        path = self.folder / "report.nc"
        path.unlink(missing_ok=True)
        if kind in BYTES:
            path.write_bytes(BYTES[kind](self.whole, chance))
        elif kind in TREES:
            tree: Tree = {place: (dict(entries), dict(attrs)) for place, (entries, attrs) in self.tree.items()}
            for variables, _ in tree.values():
                variables.update({name: (d, v, dict(a)) for name, (d, v, a) in variables.items()})
            TREES[kind](tree, chance)
            _write_in_fork(tree, path)
        else:
            lie_about_sizes(path, chance)
        return path

    def attack(self, kind: str, chance: random.Random, name: str = "") -> str:
        """Make one damaged file, and try commands on it."""
        path = self.damaged_file(kind, chance)
        content, word = path.read_bytes(), ""
        for arguments in commands(self.good, path, self.case, chance):
            title = f"{name}: {' '.join(map(repr, arguments))}"
            undamaged = self._end_undamaged(tuple(arguments))
            word = self.judge_file(kind, run_command(arguments), undamaged, title, f"{name}.nc", content)
        return word

    def _end_undamaged(self, arguments: tuple[str, ...]) -> Ending:
        """Return how the command ends on the file before it was damaged."""
        if arguments not in self._undamaged:
            path = self.folder / "report.nc"
            content = path.read_bytes()
            path.write_bytes(self.whole)
            self._undamaged[arguments] = run_command(arguments)
            path.write_bytes(content)
        return self._undamaged[arguments]

    def begin(self) -> None:
        """Try all commands on what is no report at all."""
        for kind, path in strange_files(self.folder):
            for command in (["report"], ["replay"], ["compare", str(self.good)], ["bench"]):
                arguments = [*command, str(path)]
                title = f": {' '.join(map(repr, arguments))}"
                self.judge_file(f"no report: {kind}", run_command(arguments), Ending(), title, "", b"")


def import_everything() -> None:
    """Import what the commands import, once and not in each fork."""
    for name in ("cli.compare", "cli.replay"):
        importlib.import_module(f"contactverif.{name}")
    for name in ("html.report_page", "netcdf.bench_file"):
        importlib.import_module(f"contactverif_reports.{name}")


if __name__ == "__main__":
    main(Damage)
