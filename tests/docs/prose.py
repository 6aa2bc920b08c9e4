"""Numbers in sentences and tables of the pages: each is a quotation. `python tests/docs/prose.py` writes them anew.

A comment stands right behind a number, and says where it is from; it is the inside of a replacement field of Python:

    475<!--=read("bench/fine_waves.csv").segments.max()--> slave segments

It has no space, so that a number and its comment are one word, and no bar, so that it may stand in a table. Before a
table whose rows are quoted stands a comment that names a function below:

    <!--table:steps()-->

An expression may use what this file defines. `read` gives what a file of `reports` holds, `code("module:name")` what
the code has by that name.

Rules for the next editor: nothing here computes what takes seconds, and no sentence has a number that a file holds too.
"""

import re
import sys
from collections.abc import Iterable, Sequence
from functools import cache
from importlib import import_module
from math import log
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unicodedata import normalize

import pandas as pd
import xarray as xr
from quotes import ROOT, pages

from contactverif import judge_case, load_formulation, load_properties
from contactverif.contract.property import checked_numbers
from contactverif.plugins.registry import formulation_names, the_property
from contactverif_reports.bench_costs import ratios_at
from contactverif_reports.netcdf.bench_file import read_bench

REPORTS = ROOT / "reports"
OTHERS = ("plugins/README.md", "properties/README.md", "reports/*/README.md")
PAGES = (*pages(), *(page for name in OTHERS for page in sorted(ROOT.glob(name))))
WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
MARK = re.compile(r"<!--(?:=|table:)")
NUMBER = re.compile(r"([\w.,+−-]+)([`*]*<!--=(\S+?)-->)")
TABLE = re.compile(r"^(<!--table:(\S+)-->\n(?:\|.*\n){2})((?:\|.*\n)*)", re.MULTILINE)
Cells = Iterable[Sequence[str]]


@cache
def _read(path: Path) -> Any:
    if path.name == "bench.nc":
        return read_bench(path)
    if path.suffix == ".nc":
        return xr.open_datatree(path).load()
    return pd.read_csv(path).rename(columns=lambda head: re.sub(r"\W+|^(?=\d)", "_", normalize("NFKC", head)))


def read(name: str) -> Any:
    """Return what a file of `reports` holds: a table, with _ in its heads for what is in no name; or groups."""
    return _read(REPORTS / name)


OTHER = "kratos:search=radius,search_factor=10000,normals=updated,augmentation=1e-6"


def answer(name: str, question: str) -> Any:
    """Return the line of a code or a library for a question."""
    lines = pd.concat([read("findings/engines.csv"), read("findings/libraries.csv")])
    return next(lines[(lines.engine == name) & (lines.question == question)].itertuples())


def code(name: str) -> Any:
    """Return what `module:name` is in the code."""
    module, _, attribute = name.partition(":")
    return getattr(import_module(module), attribute)


def short(value: float) -> str:
    """Return two digits of a number as sentences write it: 7.8e-2, or 7.8e2."""
    return re.sub(r"e\+?(-?)0?", r"e\1", f"{value:.1e}")


def ratio(name: str) -> str:
    """Return the seconds of an evaluation over those of VTS-PPT, at 1 % in the forces of wavy half-planes."""
    return ratios_at(read("bench/bench.nc"), "wavy", 1e-2, "evaluation")[name].text.split()[0]


def fig30(rule: int) -> list[int]:
    """Return the iterations of the basic VTS-PPT in Fig. 30, up to one of the rules when to stop."""
    counts = read("paper/paper.nc")["fig30_convergence/iterations"].sel(formulation="vts-ppt-basic")
    return [int(count) for count in counts.values[rule]]


@cache
def most_in_space() -> int:
    """Return how many properties a formulation on faces is asked at most."""
    formulations = [load_formulation(name) for name in formulation_names() if name.endswith("-3d")]
    in_space = [prop for prop in load_properties() if prop.cases_in_space is not None]
    return max(
        sum(not (prop.for_traits(each.traits).refusal_of(each) or prop.needs - each.provides) for prop in in_space)
        for each in formulations
    )


def accuracy(formulation: str, case: str, name: str = "wavy") -> SimpleNamespace:
    """Return the numbers of a case of `accuracy.NAME`."""
    return solution(formulation, f"accuracy.{name}", case)


