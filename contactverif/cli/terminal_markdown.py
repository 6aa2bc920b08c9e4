"""Markdown of the site in a terminal: headings stand at the left, and a link is its words alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from rich.console import Console, ConsoleOptions, RenderResult
from rich.markdown import Heading, Markdown, MarkdownElement
from rich.text import Text

from contactverif.explanations.markdown import without_links

MOST_COLUMNS = 80


class _LeftHeading(Heading):
    """A heading that is bold, without a frame."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield Text(self.text.plain, style="bold")


class _Markdown(Markdown):
    """Markdown whose headings have no frame."""

    elements: ClassVar[dict[str, type[MarkdownElement]]] = {**Markdown.elements, "heading_open": _LeftHeading}


@dataclass(frozen=True, slots=True)
class TerminalMarkdown:
    """Markdown as a terminal shows it, in at most 80 columns, because longer lines are hard to read."""

    markdown: str

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        narrow = options.update(width=min(options.max_width, MOST_COLUMNS))
        for line in console.render_lines(_Markdown(without_links(self.markdown)), narrow):
            text = Text.assemble(*((part.text, part.style or "") for part in line), no_wrap=True)
            text.rstrip()
            yield text
