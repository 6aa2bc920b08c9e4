"""What one evaluation of a formulation costs, on states that all share: the speed column of a comparison.

A run asks one formulation after the other, so its seconds know who came first and who was shrunk. Here all formulations
take turns on the same states, after a first turn that nobody times (kernels compile in it, answers are checked), and of
many turns the fastest counts: what disturbs a machine only ever adds. What is timed is the plugin itself, without the
checks of the harness, which would make fast and slow ones alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import nan
from time import perf_counter
from typing import Any

import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif_reports.compare.comparison import PARTS, Cost

TURNS = 9  # at least; more, up to MOST, as long as they take less than ENOUGH seconds together
MOST, ENOUGH = 60, 1.0
SEGMENTS = (16, 256)  # of the slave: small enough to show what a call costs, large enough to show what a segment costs


def measured(subjects: Sequence[Subject], cases: Sequence[Case] | None = None, turns: int = TURNS) -> tuple[Cost, ...]:
    """The cost of each formulation on each state, interleaved.

    Parameters
    ----------
    cases : Sequence[Case] | None
        The states; by default flat interfaces of `SEGMENTS` slave segments on three quarters as many.
    turns : int
        Timed at least, behind one that is not. Who begins changes from turn to turn.
    """
    found: list[Cost] = []
    for case in cases if cases is not None else [state(n) for n in SEGMENTS]:
        timed = [_Timed(subject, case) for subject in subjects]
        start, turn = perf_counter(), 0
        while turn <= turns or (turn <= MOST and perf_counter() - start < ENOUGH):
            for place in range(len(timed)):
                timed[(place + turn) % len(timed)].take(count=turn > 0)
            turn += 1
        found += [one.cost() for one in timed]
    return tuple(found)


def state(n_segments: int) -> Case:
    """A flat interface of that many unit slave segments on three quarters as many, all of it in contact."""
    n_master = max(1, 3 * n_segments // 4)
    slave_x = np.arange(n_segments + 1.0)
    master_x = np.linspace(-0.5, n_segments + 0.5, n_master + 1)[::-1]
    depth = (1 + slave_x % 3) / 64  # 1/64 to 3/64, so that no force is a repetition of its neighbour's
    upper, lower = (np.column_stack([x, np.zeros_like(x)]) for x in (slave_x, master_x))
    interface = Interface.from_chains(upper, lower)
    upper[:, 1] = -depth
    return Case(interface, np.vstack([upper, lower]).reshape(-1), penalty=16.0)


class _Timed:
    """One formulation on one state, asked again and again."""

    def __init__(self, subject: Subject, case: Case) -> None:
        self._subject, self._case = subject, case
        self._fastest = dict.fromkeys(PARTS, nan)
        self._failed = ""

    def take(self, *, count: bool) -> None:
        """One turn; an error ends it for good."""
        if self._failed:
            return
        try:
            formulation = self._subject.for_case(self._case)
            taken = self._turn(formulation.plugin if count else formulation, formulation)
        except Exception as error:  # whatever a plugin may raise that is asked without a guard
            self._failed, self._fastest = f"{error}", dict.fromkeys(PARTS, nan)
            return
        if count:
            for part, seconds in taken.items():
                self._fastest[part] = float(np.fmin(self._fastest[part], seconds))

    def cost(self) -> Cost:
        """After all turns."""
        return Cost(self._subject.name, len(self._case.interface.slave), self._fastest, self._failed)

    def _turn(self, asked: Any, formulation: CheckedFormulation) -> dict[str, float]:
        interface, provides = self._case.interface, self._subject.provides
        z = freeze(np.concatenate([self._case.z, np.zeros(formulation.n_multipliers(interface))]), np.float64)
        pairing = formulation.pair(interface, z)
        taken = {}
        if "pair" in provides:
            taken["pair"] = _seconds(lambda: asked.pair(interface, z))
        taken["residual"] = _seconds(lambda: asked.residual(interface, pairing, z))
        if "tangent" in provides:
            taken["tangent"] = _seconds(lambda: asked.tangent(interface, pairing, z))
        return taken


def _seconds(what: Callable[[], Any]) -> float:
    start = perf_counter()
    what()
    return perf_counter() - start
