"""The nastiest hostile plugins, in processes of their own: the run goes on, and nobody else notices.

`tox -e hostile` runs all of them one by one.
"""

from __future__ import annotations

import pytest
from catalogue import KINDS, PLUGINS
from containment import CHECKS, HEADS, judge

LEAST_PLUGINS = 80
# Plugins that run together: those that must be caught or are nobody's fault, and those that must be judged as NTS is.
CAUGHT = (
    "dies-exit-0",
    "dies-at-import",
    "raises-name-with-controls",
    "hangs-loop-in-c",
    "prints-write-rubbish-everywhere",
    "says-say-misuse",
)
LIKE_NTS = ("prints-print-escapes", "leaves-daemon", "process-no-paths", "process-other-folder")


def test_there_are_enough_plugins_of_every_kind_and_each_says_what_it_does() -> None:
    assert len(PLUGINS) >= LEAST_PLUGINS
    assert {plugin.kind for plugin in PLUGINS.values()} == set(KINDS)
    assert all(plugin.summary.endswith(".") for plugin in PLUGINS.values())


@pytest.mark.parametrize("names", [CAUGHT, LIKE_NTS], ids=["caught", "like nts"])
def test_hostile_plugins_are_contained(names: tuple[str, ...]) -> None:
    lines = judge([PLUGINS[name] for name in names], "process")
    for name, line in lines.items():
        cells = dict(zip(HEADS[1:], line, strict=True))
        assert all(cells[check] == "yes" for check in CHECKS), f"{name}: {cells}"
