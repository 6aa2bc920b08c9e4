"""The picture of a judged case: computed forces beside exact ones, for a file or a notebook."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Outcome, Property
from contactverif.contract.subject import Subject
from contactverif.run.judge import forces_to_draw

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SURFACES = ".vtu"  # A case in space, for ParaView.


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """The picture of a case. A notebook shows it.

    Attributes
    ----------
    figure : Figure
        The figure of matplotlib.
    """

    figure: Figure

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the picture to a file.

        Parameters
        ----------
        path : str | os.PathLike[str]
            The file, ``.png`` or ``.svg``; an older one is replaced.

        Raises
        ------
        MisuseError
            If the name has another suffix, or the file cannot be written.
        """
        from contactverif_reports.files import checked_name
        from contactverif_reports.plot.case_figures import SUFFIXES, save

        save(self.figure, checked_name(path, SUFFIXES))

    def _repr_html_(self) -> str:
        """Return the picture as SVG."""
        from contactverif_reports.html.pages import svg_inline

        return str(svg_inline(self.figure))


def make_drawing(subject: Subject, question: Property, outcome: Outcome) -> Drawing:
    """Return the picture of an outcome's case, with the forces of the formulation and, where known, the exact ones."""
    from contactverif_reports.plot.case_figures import make_case_figure  # It brings matplotlib, which is slow.

    title = f"{subject.name}, {question.id}: {outcome.reason or outcome.verdict}"
    forces = forces_to_draw(question, outcome.case, subject)
    of_formulation, exact = (None, None) if forces is None else (forces.of_formulation, forces.exact)
    return Drawing(make_case_figure(outcome.case, title=title, forces=of_formulation, exact=exact))


def draw_outcome(subject: Subject, question: Property, outcome: Outcome, path: Path, argument: str) -> None:
    """Draw the case of an outcome to a picture, or write a case in space for ParaView."""
    try:
        if path.suffix.lower() == SURFACES:
            from contactverif_reports.plot.vtu import write_surfaces

            write_surfaces(outcome.case, forces_to_draw(question, outcome.case, subject), path)
            return
        make_drawing(subject, question, outcome).write(path)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None
