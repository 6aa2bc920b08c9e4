"""Pictures of a case: a few lines of text for a terminal, a PNG or SVG for a paper."""

from __future__ import annotations

import os

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif_reports.draw.case_text import as_text
from contactverif_reports.files import checked_name

__all__ = ["as_text", "draw_case"]


def draw_case(
    case: Case,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    forces: FloatArray | None = None,
    exact: FloatArray | None = None,
) -> None:
    """Draws the current state of a case to a .png or .svg file.

    Penetrations that are small against the interface are drawn magnified, and the figure says by which factor.

    Parameters
    ----------
    case : Case
        What to draw.
    path : str | os.PathLike[str]
        File to write, replaced if it is there.
    title : str
        Above the picture, wrapped.
    forces, exact : FloatArray | None
        Nodal forces (n_nodes, 2) or (n_unknowns,) as they act on the nodes (minus the residual), found and
        right; drawn as arrows of one scale.

    Raises
    ------
    MisuseError
        If the file cannot be written, or is to be of another kind.
    """
    from contactverif_reports.draw.case_figure import SUFFIXES, make_case_figure, save  # importing matplotlib is slow

    target = checked_name(path, SUFFIXES)
    save(make_case_figure(case, title=title, forces=forces, exact=exact), target)
