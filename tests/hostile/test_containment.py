"""The catalogue of hostile plugins is complete, and each of them says what it does."""

from __future__ import annotations

from catalogue import KINDS, PLUGINS, QUICK

LEAST_PLUGINS = 80


def test_there_are_enough_plugins_of_every_kind_and_each_says_what_it_does() -> None:
    assert len(PLUGINS) >= LEAST_PLUGINS
    assert {plugin.kind for plugin in PLUGINS.values()} == set(KINDS)
    assert all(plugin.summary.endswith(".") for plugin in PLUGINS.values())
    assert set(QUICK) <= set(PLUGINS)
