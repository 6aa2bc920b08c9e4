"""A store of outcomes that loses one of them, without a word."""

from __future__ import annotations

import pytest

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome
from contactverif.run.rows import OutcomeStore


def lose_one_outcome(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let stores of outcomes lose the fourth that they get."""
    append = OutcomeStore.append
    losses: list[Outcome] = []

    def lose_one(store: OutcomeStore, outcome: Outcome, case: Case | None) -> None:
        if len(store) == 3 and not losses:
            losses.append(outcome)
        else:
            append(store, outcome, case)

    monkeypatch.setattr(OutcomeStore, "append", lose_one)