@cache
def solution(formulation: str, name: str, case: str) -> SimpleNamespace:
    """Return the numbers of the one case of a property whose name begins so, without spaces. It is solved here."""
    prop = the_property(name)
    (scene,) = (each for each in prop.cases(None) if each.name.replace(" ", "").startswith(case))
    measurement = judge_case(prop, scene, load_formulation(formulation)).measurement
    numbers = checked_numbers(prop.info, measurement)
    return SimpleNamespace(**{number.quantity.name.replace(" ", "_"): number.value for number in numbers})


def power(race: str, name: str) -> float:
    """Return the power of the number of segments with which the time of an evaluation grows from 1e4 to 1e6."""
    times = read(f"bench/{race}.csv").set_index(["formulation", "segments"])["median_µs".replace("µ", "μ")][name]
    return 1 + log(times[10**6] / times[10**4]) / log(100)


def race(name: str, digits: int) -> Cells:
    """Iterate over the rows of a race: faster than the peer, with the extremes on faces, time and memory."""
    for formulation, rows in read(f"bench/{name}.csv").groupby("formulation", sort=False):
        at = {row.segments: row for row in rows.itertuples()}
        cells = [f"{at[size].faster_median:.1f}" for size in (10**3, 10**4, 10**5)]
        if name == "faces" and not formulation.startswith("ipctk"):
            extremes = [(at[size].faster_than_ipctk_least, at[size].faster_greatest) for size in (10**3, 10**4, 10**5)]
            cells = [f"{cell} ({least:.1f} to {most:.1f})" for cell, (least, most) in zip(cells, extremes, strict=True)]
        time, memory = at[10**4].median_μs, at[10**5].peak_bytes
        yield f"`{formulation.removesuffix(' on faces')}`", *cells, f"{time:.{digits}f}", f"{memory:.0f}"


def steps() -> Cells:
    """Iterate over the rows of the steps of an evaluation at 10,000 segments."""
    for step, _, seconds, *_ in read("bench/steps.csv").values:
        if step in ("search and walk, with a tree", "which nodes feel which", "pattern of the tangent", "memory bound"):
            yield step.partition(",")[0], f"{seconds:.2f}"
        elif step == "forces and tangent":
            yield step, f"{seconds:.2f}"


def fine_waves(segments: int) -> Cells:
    """Iterate over the rows of one mesh of fine wavy half-planes."""
    for row in read("bench/fine_waves.csv").itertuples():
        if row.segments == segments:
            yield f"`{row.formulation}`", str(row.forces), str(row.systems)


SCENES = {
    "patch.flat.solve": "flat patch, at two penalties",
    "patch.curved": "two rings, two meshes",
    "patch.kinked": "zigzag, with two and three normals",
    "accuracy.wavy": "two wavy half-planes, four meshes",
    "accuracy.hertz": "Hertz in a box, finest mesh",
    "newton.attainable": "solved far from the origin, at five places",
}


def scene_work() -> Cells:
    """Iterate over the rows of what the judge does for each kind of scene, and the least that would do."""
    work = read("bench/scene_work.csv").set_index("property_id")
    for name, kind in SCENES.items():
        row = work.loc[name]
        pairs = (row.assembled, row.least_bodies), (row.facets, row.touching_facets), (row.unknowns, row.least_unknowns)
        yield kind, *(f"{number} ({least})" for number, least in pairs), str(row.all_unknowns)


METHODS = {
    "engine/control": "control",
    "engine/calculix": "CalculiX, surface to surface",
    "engine/calculix:kind=nodes": "CalculiX, node to surface",
    "engine/kratos:search=radius,normals=updated,augmentation=1e-6": "Kratos, the other search and normals, hardly any "
    "augmentation",
    "vts-g:n=3": "`vts-g:n=3`, Gauss points",
    "engine/ngsolve": "NGSolve",
    "engine/ngsolve:order=15": "NGSolve, order 15",
}


def hertz(scene: str) -> Cells:
    """Iterate over the rows of the errors of nodal forces on four Hertz meshes."""
    for row in read("findings/hertz.csv").itertuples():
        if row.scene == scene:
            errors = (re.sub("e-0?", "e-", f"{error:.3e}") for error in row[3:7])
            yield METHODS.get(row.formulation, f"`{row.formulation}`"), *errors


