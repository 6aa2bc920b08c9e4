"""The page of the reference paper: its statements, what was found, and the figures, all from reports/paper.

Rule: the facts are those of `paper.nc`. A statement or figure that is added there appears here without a change.
"""

from __future__ import annotations

import re
from pathlib import Path

import xarray as xr
from page_text import plain, table
from repository_pages import relink

FOLDER = Path("reports") / "paper"


def paper_figures(root: Path) -> dict[str, Path]:
    """Return {path in the site: file} of the kept figures."""
    return {f"paper/{path.name}": path for path in sorted((root / FOLDER).glob("*.svg"))}


def paper_page(root: Path) -> str:
    """Return the page: what the paper is, every statement beside what was found, and every figure."""
    readme = relink((root / FOLDER / "README.md").read_text(encoding="utf-8"), "reports/paper/README.md")
    with xr.open_datatree(root / FOLDER / "paper.nc") as tree:
        statements = tree["statements"].to_dataset().load()
    meanings = str(statements.verdict.attrs["flag_meanings"]).split()
    verdicts = [meanings[int(code)] for code in statements.verdict.values]
    count = ", ".join(f"{word.replace('_', ' ')} {verdicts.count(word)}" for word in meanings if word in verdicts)
    rows = [
        [str(figure), plain(str(says)), plain(str(result)), f"**{word.replace('_', ' ')}**"]
        for figure, says, result, word in zip(
            statements.figure.values, statements.says.values, statements.found.values, verdicts, strict=True
        )
    ]
    text = [
        _introduction(readme),
        "## What the paper states\n",
        f"{len(rows)} statements: {count}.\n",
        table(["in the paper", "the paper says", "computed here", "result"], rows),
        "## Figures\n",
    ]
    for path in paper_figures(root):
        name = Path(path).stem
        label = re.sub(r"^fig0?(\d+)", r"Fig. \1", name).replace("-", ": ", 1)
        text.append(f"### {label[0].upper() + label[1:]}\n\n![{label}]({Path(path).name})\n")
    return "\n".join(text)


def _introduction(readme: str) -> str:
    """Return the README of the folder up to its first heading below the title, without its code."""
    return re.split(r"^(?:## |```)", readme, maxsplit=1, flags=re.MULTILINE)[0].rstrip() + "\n"
