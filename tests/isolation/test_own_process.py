"""A plugin in a process of its own: the same answers as here, and an error whatever it does."""

import os
import pickle
import subprocess
import sys
import threading
import time

import numpy as np
import psutil
import pytest
from isolation import hostile_few

from contactverif import Pairing, Subject, Verdict, load_formulation, load_properties, named_case, verify
from contactverif.contract.arrays import dense
from contactverif.contract.errors import ContractError, MisuseError, PluginError
from contactverif.contract.result import NotLoaded
from contactverif.isolation import host, process
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import RemoteSubject, count_ends, load_remote, places
from contactverif.run.worker_pool import worker_pool

CASE = named_case("c")
QUICK = Limits(seconds=20.0, memory=2000)


def ask(subject: Subject) -> None:
    formulation = subject.for_case(CASE)
    formulation.residual(CASE.interface, formulation.pair(CASE.interface, CASE.z), CASE.z)


def test_every_answer_is_that_of_this_process() -> None:
    near, far = (load_formulation("vts-ppt", limits).for_case(CASE) for limits in (None, Limits()))
    interface, z = CASE.interface, CASE.z
    pairings = near.pair(interface, z), far.pair(interface, z)
    assert pairings[0] == pairings[1]
    batch = np.array([[z, 1.001 * z]])
    for name in ("residual", "tangent", "contact_points"):
        ours, theirs = (getattr(f, name)(interface, p, z) for f, p in zip((near, far), pairings, strict=True))
        if name == "contact_points":
            ours, theirs = (np.concatenate([points.gap, points.pressure, points.xi]) for points in (ours, theirs))
        assert np.array_equal(dense(ours), dense(theirs), equal_nan=True)
    batches = [f.residual(interface, p, batch) for f, p in zip((near, far), pairings, strict=True)]
    assert np.array_equal(*batches)
    assert np.array_equal(far.residual(interface, pairings[0], z), far.residual(interface, pairings[1], z))


def test_promises_and_parts_are_those_of_this_process() -> None:
    for name in ("vts-ppt", "mortar-lm", "two-pass/nts-ar"):
        near, far = load_formulation(name), load_formulation(name, Limits())
        assert (far.traits, far.provides) == (near.traits, near.provides)
        assert pickle.loads(pickle.dumps(far)).traits == near.traits


def test_a_batch_goes_in_one_piece_to_a_plugin_that_takes_none() -> None:
    formulation = load_remote(hostile_few.PROGRAM, "Springs", QUICK).for_case(CASE)
    pairing = formulation.pair(CASE.interface, CASE.z)
    batch = np.array([CASE.z, 2 * CASE.z])
    forces = formulation.residual(CASE.interface, pairing, batch)
    assert np.array_equal(forces[1], formulation.residual(CASE.interface, pairing, 2 * CASE.z))


def test_a_matrix_is_the_same_there_and_here_and_so_are_its_mistakes() -> None:
    near, far = Subject("Matrix", hostile_few.Matrix), load_remote(hostile_few.PROGRAM, "Matrix", QUICK)
    for penalty in hostile_few.MATRICES:
        answers = []
        for formulation in (near.with_penalty(penalty), far.with_penalty(penalty)):
            pairing = formulation.pair(CASE.interface, CASE.z)
            try:
                tangent = formulation.tangent(CASE.interface, pairing, CASE.z)
                entries = tangent.tocoo()
                answers.append([tangent.format, *(part.tolist() for part in (entries.data, entries.row, entries.col))])
            except ContractError as error:
                answers.append(f"{type(error).__name__}: {error}")
        assert answers[0] == answers[1]
        assert isinstance(answers[0], str) is (penalty in hostile_few.WRONG_MATRICES)


def test_multipliers_that_nobody_promised_are_found_at_the_first_question() -> None:
    for subject in (load_remote(hostile_few.PROGRAM, "Counts", QUICK), Subject("Counts", hostile_few.Counts)):
        with pytest.raises(ContractError, match="n_multipliers: 3 of them, with the trait enforcement 'penalty'"):
            ask(subject)


def test_a_handle_stays_in_its_process() -> None:
    handled, plain = (
        load_remote(hostile_few.PROGRAM, name, QUICK).for_case(CASE) for name in ("HandledSprings", "Springs")
    )
    interface = CASE.interface
    assert handled.pair(interface, CASE.z) is None
    pairing = handled.own_pairing(interface, CASE.z)
    assert pairing is not None
    assert (pairing.opaque, pairing.handle, dict(pairing)) == (True, None, {})
    states = np.array([CASE.z, -CASE.z, 2 * CASE.z])
    expected = [plain.residual(interface, plain.pair(interface, z), z) for z in states]
    assert np.array_equal(handled.residual(interface, None, states), expected)
    assert np.array_equal(handled.residual(interface, pairing, CASE.z), expected[0])
    other = handled.own_pairing(interface, -CASE.z)
    assert np.array_equal(handled.residual(interface, other, -CASE.z), expected[1])


