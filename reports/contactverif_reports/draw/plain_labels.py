"""Labels of figures as they are: a name of a plugin is neither a formula nor too strange to be drawn.

matplotlib reads `$…$` as a formula, and raises an error where the formula is none. Here each text of a figure is plain,
but for the powers of ten that matplotlib itself puts beside axes.
"""

from __future__ import annotations

import re
import warnings
from typing import Any

from matplotlib.figure import Figure
from matplotlib.text import Text

from contactverif.contract.foreign_text import printable

_POWER_OF_TEN = re.compile(r"(?=.*\d)-?\$(\\mathdefault\{)?[-−+]?[0-9.]*(\\times)?(10)?\^?(\{[-−]?[0-9]+\})?\}?\$")


def save_plainly(figure: Figure, target: Any, **options: Any) -> None:
    """Write a figure with `Figure.savefig`, its texts as they are."""
    for text in figure.findobj(Text):
        label = text.get_text()
        if label and not _POWER_OF_TEN.fullmatch(label):  # An empty text may become a power of ten as it is drawn.
            text.set_text(printable(label))
            text.set_parse_math(False)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font", UserWarning)  # It is drawn as a box.
        warnings.filterwarnings("ignore", ".*layout not applied", UserWarning)  # A name is as wide as the figure.
        figure.savefig(target, **options)
