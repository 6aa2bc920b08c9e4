"""Numbers in sentences and tables of the pages: each is a quotation. `python tests/docs/prose.py` writes them anew.

A comment stands right behind a number, and says where it is from; it is the inside of a replacement field of Python:

    145,275<!--=sum(trust.campaign.cases):,--> random cases

It has no space, so that a number and its comment are one word, and no bar, so that it may stand in a table. Before a
table whose rows are quoted stands a comment that names a function below:

    <!--table:race()-->

An expression may use what this file defines: `trust`, `bench` and `findings` are folders of `reports`, with a table for
each CSV file. `trust.campaign.cases` is a column, `bench.kernels("vts-ppt",10000)` is the row that begins so.
`paper` is a group of the reference paper's results, `code("module:name")` is what the code has by that name.

Rules for the next editor: nothing here computes what takes seconds, and no sentence has a number that a file holds too.
"""

import csv
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from math import log
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unicodedata import normalize

import xarray as xr
from quotes import ROOT, pages

from contactverif import judge_case, load_formulation
from contactverif.contract.property import checked_numbers
from contactverif.plugins.registry import the_property
from contactverif_reports.bench_costs import ratios_at
from contactverif_reports.bench_results import BenchResults
from contactverif_reports.netcdf.bench_file import read_bench

REPORTS = ROOT / "reports"
NAMES = ("plugins/README.md", "properties/README.md", "reports/*/README.md", "CONTRIBUTING.md")
PAGES = (*pages(), *(page for name in NAMES for page in sorted(ROOT.glob(name))))
WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
_MARK = re.compile(r"<!--(?:=|table:)")
NUMBER = re.compile(r"([\w.,+−-]+)([`*]*<!--=(\S+?)-->)")
_TABLE = re.compile(r"^(<!--table:(\S+)-->\n)((?:\|.*\n)+)", re.MULTILINE)


def plain(cell: str) -> Any:
    """Return the number in a cell of a table, or its text."""
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            pass
    return cell


@dataclass(frozen=True)
class Table:
    """A CSV file. Its columns and the fields of its rows are called by their heads, with _ for what is in no name."""

    heads: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def __getattr__(self, head: str) -> list[Any]:
        """Return a column."""
        return [row[self.heads.index(head)] for row in self.rows]

    def __iter__(self) -> Iterator[SimpleNamespace]:
        return (SimpleNamespace(**dict(zip(self.heads, row, strict=True))) for row in self.rows)

    def __call__(self, *begin: Any) -> SimpleNamespace:
        """Return the one row that begins so."""
        (index,) = (number for number, row in enumerate(self.rows) if row[: len(begin)] == begin)
        return list(self)[index]


@cache
def read_table(path: Path) -> Table:
    """Return the table of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        heads, *rows = csv.reader(file)
    names = (re.sub(r"\W+|^(?=\d)", "_", normalize("NFKC", head)) for head in heads)  # As Python writes names.
    return Table(tuple(names), tuple(tuple(map(plain, row)) for row in rows))


@dataclass(frozen=True)
class Folder:
    """A folder of `reports`, whose CSV files are its attributes."""

    name: str

    def __getattr__(self, table: str) -> Table:
        return read_table(REPORTS / self.name / f"{table}.csv")


trust, bench, findings = (Folder(name) for name in ("trust", "bench", "findings"))


@cache
def read_results(path: Path) -> BenchResults:
    """Return the results of a bench."""
    return read_bench(path)


@cache
def open_tree(path: Path) -> xr.DataTree:
    """Return what a netCDF file holds."""
    return xr.open_datatree(path).load()


def paper(group: str) -> xr.Dataset:
    """Return a group of the reference paper's results."""
    return open_tree(REPORTS / "paper" / "paper.nc")[group].to_dataset()


def fig30(rule: int) -> list[int]:
    """Return the iterations of the basic VTS-PPT in Fig. 30, up to one of the rules when to stop."""
    counts = paper("fig30_convergence").iterations.sel(formulation="vts-ppt-basic").astype(int)
    return [int(count) for count in counts.values[rule]]


def code(name: str) -> Any:
    """Return what `module:name` is in the code."""
    module, _, attribute = name.partition(":")
    return getattr(import_module(module), attribute)


def minus(text: str) -> str:
    """Return a number with the sign of sentences, and none of zero."""
    return text.replace("-", "−", 1).replace("−0.00", "0.00") if text.startswith("-") else text


def short(value: float, digits: int = 1) -> str:
    """Return a number as sentences write it: 7.8e-2."""
    return minus(re.sub(r"e([+-])0?", lambda match: "e" + match[1].strip("+"), f"{value:.{digits}e}"))


