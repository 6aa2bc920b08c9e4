"""reports/paper/README.md and docs say what the stored results say: files, groups, numbers. Nothing is solved again."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr

from contactverif_paper.items import ITEMS

FOLDER = Path(__file__).parents[2] / "reports" / "paper"
README = (FOLDER / "README.md").read_text(encoding="utf-8")


@cache
def read_paper() -> xr.DataTree:
    return xr.open_datatree(FOLDER / "paper.nc").load()


def first_cells(heading: str) -> set[str]:
    """Return what stands in code in the first column of the table with that heading."""
    table = README.partition(f"\n| {heading} |")[2].partition("\n\n")[0]
    cells = [line.split("|")[1] for line in table.splitlines()[2:]]
    return {word for cell in cells for word in re.findall(r"`(.+?)`", cell)}


def words(values: xr.DataArray) -> list[str]:
    return [word.decode() if isinstance(word, bytes) else str(word) for word in np.ravel(values.values).tolist()]


def test_the_table_of_files_lists_the_stored_figures() -> None:
    names = set(words(read_paper()["figures"].to_dataset()["name"]))
    assert first_cells("file") == names == {path.stem for path in FOLDER.glob("*.svg")}


def test_the_table_of_groups_lists_the_stored_groups() -> None:
    listed = {name for name in first_cells("group") if name.startswith("/")}
    assert listed <= set(read_paper().groups)
    assert {name.split("/")[1] for name in listed} == set(read_paper().children)
    assert set(read_paper().children) == {item.name for item in ITEMS} | {"statements", "figures"}


def test_fig_39_fits_on_the_meshes_that_the_page_names() -> None:
    statements = read_paper()["statements"].to_dataset()
    (condition,) = [
        condition
        for place, condition in zip(words(statements.place), words(statements.condition), strict=True)
        if place == "Fig. 39"
    ]
    assert condition == "on meshes twice as fine only"
    assert "Fig. 39 fits the printed axis on meshes twice as fine as our base meshes only" in " ".join(README.split())
