"""Two pairings of one state, of a plugin whose pairing has a handle: nobody looks into it, but answers show it."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray, dense
from contactverif.contract.interface import Interface
from contactverif.contract.subject import CheckedFormulation


def compare_two_pairings(
    formulation: CheckedFormulation, interface: Interface, z: FloatArray, distant: FloatArray
) -> list[str]:
    """Pair twice at a state, with another state in between, and return in words what differs.

    Parameters
    ----------
    formulation : CheckedFormulation
        The formulation.
    interface : Interface
        The meshes.
    z, distant : FloatArray, shape (n_unknowns + n_multipliers,)
        The state, and another one.

    Returns
    -------
    list[str]
        A sentence for each difference; empty where the pairing has no handle, or nothing differs.
    """
    first = formulation.own_pairing(interface, z)
    if first is None or not first.opaque:
        return []
    formulation.own_pairing(interface, distant)
    methods = ["residual", *(["tangent"] if "tangent" in formulation.provides else [])]
    answers = [dense(getattr(formulation, method)(interface, first, z)) for method in methods]
    second = formulation.own_pairing(interface, z)
    if first != second:
        return ["the pairing of a state differs in a repeated call"]
    return [
        f"the {method} differs on two pairings of one state"
        for method, answer in zip(methods, answers, strict=True)
        if not np.array_equal(answer, dense(getattr(formulation, method)(interface, second, z)))
    ]
