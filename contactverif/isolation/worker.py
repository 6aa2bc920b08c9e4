"""The process of a plugin: it loads one formulation, and answers questions until its judge is gone.

Rules for the next editor: nothing of the judge comes here, no expected answer and no other plugin. A plugin may do to
this process what it likes, so the judge believes nothing that it says, and checks every answer again. Every answer is
checked here first, so that an error has the same words as in the judge's own process.
"""

from __future__ import annotations

import faulthandler
import mmap
import os
import socket
from collections.abc import Callable
from dataclasses import fields
from importlib import import_module
from time import perf_counter
from typing import Any

import numpy as np

from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError
from contactverif.contract.foreign_text import describe_error
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import CheckedFormulation, Subject, compressed_parts
from contactverif.contract.traits import Traits
from contactverif.isolation.channel import Channel, ClosedError
from contactverif.isolation.limits import MEGABYTE
from contactverif.isolation.messages import (
    Answer,
    Ask,
    Failure,
    Forget,
    Loaded,
    Make,
    PackedArray,
    Reply,
    Request,
    Run,
    Share,
    SharePairing,
    Unloaded,
    Words,
    Wraps,
    decode_requests,
    encode,
    pack_array,
    travels,
    unpack_array,
)
from contactverif.isolation.parent_death import die_with_parent


def main(end: int, progress: int, memory: int) -> None:
    """Answer the judge at the other end of a socket until it is closed.

    Parameters
    ----------
    end : int
        The file descriptor of the socket.
    progress : int
        The file descriptor of one byte that the judge sees: the number of the question that is being answered.
    memory : int
        The megabytes of address space that this process may take beyond what it has now.
    """
    die_with_parent()
    faulthandler.enable()
    _limit_memory(memory)
    channel, desk, byte = Channel(socket.socket(fileno=end)), Desk(), mmap.mmap(progress, 1)
    while True:
        try:
            data = channel.receive()
        except ClosedError:
            os._exit(0)  # What a plugin wants to do at the end of its process is not waited for.
        replies: list[Reply] = []
        for request in decode_requests(data):
            byte[0] = len(replies)  # So the judge knows which call has ended this process.
            reply = desk.reply(request)
            if reply is not None:
                replies.append(reply)
        if replies:
            channel.send(encode(replies))


def _limit_memory(megabytes: int) -> None:
    """Limit the address space of this process, and write no image of it when it crashes. Windows has no such limits."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with open("/proc/self/statm") if os.path.exists("/proc/self/statm") else open(os.devnull) as file:
        pages = int((file.read().split() or ["0"])[0])
    limit = pages * resource.getpagesize() + megabytes * MEGABYTE
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    if most == resource.RLIM_INFINITY or limit < most:
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


class Desk:
    """The store of a plugin's process: the formulation, and by number its instances, interfaces and pairings."""

    def __init__(self) -> None:
        self._subject: Subject | None = None
        self._store: dict[int, Any] = {}

    def reply(self, request: Request) -> Reply | None:
        """Return the reply to a request; None if it has none."""
        match request:
            case Make(number) | Share(number) | SharePairing(number):
                self._store[number] = self._make_or_fail(request)
                return None
            case Forget(numbers):
                for number in numbers:
                    self._store.pop(number, None)
                return None
        try:
            match request:
                case Ask():
                    return self._ask(request)
                case Run(function, words):
                    return Words(_find(function)(self._subject, words))
                case _:
                    return self._load(request.loader, request.name)
        except BaseException as error:  # A plugin may raise what it likes, and may have changed what we call.
            return _failure(error)

    def _make_or_fail(self, request: Make | Share | SharePairing) -> Any:
        """Return what the judge wants to be kept, or the error that came instead: who asks for it is told.

        A request that has no reply must never get one, or the judge would take each reply for that of another question.
        """
        try:
            match request:
                case Make(_, penalty):
                    return self._make(penalty)
                case Share(_, nodes, slave, master):
                    surfaces = (Surface(unpack_array(segments)) for segments in (slave, master))
                    return Interface.of_parts(unpack_array(nodes), *surfaces)
                case SharePairing(_, arrays):
                    return Pairing({name: unpack_array(array) for name, array in arrays.items()})
        except BaseException as error:
            return error

    def _get(self, number: int) -> Any:
        """Return what is kept under a number, or raise the error that is kept instead."""
        item = self._store[number]
        if isinstance(item, BaseException):
            raise item
        return item

    def _load(self, loader: str, name: str) -> Reply:
        item = _find(loader)(name)
        if isinstance(item, NotLoaded):
            return Unloaded(item.reason)
        if not isinstance(item, Subject):
            return Wraps(str(item.summary))
        self._subject = item
        methods = item.provides | ({"n_multipliers"} if item.counts_multipliers else set())
        return Loaded(_words_of_traits(item.traits), sorted(methods))

    def _make(self, penalty: float) -> CheckedFormulation:
        """Return the formulation with a penalty."""
        assert self._subject is not None
        formulation = self._subject.with_penalty(penalty)
        formulation.plugin, formulation.passes_on = Stopwatch(formulation.plugin), True
        return formulation

    def _ask(self, ask: Ask) -> Reply:
        formulation: CheckedFormulation = self._get(ask.formulation)
        interface: Interface = self._get(ask.interface)
        if ask.verb == "n_multipliers":
            return Answer({}, 0.0, formulation.n_multipliers(interface))
        assert ask.z is not None
        z = unpack_array(ask.z)
        if ask.verb == "pair":
            pairing = formulation.own_pairing(interface, z)
            assert pairing is not None
            self._store[ask.keep] = pairing  # A handle stays here.
            arrays = {name: pack_array(array) for name, array in pairing.items()}
            return Answer(arrays, formulation.plugin.seconds, opaque=pairing.opaque)
        pairing = None if ask.pairing is None else self._get(ask.pairing)
        answer = getattr(formulation, ask.verb)(interface, pairing, z)
        return Answer(_PACKERS[ask.verb](answer), formulation.plugin.seconds)


