"""Read an HTML page as strictly as the standard library allows: its nesting, ids, links and texts."""

from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = {"meta", "link", "img", "br", "hr", "input", "col"}


@dataclass
class Table:
    """A table of a page: the texts of its cells; `headers` are those of the column headers with a scope."""

    caption: str = ""
    headers: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)


class Page(HTMLParser):
    """The contents of a page, as tests check them.

    Attributes
    ----------
    errors : list[str]
        The elements that are closed in the wrong order or not at all.
    ids : list[str]
        All ids in their order; a repeated id is repeated here.
    links : list[str]
        The targets of every `href`, `src` and `url(…)`.
    text : str
        The text of the page without style sheets; all white space is one blank.
    """

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.errors: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.tables: list[Table] = []
        self._words: list[str] = []
        self._cell: list[str] | None = None
        self.feed(html)
        self.close()
        self.errors += [f"{tag} is not closed" for tag in self.open]
        self.text = " ".join(" ".join(self._words).split())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._take(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append(Table())
        if tag == "tr" and self.tables:
            self.tables[-1].rows.append([])
        if tag in ("td", "th", "caption"):
            self._cell = []

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._take(tag, attrs)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.errors.append(f"</{tag}> at {self.getpos()}")
        if tag in ("td", "th", "caption") and self._cell is not None:
            text = " ".join("".join(self._cell).split())
            if tag == "caption":
                self.tables[-1].caption = text
            else:
                more = int(self._attribute_of_last(tag, "colspan") or 1) - 1  # Columns that the cell covers, too.
                self.tables[-1].rows[-1] += [text, *[""] * more]
                if tag == "th" and self._attribute_of_last("th", "scope") == "col":
                    self.tables[-1].headers.append(text)
            self._cell = None

    def handle_data(self, data: str) -> None:
        if "style" in self.open:
            return
        self._words.append(data)
        if self._cell is not None:
            self._cell.append(data)

    def _take(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = {name: value or "" for name, value in attrs}
        self.tags.append((tag, attributes))
        if "id" in attributes:
            self.ids.append(attributes["id"])
        self.links += [attributes[name] for name in ("href", "src", "srcset", "data", "poster") if name in attributes]
        self.links += [
            part.partition(")")[0] for value in attributes.values() for part in value.split("url(")[1:] if part
        ]

    def _attribute_of_last(self, tag: str, name: str) -> str:
        return next((attrs.get(name, "") for other, attrs in reversed(self.tags) if other == tag), "")


def complaints(html: str) -> list[str]:
    """Return the mistakes in a page of ours, a line each."""
    page = Page(html)
    mistakes = list(page.errors)
    mistakes += [f"id {name!r} twice" for name in sorted({name for name in page.ids if page.ids.count(name) > 1})]
    mistakes += [f"outside: {link}" for link in page.links if not link.startswith("#")]
    mistakes += [f"leads nowhere: {link}" for link in page.links if link[:1] == "#" and link[1:] not in page.ids]
    mistakes += [f"script: {attrs}" for tag, attrs in page.tags if tag in ("script", "link", "iframe", "object")]
    mistakes += [f"@import in {tag}" for tag in ("style",) if "@import" in html]
    tags = [tag for tag, _ in page.tags]
    mistakes += [
        f"{tags.count(tag)} × {tag}" for tag in ("html", "title", "h1", "main", "header") if tags.count(tag) != 1
    ]
    mistakes += [] if any(tag == "html" and attrs.get("lang") for tag, attrs in page.tags) else ["no language"]
    for number, table in enumerate(page.tables):
        if not table.headers:
            mistakes.append(f"table {number} ({table.caption}) has no column headers with a scope")
        if not table.caption:
            mistakes.append(f"table {number} has no caption")
        if len({len(row) for row in table.rows}) != 1:
            mistakes.append(f"table {number} ({table.caption}) is ragged")
    for tag, attrs in page.tags:
        if tag == "svg" and not (attrs.get("aria-label") or attrs.get("aria-hidden")):
            mistakes.append("an svg says nothing")
    return mistakes
