"""The property `purity`: which quantity shows which dependence on something else than the question."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from handmade import Handmade, case, subject

from contactverif.contract.property import Measurement, Verdict
from contactverif.run.runner import judge_case
from contactverif_properties.purity import BATCHED, PURITY, REORDERED, REPEATED, measure_purity


class Pure(Handmade):
    """A smooth function of the positions."""

    def pair(self, interface: Any, z: Any) -> Any:
        return {"up": z[1::2] > 0}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return z**2 + np.repeat(pairing["up"], 2)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return np.diag(2 * z)


def measure(plugin: Any, **traits: Any) -> Measurement:
    return measure_purity(case(seed=3), subject(plugin, **traits))


def nonzero_quantities(plugin: Any, **traits: Any) -> set[str]:
    """Return the names of the quantities that are not zero."""
    return {name for name, value in measure(plugin, **traits).values.items() if value > 0}


@pytest.mark.parametrize("batched", [False, True])
def test_a_function_is_pure(batched: bool) -> None:
    measurement = measure(Pure, batched=batched)
    assert measurement.values == {REPEATED.name: 0, REORDERED.name: 0, BATCHED.name: 0}
    assert not measurement.broken
    assert judge_case(PURITY, case(), subject(Pure, batched=batched)).verdict is Verdict.PASS


def test_what_counts_its_calls_is_told_when_asked_again() -> None:
    class Counts(Pure):
        calls = 0

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            self.calls += 1
            return z * (1 + self.calls * 2.0**-50)

    assert REPEATED.name in nonzero_quantities(Counts)


def test_what_a_tangent_leaves_behind_is_told_by_the_order() -> None:
    class Trace(Pure):
        after = 0.0

        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            self.after = 2.0**-30
            return super().tangent(interface, pairing, z)

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return z + self.after

    assert nonzero_quantities(Trace) == {REORDERED.name}
    z = case().z
    assert measure(Trace).values[REORDERED.name] == 2 * z.size  # each entry of both states


def test_what_a_state_leaves_behind_for_the_next_is_nonzero_quantities() -> None:
    class Remembers(Pure):
        first: Any = None

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            self.first = z if self.first is None else self.first
            return self.first + 0 * z

    assert REORDERED.name in nonzero_quantities(Remembers)


def test_a_batch_that_is_no_loop_is_nonzero_quantities() -> None:
    class First(Pure):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return z if z.ndim == 1 else 0 * z + z[0]

    assert nonzero_quantities(First, batched=True) == {BATCHED.name}
    assert nonzero_quantities(First, batched=False) == set()


def test_a_batch_may_sum_in_another_order() -> None:
    class Roundoff(Pure):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return z if z.ndim == 1 else z * (1 + 2.0**-52)

    assert nonzero_quantities(Roundoff, batched=True) == {BATCHED.name}
    assert judge_case(PURITY, case(), subject(Roundoff, batched=True)).verdict is Verdict.PASS


class Stuck(Pure):
    """The pairing of the first state, for ever."""

    first: Any = None

    def pair(self, interface: Any, z: Any) -> Any:
        self.first = {"first": (z[1::2] > z[1:].mean())} if self.first is None else self.first
        return self.first

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return 0 * z


class Restless(Pure):
    calls = 0

    def pair(self, interface: Any, z: Any) -> Any:
        self.calls += 1
        return {"call": np.array([self.calls])}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return 0 * z


class Moves(Pure):
    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        object.__setattr__(interface, "nodes", interface.nodes + 2.0**-40)
        return 0 * z


@pytest.mark.parametrize(
    ("plugin", "message"),
    [
        (Stuck, "the pairing of a state depends on the state before it"),
        (Restless, "the pairing of a state differs in a repeated call"),
        (Moves, "the interface was changed"),
    ],
)
def test_a_breach_that_no_number_tells_is_said_in_words(plugin: Any, message: str) -> None:
    if plugin is Stuck:  # a seed for which the two states pair differently
        messages = [measure_purity(case(seed=seed), subject(plugin)).broken for seed in range(40)]
        assert message in messages
        return
    assert message in measure(plugin).broken
    assert judge_case(PURITY, case(), subject(plugin)).verdict is Verdict.FAIL


def test_positions_cannot_be_written_on() -> None:
    class Writes(Pure):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            z[0] = 1.0
            return z

    outcome = judge_case(PURITY, case(), subject(Writes))
    assert outcome.verdict is Verdict.CRASHED
    assert "read-only" in outcome.reason
