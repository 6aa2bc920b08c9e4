"""Tell which call changes a later answer, of a formulation that keeps something between calls."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array, FloatArray, dense
from contactverif.contract.interface import Interface
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.diagnosis.flat_state import flat_state

_CALLS = ("pair", "residual", "tangent")
_TILT = 2.0**-4  # The slope of a slave that has other normals.
_SLIDE = 0.625  # The way along the surface after which most slave nodes face another segment.


def diagnose_memory(subject: Subject) -> str:
    """Return which call lets a later one answer otherwise; empty if none of these does."""
    state = flat_state()
    interface, z = state.case.interface, state.case.z
    slid = z.copy()
    slid[: 2 * state.n_slave_nodes : 2] += _SLIDE
    others = {
        "at which the slave is tilted": flat_state(slope=1.0, depth=_TILT).case.z,
        "at which nodes face other segments": slid,
    }
    calls = [call for call in _CALLS if call != "tangent" or call in subject.provides]
    for call in (call for call in calls if call != "pair"):
        first = _answer(call, subject.for_case(state.case), interface, z)
        if not np.array_equal(_answer(call, subject.for_case(state.case), interface, z), first):
            return f"something is kept outside of the instance: `{call}` of a new one answers otherwise"
        before = {f"after `{other}` of a state {words}": (other, at) for words, at in others.items() for other in calls}
        for words, (other, at) in {"when it is asked the same again": (call, z), **before}.items():
            formulation = subject.for_case(state.case)
            _answer(other, formulation, interface, at)
            if not np.array_equal(_answer(call, formulation, interface, z), first):
                return f"something is kept between calls: `{call}` answers otherwise {words}"
    return ""


def _answer(call: str, formulation: CheckedFormulation, interface: Interface, z: Array) -> FloatArray:
    """Return what a formulation answers at a state; of the pairing nothing, since it may hold what it likes."""
    pairing = formulation.pair(interface, z)
    if call == "pair":
        return np.empty(0)
    if call == "residual":
        return formulation.residual(interface, pairing, z)
    return dense(formulation.tangent(interface, pairing, z))
