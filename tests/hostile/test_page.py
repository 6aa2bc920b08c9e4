"""The page of hostile plugins says what the tables say."""

from catalogue import PLUGINS
from containment import MODES
from hostile_page import NOT_CONTAINED, PAGE, REACHES, is_whole, name_of, page, rows
from tables import FOLDER


def test_the_page_says_what_the_tables_say() -> None:
    assert (FOLDER / PAGE).read_text(encoding="utf-8") == page()


def test_all_hostile_plugins_in_a_box_are_contained_but_those_with_a_reason() -> None:
    assert {name_of(row) for row in rows("box") if not is_whole(row)} <= set(NOT_CONTAINED["box"])


def test_without_a_box_all_are_contained_but_those_that_were_written_against_it() -> None:
    others = {name_of(row) for row in rows("process") if not is_whole(row)}
    assert {name for name in others if not name.startswith(REACHES)} <= {"leaves-memory-file"}


def test_every_plugin_was_run_in_every_way() -> None:
    for mode in MODES:
        assert {name_of(row) for row in rows(mode)} == set(PLUGINS)
