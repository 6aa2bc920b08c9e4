"""Puts the datasets of the items into one `xarray.DataTree`, which becomes `paper.nc`.

Each item has a group of its own name. `/statements` holds all statements, `/figures` the list of figures. Style and
units are those of a report (`reports/README.md`). This file names no item.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from contactverif.contract.arrays import FloatArray
from contactverif_paper.paper_item import Agreement, Paper, PaperFigure, Statement
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.variables import codes, words

TITLE = "contactverif: the reference paper, computed again"
REFERENCE = "Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416"
STATEMENTS, FIGURES = "statements", "figures"
_WORTH_COMPRESSING = 4096  # bytes


def tree_of(paper: Paper) -> xr.DataTree:
    """Return all groups."""
    groups = {
        "/": xr.Dataset(attrs=_root(paper)),
        f"/{STATEMENTS}": _statements(paper.statements),
        f"/{FIGURES}": _figures(paper.figures),
    }
    for result in paper.results:
        for name, dataset in result.item.datasets(result.data).items():
            path = f"/{result.item.name}/{name}".rstrip("/")
            if path in groups:
                raise ValueError(f"{path}: two items have this group")
            groups[path] = dataset
    return xr.DataTree.from_dict({name: _without_small_filters(group) for name, group in groups.items()})


def pad_rows(rows: Sequence[ArrayLike]) -> FloatArray:
    """Return rows of different lengths as one array (n_rows, longest) with NaN behind the end of a row."""
    return np.array(list(itertools.zip_longest(*map(np.atleast_1d, rows), fillvalue=np.nan)), dtype=np.float64).T


def _root(paper: Paper) -> dict[str, str]:
    facts = {name: schema.text(value) for name, value in paper.provenance.items()}
    return facts | {
        "Conventions": schema.CONVENTIONS,
        "title": TITLE,
        "references": REFERENCE,
        "comment": schema.UNITS_NOTE,
    }


def _statements(statements: Sequence[Statement]) -> xr.Dataset:
    dims = ["statement"]
    meanings = {agreement.words.replace(" ", "_"): int(agreement) for agreement in Agreement}
    columns = {
        "place": "where in the paper",
        "claim": "what the paper says, in our words",
        "result": "what was computed here",
        "condition": "when the statement holds; empty: always, or not at all",
        "figure": "file name of the figure here; empty: none",
    }
    table = {
        name: words(dims, [getattr(statement, name) for statement in statements], meaning)
        for name, meaning in columns.items()
    }
    verdicts = [statement.agreement for statement in statements]
    table["agreement"] = codes(dims, verdicts, meanings, "how claim and result compare")
    return xr.Dataset(table, attrs={"comment": "the paper's statements beside what was computed"})


def _figures(figures: Sequence[PaperFigure]) -> xr.Dataset:
    columns = {
        "name": "file name, without its suffix",
        "source": "the paper's figure, or ours",
        "caption": "what it shows",
    }
    table = {
        name: words(["figure"], [getattr(figure, name) for figure in figures], meaning)
        for name, meaning in columns.items()
    }
    return xr.Dataset(table, attrs={"comment": "the figures, in the order of the page"})


def _without_small_filters(group: xr.Dataset) -> xr.Dataset:
    """Store small variables uncompressed: the filter costs 2 kB each."""
    for variable in group.variables.values():
        if variable.nbytes < _WORTH_COMPRESSING:
            variable.encoding = {k: v for k, v in variable.encoding.items() if k not in ("zlib", "complevel")}
    return group
