"""Pictures of a case: a few lines of text for a terminal, a PNG or SVG for a paper.

Rule: a picture may be rough where a judge may not; nothing here is used for a verdict.
"""

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
    """Draw the current state of a case to a .png or .svg file.

    A penetration that is small against the interface is magnified, and the figure says by which factor.

    Parameters
    ----------
    case : Case
        The case.
    path : str | os.PathLike[str]
        The file to write; an older one is replaced.
    title : str
        The title above the picture; it is wrapped.
    forces, exact : FloatArray (n_nodes, dim) or (n_unknowns,) | None
        Nodal forces of the formulation and exact ones, as they act on the nodes (minus the residual). They are drawn
        as arrows of one scale; in space faces are shaded by their difference.
    """
    from contactverif_reports.draw.case_figure import SUFFIXES, make_case_figure, save  # importing matplotlib is slow

    target = checked_name(path, SUFFIXES)
    save(make_case_figure(case, title=title, forces=forces, exact=exact), target)