def ratio(name: str, target: float = 1e-2) -> str:
    """Return the seconds of an evaluation over those of VTS-PPT, at an error of the forces of wavy half-planes."""
    return ratios_at(read_bench(REPORTS / "bench" / "bench.nc"), "wavy", target, "evaluation")[name].text.partition(
        " "
    )[0]


def power(race: Table, name: str) -> float:
    """Return the power of the number of segments with which the time of an evaluation grows from 1e4 to 1e6."""
    return 1 + log(race(name, 10**6).median_µs / race(name, 10**4).median_µs) / log(100)


def race() -> list[list[str]]:
    """Return the rows of the race on segments."""
    table, rows = bench.kernels, []
    for name in dict.fromkeys(table.formulation):
        at = {size: table(name, size) for size in (10**3, 10**4, 10**5)}
        ratios = [f"{each.faster_median:.1f}" for each in at.values()]
        rows.append([f"`{name}`", *ratios, f"{at[10**4].median_µs:.2f}", f"{at[10**5].peak_bytes:.0f}"])
    return rows


def race_on_faces() -> list[list[str]]:
    """Return the rows of the race on faces: medians, and the least and greatest of those that are not the peer."""
    table, rows = bench.faces, []
    for name in dict.fromkeys(table.formulation):
        at = {size: table(name, size) for size in (10**3, 10**4, 10**5)}
        ratios = [
            f"{each.faster_median:.1f} ({each.faster_than_ipctk_least:.1f} to {each.faster_greatest:.1f})"
            if each.faster_than_ipctk_least < each.faster_greatest
            else f"{each.faster_median:.1f}"
            for each in at.values()
        ]
        label = re.sub(r"^([\w-]+)", r"`\1`", name.removesuffix(" on faces"))
        rows.append([label, *ratios, f"{at[10**4].median_µs:.1f}", f"{at[10**5].peak_bytes:.0f}"])
    return rows


def steps() -> list[list[str]]:
    """Return the rows of the steps of an evaluation at 10,000 segments."""
    names = {"search and walk, with a tree": "search and walk"}
    shown = ("search and walk, with a tree", "which nodes feel which", "pattern of the tangent", "forces and tangent")
    return [[names.get(step, step), f"{bench.steps(step)._10000:.2f}"] for step in (*shown, "memory bound")]


def fine_waves(segments: int) -> list[list[str]]:
    """Return the rows of the largest meshes of wavy half-planes."""
    rows = [row for row in bench.fine_waves if row.segments == segments]
    return [[f"`{row.formulation}`", str(row.forces), str(row.systems)] for row in rows]


def stability(group: str = "/") -> xr.Dataset:
    """Return a group of the report of the stability figure."""
    return open_tree(REPORTS / "stability" / "stability.nc")[group].to_dataset()


@cache
def stability_errors(file: Path) -> dict[str, dict[str, tuple[float, float]]]:
    """Return {formulation: {state: (error in u κ, relative error of a force)}}."""
    errors: dict[str, dict[str, tuple[float, float]]] = {}
    for name in ("sweep", "stiffness"):
        group = open_tree(file)[f"stability/{name}"].to_dataset()
        forces = group.detail_value.sel(detail="force error").values
        for index, formulation in enumerate(group.formulation.values):
            rows = zip(group.case_name.values[index], group.value.values[index, :, 0], forces[index], strict=True)
            known = {str(state): (error, force) for state, error, force in rows if error == error}  # NaN: not asked.
            errors.setdefault(str(formulation), {}).update(known)
    return errors


def stability_rows() -> dict[str, dict[str, tuple[float, float]]]:
    return stability_errors(REPORTS / "stability" / "stability.nc")


def below_roundoff() -> int:
    """Return how many formulations have all errors below u κ."""
    return sum(max(errors.values())[0] <= 1 for errors in stability_rows().values())


def largest_errors() -> list[list[str]]:
    """Return the rows of the largest errors: formulation, how many states, error in u κ, state."""
    rows = []
    for name, errors in stability_rows().items():
        worst = max(errors, key=lambda state: errors[state])
        rows.append([f"`{name}`", str(len(errors)), f"{errors[worst][0]:.2g}", f"`{worst}`"])
    return rows


STATES = ("gap-1e-2", "gap-1e-9", "offset-1e6", "offset-1e6-gap-1e-6", "ratio-1e-6", "all")


