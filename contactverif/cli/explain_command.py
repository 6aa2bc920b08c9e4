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
        typer.Argument(
            help="A property, a term, a symbol or a trait.", metavar="NAME", autocompletion=complete_property
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="A report, whose numbers are put into the tolerances.", metavar="REPORT")
    ] = None,
    case: CaseId = None,
    isolation: IsolationOptions,
) -> None:
    """Explain a property, a term or a trait; without NAME, list the terms.

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
    from contactverif.explanations.terms import list_of_terms, term_text
    from contactverif.explanations.trait_text import trait_text
    from contactverif.plugins.registry import property_ids

    run, examples = _read(name, report, case)
    if run is not None:
        name = name or examples[0].property_id
    if name in property_ids(engines=True):
        _explain_property(name, run, examples, report, isolation)
    elif name is None:
        _show(list_of_terms())
    elif text := term_text(name) or trait_text(name):
        _show(text)
    else:
        raise _unknown(name)


def _unknown(name: str) -> MisuseError:
    """Return the error for a name that nothing explains."""
    from contactverif.contract.names import unknown_name_error
    from contactverif.explanations.terms import symbol_meanings, term_texts
    from contactverif.explanations.trait_text import trait_names
    from contactverif.plugins.registry import property_ids

    names = {*property_ids(engines=True), *term_texts(), *symbol_meanings(), *trait_names()}
    needed = "a property, a term, a symbol or a trait; `contactverif explain` lists the terms"
    return unknown_name_error("NAME", name, names, needed)


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
    if not examples and name not in {row.property_id for row in run.rows}:
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
    if run is not None and not examples:
        _say_results(name, run)
    for example in examples:
        say("")
        diagnosis = run.diagnoses.get(example.formulation, "") if run is not None else ""
        _show(case_text(example, diagnosis, solved=question.bodies))
        show_as_it_is(Text(f"\n{as_text(example.case)}\n{example.replay_command(str(report))}"))
    say("")
    # The formulations come last, because a reader need not wait until they are loaded.
    _show(stated_failures(question, load_formulations(isolation.limits())))


def _say_results(name: str, run: Run) -> None:
    """Say how each formulation of a report did, where no counterexample shows it."""
    from contactverif.cli.console import say

    for row in run.rows:
        if row.property_id == name:
            say(f"\n{row.formulation}: {row.result}{': ' if row.reason else ''}{row.reason}")


def _show(markdown: str) -> None:
    """Print Markdown."""
    from contactverif.cli.console import show
    from contactverif.cli.terminal_markdown import TerminalMarkdown

    show(TerminalMarkdown(markdown))
