"""The program of a plugin's process: it loads one formulation, and answers questions until its judge is gone.

Rules: nothing of the judge comes here, no expected answer and no other plugin. A plugin may do to this process what it
likes, so the judge checks every answer again. What cannot travel is checked here, and so is what the judge may not look
into, so that an error has the same words as in the judge's own process.
"""

import mmap
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import nullcontext, suppress
from dataclasses import fields
from functools import partial
from importlib import import_module
from time import perf_counter
from types import FrameType
from typing import Any, Self

import msgspec
import numpy as np

from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError, describe_error
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import CheckedFormulation, Subject, _call_plugin, _check_forces, copy_entries
from contactverif.isolation import child, wire
from contactverif.isolation.confine import PROCESSES, PROGRESS, SOCKET, confine, die_with_parent, hide_memory

METHODS = frozenset({"pair", "residual", "tangent", "residual_and_tangent"})
_SHORT = 1e-3  # Seconds. Other processes have used the caches before a call, so a shorter one is timed when repeated.
_COMPRESSED = ("data", "indices", "indptr")  # The arrays of a csr or csc matrix of scipy.
_USUAL = (np.float64, np.int32, np.int64)
_FORCES = ("<f8", "<c16")
_LARGEST_SURVEY = 1 << 20  # Bytes of a reply. Traits are some hundred.
_CHANGED = 113  # The status with which a process ends that a copy has changed.
_FOLDERS = tempfile.gettempdir(), "/dev/shm"  # The folders that may be written in a box.

Loader = Callable[[str], Any]  # {name: a `Subject`, a `NotLoaded`, or a `Wrapper`}.


def main(load: Loader, survey: Loader) -> None:
    """Answer the judge until it is gone. `survey` loads a name with the defaults of its options, also of a wrapper."""
    confine()
    channel, handler = child.Channel(child.socket_of_parent()), RequestHandler(load, survey)
    progress = mmap.mmap(int(os.environ[PROGRESS]), 1)
    while True:
        try:
            data = channel.receive()
        except child.ClosedError:
            os._exit(0)  # What a plugin wants to do at the end of its process is not waited for.
        replies: list[wire.Reply] = []
        for request in wire.decode_requests(data):
            progress[0] = len(replies)  # So the judge knows which call has ended this process.
            reply = handler.reply(request)
            if reply is not None:
                replies.append(reply)
        if replies:
            channel.send(wire.encode(replies))


class RequestHandler:
    """The store of a plugin's process: the formulation, and by number its instances, interfaces and pairings."""

    def __init__(self, load: Loader, survey: Loader) -> None:
        self._loaders = load, survey
        self._subject: Subject | None = None
        self._store: dict[int, Any] = {}

    def reply(self, request: wire.Request) -> wire.Reply | None:
        """Return the reply to a request; None if it has none."""
        if isinstance(request, wire.Load | wire.Ask):
            try:
                if isinstance(request, wire.Ask):
                    return self._ask(request)
                describe = partial(self._describe, request)
                return _survey_in_copy(describe, request.question) if request.survey and child.FORKS else describe()
            except BaseException as error:  # A plugin may raise what it likes, and may have changed what we call.
                return _failure(request.question, error)
        if isinstance(request, wire.Forget):
            for number in request.numbers:
                self._store.pop(number, None)
            return None
        # A request without reply never gets one, or the judge would take it for that of another question. So an error
        # is kept, and told when something is asked that needs what is missing.
        try:
            self._store[request.number] = self._item(request)
        except BaseException as error:  # A plugin may raise what it likes in its constructor.
            self._store[request.number] = error
        return None

    def _item(self, request: wire.Make | wire.ShareInterface | wire.SharePairing) -> Any:
        match request:
            case wire.Make(_, penalty):
                assert self._subject is not None
                formulation = self._subject.with_penalty(penalty)
                formulation.plugin, formulation.copy_matrix = Stopwatch(formulation.plugin), _keep_compressed
                return formulation
            case wire.ShareInterface(_, nodes, slave, master):
                return Interface.of_parts(nodes.unpack(), Surface(slave.unpack()), Surface(master.unpack()))
            case wire.SharePairing(_, arrays):
                return Pairing({name: array.unpack() for name, array in arrays.items()})

    def _get(self, number: int) -> Any:
        item = self._store[number]
        if isinstance(item, BaseException):
            raise item
        return item

    def _describe(self, request: wire.Load) -> wire.Reply:
        item = self._loaders[request.survey](request.name)
        if isinstance(item, NotLoaded):
            return wire.Unloaded(request.question, item.reason)
        if not isinstance(item, Subject):
            return wire.Wraps(request.question, str(item.summary), str(item.form))
        self._subject = item
        methods = item.provides | ({"n_multipliers"} if item.counts_multipliers else set())
        traits = msgspec.to_builtins(item.traits, enc_hook=_plain)
        return wire.Loaded(request.question, traits, sorted(methods))

    def _ask(self, ask: wire.Ask) -> wire.Reply:
        formulation: CheckedFormulation = self._get(ask.formulation)
        watch: Stopwatch = formulation.plugin
        interface: Interface = self._get(ask.interface)
        count = formulation.n_multipliers(interface)  # It is known from now on, so no call is timed with it.
        if ask.method == "n_multipliers":
            return wire.Answer(ask.question, {}, 0.0, 0, count)
        assert ask.z is not None
        arguments = interface, None if ask.pairing is None else self._get(ask.pairing), ask.z.unpack()
        watch.runs, watch.counts = ask.timed, ask.counted
        for _ in range(2):
            watch.seconds, watch.calls = 0.0, 0
            if ask.method == "pair":
                answer: Any = formulation.own_pairing(interface, arguments[2])
                self._store[ask.question] = answer
            elif ask.method == "residual":
                answer = _residual(formulation, *arguments)
            else:
                answer = getattr(formulation, ask.method)(*arguments)
            if not ask.timed or watch.seconds > _SHORT:
                break
        handle = ask.method == "pair" and answer.opaque
        return wire.Answer(ask.question, _pack(ask.method, answer), watch.seconds, watch.calls, handle=handle)


