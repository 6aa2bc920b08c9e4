"""The check that a formulation's forces have the right sign, before any property is asked.

A residual with all signs turned round is the most frequent mistake of a first plugin. Then nearly every property fails,
and none of the numbers says why. So the harness looks at two states that every formulation understands, and tells the
user in words. Rule for the next editor: this check accuses only where nothing else can explain the answer.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError
from contactverif.contract.subject import Subject
from contactverif.problems.named_states import named_case

STATES = ("a1", "c")  # Flat interfaces that penetrate uniformly.


def has_opposite_sign(subject: Subject) -> bool:
    """Return whether the forces of a formulation pull the slave towards the master wherever it penetrates.

    Parameters
    ----------
    subject : Subject
        The formulation. A barrier is not asked, because it is not defined in penetration.

    Returns
    -------
    bool
        True if the slave's total force points into the master in all of `STATES`. False if it does not, or if the
        formulation gives no answer; properties say that.
    """
    if subject.traits.enforcement == "barrier":
        return False
    try:
        return all(_push(subject, named_case(name)) < 0 for name in STATES)
    except ContractError:
        return False


def _push(subject: Subject, case: Case) -> float:
    """Return the total force on the slave along the master's outward normal; multipliers, if any, press."""
    formulation, interface = subject.for_case(case), case.interface
    pressure = case.penalty * case.parameter("penetration")
    state = case.with_multipliers(np.full(formulation.n_multipliers(interface), pressure))
    residual = formulation.residual(interface, formulation.pair(interface, state.z), state.z)
    x, y = case.parameters["direction"]
    slave = -residual[: interface.n_unknowns].reshape(-1, 2)[: interface.n_slave_nodes]
    return float((slave @ np.array([-y, x])).sum())
