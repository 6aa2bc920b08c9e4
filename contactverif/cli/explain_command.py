"""The command `explain`: what a property asks, or what a term means, and the numbers of a case that fails."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.shared_options import CaseId, complete_property
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.contract.counterexample import Counterexample
    from contactverif.contract.result import Run


def explain(
    *,
    name: Annotated[
        str | None,
        typer.Argument(help="A property, a term or a symbol.", metavar="NAME", autocompletion=complete_property),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="A report, whose numbers are put into the tolerances.", metavar="REPORT")
    ] = None,
    case: CaseId = None,
    isolation: IsolationOptions,
) -> None:
    """Explain a property or a term; without NAME, list the terms.

    Of a property it says what is asked and why, the tolerance with its
    reasons, and who is known to fail. With --report come the numbers of the
    counterexamples that the report has of this property, or of one --case.

    \bExit status
      0  explained
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif explain patch.flat.nodal
      contactverif explain witness
      contactverif explain balance.force --report ppt.nc
      contactverif explain --report ppt.nc --case vts-ppt.balance.force
    """
    from contactverif.contract.names import unknown_name_error
    from contactverif.explanations.terms import list_of_terms, symbol_meanings, term_text, term_texts
    from contactverif.plugins.registry import property_ids

    run, examples = _read(name, report, case)
    if run is not None:
        name = name or examples[0].property_id
    if name in property_ids():
        _explain_property(name, run, examples, report, isolation)
    elif name is None:
        _show(list_of_terms())
    elif text := term_text(name):
        _show(text)
    else:
        raise unknown_name_error("NAME", name, [*property_ids(), *term_texts(), *symbol_meanings()])


def _read(name: str | None, report: Path | None, case: str | None) -> tuple[Run | None, list[Counterexample]]:
    """Return the run in a report, and the counterexamples of it that the user means."""
    if report is None:
        if case is not None:
            raise MisuseError("--report", "nothing", f"the report that has the case {case!r}")
        return None, []
    from contactverif.contract.counterexample import find_counterexample
    from contactverif_reports.netcdf.read import read_run

    run = read_run(report)
    if case is None:
        return run, _examples_of(name, run, report)
    example = find_counterexample(run, case)
    if name not in (None, example.property_id):
        raise MisuseError("NAME", repr(name), f"{example.property_id}, the property of the case {case}")
    return run, [example]


def _examples_of(name: str | None, run: Run, report: Path) -> list[Counterexample]:
    """Return the counterexamples of a property in a report."""
    from contactverif.contract.counterexample import counterexamples

    every = counterexamples(run).values()
    examples = [example for example in every if example.property_id == name]
    if not examples:
        failing = ", ".join(dict.fromkeys(example.property_id for example in every))
        needed = f"one of which {report} has a counterexample: {failing}" if failing else "no --report"
        raise MisuseError("NAME", "nothing" if name is None else repr(name), needed)
    return examples


def _explain_property(
    name: str, run: Run | None, examples: list[Counterexample], report: Path | None, isolation: IsolationOptions
) -> None:
    """Show the text of a property, the numbers of its counterexamples, and who states a failure."""
    from rich.text import Text

    from contactverif.cli.console import say, show_as_it_is
    from contactverif.explanations.case_numbers import case_text
    from contactverif.explanations.known_failures import stated_failures
    from contactverif.explanations.property_text import property_text
    from contactverif.plugins.registry import load_formulations, the_property
    from contactverif_reports.draw import as_text

    question = the_property(name)
    _show(property_text(question))
    for example in examples:
        say("")
        diagnosis = run.diagnoses.get(example.formulation, "") if run is not None else ""
        _show(case_text(example, diagnosis, solved=question.bodies))
        show_as_it_is(Text(f"\n{as_text(example.case)}\n{example.replay_command(str(report))}"))
    say("")
    # The formulations come last, because a reader need not wait until they are loaded.
    _show(stated_failures(question, load_formulations(isolation.limits())))


def _show(markdown: str) -> None:
    """Print Markdown."""
    from contactverif.cli.console import show
    from contactverif.cli.terminal_markdown import TerminalMarkdown

    show(TerminalMarkdown(markdown))