def test_a_plugin_pairs_with_a_handle_always_or_never() -> None:
    formulation = load_remote(hostile_few.PROGRAM, "HandledAtTimes", QUICK).for_case(CASE)
    assert formulation.pair(CASE.interface, CASE.z) is None
    far = CASE.z + 2000
    with pytest.raises(ContractError, match="pair: returned a handle in some states, and none in others"):
        dict(formulation.own_pairing(CASE.interface, far))


@pytest.mark.parametrize(
    ("name", "cause", "words"),
    [
        ("Kills", "signal", "residual: SIGSEGV ended its process"),
        ("Exits", "exit", "residual: its process ended with status 0"),
        ("KillsInPair", "signal", "pair: SIGABRT ended its process"),
        ("RaisesInPair", "exception", "pair: RuntimeError: no pairing today"),
        ("RaisesInMake", "exception", "make: ValueError: no other penalty"),
        ("Hangs", "hang", "residual: no answer within 0.5 s"),
        ("HangsInPair", "hang", "pair: no answer within 0.5 s"),
        ("Cuts", "hang", ": no answer within 0.5 s"),
        ("TakesAll", "memory", "residual: .*MemoryError"),
        ("Forges", "channel", "residual: a message that cannot be read"),
        ("TooLong", "memory", "residual: an answer of"),
        ("RaisesUnspeakable", "exception", "residual: Unspeakable, whose message cannot be read"),
        ("Shouts", "exception", r"residual: ValueError: x+… \(20000000 characters\)"),
    ],
)
def test_whatever_it_does_is_an_error_that_says_it(name: str, cause: str, words: str) -> None:
    subject = load_remote(hostile_few.PROGRAM, name, QUICK)
    if name in ("Hangs", "HangsInPair", "Cuts", "TooLong"):  # The import takes longer than such a limit.
        subject.host._limits = Limits(seconds=0.1)
    with pytest.raises(PluginError, match=words) as caught:
        ask(subject)
    assert caught.value.cause == cause
    assert caught.value.ended is (cause not in ("exception",) and name != "TakesAll")


def test_a_process_that_ended_is_started_again() -> None:
    subject = load_remote(hostile_few.PROGRAM, "Kills", QUICK)
    for times in (1, 2):
        with pytest.raises(PluginError, match="SIGSEGV"):
            ask(subject)
        assert count_ends(subject) == times
    pairing = subject.for_case(CASE).pair(CASE.interface, CASE.z)
    assert pairing["active"].dtype == np.bool_


def test_one_that_always_ends_its_process_is_not_asked_for_ever() -> None:
    (question,) = load_properties(["patch.flat.transmission"])
    (row,) = verify([load_remote(hostile_few.PROGRAM, "Kills", QUICK)], [question], examples=20, seed=1).rows
    reasons = [outcome.reason for outcome in row.outcomes]
    assert row.verdict is Verdict.CRASHED
    assert sum("SIGSEGV" in reason for reason in reasons) <= 3
    assert reasons[-1] == "not asked: its process ended 3 times"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Springs", None),
        ("KnowsItsProcess", "difference from a second process"),
        ("PairsByThreads", None),
    ],
)
def test_purity_asks_a_second_process(name: str, words: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONHASHSEED", "1")
    (question,) = load_properties(["purity"])
    (here,) = verify([Subject(name, getattr(hostile_few, name))], [question], examples=4, seed=1).rows
    (there,) = verify([load_remote(hostile_few.PROGRAM, name, QUICK)], [question], examples=4, seed=1).rows
    assert here.verdict is Verdict.PASS
    assert there.verdict is (Verdict.FAIL if words else Verdict.PASS), there.reason
    assert words is None or words in there.reason


@pytest.mark.parametrize("threads", ["", "4"])
def test_every_process_of_a_plugin_has_one_thread(threads: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenMP, linear algebra, numba, and cores, which TBB counts: in the first process and in the second."""
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        monkeypatch.setenv(name, threads) if threads else monkeypatch.delenv(name, raising=False)
    first = load_remote(hostile_few.PROGRAM, "PairsByThreads", QUICK)
    assert isinstance(first, RemoteSubject)
    for subject in (first, first.restart()):
        pairing = subject.for_case(CASE).pair(CASE.interface, CASE.z)
        assert pairing is not None
        assert pairing["threads"].tolist() == [1, 1, 1, 1]


def test_a_worker_of_a_run_has_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plugin lives there with `--isolation inline`."""
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    with worker_pool(2) as executor:
        assert executor is not None
        assert executor.submit(hostile_few.count_threads).result() == (1, 1, 1)
    assert os.environ["OMP_NUM_THREADS"] == "4"


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Springs", ""),
        ("WearsOut", "entries that change in 2,000 calls of one instance"),
        ("WrongAtFirst", "difference of the first residual of a process"),
    ],
)
def test_a_long_life_and_a_fresh_process_answer_alike(name: str, words: str, jobs: int) -> None:
    """The check of signs takes the first call, here and in a process of the plugin, in a worker or not."""
    questions = load_properties(["patch.flat.transmission", "purity.long"])
    hostile_few.WrongAtFirst.answered = False
    with worker_pool(jobs) as executor:
        for subject in (Subject(name, getattr(hostile_few, name)), load_remote(hostile_few.PROGRAM, name, QUICK)):
            _, row = verify([subject], questions, examples=2, seed=1, executor=executor).rows
            assert row.verdict is (Verdict.FAIL if words else Verdict.PASS), row.reason
            assert words in row.reason
        host.end_all()


