"""The recheck of a store: what is forged in a whole row is found, and nothing that it says is believed."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import msgspec
import pytest
from forged_records import EXAMPLES, IDS, Record, forge, judge, plan_of, say_pass, scale_numbers
from same_facts import facts
from test_store import journal_of

from contactverif import Run
from contactverif.contract.property import Verdict
from contactverif.run import recheck
from contactverif.run.store import FormRecord, OutcomeRecord, Store

N_OUTCOMES = 2 * EXAMPLES + 1  # One formulation states that it fails, and has a witness.


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    folder = journal_of(tmp_path_factory.mktemp("whole"), plan_of())
    return judge(Store(plan_of(), folder)), folder


@pytest.fixture
def copy(unbroken: tuple[Run, Path], tmp_path: Path) -> Path:
    return Path(shutil.copytree(unbroken[1], tmp_path / "copy"))


def go_on(folder: Path) -> tuple[Run, Store]:
    store = Store(plan_of(), None, [folder])
    return judge(store), store


def exchange_rows(record: Record) -> Record:
    return msgspec.structs.replace(record, row=1 - record.row) if isinstance(record, OutcomeRecord) else record


def exchange_cases(record: Record) -> Record:
    """Return each outcome as that of the next case, and the last as that of the witness."""
    if not isinstance(record, OutcomeRecord):
        return record
    return msgspec.structs.replace(record, number=(record.number + 2) % (EXAMPLES + 1) - 1)


def impossible(record: Record) -> Record:
    changes = {"row": 10**9, "number": 2**63, "form": 2**63}
    return msgspec.structs.replace(record, **changes) if isinstance(record, OutcomeRecord) else record


def without_numbers(verdict: Verdict, reason: str, record: Record) -> Record:
    """Return the form of an outcome without numbers, which cannot be derived from anything."""
    if not isinstance(record, FormRecord):
        return record
    return FormRecord(
        msgspec.msgpack.encode([msgspec.msgpack.decode(record.form)[0], verdict.name, reason, None, 0.0, False])
    )


crash = partial(without_numbers, Verdict.CRASHED, "signal 9")
empty_pass = partial(without_numbers, Verdict.PASS, "")


def test_what_agrees_is_kept_and_the_report_says_how_much_was_judged_again(unbroken: tuple[Run, Path]) -> None:
    result, store = go_on(unbroken[1])
    assert facts(result) == facts(unbroken[0])
    assert store.remarks == []
    assert result.provenance["stored_outcomes"] == f"{N_OUTCOMES}, of which 2 were judged again"
    assert "stored_outcomes" not in unbroken[0].provenance


@pytest.mark.parametrize(
    "change", [say_pass, scale_numbers, exchange_rows, exchange_cases, impossible, crash, empty_pass]
)
def test_a_row_that_is_forged_is_found(
    unbroken: tuple[Run, Path], copy: Path, change: Callable[[Record], Record]
) -> None:
    """Every outcome of a row is forged, so that any share shows it."""
    forge(copy, change)
    result, store = go_on(copy)
    assert facts(result) == facts(unbroken[0])
    assert all("that were judged again differ, " in remark for remark in store.remarks)
    if change in (scale_numbers, exchange_cases):
        assert [remark.split(":")[0] for remark in store.remarks] == [f"nts {id_}" for id_ in IDS]


def test_outcomes_of_another_seed_are_found(
    unbroken: tuple[Run, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first case, the simplest, is that of every seed; so here it is not among those that are chosen."""
    monkeypatch.setattr(recheck, "choose_share", lambda numbers: numbers[-1:])
    other = journal_of(tmp_path, plan_of(seed=4))
    judge(Store(plan_of(seed=4), other), seed=4)
    result, store = go_on(other)
    assert facts(result) == facts(unbroken[0])
    assert len(store.remarks) == 2
    assert result.provenance["stored_outcomes"] == f"{N_OUTCOMES}, of which {N_OUTCOMES} were judged again"


def test_a_row_that_is_rejected_stays_rejected_after_a_kill(unbroken: tuple[Run, Path], copy: Path) -> None:
    forge(copy, scale_numbers)
    store = Store(plan_of(), copy, [copy])
    for property_id in IDS:
        store.reject("nts", property_id, "it differs")
    store.close()  # The run is killed before it judges anything.
    again = Store(plan_of(), copy, [copy])
    assert again.n_outcomes == 0
    assert facts(judge(again)) == facts(unbroken[0])
    assert again.n_stored == 0
    assert Store(plan_of(), None, [copy]).n_outcomes == N_OUTCOMES  # What was judged since then counts.


@pytest.mark.parametrize(("change", "exact", "differs"), [(0.5, False, False), (0.5, True, True), (1.5, False, True)])
def test_on_another_machine_numbers_agree_up_to_their_tolerance(
    unbroken: tuple[Run, Path], change: float, exact: bool, differs: bool
) -> None:
    outcome = unbroken[0].rows[0].outcomes[0]
    assert outcome.measurement is not None
    number, *others = outcome.measurement.numbers
    other = replace(number, value=number.value + change * number.tolerance)
    stored = replace(outcome, measurement=replace(outcome.measurement, numbers=[other, *others]))
    words = f"{number.quantity.name} is {other.value!r}, and again {number.value!r}" if differs else ""
    assert recheck.find_difference(stored, outcome, exact=exact) == words


def test_the_share_is_drawn_anew_and_has_at_least_one() -> None:
    numbers = list(range(10_000))
    first, second = recheck.choose_share(numbers), recheck.choose_share(numbers)
    assert len(first) == len(second) == 100
    assert first != second
    assert recheck.choose_share([7]) == [7]
