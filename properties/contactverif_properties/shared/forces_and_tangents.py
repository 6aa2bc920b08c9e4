"""Forces and tangents in some states, asked for together, so that a plugin in another process gets one message."""

from __future__ import annotations

from contactverif.contract.arrays import FloatArray, dense
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.subject import CheckedFormulation


def ask_forces_and_tangents(
    formulation: CheckedFormulation, *states: tuple[Interface, Pairing | None, FloatArray]
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the residuals (n,) and the tangents (n, n) in some states.

    Parameters
    ----------
    formulation : CheckedFormulation
        The formulation.
    *states : tuple[Interface, Pairing | None, FloatArray]
        The meshes, the frozen pairing and the state z (n,), for n unknowns and multipliers.

    Returns
    -------
    forces : list[FloatArray]
        The residual in each state.
    tangents : list[FloatArray]
        The tangent in each state, dense; empty where the formulation has none.
    """
    methods = ["residual", *(["tangent"] if "tangent" in formulation.provides else [])]
    answers = formulation.answers([(method, *state) for method in methods for state in states])
    return answers[: len(states)], [dense(tangent) for tangent in answers[len(states) :]]