def _find(path: str) -> Callable[..., Any]:
    """Return a function of the harness, ``"module:function"``."""
    module, _, name = path.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function


class Stopwatch:
    """A plugin whose calls are timed: `seconds` is the time of the last call."""

    def __init__(self, plugin: Any) -> None:
        self._plugin = plugin
        self.seconds = 0.0

    def __getattr__(self, name: str) -> Any:
        method = getattr(self._plugin, name)

        def call(*arguments: Any) -> Any:
            start = perf_counter()
            answer = method(*arguments)
            self.seconds = perf_counter() - start
            return answer

        return call


def _pack_residual(forces: np.ndarray[Any, Any]) -> dict[str, PackedArray]:
    if not travels(forces):
        raise ContractError(f"residual: returned dtype {forces.dtype}; needed one of numpy's usual ones")
    return {"residual": pack_array(forces)}


def _pack_tangent(tangent: Any) -> dict[str, PackedArray]:
    if isinstance(tangent, np.ndarray):
        return {"dense": pack_array(tangent)}
    if parts := compressed_parts(tangent):
        return {f"{tangent.format} {name}": pack_array(part) for name, part in parts.items()}
    return {name: pack_array(getattr(tangent, name)) for name in ("row", "col", "data")}


def _pack_both(answer: tuple[np.ndarray[Any, Any], Any]) -> dict[str, PackedArray]:
    return _pack_residual(answer[0]) | _pack_tangent(answer[1])


def _pack_points(points: ContactPoints) -> dict[str, PackedArray]:
    return {entry.name: pack_array(getattr(points, entry.name)) for entry in fields(ContactPoints)}


_PACKERS: dict[str, Callable[[Any], dict[str, PackedArray]]] = {
    "residual": _pack_residual,
    "tangent": _pack_tangent,
    "residual_and_tangent": _pack_both,
    "contact_points": _pack_points,
}


def _words_of_traits(traits: Traits) -> dict[str, Any]:
    """Return the traits as words and numbers that travel. `Traits` is checked again at the other end."""
    words = {entry.name: getattr(traits, entry.name) for entry in fields(Traits)}
    words["dimensions"] = [int(number) for number in traits.dimensions]
    for name in ("witnesses", "published_forces"):
        words[name] = {str(key): str(value) for key, value in words[name].items()}
    return words


def _failure(error: BaseException) -> Failure:
    """Return what the judge is told of an error."""
    match error:
        case PluginError():
            return Failure("plugin", error.cause, (str(error),))
        case NonFiniteError():
            return Failure("not finite", "exception", (str(error),))
        case ContractError():
            return Failure("contract", "exception", (str(error),))
        case MisuseError():
            return Failure("misuse", "exception", (error.argument, error.found, error.needed))
    return Failure("plugin", "exception", (f"its process: {describe_error(error)}",))
