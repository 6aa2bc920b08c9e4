"""HTML pages that need nothing but themselves: templates filled in, figures inlined as SVG, files written whole.

`templates/base.html.j2` has the looks of every page (screen, phone, dark, print); `templates/parts.html.j2` has what
pages share: verdicts, figures, boxes that scroll. A page may have thousands of strips of margins: they are written
without matplotlib, which would take a thousand times the bytes and the time.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from math import ceil, inf
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError, printable
from contactverif.contract.property import Verdict
from contactverif.contract.result import Result, percent
from contactverif_reports.files import check_writable, checked_name, whole
from contactverif_reports.tables import Change, Code, Measured, ResultCell, decimal, plain_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".html", ".htm")
MARKS: dict[Verdict | Result, str] = {
    Verdict.PASS: "✓",
    Verdict.FAIL: "✗",
    Verdict.UNDECIDED: "?",
    Verdict.NOT_APPLICABLE: "–",
    Verdict.CRASHED: "✗✗",
    Verdict.NOT_PROVIDED: "○",
    Verdict.NOT_LOADED: "○",
    Verdict.NOT_JUDGED: "?",
    Result.FAILS_AS_STATED: "✗",
    Result.BROKEN_PROMISE: "✗",
    Result.WRONG_TRAITS: "✗✗",
}
_SVG = "{http://www.w3.org/2000/svg}"
_HREF = "{http://www.w3.org/1999/xlink}href"
_LEAST_SCALE = 0.6  # a figure is drawn no smaller than this; then its box scrolls, or labels of 9 pt cannot be read
_PX_PER_PT = 96 / 72
# The strips of margins.
LEAST = -4  # Decades below the tolerance: smaller margins are drawn at the left end.
_MOST = 16  # Decades beyond the tolerance: larger margins, and failures without a number, are drawn at the right end.
_FEWEST = 2  # Decades beyond the tolerance that every axis has.
_WIDTH, _HEIGHT, _TOP = 200, 26, 7  # User units of the SVG; the mark of the worst margin is above the bars.
_BINS_A_DECADE = 2
_INLINED = re.compile(r'<svg data-figure="(\w+)".*?</svg>', re.S)


def render(template_name: str, *, package: str = "contactverif_reports.html", **context: Any) -> str:
    """Fill in the template of that name (`report.html.j2`).

    What is not `Markup` is escaped; a name that the template asks for and the context lacks is an error. A figure that
    stands in the page several times gets ids of its own each time.
    """
    counts: dict[str, int] = {}

    def with_own_ids(match: re.Match[str]) -> str:
        name = match[1]
        counts[name] = counts.get(name, 0) + 1
        return match[0] if counts[name] == 1 else match[0].replace(name, f"{name}-{counts[name]}")

    return _INLINED.sub(with_own_ids, _environment(package).get_template(template_name).render(context))


def write_page(path: str | os.PathLike[str], html: str, argument: str = "--out") -> None:
    """Write a page, whole or not at all, as UTF-8."""
    checked_name(path, SUFFIXES, argument)
    check_writable(path, argument, "FILE.html")
    try:
        with whole(path) as part:
            part.write_text(html, encoding="utf-8", newline="\n")
    except OSError as error:
        raise MisuseError(argument, f"{os.fspath(path)}: {error.strerror}", "a file that can be written") from error


def svg_inline(figure: Figure, label: str = "") -> Markup:
    """Turn a figure into an `<svg>` element for a page: no prolog, no background, as wide as there is room.

    The same figure gives the same bytes. Text stays text: it is selected, searched and read aloud, and a page of many
    figures stays small; widths were computed with a wide font, so that another one fits too.
    """
    import matplotlib

    from contactverif_reports.plot.case_figures import save_plainly

    buffer = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "contactverif", "svg.fonttype": "none"}):
        save_plainly(figure, buffer, format="svg", transparent=True, metadata={"Date": None})
    root = ElementTree.fromstring(buffer.getvalue())
    for parent in list(root.iter()):  # Metadata, and a style sheet for every element of the page, do not belong to it.
        for child in list(parent):
            if child.tag in (f"{_SVG}metadata", f"{_SVG}style"):
                parent.remove(child)
    _prefix_ids(root, "f" + hashlib.sha256(buffer.getvalue()).hexdigest()[:9])
    for element in root.iter():
        element.tag = element.tag.removeprefix(_SVG)
    width = float(root.attrib["width"].removesuffix("pt")) * _PX_PER_PT
    root.attrib = {
        "data-figure": root.attrib["data-figure"],
        "viewBox": root.attrib["viewBox"],
        "width": "100%",
        "style": f"max-width:{width:.0f}px;--least:{_LEAST_SCALE * width:.0f}px;"
        "stroke-linejoin:round;stroke-linecap:butt",
        **({"role": "img", "aria-label": label} if label else {"aria-hidden": "true"}),
    }
    return Markup(ElementTree.tostring(root, encoding="unicode"))


def number(value: float, digits: int = 3) -> str:
    """Format a number for a reader: few digits, a true minus sign, – for NaN."""
    return "–" if value != value else decimal(value, digits).replace("-", "−").replace("inf", "∞")


def page_cell(value: Any) -> str:
    """Return a cell of a table as a page shows it."""
    match value:
        case float():
            return number(value, 2)
        case Code():
            return Markup("<code>{}</code>").format(value)
        case Change(old, new) if plain_text(old) != plain_text(new):
            return Markup("{} → {}").format(page_cell(old), page_cell(new))
        case Change(_, new):
            return page_cell(new)
        case Measured(measured, name):
            return f"{number(measured, 2)} {name}"
        case ResultCell(result, unexpected, differs) if result:
            parts: Any = _environment().get_template("parts.html.j2").module
            verdict = Markup(parts.verdict(str(result), unexpected))
            return verdict + Markup(' <span class="soft">(differs)</span>') if differs else verdict
        case ResultCell():
            return "–"
    return value if isinstance(value, str) else plain_text(value)


def origin(provenance: Mapping[str, str], names: Iterable[str]) -> dict[str, str]:
    """Return what a reader of a page wants to know of the origin of its numbers."""
    return {name.replace("_", " "): provenance[name] for name in names if provenance.get(name)}


@cache
def _environment(package: str = "contactverif_reports.html") -> Environment:
    """Return the templates of a package and of this one, such as `base.html.j2`."""
    packages = dict.fromkeys([package, "contactverif_reports.html"])
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in packages]),
        autoescape=lambda name: name is None or not name.endswith(".md.j2"),
        undefined=StrictUndefined,
        # No control character comes into a page; only `Markup` is of our own making.
        finalize=lambda value: printable(value) if isinstance(value, str) and not isinstance(value, Markup) else value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = number
    environment.filters["cell"] = page_cell
    environment.filters["percent"] = percent
    environment.globals["marks"] = {str(word): mark for word, mark in MARKS.items()}
    return environment


def _prefix_ids(root: ElementTree.Element, prefix: str) -> None:
    """Put the prefix before each id that some element refers to, and remove the other ids."""
    references = re.compile(r"url\(#([^)]+)\)")
    used: set[str] = set()
    for element in root.iter():
        if _HREF in element.attrib:
            element.set("href", element.attrib.pop(_HREF))
        for name, value in element.attrib.items():
            if name == "href" and value.startswith("#"):
                used.add(value[1:])
                element.set(name, f"#{prefix}-{value[1:]}")
            elif "url(#" in value:
                used.update(references.findall(value))
                element.set(name, references.sub(rf"url(#{prefix}-\1)", value))
    for element in root.iter():
        if (id_ := element.attrib.pop("id", None)) in used:
            element.set("id", f"{prefix}-{id_}")
    root.set("data-figure", prefix)


# Strips: a histogram of the margins of the cases of a row, as a small SVG that fits into a table.


@dataclass(frozen=True, slots=True)
class Axis:
    """A logarithmic axis of value/tolerance, the same for all strips of a page: from 10^LEAST to 10^most."""

    most: int

    @classmethod
    def from_margins(cls, margins: Iterable[FloatArray]) -> Axis:
        """Return the shortest axis that holds every finite margin, up to 10^16."""
        tops = [float(finite.max()) for sample in margins if len(finite := sample[np.isfinite(sample)])]
        top = max(tops, default=1.0)
        return cls(int(np.clip(ceil(np.log10(top)) if top > 0 else 0, _FEWEST, _MOST)))

    @property
    def n_bins(self) -> int:
        """The number of bins, half a decade each; the last one is for failures without a number."""
        return (self.most - LEAST) * _BINS_A_DECADE + 1

    def bins(self, margins: FloatArray) -> FloatArray:
        """Return the bin numbers (n,) of margins; a margin of exactly 1 is on the left of the tolerance."""
        with np.errstate(divide="ignore"):
            places = np.ceil((np.log10(margins) - LEAST) * _BINS_A_DECADE) - 1
        last = self.n_bins - 1
        return np.where(np.isinf(margins), last, np.clip(places, 0, last - 1)).astype(np.int64)

    def x(self, decade: float) -> float:
        """Return the position of a power of ten on the axis, in user units."""
        return _WIDTH * (decade - LEAST) * _BINS_A_DECADE / self.n_bins


def strip(margins: FloatArray, axis: Axis) -> Markup:
    """Draw the histogram of margins (n,), with a line at the tolerance and a mark at the worst; empty for none.

    Heights are the square roots of the shares, so that one case of thousands is visible.
    """
    known = margins[~np.isnan(margins)]
    if not len(known):
        return Markup("")
    numbers, counts = np.unique(axis.bins(known), return_counts=True)
    width, room = _WIDTH / axis.n_bins, _HEIGHT - _TOP
    tolerance = -LEAST * _BINS_A_DECADE  # The first bin beyond the tolerance.
    bars = []
    for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
        height = max(2.0, room * (count / len(known)) ** 0.5)
        kind = "within" if number < tolerance else "beyond"
        bars.append(
            f'<rect class="{kind}" x="{number * width + 0.5:.1f}" y="{_HEIGHT - height:.1f}" '
            f'width="{width - 1:.1f}" height="{height:.1f}"/>'
        )
    at = (numbers[-1] + 0.5) * width
    line = axis.x(0)
    median, worst = (
        "infinitely" if margin == inf else f"{margin:.2g} times" for margin in (np.median(known), known.max())
    )
    label = f"{len(known)} case{'s' * (len(known) > 1)}, median {median}, worst {worst} the tolerance"
    return Markup(
        f'<svg class="strip" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{label}">'
        f'<path class="base" d="M0 {_HEIGHT}H{_WIDTH}"/>{"".join(bars)}'
        f'<path class="tolerance" d="M{line:.1f} 0V{_HEIGHT}"/>'
        f'<path class="worst" d="M{at - 3:.1f} 0H{at + 3:.1f}L{at:.1f} 5z"/></svg>'
    )


def ticks(axis: Axis) -> Markup:
    """Draw the labels of the axis, for the head of the column."""
    step, labels = 4 if axis.most <= 8 else 8, []
    for decade in (LEAST, 0, *range(step, axis.most + 1, step)):
        anchor = "start" if decade == LEAST else "middle" if axis.x(decade) < 0.93 * _WIDTH else "end"
        power = "1" if decade == 0 else f'10<tspan dy="-4" font-size="8">{str(decade).replace("-", "−")}</tspan>'
        labels.append(f'<text x="{axis.x(decade):.1f}" y="13" text-anchor="{anchor}">{power}</text>')
    return Markup(f'<svg class="strip ticks" viewBox="0 0 {_WIDTH} 16" aria-hidden="true">{"".join(labels)}</svg>')
