"""The counters and the clock around a plugin, between the harness and the plugin's process.

Counts are of what the harness asks, so that no plugin tells them. Seconds are those of the plugin's own process, which
times each call itself, without the checks of the harness and without the way there.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from contactverif.contract.arrays import Array
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.contract.pairing import Pairing
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.isolation.remote import RemoteFormulation
from contactverif.isolation.worker import MethodCalls
from contactverif_reports.bench.results import COUNTS

_COUNTS_OF_VERB = {
    "pair": ("pairs",),
    "residual": ("residuals",),
    "tangent": ("tangents",),
    "residual_and_tangent": ("residuals", "tangents"),
}


class Meter:
    """The counts of one solution by name, and the seconds, or the methods that run, of all calls where wanted."""

    def __init__(self, *, timed: bool = False, counted: bool = False) -> None:
        self.timed, self.counted = timed, counted
        self.seconds, self.calls = 0.0, 0
        self.counts = dict.fromkeys(tuple(COUNTS)[1:], 0)  # All but the iterations
        self.differencing = False

    def call(self, verb: str, plugin: Any, method: Callable[..., Any], *arguments: Any) -> Any:
        """Call a method of the plugin, and count its states and its seconds."""
        with MethodCalls() if self.counted else nullcontext() as counter:
            start = perf_counter()
            answer = method(*arguments)
            seconds = perf_counter() - start
        calls = 0 if counter is None else counter.count
        if isinstance(plugin, RemoteFormulation) and (self.timed or self.counted):
            seconds, calls = plugin.seconds(), plugin.calls()
        self.seconds += seconds
        self.calls += calls
        n_states = int(np.prod(np.shape(arguments[-1])[:-1]))  # Forces may be wanted at a batch z (..., n_unknowns).
        for name in ("differences",) if self.differencing else _COUNTS_OF_VERB[verb]:
            self.counts[name] += n_states
        return answer


class MeteredPlugin:
    """A plugin whose verbs are counted; everything else is the plugin's own."""

    def __init__(self, plugin: Any, meter: Meter) -> None:
        self._plugin, self._meter = plugin, meter

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._plugin, name)
        is_counted = name in _COUNTS_OF_VERB and callable(value)
        return partial(self._meter.call, name, self._plugin, value) if is_counted else value


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
    """Return the formulation with the penalty of a case, as Newton's method needs it, with the meter around it."""
    plugin = subject.for_case(case).plugin
    if isinstance(plugin, RemoteFormulation):
        plugin.timed, plugin.counted = meter.timed, meter.counted
    metered = MeteredPlugin(plugin, meter)
    return MeteredFormulation(CheckedFormulation(metered, subject.traits, subject.provides), meter)