def _residual(formulation: CheckedFormulation, interface: Interface, pairing: Any, z: Any) -> Any:
    """Return the forces. The judge checks their shape and their numbers, so they are not checked twice."""
    size = interface.n_unknowns + formulation.n_multipliers(interface)
    if z.shape != (size,) or formulation.decides_anew(pairing):
        return formulation.residual(interface, pairing, z)
    forces = _call_plugin("residual", formulation.plugin.residual, interface, pairing, z)
    return (
        forces if type(forces) is np.ndarray and forces.dtype.str in _FORCES else _check_forces("residual", forces, z)
    )


def _plain(value: Any) -> Any:
    return dict(value) if isinstance(value, Mapping) else value.item()


class MethodCalls:
    """A block in which `count` grows by one for each call of a Python function that has the name of a method.

    So it has those that a plugin calls itself. Unlike seconds they are the same on every machine.
    """

    def __init__(self) -> None:
        self.count = 0
        self._before: Any = None

    def __enter__(self) -> Self:
        self._before = sys.getprofile()
        sys.setprofile(self._see)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(self._before)

    def _see(self, frame: FrameType, event: str, _: Any) -> None:
        self.count += event == "call" and frame.f_code.co_name in METHODS


class Stopwatch:
    """A plugin whose calls are timed while the clock `runs`, and whose methods are counted while it `counts`."""

    def __init__(self, plugin: Any) -> None:
        self._plugin, self.runs, self.counts = plugin, False, False
        self.seconds, self.calls = 0.0, 0

    def __getattr__(self, name: str) -> Any:
        method = getattr(self._plugin, name)
        if not callable(method) or not (self.runs or self.counts):
            return method

        def call(*arguments: Any) -> Any:
            with MethodCalls() if self.counts else nullcontext() as counter:
                start = perf_counter()
                answer = method(*arguments)
                self.seconds += perf_counter() - start
            self.calls += 0 if counter is None else counter.count
            return answer

        return call


def _pack(method: str, answer: Any) -> dict[str, wire.PackedArray]:
    try:
        return {name: wire.PackedArray.pack(array) for name, array in _ARRAYS[method](answer).items()}
    except ValueError as error:
        raise ContractError(f"{method}: returned {error}") from None


def _tangent_arrays(tangent: Any) -> dict[str, Any]:
    if isinstance(tangent, np.ndarray):
        return {"dense": tangent}
    if tangent.format == "coo":
        return {name: getattr(tangent, name) for name in ("row", "col", "data")}
    return {f"{tangent.format} {name}": getattr(tangent, name) for name in _COMPRESSED}


