"""Tell which call changes a later answer, of a formulation that keeps something between calls."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from contactverif.contract.arrays import Array, FloatArray, dense
from contactverif.contract.interface import Interface
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.diagnosis.flat_state import PENALTY, flat_state

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
    for call in ("residual", "tangent") if "tangent" in subject.provides else ("residual",):
        if text := _what_changes(call, subject, interface, z, others):
            return text
    return ""


def _what_changes(call: str, subject: Subject, interface: Interface, z: Array, others: Mapping[str, Array]) -> str:
    """Return which call lets one answer otherwise at a state than a new instance does."""
    first = _answer(call, subject.for_interface(interface, PENALTY), interface, z)
    if not np.array_equal(_answer(call, subject.for_interface(interface, PENALTY), interface, z), first):
        return f"something is kept outside of the instance: `{call}` of a new one answers otherwise"
    before = {"when it is asked the same again": (call, z)}
    for words, at in others.items():
        before |= {f"after `{other}` of a state {words}": (other, at) for other in ("pair", call)}
    for words, (other, at) in before.items():
        formulation = subject.for_interface(interface, PENALTY)
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
