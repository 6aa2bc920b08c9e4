"""A plugin in a box: the same answers, and nothing outside that it can change, stop or reach."""

import os
import pty
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from isolation import boxed_few, hostile_few

from contactverif import Subject, load_formulation, named_case
from contactverif.contract.errors import PluginError
from contactverif.contract.result import NotLoaded
from contactverif.isolation import box as boxes
from contactverif.isolation import process
from contactverif.isolation.box import MOST_PROCESSES, Box, ControlGroup, _find_parents, why_no_box
from contactverif.isolation.confine import NETWORK, landlock_version
from contactverif.isolation.host import end_all
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import RemoteSubject, count_ends, load_remote, python_program, survey

LIMITS = Limits(seconds=20.0, memory=2000, box=Box())
needs_box = pytest.mark.skipif(bool(why_no_box()), reason=why_no_box() or "there are boxes")


def try_targets(
    monkeypatch: pytest.MonkeyPatch, box: Box | None, limits: Limits = LIMITS, **targets: object
) -> set[str]:
    """Return which attempts a plugin manages, {method of `boxed_few`: what it aims at}."""
    monkeypatch.setenv(boxed_few.TARGETS, "\n".join(f"{verb} {target}" for verb, target in targets.items()))
    item = load_remote(boxed_few.PROGRAM, "Attempts", replace(limits, box=box))
    assert isinstance(item, NotLoaded)
    return set(item.reason.partition("managed: ")[2].partition(" (")[0].split()) - {"nothing"}


@pytest.fixture
def bystander() -> Iterator[psutil.Process]:
    """Yield a process of the same user."""
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as popen:
        yield psutil.Process(popen.pid)
        popen.kill()


@needs_box
def test_answers_are_those_of_this_process() -> None:
    case = named_case("c")
    forces = []
    for limits in (None, LIMITS):
        formulation = load_formulation("vts-ppt", limits).for_case(case)
        forces.append(formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z))
    assert np.array_equal(*forces)


@needs_box
def test_files_can_be_read_and_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "file"
    file.write_text("as it was", encoding="utf-8")
    attempts = {"write_file": file, "delete_file": file, "read_file": file}
    assert try_targets(monkeypatch, Box(), **attempts) == {"read_file"}
    assert file.read_text(encoding="utf-8") == "as it was"
    assert try_targets(monkeypatch, None, write_file=file) == {"write_file"}


@needs_box
def test_what_is_hidden_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, file = tmp_path / "journal", tmp_path / "report"
    folder.mkdir()
    for path in (folder / "file", file):
        path.write_text("secret", encoding="utf-8")
    hidden = Box(hidden=(str(folder), str(file), str(tmp_path / "absent")))
    for path in (folder / "file", file):
        assert try_targets(monkeypatch, hidden, read_file=path) == set()
        assert try_targets(monkeypatch, Box(), read_file=path) == {"read_file"}


@needs_box
def test_what_is_opened_can_be_written_but_for_what_is_hidden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hidden = tmp_path / "journal"
    hidden.mkdir()
    box = Box(opened=(str(tmp_path),), hidden=(str(hidden),))
    assert try_targets(monkeypatch, box, write_file=tmp_path / "new") == {"write_file"}
    assert (tmp_path / "new").read_text(encoding="utf-8") == "changed"
    try_targets(monkeypatch, box, write_file=hidden / "new")
    assert not list(hidden.iterdir())


@needs_box
def test_other_processes_cannot_be_seen_or_stopped(bystander: psutil.Process, monkeypatch: pytest.MonkeyPatch) -> None:
    attempts = {"see_process": bystander.pid, "limit_process": bystander.pid, "stop_process": bystander.pid}
    assert try_targets(monkeypatch, Box(), **attempts) == set()
    assert bystander.status() != psutil.STATUS_STOPPED
    assert try_targets(monkeypatch, None, **attempts) == set(attempts)


@needs_box
def test_no_line_leads_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"contactverif-test-{os.getpid()}"
    with (
        socket.create_server(("127.0.0.1", 0)) as by_network,
        socket.socket(socket.AF_UNIX) as by_file,
        socket.socket(socket.AF_UNIX) as by_name,
    ):
        by_file.bind(str(tmp_path / "s"))
        by_name.bind(f"\0{name}")
        by_file.listen()
        by_name.listen()
        attempts = {
            "connect_by_network": by_network.getsockname()[1],
            "connect_by_file": tmp_path / "s",
            "connect_by_name": name,
        }
        assert try_targets(monkeypatch, Box(), **attempts) == set()
        assert try_targets(monkeypatch, Box(opened=(NETWORK,)), **attempts) == {"connect_by_network", "connect_by_name"}
        assert try_targets(monkeypatch, None, **attempts) == set(attempts)


