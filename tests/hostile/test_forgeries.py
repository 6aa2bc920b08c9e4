"""A forged journal is not believed, an audit sees what was forged in a report, and the page says what the tables say.

`forged_journals.py` and `forged_reports.py` forge many more, and count.
"""

import random

import forged_journals
import forged_reports
import forged_shards
import pytest
from catalogue import PLUGINS
from containment import MODES
from forged_reports import NUMBERS
from hostile_page import NOT_CONTAINED, PAGE, REACHES, is_whole, name_of, page, rows
from tables import FOLDER

NAMED = ("other numbers", "records of another seed")  # The kinds that differ in numbers, so that a line names them.


@pytest.fixture(scope="module")
def journals(tmp_path_factory: pytest.TempPathFactory) -> forged_journals.Forgery:
    return forged_journals.Forgery(tmp_path_factory.mktemp("journals"))


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> forged_reports.Forgery:
    return forged_reports.Forgery(tmp_path_factory.mktemp("reports"))


@pytest.fixture(scope="module")
def shards(tmp_path_factory: pytest.TempPathFactory) -> forged_shards.Forgery:
    return forged_shards.Forgery(tmp_path_factory.mktemp("shards"))


@pytest.mark.parametrize("kind", forged_journals.KINDS)
def test_a_forged_journal_is_not_believed(journals: forged_journals.Forgery, kind: str) -> None:
    endings = {journals.attack(kind, random.Random(f"{kind}/{number}")) for number in range(2)}
    assert not endings & journals.harmful
    if kind in NAMED:
        assert endings == {"named"}


@pytest.mark.parametrize("kind", ["isolation", "a scene file", "a program", "a pipe"])
def test_a_merge_does_not_obey_a_shard(shards: forged_shards.Forgery, kind: str) -> None:
    assert shards.attack(kind, random.Random(kind)) not in shards.harmful


@pytest.mark.parametrize("kind", [kind for kind in forged_reports.KINDS if kind not in NUMBERS])
def test_an_audit_sees_what_disagrees_with_the_numbers(reports: forged_reports.Forgery, kind: str) -> None:
    assert reports.attack(kind, random.Random(kind)) not in reports.harmful


def test_an_audit_sees_most_numbers_of_many(reports: forged_reports.Forgery) -> None:
    kind = next(kind for kind, count in NUMBERS.items() if count > 1)
    assert reports.attack(kind, random.Random(1)) != "traceback"
    assert 0.3 < reports.chance[str(NUMBERS[kind])] < 1


def test_the_page_says_what_the_tables_say() -> None:
    assert (FOLDER / PAGE).read_text(encoding="utf-8") == page()


def test_all_hostile_plugins_are_contained_but_those_with_a_reason() -> None:
    """A plugin that was written against a box is contained in a box alone."""
    others = {mode: {name_of(row) for row in rows(mode) if not is_whole(row)} for mode in ("box", "process")}
    assert others["box"] <= set(NOT_CONTAINED["box"])
    assert {name for name in others["process"] if not name.startswith(REACHES)} <= {"leaves-memory-file"}


def test_every_plugin_was_run_in_every_way() -> None:
    for mode in MODES:
        assert {name_of(row) for row in rows(mode)} == set(PLUGINS)
