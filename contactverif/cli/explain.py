"""The work of `explain`: what a property asks, or what a term means, and the numbers of a case that fails."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from rich.console import Console, ConsoleOptions, RenderResult
from rich.markdown import Heading, Markdown, MarkdownElement
from rich.text import Text

from contactverif.cli.console import echo, show, show_verbatim
from contactverif.contract.counterexample import Counterexample, counterexamples, find_counterexample
from contactverif.contract.errors import MisuseError, unknown_name_error
from contactverif.contract.result import Run
from contactverif.explanations import terms
from contactverif.explanations.property_text import case_text, property_text, stated_failures
from contactverif.plugins.registry import load_formulations, property_ids, the_property
from contactverif.problems.named_states import NAMED, named_case
from contactverif.run.run_options import RunOptions
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.plot.text import as_text

_MOST_COLUMNS = 80  # Longer lines are hard to read.


def explain(name: str | None, report: Path | None, case: str | None, options: RunOptions) -> None:
    """Explain a name, with the numbers of a report; or list the terms."""
    run, examples = _read(name, report, case)
    name = examples[0].property_id if name is None and examples else name
    ids = property_ids(engines=True)
    name = name.lower() if name is not None and name.lower() in ids else name
    if name not in ids:
        if name in NAMED:
            show_verbatim(Text(as_text(named_case(name))))
            return
        text = terms.list_of_terms() if name is None else terms.term_text(name) or terms.trait_text(name)
        if name is not None and not text:
            names = {*ids, *terms.term_texts(), *terms.symbol_meanings(), *terms.trait_names(), *NAMED}
            needed = "a property, a term, a symbol, a trait or a named case; `contactverif explain` lists the terms"
            raise unknown_name_error("NAME", name, names, needed)
        show(TerminalMarkdown(text))
        return
    question = the_property(name)
    show(TerminalMarkdown(property_text(question)))
    for row in run.rows if run is not None and not examples else ():
        if row.property_id == name:
            echo(f"\n{row.formulation}: {row.result}{': ' if row.reason else ''}{row.reason}")
    for example in examples:
        echo("")
        diagnosis = run.diagnoses.get(example.formulation, "") if run is not None else ""
        show(TerminalMarkdown(case_text(example, diagnosis, solved=question.bodies)))
        show_verbatim(Text(f"\n{as_text(example.case)}\n{example.replay_command(str(report))}"))
    echo("")
    # The formulations come last, because a reader need not wait until they are loaded.
    show(TerminalMarkdown(stated_failures(question, load_formulations(options.limits()))))


def _read(name: str | None, report: Path | None, case: str | None) -> tuple[Run | None, list[Counterexample]]:
    if report is None:
        if case is not None:
            raise MisuseError("--report", "nothing", f"the report that has the case {case!r}")
        return None, []
    run = read_run(report)
    if case is not None:
        example = find_counterexample(run, case)
        if name not in (None, example.property_id):
            raise MisuseError("NAME", repr(name), f"{example.property_id}, the property of the case {case}")
        return run, [example]
    every = counterexamples(run).values()
    examples = [example for example in every if example.property_id == name]
    if not examples and name not in {row.property_id for row in run.rows}:
        failing = ", ".join(dict.fromkeys(example.property_id for example in every))
        needed = f"one of which {report} has a counterexample: {failing}" if failing else "no --report"
        raise MisuseError("NAME", "nothing" if name is None else repr(name), needed)
    return run, examples


class _LeftHeading(Heading):
    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield Text(self.text.plain, style="bold")


class _Markdown(Markdown):
    elements: ClassVar[dict[str, type[MarkdownElement]]] = {**Markdown.elements, "heading_open": _LeftHeading}


@dataclass(frozen=True, slots=True)
class TerminalMarkdown:
    """Markdown of the site in a terminal: headings stand at the left, and a link is its words alone."""

    markdown: str

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        narrow = options.update(width=min(options.max_width, _MOST_COLUMNS))
        without_links = re.sub(r"(?<![\\!])\[([^\]]+)\]\([^)]*\)", r"\1", self.markdown)  # There is no page to go to.
        for line in console.render_lines(_Markdown(without_links), narrow):
            text = Text.assemble(*((part.text, part.style or "") for part in line), no_wrap=True)
            text.rstrip()
            yield text
