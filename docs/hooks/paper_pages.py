"""The page of the reference paper: its figures and statements, and what was computed, all from reports/paper.

Rule: the facts are those of `paper.nc`. A statement or figure that is added there appears here without a change.
"""

from __future__ import annotations

import re
from pathlib import Path

import xarray as xr
from page_text import table
from repository_pages import relink

from contactverif.explanations.terms import plain, sentence

FOLDER = Path("reports") / "paper"


def paper_figures(root: Path) -> dict[str, Path]:
    """Return {path in the site: file} of the kept figures."""
    return {f"paper/{path.name}": path for path in sorted((root / FOLDER).glob("*.svg"))}


def paper_page(root: Path) -> str:
    """Return the page: what the paper is, every statement beside what was computed, and every figure."""
    readme = relink((root / FOLDER / "README.md").read_text(encoding="utf-8"), "reports/paper/README.md")
    with xr.open_datatree(root / FOLDER / "paper.nc") as tree:
        statements = tree["statements"].to_dataset().load()
        figures = tree["figures"].to_dataset()
        captions = dict(zip(map(str, figures["name"].values), map(str, figures["caption"].values), strict=True))
    attributes = statements.agreement.attrs
    words = [word.replace("_", " ") for word in str(attributes["flag_meanings"]).split()]
    meanings = dict(zip(attributes["flag_values"].tolist(), words, strict=True))
    verdicts = [meanings[int(code)] for code in statements.agreement.values]
    counts = [(word, verdicts.count(word)) for word in words]
    conditions = statements.condition.values
    rows = []
    for number, verdict in enumerate(verdicts):
        place, claim, result = (str(statements[name].values[number]) for name in ("place", "claim", "result"))
        condition = f"<br>*{plain(str(conditions[number]))}*" if conditions[number] else ""
        rows.append([place, sentence(plain(claim)), sentence(plain(result)), f"**{verdict}**{condition}"])
    text = [
        _introduction(readme),
        "## What the paper states\n",
        f"{len(rows)} statements: {', '.join(f'{word} {count}' for word, count in counts if count)}.\n",
        table(["in the paper", "the paper says", "computed here", "agreement"], rows),
        "## Figures\n",
    ]
    for path in paper_figures(root):
        name = Path(path).stem
        label = re.sub(r"^fig0?(\d+)", r"Fig. \1", name).replace("-", " ")
        title = label[0].upper() + label[1:]
        caption = sentence(plain(captions[name]))
        text.append(f"### {title}\n\n![{title}]({Path(path).name})\n\n{caption}\n")
    return "\n".join(text)


def _introduction(readme: str) -> str:
    """Return the README of the folder up to its first table, code or heading below the title."""
    return re.split(r"^(?:## |```|\|)", readme, maxsplit=1, flags=re.MULTILINE)[0].rstrip() + "\n"