_POINTS = [entry.name for entry in fields(ContactPoints)]
_ARRAYS: dict[str, Callable[[Any], dict[str, Any]]] = {
    "pair": dict,
    "residual": lambda forces: {"residual": forces},
    "tangent": _tangent_arrays,
    "residual_and_tangent": lambda both: {"residual": both[0]} | _tangent_arrays(both[1]),
    "contact_points": lambda points: {name: getattr(points, name) for name in _POINTS},
}


def _keep_compressed(verb: str, tangent: Any) -> Any:
    """Return a csr or csc matrix as the plugin made it, since the judge checks and copies it; else a checked copy."""
    if tangent.format in ("csr", "csc"):
        parts = [getattr(tangent, name) for name in _COMPRESSED]
        if all(type(part) is np.ndarray and part.dtype in _USUAL for part in parts):
            return tangent
    return copy_entries(verb, tangent)


def _failure(question: int, error: BaseException) -> wire.Failure:
    match error:
        case PluginError():
            return wire.Failure(question, "plugin", error.cause, (str(error),))
        case NonFiniteError():
            return wire.Failure(question, "not finite", "exception", (str(error),))
        case ContractError():
            return wire.Failure(question, "contract", "exception", (str(error),))
        case MisuseError():
            return wire.Failure(question, "misuse", "exception", (error.argument, error.found, error.needed))
    return wire.Failure(question, "plugin", "exception", (f"its process: {describe_error(error)}",))


def _survey_in_copy(describe: Callable[[], wire.Reply], question: int) -> wire.Reply:
    """Return the reply of a copy of this process, which no other plugin has changed, or how the copy ended."""
    hide_memory(hidden=True)
    for name in ("contactverif.geometry.projection", "scipy.sparse"):
        import_module(name)  # What most plugins import is imported once.
    _end_what_is_left()
    before = _state()
    copy = child.Child.fork(partial(_send_description, describe, question), _LARGEST_SURVEY)
    try:
        (reply,) = wire.decode_replies(copy.channel.receive(), loading=True)
    except child.ClosedError:
        status = copy.wait() or 0
        words = f"its process ended with status {status}"
        if status < 0:
            words = f"{child.name_of_signal(-status)} ended its process"
        return wire.Failure(question, "plugin", "exit", (f"import: {words}",))
    except (child.TooLargeError, wire.MessageError, ValueError) as error:
        return wire.Failure(question, "plugin", "channel", (f"import: {error}",))
    else:
        return reply
    finally:
        copy.end()
        _end_what_is_left()
        changed = True
        with suppress(OSError):  # It may not open another file.
            changed = _state() != before
        if changed:
            os._exit(_CHANGED)


def _send_description(describe: Callable[[], wire.Reply], question: int, channel: child.Channel) -> None:
    os.close(int(os.environ[SOCKET]))  # The line of the process that was copied.
    hide_memory(hidden=False)  # A plugin may want to look at itself.
    die_with_parent()
    try:
        reply = describe()
    except BaseException as error:  # A plugin may raise anything.
        reply = wire.Failure(question, "plugin", "exception", (f"import: {describe_error(error)}",))
    channel.send(wire.encode([reply]))


def _end_what_is_left() -> None:
    """End all other processes in the box and delete files. Without a box the judge does so when the survey is over."""
    if PROCESSES in os.environ and os.getppid() == 1:  # Outside of a box these would be all of the user.
        with suppress(ProcessLookupError):
            os.kill(-1, signal.SIGKILL)
        for folder in _FOLDERS:
            with suppress(OSError, RecursionError):  # What cannot be deleted is a change.
                _empty(folder)


def _empty(folder: str) -> None:
    for place, folders, files in os.walk(folder):
        for name in folders:
            with suppress(OSError):
                os.chmod(os.path.join(place, name), 0o700)
        for name in files:
            with suppress(OSError):
                os.unlink(os.path.join(place, name))
    for entry in os.scandir(folder):
        shutil.rmtree(entry.path, ignore_errors=True)


def _state() -> tuple[object, ...]:
    """Return what a copy can change for those after it: the limits of this process, and the files in its box."""
    if sys.platform == "win32":  # There are no copies, and no such limits.
        return ()
    import resource

    limits = [resource.getrlimit(getattr(resource, name)) for name in dir(resource) if name.startswith("RLIMIT_")]
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    files = [os.listdir(folder) for folder in _FOLDERS] if PROCESSES in os.environ else []
    return limits, cores, os.getpriority(os.PRIO_PROCESS, 0), files