def stability_sweeps() -> list[list[str]]:
    """Return the rows of the errors in u κ in some states, and of the relative error of the forces in one of them."""
    rows = []
    for name, errors in stability_rows().items():
        at = [max(errors[f"{state}-{letter}"][0] for letter in "ab") for state in STATES]
        force = max(errors[f"{STATES[3]}-{letter}"][1] for letter in "ab")
        rows.append([f"`{name}`", *(f"{value:.2g}" for value in at), re.sub("e-0?", "e-", f"{force:.2g}")])
    return rows


@cache
def accuracy(formulation: str, case: str, name: str = "wavy") -> SimpleNamespace:
    """Return quantities and details of the one case of `accuracy.NAME` whose name begins so; it is solved here."""
    prop = the_property(f"accuracy.{name}")
    (asked,) = (each for each in prop.cases(None) if each.name.replace(" ", "").startswith(case))
    measurement = judge_case(prop, asked, load_formulation(formulation)).measurement
    numbers = {number.quantity.name: number.value for number in checked_numbers(prop.info, measurement)}
    return SimpleNamespace(**{head.replace(" ", "_"): value for head, value in numbers.items()})


def flat_rates() -> list[list[str]]:
    """Return the rows of the rates on wavy bodies whose meshes are about as fine."""
    rows = []
    for name in ("sts", "mortar", "vts-ppt", "vts-me", "nts-ar"):
        found = accuracy(name, "upperslave,10E")
        rates = (minus(f"{rate:.2f}") for rate in (found.rate_of_forces, found.rate_of_pressures))
        rows.append([f"`{name}`", *rates, short(found.pressure_error_on_the_finest_mesh)])
    return rows


def fine_and_coarse() -> list[list[str]]:
    """Return the rows of the rates of forces on wavy bodies of which one is four times finer."""
    rows = []
    for name in ("sts", "mortar", "mortar-dual", "vts-ppt", "vts-me", "vts-me:n=12", "nts-ar"):
        finer, coarser = (accuracy(name, f"{word}slave") for word in ("finer", "coarser"))
        rates = (minus(f"{each.rate_of_forces:.2f}") for each in (finer, coarser))
        rows.append([f"`{name}`", *rates, short(coarser.pressure_error_on_the_finest_mesh)])
    return rows


SCENES = {
    "flat patch, at two penalties": "patch.flat.solve",
    "flat, tilted or sliding interface": "",
    "two rings, two meshes": "patch.curved",
    "zigzag, with two and three normals": "patch.kinked",
    "two wavy half-planes, four meshes": "accuracy.wavy",
    "Hertz in a box, four meshes": "accuracy.hertz",
    "solved far from the origin, at five places": "newton.attainable",
}


def scene_work() -> list[list[str]]:
    """Return the rows of what the judge does for each kind of scene."""
    rows = []
    for kind, name in SCENES.items():
        row = bench.scene_work(name) if name else None
        cells = (
            ["0 (0)", "no solution", "", ""]
            if row is None
            else [
                f"{row.assembled} ({row.least_bodies})",
                f"{row.facets} ({row.touching_facets})",
                f"{row.unknowns} ({row.least_unknowns})",
                str(row.all_unknowns),
            ]
        )
        rows.append([kind, *cells])
    return rows


def evaluate(expression: str) -> str:
    """Return what a replacement field gives."""
    return str(eval(f'f"""{{{expression}}}"""', globals()))  # The pages are ours, as this file is.


def renew(text: str) -> str:
    """Return the text of a page with its numbers and quoted tables anew."""

    def rows_of(match: re.Match[str]) -> str:
        head = "".join(match[3].splitlines(keepends=True)[:2])
        return match[1] + head + "".join(f"| {' | '.join(row)} |\n" for row in eval(match[2], globals()))

    known = len(NUMBER.findall(text)) + len(_TABLE.findall(text))
    if known != len(_MARK.findall(text)):
        raise ValueError(f"{len(_MARK.findall(text)) - known} comments have no number or no table")
    return _TABLE.sub(rows_of, NUMBER.sub(lambda match: evaluate(match[3]) + match[2], text))


def differences(page: Path) -> list[str]:
    """Return the lines of a page that say something else than their sources, beside what they should be."""
    text = page.read_text(encoding="utf-8")
    lines = zip(text.splitlines(), renew(text).splitlines(), strict=False)
    return [f"{page.name}: {old} -> {new}" for old, new in lines if old != new]


def main(names: Sequence[str]) -> None:
    """Write numbers anew into some pages, or all."""
    for page in [Path(name).resolve() for name in names] or PAGES:
        print(*differences(page), sep="\n", end="")
        page.write_text(renew(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
