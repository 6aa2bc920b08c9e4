"""The first questions to a formulation in a process."""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress

import numpy as np

from contactverif.contract.arrays import FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError
from contactverif.contract.first_answers import FirstAnswers
from contactverif.contract.subject import Subject


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
