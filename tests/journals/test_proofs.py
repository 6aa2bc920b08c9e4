"""The trust in a journal: what is forged without the key is named or found, and nothing that it says is believed."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from forged_records import BOX, EXAMPLES, IDS, Record, forge, judge, plan_of, read, say_pass, scale_numbers
from same_facts import facts
from test_journal import new_journal

from contactverif import Run
from contactverif.journals.journal import record_files, write_record
from contactverif.journals.known_outcomes import KnownOutcomes
from contactverif.journals.outcome_records import FormRecord, OutcomeRecord
from contactverif.journals.run_journal import Journal
from contactverif.journals.run_plan import is_provable
from contactverif.run import second_look


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    folder = new_journal(tmp_path_factory.mktemp("proven"), plan_of())
    return judge(Journal(plan_of(), folder)), folder


@pytest.fixture
def copy(unbroken: tuple[Run, Path], tmp_path: Path) -> Path:
    return Path(shutil.copytree(unbroken[1], tmp_path / "copy"))


def go_on(folder: Path) -> tuple[Run, Journal]:
    journal = Journal(plan_of(), None, [folder])
    return judge(journal), journal


def without_key(folder: Path) -> Path:
    """Return a journal with the same records, of which the key is not here."""
    write_record(folder / "header", msgspec.structs.replace(plan_of(), nonce="another"))
    return folder


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


FORGERIES: list[Callable[[Record], Record]] = [say_pass, scale_numbers, exchange_rows, exchange_cases, impossible]


def test_a_proven_journal_is_believed_and_nothing_is_judged(unbroken: tuple[Run, Path]) -> None:
    result, journal = go_on(unbroken[1])
    assert facts(result) == facts(unbroken[0])
    assert (journal.remarks, journal.doubt) == ([], "")
    assert "unproven_outcomes" not in result.provenance


def test_what_does_not_fit_the_key_is_named_and_judged_again(unbroken: tuple[Run, Path], copy: Path) -> None:
    """`tests/hostile/test_forged_journals.py` forges in more ways."""
    forge(copy, scale_numbers)
    result, journal = go_on(copy)
    assert facts(result) == facts(unbroken[0])
    (remark,) = journal.remarks
    assert remark.startswith(f"{journal.known.n_misfits} records do not fit the key of the journal; ")
    assert f" in copy/{record_files(copy)[0].name}" in remark
    assert remark.endswith("; …; what they say is judged again")


def test_records_of_another_run_or_of_another_file_do_not_fit(
    unbroken: tuple[Run, Path], copy: Path, tmp_path: Path
) -> None:
    other = new_journal(tmp_path, plan_of())
    judge(Journal(plan_of(), other))
    (first,) = record_files(copy)
    for foreign in (record_files(other)[0], first):
        shutil.copy(foreign, copy / "1-00000000.outcomes")
        result, journal = go_on(copy)
        assert facts(result) == facts(unbroken[0])
        assert journal.known.n_misfits == len([*read(first)])
        assert journal.known.n_outcomes == 2 * EXAMPLES + 1


@pytest.mark.parametrize("change", FORGERIES)
def test_without_the_key_a_share_of_each_row_is_judged_again(
    unbroken: tuple[Run, Path], copy: Path, change: Callable[[Record], Record]
) -> None:
    """Every outcome of a row is forged, so that any share shows it."""
    forge(without_key(copy), change)
    result, journal = go_on(copy)
    assert facts(result) == facts(unbroken[0])
    assert all("that were judged again differ, " in remark for remark in journal.remarks)
    if change in (scale_numbers, exchange_cases):
        assert [remark.split(":")[0] for remark in journal.remarks] == [f"nts {id_}" for id_ in IDS]


def test_the_report_says_how_many_outcomes_had_no_proof(unbroken: tuple[Run, Path], copy: Path) -> None:
    result, journal = go_on(without_key(copy))
    assert facts(result) == facts(unbroken[0])
    assert journal.remarks == []
    count = 2 * EXAMPLES + 1
    assert result.provenance["unproven_outcomes"] == f"{count}, of which 2 were judged again"


def test_outcomes_of_another_seed_are_found(
    unbroken: tuple[Run, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first case, the simplest, is that of every seed; so here it is not among those that are chosen."""
    monkeypatch.setattr(second_look, "choose_share", lambda numbers: numbers[-1:])
    other = new_journal(tmp_path, plan_of(seed=4))
    judge(Journal(plan_of(seed=4), other), seed=4)
    result, journal = go_on(without_key(other))
    assert facts(result) == facts(unbroken[0])
    assert len(journal.remarks) == 2
    assert journal.doubt == f"{2 * EXAMPLES + 1}, of which {2 * EXAMPLES + 1} were judged again"


def test_a_row_that_is_not_believed_is_not_believed_after_a_kill(unbroken: tuple[Run, Path], copy: Path) -> None:
    forge(without_key(copy), scale_numbers)
    journal = Journal(plan_of(), copy, [copy])
    for property_id in IDS:
        journal.distrust("nts", property_id, "it differs")
    journal.close()  # The run is killed before it judges anything.
    again = Journal(plan_of(), copy, [copy])
    assert again.known.n_outcomes == 0
    result = judge(again)
    assert facts(result) == facts(unbroken[0])
    assert again.doubt == ""
    third = Journal(plan_of(), None, [copy])  # What was judged since then counts.
    assert third.known.n_outcomes == 2 * EXAMPLES + 1


def test_a_key_that_a_plugin_could_read_proves_nothing(unbroken: tuple[Run, Path], tmp_path: Path) -> None:
    plan = plan_of(options={"isolation": {"isolation": "process"}})
    folder = new_journal(tmp_path, plan)
    judge(Journal(plan, folder))
    result, journal = go_on(folder)
    assert facts(result) == facts(unbroken[0])
    assert journal.n_judged_again == 2


def test_only_a_box_hides_the_key() -> None:
    assert is_provable(BOX)
    for options in ({}, {"isolation": None}, {"isolation": {}}, {"isolation": {"isolation": "inline"}}):
        assert not is_provable(options)


def test_what_has_no_numbers_and_no_proof_is_judged_again(unbroken: tuple[Run, Path], copy: Path) -> None:
    """A crash cannot be derived from anything."""

    def crash(record: Record) -> Record:
        if not isinstance(record, FormRecord):
            return record
        form = record.form._replace(measured=False, quantities=(), details=(), series=(), finding=None, n_found=0)
        return FormRecord(form)

    forge(without_key(copy), crash)
    result, journal = go_on(copy)
    assert facts(result) == facts(unbroken[0])
    assert journal.doubt == ""


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
    assert second_look.find_difference(stored, outcome, exact=exact) == words


def test_a_case_with_a_number_that_nobody_has_takes_no_memory(tmp_path: Path) -> None:
    """A list of all cases up to the number would take a terabyte."""
    plan = msgspec.structs.replace(plan_of(), examples=10**12)
    folder = new_journal(tmp_path, plan)
    notes = Journal(plan, folder).notes("nts", IDS[0], 10**12)
    outcome = judge(Journal()).rows[0].outcomes[0]
    notes.add(0, replace(outcome, case_or_summary=outcome.summary))
    known = KnownOutcomes([folder], 2, 2 * 10**12)
    known.close()
    assert known.n_outcomes == 1
    assert known.is_proven(0, 10**12)


def test_the_share_is_drawn_anew_and_has_at_least_one() -> None:
    numbers = list(range(10_000))
    first, second = second_look.choose_share(numbers), second_look.choose_share(numbers)
    assert len(first) == len(second) == 100
    assert first != second
    assert second_look.choose_share([7]) == [7]
