"""Markdown of the site in a terminal: headings stand at the left, and a link is its words alone."""

from __future__ import annotations

from typing import ClassVar

from rich.console import Console, ConsoleOptions, RenderResult
from rich.markdown import Heading, Markdown, MarkdownElement
from rich.text import Text

from contactverif.explanations.markdown import without_links


class _LeftHeading(Heading):
    """A heading that is bold, without a frame."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield Text(self.text.plain, style="bold")


class TerminalMarkdown(Markdown):
    """Markdown as a terminal shows it."""

    elements: ClassVar[dict[str, type[MarkdownElement]]] = {**Markdown.elements, "heading_open": _LeftHeading}

    def __init__(self, markup: str) -> None:
        super().__init__(without_links(markup))