def hertz_difference() -> float:
    """Return the largest difference of a code from the formulation before it, which has its method, over its errors."""
    table = read("findings/hertz.csv")
    ours = table.iloc[:, 2:6].where(~table.formulation.str.startswith("engine/")).ffill()
    return float((table.iloc[:, 2:6] / ours - 1).abs().max(axis=None))


def flat_rates() -> Cells:
    """Iterate over the rows of the rates on wavy bodies whose meshes are about as fine."""
    for name in ("sts", "mortar", "vts-ppt", "vts-me", "nts-ar"):
        numbers = accuracy(name, "upperslave,10E")
        rates = f"{numbers.rate_of_forces:.2f}", f"{numbers.rate_of_pressures:.2f}"
        yield f"`{name}`", *rates, short(numbers.pressure_error_on_the_finest_mesh)


def fine_and_coarse() -> Cells:
    """Iterate over the rows of the rates of forces on wavy bodies of which one is four times finer."""
    for name in ("sts", "mortar", "mortar-dual", "vts-ppt", "vts-me", "vts-me:n=12", "nts-ar"):
        finer, coarser = (accuracy(name, f"{word}slave") for word in ("finer", "coarser"))
        rates = f"{finer.rate_of_forces:.2f}", f"{coarser.rate_of_forces:.2f}"
        yield f"`{name}`", *rates, short(coarser.pressure_error_on_the_finest_mesh)


def stability() -> pd.DataFrame:
    """Return the error over u κ, and that of a force, by formulation and state; none where it was not asked."""
    groups = (read("stability/stability.nc")[f"stability/{name}"].to_dataset() for name in ("sweep", "stiffness"))
    frames = [
        xr.Dataset({
            "state": group.case_name,
            "error": group.value.isel(quantity=0, drop=True),
            "force": group.detail_value.sel(detail="force error", drop=True),
        }).to_dataframe()
        for group in groups
    ]  # fmt: skip
    return pd.concat(frames).dropna().reset_index().sort_index()


def largest_errors() -> Cells:
    """Iterate over the rows of the largest errors: formulation, how many states, error over u κ, state."""
    for name, rows in stability().groupby("formulation", sort=False):
        worst = rows.loc[rows.error.idxmax()]
        yield f"`{name}`", str(len(rows)), f"{worst.error:.2g}", f"`{worst.state}`"


def stability_sweeps() -> Cells:
    """Iterate over the rows of the errors over u κ in some states, and of the error of the forces in one of them."""
    states = "gap-1e-2", "gap-1e-9", "offset-1e6", "offset-1e6-gap-1e-6", "ratio-1e-6", "all"
    for name, rows in stability().groupby("formulation", sort=False):
        most = rows.groupby(rows.state.str.removesuffix("-a").str.removesuffix("-b"))[["error", "force"]].max()
        yield f"`{name}`", *(f"{most.error[state]:.2g}" for state in states), f"{most.force[states[3]]:.2g}"


def _write(value: Any) -> str:
    return re.sub("^-0[.]0*$", lambda zero: zero[0][1:], str(value)).replace("-", "−", str(value).startswith("-"))


def renew(text: str) -> str:
    """Return the text of a page with its numbers and the rows of its quoted tables anew."""

    def number(match: re.Match[str]) -> str:
        return _write(eval(f'f"""{{{match[3]}}}"""', globals())) + match[2]

    def table(match: re.Match[str]) -> str:
        return match[1] + "".join(f"| {' | '.join(map(_write, row))} |\n" for row in eval(match[2], globals()))

    missing = len(MARK.findall(text)) - len(NUMBER.findall(text)) - len(TABLE.findall(text))
    if missing:
        raise ValueError(f"{missing} comments have no number before them or no table behind them")
    return TABLE.sub(table, NUMBER.sub(number, text))


def differences(page: Path) -> list[str]:
    """Return the lines of a page that say something else than their sources, beside what they should be."""
    text = page.read_text(encoding="utf-8")
    lines = zip(text.splitlines(), renew(text).splitlines(), strict=False)
    return [f"{page.relative_to(ROOT)}: {old} -> {new}" for old, new in lines if old != new]


if __name__ == "__main__":
    for page in [Path(name).resolve() for name in sys.argv[1:]] or PAGES:
        print(*differences(page), sep="\n", end="")
        page.write_text(renew(page.read_text(encoding="utf-8")), encoding="utf-8")