def test_processes_make_room_where_memory_is_short(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = (load_remote(hostile_few.PROGRAM, name, QUICK) for name in ("Springs", "HandledSprings"))
    ask(first)
    monkeypatch.setattr(host, "_LEAST_MEMORY", 1 << 60)
    ask(second)
    third = load_remote(hostile_few.PROGRAM, "RaisesInMake", QUICK)
    assert [subject.host.has_process for subject in (first, second, third)] == [False, False, True]
    ask(first)  # It starts again, and that is no mistake of the plugin.
    assert count_ends(first) == 0


def test_a_damaged_pairing_of_the_judge_is_refused_there_as_here() -> None:
    formulation = load_remote(hostile_few.PROGRAM, "Springs", QUICK).for_case(CASE)
    pairing = Pairing({"other": np.zeros(3, np.int64)})
    with pytest.raises(PluginError, match="residual: KeyError: 'active'"):
        formulation.residual(CASE.interface, pairing, CASE.z)


def test_a_wrong_option_is_a_mistake_of_the_user() -> None:
    with pytest.raises(MisuseError, match=r"option of .*: found .colour."):
        load_formulation("vts-me:colour=red", QUICK)
    with pytest.raises(MisuseError, match="formulation"):
        load_formulation("no-such", QUICK)


def test_a_formulation_that_cannot_be_imported_is_not_loaded() -> None:
    assert isinstance(load_remote(hostile_few.PROGRAM, "no_such_class", QUICK), NotLoaded)


def test_a_process_without_a_thread_for_its_output_is_not_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threading.Thread, "start", lambda _: hostile_few.throw(RuntimeError("can't start new thread")))
    item = load_remote(hostile_few.PROGRAM, "Springs", Limits(seconds=22.0))
    assert isinstance(item, NotLoaded)
    assert "does not start: can't start new thread" in item.reason


def test_a_lower_limit_of_the_user_stays() -> None:
    words = "import resource; number = resource.RLIMIT_NPROC; resource.setrlimit(number, (400, 400)); "
    words += "from contactverif.isolation import confine; confine._lower('RLIMIT_NPROC', 512); "
    command = [sys.executable, "-c", f"{words}print(*resource.getrlimit(number))"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "400 400\n"


def test_what_it_prints_is_kept_wherever_its_process_is() -> None:
    ask(load_remote(hostile_few.PROGRAM, "Prints", QUICK))
    host.note_last_words({"Other": b"in a worker"})
    assert host.end_all() == {"Prints": b"printed\nand written\n", "Other": b"in a worker"}
    assert host.end_all() == {}


def test_nothing_it_started_is_left_behind() -> None:
    ask(load_remote(hostile_few.PROGRAM, "LeavesChildren", QUICK))
    for _ in range(500):
        marked = [p.pid for p in psutil.process_iter() if _is_marked(p)]
        if len(marked) > 1:
            break
        time.sleep(0.01)
    assert len(marked) > 1
    host.end_all()
    time.sleep(0.1)
    assert not [pid for pid in marked if psutil.pid_exists(pid) and psutil.Process(pid).status() != "zombie"]


def _is_marked(item: psutil.Process) -> bool:
    try:
        return item.environ().get(process.MARK) == process._run
    except (psutil.Error, OSError):
        return False


def test_limits_are_positive() -> None:
    with pytest.raises(MisuseError, match="time limit: found 0"):
        Limits(seconds=0)


@pytest.mark.skipif(not os.path.exists("/proc/self/maps"), reason="this system does not show what is mapped")
def test_the_report_names_the_compiled_code_of_the_process_and_not_that_of_the_judge() -> None:
    subject = load_remote((*hostile_few.PROGRAM,), "LoadsLibrary", QUICK)
    assert isinstance(subject, RemoteSubject)
    facts = places([subject, Subject("near", hostile_few.Springs)])
    assert facts["isolation"] == "inline; process"
    assert "opened" not in facts
    names = [entry.split()[0] for entry in facts["libraries"].split("; ")]
    assert any(name.startswith("_curses") for name in names)
    assert not any("_multiarray_umath" in name for name in names)


def test_a_row_says_by_which_traits_it_is_promised_in_the_same_words_wherever_the_plugin_lives() -> None:
    """Found by the hostile campaign: a table of forces was written with the name of its class, which differs."""
    for place in ("inline", "process"):
        (row,) = verify("nts", "patch.flat.published", examples=1, isolation=place).rows
        assert row.promised_by == "published_forces", place
