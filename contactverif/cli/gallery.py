"""The scenes that have a name, as a terminal shows them: what, from where, what was chosen, and a drawing of each."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import Any

from rich.console import Console, ConsoleOptions
from rich.text import Text

from contactverif.scenes.catalogue import BLOCKS, SCENES, load_scene, options_of
from contactverif_reports.draw.scene_text import blocks_as_text, silhouettes_as_text

SOURCE = "Zavarise & De Lorenzis (2009)"
MEANINGS = {
    "refine": "parts that each segment and each layer of cells is divided into",
    "penalty": "ε̂, force per length of the interface, per length of penetration; 10 E/h by default",
    "young": "Young's modulus E of the slave",
    "ratio": "E of the master over E of the slave",
    "poisson": "Poisson's ratio of both",
    "pressure": "on top of the slave; the scene's own by default",
    "degrees": "by which all of it is turned, counter-clockwise",
    "sides": "rollers, or free to strain, so that the contact area changes",
    "lowered": "how deep the slave is pushed in the first guess, 0 to begin where they touch; p/ε̂ by default",
    "force": "on top of the disk, per unit of thickness",
}
_MARGIN = 4
_NARROW = 96  # columns of running text at most


class Gallery:
    """All scenes, then their options."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        width = min(options.max_width, _NARROW)
        for name, drawing in SCENES.items():
            yield Text(name, style="bold")
            source = f"{SOURCE}, {drawing.source}" if drawing.source else "ours"
            for label, words in (("", drawing.summary), ("source: ", source)):
                yield _folded(f"{label}{words}", width)
            pressure = f"; pressure {BLOCKS[name].pressure:g}" if name in BLOCKS else ""
            yield _folded(f"chosen: {drawing.chosen}{pressure}", width)
            if name not in BLOCKS:
                own = (f"{option} {_shown(default)}".strip() for option, default in options_of(name).items())
                yield _folded(f"options: {', '.join(own)}", width)
            scene = load_scene(name)
            slave, master = scene.bodies
            draw = blocks_as_text if name in BLOCKS else silhouettes_as_text
            picture = draw(scene.case(), slave, master, width - _MARGIN)
            yield _as_it_is(textwrap.indent(picture, " " * _MARGIN))
            yield Text("")
        yield Text("options, as in --scene c:refine=2,penalty=1e4", style="bold")
        defaults = {option: default for name in [*SCENES][::-1] for option, default in options_of(name).items()}
        longest = max(map(len, MEANINGS))
        for option, meaning in MEANINGS.items():
            said = f"{meaning} {_shown(defaults[option])}".strip()
            lines = textwrap.wrap(said, width - longest - _MARGIN)
            yield _as_it_is(f"\n{' ' * (longest + _MARGIN)}".join([f"  {option:{longest}}  {lines[0]}", *lines[1:]]))


def _shown(default: Any) -> str:
    """A default in parentheses; nothing where the scene has its own."""
    if default is None:
        return ""
    return f"({default})" if isinstance(default, str) else f"({default:g})"


def _folded(words: str, width: int) -> Text:
    indent = " " * _MARGIN
    return _as_it_is(textwrap.fill(words, width, initial_indent=indent, subsequent_indent=indent + "  "))


def _as_it_is(words: str) -> Text:
    return Text(words, no_wrap=True, overflow="ignore")
