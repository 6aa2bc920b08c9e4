"""The list of named scenes in a terminal: what each shows, where it comes from, its options, and a drawing."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import Any

from rich.console import Console, ConsoleOptions
from rich.text import Text

from contactverif.problems.catalogue import BLOCKS, SCENES, load_scene, options_of
from contactverif_reports.draw.scene_text import blocks_as_text, silhouettes_as_text

SOURCE = "Zavarise & De Lorenzis (2009)"
MEANINGS = {
    "refine": "number of parts into which each segment and each layer of cells is divided",
    "penalty": "penalty ε̂: force per length of the interface, per length of penetration; 10 E/h by default",
    "young": "Young's modulus E of the slave",
    "ratio": "E of the master over E of the slave",
    "poisson": "Poisson's ratio of both bodies",
    "pressure": "pressure on top of the slave; each scene has its own default",
    "degrees": "angle by which the whole scene is rotated, counter-clockwise",
    "sides": "rollers; or free, so that the bodies strain sideways and the contact area changes",
    "lowered": "depth of the slave in the first guess; 0 begins where the bodies touch; p/ε̂ by default",
    "force": "force on top of the disk, per unit of thickness",
}
_MARGIN = 4
_NARROWEST, _WIDEST = 40, 96  # Columns of running text, whatever the terminal has.


class Gallery:
    """All scenes, then the meaning of their options."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        width = max(_NARROWEST, min(options.max_width, _WIDEST))
        for name in SCENES:
            yield from _scene(name, width)
        yield from _options(width)


def _scene(name: str, width: int) -> Iterator[Text]:
    """Yield the description of one scene and its drawing."""
    entry = SCENES[name]
    yield Text(name, style="bold")
    yield _wrap(entry.summary, width)
    yield _wrap(f"source: {SOURCE}, {entry.source}" if entry.source else "source: this project", width)
    pressure = f"; pressure {BLOCKS[name].pressure:g}" if name in BLOCKS else ""
    yield _wrap(f"our choice: {entry.assumptions}{pressure}", width)
    if name not in BLOCKS:
        options = (f"{option} {_default_in_words(default)}".strip() for option, default in options_of(name).items())
        yield _wrap(f"options: {', '.join(options)}", width)
    scene = load_scene(name)
    slave, master = scene.bodies
    draw = blocks_as_text if name in BLOCKS else silhouettes_as_text
    picture = draw(scene.case(), slave, master, width - _MARGIN)
    yield _keep_lines(textwrap.indent(picture, " " * _MARGIN))
    yield Text("")


def _options(width: int) -> Iterator[Text]:
    """Yield the options of the scenes, with their meanings and defaults."""
    yield Text("options, as in --scene c:refine=2,penalty=1e4", style="bold")
    defaults = {option: default for name in [*SCENES][::-1] for option, default in options_of(name).items()}
    longest = max(map(len, MEANINGS))
    for option, meaning in MEANINGS.items():
        lines = textwrap.wrap(f"{meaning} {_default_in_words(defaults[option])}".strip(), width - longest - _MARGIN)
        indent = " " * (longest + _MARGIN)
        yield _keep_lines(f"\n{indent}".join([f"  {option:{longest}}  {lines[0]}", *lines[1:]]))


def _default_in_words(default: Any) -> str:
    """Return a default in parentheses; nothing where the scene has its own."""
    if default is None:
        return ""
    return f"({default})" if isinstance(default, str) else f"({default:g})"


def _wrap(words: str, width: int) -> Text:
    """Return words wrapped and indented below the name of a scene."""
    indent = " " * _MARGIN
    return _keep_lines(textwrap.fill(words, width, initial_indent=indent, subsequent_indent=indent + "  "))


def _keep_lines(words: str) -> Text:
    """Return words that the terminal does not wrap once more."""
    return Text(words, no_wrap=True, overflow="ignore")
