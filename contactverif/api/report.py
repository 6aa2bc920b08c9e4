"""A run as scripts and notebooks see it: short when it is printed, a table and pictures in a notebook, files.

Rule: what takes long to import is imported where it is used.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from contactverif.api.run_files import PARAVIEW, RUN_FILES, either, write_run
from contactverif.contract.counterexample import Counterexample, failing_examples
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.result import OPPOSITE_SIGN, Result, Row, Run, describe
from contactverif.contract.subject import Subject
from contactverif.isolation.host import end_all
from contactverif.isolation.remote import RemoteSubject
from contactverif.run.judge import forces_to_draw
from contactverif.run.ranking import by_rank

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

_MOST_FORMULATIONS = 6  # With more of them, only all rows together are counted.


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
        if path.suffix.lower() == PARAVIEW:
            from contactverif_reports.plot.vtu import write_surfaces

            write_surfaces(outcome.case, forces_to_draw(question, outcome.case, subject), path)
            return
        make_drawing(subject, question, outcome).write(path)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Failure(Counterexample):
    """A case on which a formulation fails. A notebook shows its picture.

    Attributes
    ----------
    subject : Subject
        The formulation.
    question : Property
        The property.
    """

    subject: Subject
    question: Property

    def draw(self) -> Drawing:
        """Draw the mesh, with the forces of the formulation beside the exact ones where they are known.

        The formulation is asked once more for its forces on this case.
        A notebook shows the picture, ``write("failure.svg")`` stores it, and ``figure`` is that of matplotlib.
        """
        try:
            return make_drawing(self.subject, self.question, self.outcome)
        finally:
            if isinstance(self.subject, RemoteSubject):
                end_all()

    def __repr__(self) -> str:
        return "\n    ".join(self.words)

    def _repr_html_(self) -> str:
        return self.draw()._repr_html_()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Report(Run):
    """The results of `verify`: a `Run` that shows itself and writes itself.

    ``print(report)`` gives a few lines. A notebook shows a table of what fails and the mesh of the first failure.

    Attributes
    ----------
    subjects : Mapping[str, Subject]
        The formulations by name.
    questions : Mapping[str, Property]
        The properties by id.

    Examples
    --------
    >>> from contactverif import verify
    >>> verify("vts-me", "patch.flat.transmission", examples=5, seed=1).promises_kept
    True
    """

    subjects: Mapping[str, Subject] = field(default_factory=dict)
    questions: Mapping[str, Property] = field(default_factory=dict)

    @property
    def failures(self) -> list[Failure]:
        """The cases that fail, one for each row: broken promises first, failures as stated last, by rank.

        A row that fails without a case (not judged, wrong traits) is in `table` alone.
        """
        examples = {id(example.row): example for example in failing_examples(self)}
        return [
            Failure(example.id, row, example.outcome, self.subjects[row.formulation], self.questions[row.property_id])
            for row in _failing_rows(self)
            if (example := examples.get(id(row))) is not None
        ]

    def table(self) -> pd.DataFrame:
        """Return a table with a line for each formulation and property, and the columns of the rows in the JSON file.

        ``quantity``, ``value`` and ``tolerance`` are of the number that came closest to its tolerance.
        """
        import pandas as pd

        from contactverif_reports.exchange.run_document import row_values

        lines = []
        for row in self.rows:
            line = row_values(row)
            closest = line.pop("closest")
            line["quantity"] = closest.name if closest else ""
            line["value"], line["tolerance"] = (closest.value, closest.tolerance) if closest else (None, None)
            lines.append(line)
        return pd.DataFrame(lines)

    def to_xarray(self) -> xr.DataTree:
        """Return the report as xarray reads it from the netCDF file, in memory.

        The groups are ``summary``, one for each property such as ``patch/flat/transmission``, and the counterexamples.
        """
        from contactverif_reports.netcdf.write import as_tree

        return as_tree(self)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the report to a file, as the option ``--out`` does.

        Parameters
        ----------
        path : str | os.PathLike[str]
            The file; its suffix says what is written: ``.nc``, ``.html``, ``.json`` or ``.xml`` (JUnit).

        Raises
        ------
        MisuseError
            If the name has another suffix, or the file cannot be written.
        """
        from contactverif_reports.files import check_writable

        target = Path(path)
        suffix = target.suffix.lower()
        if suffix not in RUN_FILES:
            raise MisuseError("path", repr(os.fspath(path)), f"a name that ends in {either(RUN_FILES)}")
        check_writable(target, "path", f"FILE{suffix}")
        write_run(self, target)

    def __repr__(self) -> str:
        from contactverif_reports.html.report_page import headline

        names = self.formulations
        if len(names) <= _MOST_FORMULATIONS:
            lines = [f"{name}: {describe(self.rows_of(name))}" for name in names]
        else:
            counts = Counter(row.result for row in self.rows)
            listed = ", ".join(f"{counts[result]} {result}" for result in Result if counts[result])
            lines = [f"{len(names)} formulations: {listed}"]
        lines += _remarks(self)
        lines += [f"first failure: {failure!r}" for failure in self.failures[:1]]
        return "\n".join([*lines, headline(self)])

    def _repr_html_(self) -> str:
        """Return the table of what fails, and the mesh of the first failure."""
        from contactverif_reports.html.report_page import run_view

        rows, failures = _failing_rows(self), self.failures
        return run_view(self, rows, _remarks(self), failures[0] if failures else None)


def _failing_rows(run: Run) -> list[Row]:
    """Return the rows that fail: those that make the run fail first, those that fail as stated last."""
    failures = (Verdict.FAIL, Verdict.CRASHED)
    rows = [row for row in run.rows if (row.unexpected or row.verdict in failures) and not row.omitted]
    return sorted(by_rank(rows), key=lambda row: (not row.unexpected, row.result is Result.FAILS_AS_STATED))


def _remarks(run: Run) -> list[str]:
    remarks = [f"{item.formulation}: {Result.NOT_LOADED}: {item.reason}" for item in run.not_loaded]
    remarks += [f"{name}: {OPPOSITE_SIGN}" for name in run.opposite_signs]
    return remarks + [f"{name}: {words}" for name, words in run.diagnoses.items()]
