"""Write `reports/trust/README.md` and its figure from the tables that the studies of this folder keep beside it."""

from __future__ import annotations

import csv
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

FOLDER = Path(__file__).parents[2] / "reports" / "trust"
SURVIVES = "survives: "

INTRODUCTION = """# Trust

A verifier must catch what is wrong, and never accuse what is right. `tox -e trust` measures both, and wrote this page.

"""
CAMPAIGN = """## Nobody who is right is accused

{cases:,} random cases over {formulations} formulations that are right, with seeds {seeds}: {accusations} accusations.
*Nearest* is the largest number over its tolerance in a case that passes, and the formulation that came so near. *Idle*
cases have nothing in contact. The named cases of finite lists are the same for every seed; the tests run them all.

"""
KILLS = """## Who catches whom

{mutants} formulations are wrong on purpose. Each row of the figure is one of them, each column a property: dark where
it is the one that is meant to catch it, light where it does so too. {survivors} more survive, and wait for a property.

![Mutants against properties](kills.svg)

The table counts the mutants that each property is meant to catch, those that it catches, and those that no other
property catches. Properties with random cases had 20 of them, those with bodies and those with finite lists one.

"""
SMALLEST = """## How small an error is caught

An error of a kind and a relative size was planted in a formulation that is right. The table has the smallest size, a
power of ten, that each property caught; where a cell is empty, it does not look at that.

"""


def read(name: str) -> list[dict[str, str]]:
    """Return the lines of a table that is kept beside the page."""
    with (FOLDER / name).open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def table(heads: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown, its first column to the left."""
    lines = [f"| {' | '.join(heads)} |", f"|---|{'--:|' * (len(heads) - 1)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def campaign() -> str:
    """Return the part about formulations that are right."""
    rows = read("campaign.csv")
    text = CAMPAIGN.format(
        cases=sum(int(row["cases"]) for row in rows),
        formulations=max(int(row["formulations"]) for row in rows),
        seeds=rows[0]["seeds"].replace(" ", ", "),
        accusations=sum(int(row["accusations"]) for row in rows) or "no",
    )
    lines = [
        [
            f"`{row['property']}`",
            row["cases"],
            row["accusations"],
            *(f"{int(row[share]) / max(int(row['cases']), 1):.1%}" for share in ("undecided", "idle")),
            f"{float(row['nearest']):.2g}",
            f"`{row['formulation']}`" if row["formulation"] else "",
        ]
        for row in rows
    ]
    return text + table(["property", "cases", "accused", "undecided", "idle", "nearest", "by"], lines)


def caught_by_property() -> dict[str, tuple[int, int, int]]:
    """Return {property: mutants it is meant to catch, mutants it catches, mutants that it alone catches}."""
    rows = [row for row in read("kills.csv") if not row["mutant"].startswith(SURVIVES)]
    ids = [name for name in rows[0] if name not in ("mutant", "caught by")]
    return {
        name: (
            sum(row["caught by"] == name for row in rows),
            sum(bool(row[name]) for row in rows),
            sum(bool(row[name]) and not any(row[other] for other in ids if other != name) for row in rows),
        )
        for name in ids
    }


def kills() -> str:
    """Return the part about formulations that are wrong."""
    survivors = sum(row["mutant"].startswith(SURVIVES) for row in read("kills.csv"))
    text = KILLS.format(mutants=len(read("kills.csv")) - survivors, survivors=survivors)
    lines = [[f"`{name}`", *map(str, counts)] for name, counts in caught_by_property().items()]
    return text + table(["property", "meant to catch", "catches", "alone"], lines)


def smallest() -> str:
    """Return the part about the sizes of errors."""
    rows = read("smallest_errors.csv")
    kinds = [name for name in rows[0] if name not in ("property", "carrier")]
    lines = [
        [f"`{row['property']}`", *(f"1e-{row[kind]}" if row[kind] else "" for kind in kinds)]
        for row in rows
        if any(row[kind] for kind in kinds)
    ]
    return SMALLEST + '<div class="wide" markdown>\n\n' + table(["property", *kinds], lines) + "\n</div>\n"


def page() -> str:
    """Return the whole page."""
    return INTRODUCTION + "\n".join([campaign(), kills(), smallest()])


def draw() -> None:
    """Draw the kill matrix."""
    rows = [row for row in read("kills.csv") if not row["mutant"].startswith(SURVIVES)]
    ids = [name for name in rows[0] if name not in ("mutant", "caught by")]
    rows.sort(key=lambda row: ids.index(row["caught by"]))
    shades = np.array([[(row["caught by"] == name) + 0.45 * bool(row[name]) for name in ids] for row in rows])
    mpl.rcParams.update({"svg.hashsalt": "contactverif", "svg.fonttype": "none"})
    figure, axes = plt.subplots(figsize=(0.16 * len(ids) + 1, 0.045 * len(rows) + 2.4), layout="constrained")
    axes.imshow(np.minimum(shades, 1), cmap="Blues", vmin=0, vmax=1.15, aspect="auto", interpolation="nearest")
    axes.set_xticks(range(len(ids)), ids, rotation=90, fontsize=6)
    axes.set_yticks([])
    axes.set_ylabel(f"{len(rows)} wrong formulations")
    for side in axes.spines.values():
        side.set_visible(False)
    figure.savefig(FOLDER / "kills.svg", metadata={"Date": None})


if __name__ == "__main__":
    (FOLDER / "README.md").write_text(page(), encoding="utf-8")
    draw()
