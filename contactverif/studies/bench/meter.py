"""The clock and the counters around a plugin, while Newton's method calls it.

The plugin itself is timed, without the checks of the harness and without the way to its process, which times each call
itself. The clock is that of the processor, because a program beside this one may take the core away in the middle of a
call. The wall clock is read too.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import perf_counter, process_time
from typing import Any

import numpy as np

from contactverif.contract.arrays import Array
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.contract.pairing import Pairing
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.isolation.remote_formulation import RemoteFormulation

# {verb of a plugin: the part of the time that it belongs to}. A verb that is not here is not timed by itself.
PART_OF_VERB = {"pair": "pair", "residual": "residual", "tangent": "tangent", "residual_and_tangent": "tangent"}


class Meter:
    """Seconds and counts of one solution."""

    def __init__(self) -> None:
        parts = ("pair", "residual", "tangent", "differences")
        self.seconds, self.states = dict.fromkeys(parts, 0.0), dict.fromkeys(parts, 0)
        self.differencing = False
        self.wall_excess = self.excess = 0.0  # Seconds of calls here that the calls there did not take.

    def call(self, part: str, plugin: Any, verb: Callable[..., Any], *arguments: Any) -> Any:
        """Call a verb of the plugin and book its time and its states."""
        wall, start = perf_counter(), process_time()
        answer = verb(*arguments)
        if isinstance(plugin, RemoteFormulation):
            wall_there, elapsed = plugin.seconds()
            if part == "pair":
                len(answer)  # A pairing comes from its process when it is looked into, which is no part of the time.
            self.wall_excess += perf_counter() - wall - wall_there
            self.excess += process_time() - start - elapsed
        else:
            elapsed = process_time() - start
        part = "differences" if self.differencing else part
        self.seconds[part] += elapsed
        state = np.shape(arguments[-1])  # Forces may be wanted at a batch of states z (..., n_unknowns).
        self.states[part] += int(np.prod(state[:-1]))
        return answer


class MeteredPlugin:
    """A plugin whose verbs are timed; everything else is the plugin's own."""

    def __init__(self, plugin: Any, meter: Meter) -> None:
        self._plugin, self._meter = plugin, meter

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._plugin, name)
        part = PART_OF_VERB.get(name)
        return value if part is None or not callable(value) else partial(self._meter.call, part, self._plugin, value)


class MeteredFormulation:
    """A checked formulation of which the meter knows when forces are computed for differences."""

    def __init__(self, formulation: CheckedFormulation, meter: Meter) -> None:
        self._formulation, self._meter = formulation, meter

    def __getattr__(self, name: str) -> Any:
        return getattr(self._formulation, name)

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        """Return the forces (..., n_unknowns) at z (..., n_unknowns); a batch of states is for differences."""
        self._meter.differencing = z.ndim > 1
        try:
            return self._formulation.residual(interface, pairing, z)
        finally:
            self._meter.differencing = False


def add_meter(subject: Subject, case: Case, meter: Meter) -> Any:
    """Return the formulation with the penalty of a case, as Newton's method needs it, timed by the meter."""
    plugin = subject.for_case(case).plugin
    if isinstance(plugin, RemoteFormulation):
        plugin.timed = True
    metered = MeteredPlugin(plugin, meter)
    return MeteredFormulation(CheckedFormulation(metered, subject.traits, subject.provides), meter)