@needs_box
def test_a_box_has_a_network_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rules of Landlock took its ports away, and OpenSees, which listens to one, ended as it was imported."""
    assert try_targets(monkeypatch, Box(), talk_to_itself="127.0.0.1") == {"talk_to_itself"}


@needs_box
def test_shared_memory_is_that_of_the_box(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = Path(f"/dev/shm/contactverif-{os.getpid()}")
    memory.write_text("of this process", encoding="utf-8")
    try:
        assert try_targets(monkeypatch, Box(), read_file=memory) == set()
        assert try_targets(monkeypatch, None, read_file=memory) == {"read_file"}
    finally:
        memory.unlink()


@needs_box
def test_a_terminal_cannot_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = pty.openpty()
    try:
        attempts = {"write_to_terminal": os.ttyname(theirs)}
        assert try_targets(monkeypatch, Box(), **attempts) == set()
        assert try_targets(monkeypatch, None, **attempts) == {"write_to_terminal"}
    finally:
        os.close(ours)
        os.close(theirs)


@needs_box
@pytest.mark.skipif(
    not any(os.access(parent, os.W_OK) for _, parent in _find_parents()), reason="this user may make no control group"
)
def test_all_processes_of_a_box_share_the_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    groups = list[ControlGroup]()
    make = ControlGroup.__init__
    monkeypatch.setattr(ControlGroup, "__init__", lambda self, *limit: (groups.append(self), make(self, *limit))[1])
    assert try_targets(monkeypatch, Box(), fork_often=2 * MOST_PROCESSES) == set()
    assert try_targets(monkeypatch, Box(), fork_often=MOST_PROCESSES // 4) == {"fork_often"}
    monkeypatch.setattr(boxes, "_BASE_MEMORY", 256 << 20)
    small = replace(LIMITS, memory=1000)
    assert try_targets(monkeypatch, Box(), small, fill_memory=3600) == set()
    assert try_targets(monkeypatch, Box(), small, fill_memory=400) == {"fill_memory"}
    end_all()
    assert not [folder for group in groups for folder in group.folders]


@needs_box
def test_settings_of_the_system_cannot_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    """The system runs the program that gets images of crashed processes, and root could name another one."""
    attempts = {"open_to_write": "/proc/sys/fs/lease-break-time"}
    assert try_targets(monkeypatch, Box(), **attempts) == set()
    assert try_targets(monkeypatch, None, **attempts) == (set(attempts) if os.geteuid() == 0 else set())


@needs_box
@pytest.mark.parametrize("folder", ["/run", "/dev", "/sys/fs/cgroup"])
def test_folders_that_are_hidden_take_no_files(folder: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert try_targets(monkeypatch, Box(), make_file=f"{folder}/hostile", list_folder="/sys/fs/cgroup") == set()


@needs_box
@pytest.mark.skipif(not boxes._no_namespaces(), reason="this bubblewrap cannot forbid namespaces")
def test_a_box_has_no_further_namespaces(monkeypatch: pytest.MonkeyPatch) -> None:
    """With rights of its own in another namespace, a plugin could mount control groups and lift its limits."""
    assert try_targets(monkeypatch, Box(), make_user_namespace=0x10000000) == set()


@needs_box
def test_the_file_that_tells_the_progress_cannot_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    assert try_targets(monkeypatch, Box(), lengthen_progress=1 << 20) == set()


@needs_box
@pytest.mark.skipif(not landlock_version(), reason="this system has no Landlock")
def test_rules_of_landlock_hold_in_a_box(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They keep pipes of other programs, and the first process of the box, which ends it with its parent."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        assert try_targets(monkeypatch, Box(), open_to_write=pipe, attach_to=1) == set()
        assert try_targets(monkeypatch, None, open_to_write=pipe) == {"open_to_write"}
    finally:
        os.close(reader)


@needs_box
def test_a_box_that_forgets_to_end_with_its_parent_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plugin that may attach to the first process of its box can make it leave its session and outlive its parent."""
    real = boxes.enclose

    def enclose(*arguments: Any) -> tuple[str, ...]:
        return tuple("--new-session" if word == "--die-with-parent" else word for word in real(*arguments))

    monkeypatch.setattr(boxes, "enclose", enclose)
    code = "print('begins', flush=True); import time; time.sleep(60)"
    plugin = process.PluginProcess((sys.executable, "-c", code), LIMITS)
    with pytest.raises(PluginError):
        plugin.ask(b"", [process.Question(0, "import")], 3.0)
    assert plugin.output.last == b"begins\n"
    box = [other for other in psutil.process_iter() if code in _words(other)]
    psutil.wait_procs(box, timeout=5.0)
    assert not [other for other in box if other.is_running()]


