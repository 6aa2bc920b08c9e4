"""The first answers of a formulation in a process, kept to be compared with later answers to the same questions.

Whatever is asked first takes the first call: in a run that is the check of signs, in a test the property itself. So the
answers are noted where they are given, and travel with the `Subject`.
"""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from contactverif.contract.arrays import FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError

if TYPE_CHECKING:
    from contactverif.contract.subject import Subject


@dataclass(frozen=True, slots=True, eq=False)
class FirstAnswers:
    """The answers to the first questions, at one state."""

    case: Case  # The state, with its multipliers if there are any.
    residual: FloatArray  # (n,) with n = n_unknowns + n_multipliers
    tangent: FloatArray | None  # (n, n); None if it was not asked.


def ask_first(subject: Subject, case: Case, parts: Collection[str]) -> FirstAnswers:
    """Ask a flat case, whose multipliers press, for its pairing, its residual and, if it is among `parts`, its tangent.

    A tangent that breaks the contract is None here.

    Raises
    ------
    ContractError
        If pairing or residual break the contract, or the plugin raises an exception there.
    """
    formulation, interface = subject.for_case(case), case.interface
    pressure = case.penalty * case.parameter("penetration")
    state = case.with_multipliers(np.full(formulation.n_multipliers(interface), pressure))
    pairing = formulation.pair(interface, state.z)
    residual: FloatArray = formulation.residual(interface, pairing, state.z)
    tangent: FloatArray | None = None
    if "tangent" in parts:
        with suppress(ContractError):
            tangent = dense(formulation.tangent(interface, pairing, state.z))
    return FirstAnswers(state, residual, tangent)
