"""The nodal forces of a formulation in any state."""

from __future__ import annotations

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.subject import Subject
from contactverif_properties.shared.any_state import prepare_state


def forces_of_any_state(case: Case, subject: Subject) -> tuple[Case, FloatArray]:
    """Return the case as the formulation is asked about it, and the residual of its nodes.

    Parameters
    ----------
    case : Case
        A case without multipliers.
    subject : Subject
        The formulation.

    Returns
    -------
    state : Case
        The case, with random multipliers if the formulation has any (`prepare_state`).
    forces : FloatArray, shape (n_nodes, 2)
        The position rows of the residual there.
    """
    formulation, state = prepare_state(case, subject)
    pairing = formulation.pair(state.interface, state.z)
    forces = formulation.residual(state.interface, pairing, state.z)
    return state, forces[: state.interface.n_unknowns].reshape(-1, 2)
