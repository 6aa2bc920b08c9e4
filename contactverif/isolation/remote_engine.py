"""An engine in a process of its own, whose interpreter may be another one than that of the judge."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from contactverif.contract.engine import EngineAnswer, EngineTraits, SceneArrays
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.errors import ContractError, PluginError
from contactverif.contract.foreign_text import one_line
from contactverif.contract.result import NotLoaded
from contactverif.isolation.box import Box
from contactverif.isolation.host import Host, host_of
from contactverif.isolation.limits import Limits
from contactverif.isolation.messages import Loaded, Unloaded
from contactverif.isolation.packed import PackedArray

_MOST_ITERATIONS = 1 << 31


@dataclass(frozen=True)
class RemoteEngine:
    """An engine that a program, `command`, has made. It can be pickled."""

    command: tuple[str, ...]
    name: str
    limits: Limits
    traits: EngineTraits

    @property
    def host(self) -> Host:
        """The host in this process of the judge."""
        return host_of(self.command, self.name, self.limits)

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Return the answer of the engine, of which nothing is checked but its kind."""
        reply = self.host.solve(scene.to_arrays())
        iterations = reply.iterations if abs(reply.iterations) < _MOST_ITERATIONS else -1
        try:
            arrays = {name: _unpack(array) for name, array in reply.arrays.items()}
            return EngineAnswer(
                converged=reply.converged, iterations=iterations, message=one_line(reply.message), **arrays
            )
        except (ValueError, TypeError) as error:
            raise ContractError(f"solve: {one_line(str(error))}") from None


class RemoteEngineSubject(EngineSubject):
    """An engine that lives in a process of its own. It can be pickled."""

    def __init__(self, name: str, engine: RemoteEngine) -> None:
        super().__init__(name, engine)
        self._remote = engine

    @property
    def host(self) -> Host:
        """The host in this process of the judge."""
        return self._remote.host

    @property
    def box(self) -> Box | None:
        """The box of its process; None if there is none."""
        return self._remote.limits.box

    def _call(self, scene: SceneArrays) -> EngineAnswer:
        return self._remote.solve(scene)


def _unpack(packed: PackedArray) -> Any:
    array = packed.unpack()
    return array.astype(np.float64) if array.dtype == np.float64 else array


def engine_program(entry: str, options: Mapping[str, Any], python: str | None = None) -> tuple[str, ...]:
    """Return the command that makes an engine of an entry point, by default in the interpreter of this process.

    An interpreter of its own finds its own modules first, and of this process's the harness and the engine alone.
    """
    worker = str(Path(__file__).with_name("engine_worker.py"))
    places, folders = ({}, filter(None, sys.path)) if python is None else (_places_of(entry), ())
    return python or sys.executable, worker, entry, json.dumps(options), json.dumps(places), *folders


def _places_of(entry: str) -> dict[str, str]:
    """Return {module: folder} of the harness, of what is installed together with an entry point, and of `landlockpy`.

    The folder may be that of all packages of this interpreter, such as a numpy that another one cannot load.
    """
    import importlib.util
    from importlib.metadata import packages_distributions

    module, owners = entry.partition(":")[0].partition(".")[0], packages_distributions()
    installed = set(owners.get(module, ()))
    names = {"contactverif", module, "landlockpy", *(name for name in owners if installed & set(owners[name]))}
    specs = ((name, importlib.util.find_spec(name)) for name in sorted(names))
    return {
        name: str(Path(spec.origin).parents[bool(spec.submodule_search_locations)])
        for name, spec in specs
        if spec and spec.origin
    }


def load_remote_engine(command: tuple[str, ...], name: str, limits: Limits) -> EngineSubject | NotLoaded:
    """Load an engine in a process of its own, and return it under a name, or why it does not load."""
    try:
        reply = host_of(command, name, limits).load()
        if isinstance(reply, Unloaded):
            return NotLoaded(name, one_line(reply.reason))
        if not isinstance(reply, Loaded):
            raise PluginError(f"import: a {type(reply).__name__} where an engine was needed", "channel")
        return RemoteEngineSubject(name, RemoteEngine(command, name, limits, _traits(reply.traits)))
    except ContractError as error:
        return NotLoaded(name, str(error))


def _traits(words: dict[str, Any]) -> EngineTraits:
    """Return the traits that the process of an engine states, checked."""
    try:
        traits = msgspec.convert(words, EngineTraits)
    except (msgspec.ValidationError, RecursionError, ValueError) as error:
        raise ContractError(f"traits: {one_line(str(error))}") from None
    return traits