@needs_box
def test_a_box_that_could_not_be_made_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Found by a golden run: a socket went between the look for sockets to hide and the start of the box."""
    real, attempts = boxes.enclose, [True]

    def enclose(*arguments: Any) -> tuple[str, ...]:
        flawed = ("/bin/sh", "-c", "echo 'bwrap: Can not bind mount' >&2; exit 1")
        return flawed if attempts and attempts.pop() else real(*arguments)

    monkeypatch.setattr(boxes, "enclose", enclose)
    subject = load_formulation("nts", LIMITS)
    assert isinstance(subject, Subject)
    assert count_ends(subject) == 0
    attempts[:] = [True]
    assert [type(item) for item in survey(hostile_few.PROGRAM, ["Springs"], LIMITS)] == [RemoteSubject]
    attempts[:] = [True]
    boxes.why_no_box.cache_clear()
    assert boxes.why_no_box() == ""
    attempts[:] = [True] * 3
    item = load_formulation("nts", replace(LIMITS, seconds=21.0))
    assert isinstance(item, NotLoaded)
    assert item.reason == "exit: import: its process ended with status 1: bwrap: Can not bind mount"


@needs_box
def test_daemons_that_fork_as_they_are_ended_end_with_the_box(tmp_path: Path) -> None:
    program = tmp_path / "boxed_few.py"  # Another path than in the tests that run at the same time.
    program.write_text(Path(boxed_few.__file__).read_text(encoding="utf-8"), encoding="utf-8")
    load_remote(python_program(str(program)), "Daemons", LIMITS)
    process.end_marked()

    def daemons() -> list[psutil.Process]:
        return [other for other in psutil.process_iter() if str(program) in _words(other)]

    psutil.wait_procs(daemons(), timeout=5.0)  # The system ends the processes of a box one after another.
    assert not daemons()


def _words(other: psutil.Process) -> list[str]:
    try:
        return list(other.cmdline())
    except psutil.Error:
        return []


@needs_box
@pytest.mark.parametrize("name", ["Kills", "Exits", "ExitsWithMinusOne"])
def test_the_end_of_a_process_is_told_as_without_a_box(name: str) -> None:
    case, ends = named_case("c"), []
    for box in (None, Box()):
        item = load_remote(hostile_few.PROGRAM, name, replace(LIMITS, box=box))
        assert isinstance(item, Subject)
        with pytest.raises(PluginError) as raised:
            item.for_case(case).residual(case.interface, None, case.z)
        ends.append((str(raised.value), raised.value.cause))
    assert ends[0] == ends[1]


def test_where_there_are_no_boxes_the_reason_names_a_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(boxes, "_program", lambda: "")
    assert boxes.why_no_box.__wrapped__() == (
        "bubblewrap is missing; install the package bubblewrap of the system, or contactverif[box]"
    )
    monkeypatch.setattr(boxes.sys, "platform", "darwin")
    assert boxes.why_no_box.__wrapped__() == "only Linux has boxes"


def test_where_user_namespaces_are_forbidden_the_reason_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "bwrap"
    program.write_text("#!/bin/sh\necho 'bwrap: setting up uid map: Permission denied' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr(boxes, "_program", lambda: str(program))
    monkeypatch.setattr(boxes.sys, "platform", "linux")
    reason = boxes.why_no_box.__wrapped__()
    assert reason.startswith("bwrap: setting up uid map: Permission denied; allow user namespaces")
    program.write_text("#!/missing/interpreter\n")
    assert boxes.why_no_box.__wrapped__().startswith("bubblewrap does not run (FileNotFoundError)")


@pytest.mark.skipif(not landlock_version(), reason="this system has no Landlock")
def test_rules_of_landlock_keep_files_network_and_processes(
    tmp_path: Path, bystander: psutil.Process, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, folder = tmp_path / "file", tmp_path / "open"
    file.write_text("as it was", encoding="utf-8")
    folder.mkdir()
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        attempts = {"write_file": file, "delete_file": file, "read_file": file, "connect_by_network": port}
        assert try_targets(monkeypatch, Box(by_rules=True), **attempts) <= {"read_file", "connect_by_network"}
    assert file.read_text(encoding="utf-8") == "as it was"
    box = Box(by_rules=True, opened=(str(folder),))
    assert try_targets(monkeypatch, box, write_file=folder / "new") == {"write_file"}
    if landlock_version() >= 6:
        assert try_targets(monkeypatch, box, stop_process=bystander.pid) == set()


@pytest.mark.skipif(not landlock_version(), reason="this system has no Landlock")
def test_compiled_code_works_under_rules_of_landlock() -> None:
    case = named_case("c")
    formulation = load_formulation("vts-ppt", replace(LIMITS, box=Box(by_rules=True))).for_case(case)
    assert formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z).any()
