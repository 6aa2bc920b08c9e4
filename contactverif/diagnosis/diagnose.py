"""Tell the kind of mistake of a formulation that fails, as far as a rule knows it."""

from collections.abc import Sequence

import numpy as np

from contactverif.contract.arrays import Array, FloatArray, dense
from contactverif.contract.errors import ContractError, NonFiniteError
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.result import OF_TANGENT
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.contract.traits import PatchPromises
from contactverif.diagnosis.changes import diagnose_changes, find_kept_mesh
from contactverif.diagnosis.flat_state import PENALTY, flat_state, residual_of
from contactverif.diagnosis.force_patterns import diagnose_forces, find_lost_places
from contactverif.diagnosis.matching_pairs import diagnose_matching
from contactverif.diagnosis.tangent_patterns import diagnose_tangent

_OF_TANGENTS = ("tangent.", "newton.")
_OF_FORCES = (
    "balance.",
    "unilateral",
    "patch.",
    "nodal-push",
    "stability.",
    "total-stiffness",
    "accuracy.",
    "projection.",
)
_TILT = 2.0**-4  # The slope of a slave that has other normals.
_SLIDE = 0.625  # The way along the surface after which most slave nodes face another segment.


def diagnose(subject: Subject, property_id: str, others: Sequence[str] = ()) -> str:
    """Return what kind of mistake a formulation makes that fails a property, in a sentence; empty if no rule knows it.

    For a property of purity, what calls change is looked at, else the forces and then the tangent. Where all properties
    that fail are of tangents, the forces are not.
    """
    try:
        with np.errstate(all="ignore"):
            if subject.traits.rules.own_law:  # Patterns are of forces in proportion to the gap.
                return diagnose_changes(subject) or diagnose_tangent(subject)
            springs = subject.traits.rules.enforcement == "penalty" and subject.traits.abilities.in_plane
            if text := (springs and _diagnose_numbering(subject)) or find_kept_mesh(subject):
                return text
            if property_id.startswith("purity"):  # Other patterns mean nothing then.
                return _diagnose_memory(subject) if springs else ""
            every = (property_id, *others)
            if all(name.startswith(_OF_TANGENTS) for name in every):
                text = diagnose_tangent(subject)
                return f"only the tangent fails: {text}" if text else ""
            promises_none = subject.traits.promises.patch == PatchPromises()  # Else its own errors may be no mistake.
            asks_nodes = promises_none and property_id.startswith("patch.") and not property_id.endswith(".resultant")
            in_full = asks_nodes or subject.traits.promises.patch.flat is True
            text = (springs and find_lost_places(subject)) or diagnose_matching(subject)
            text = text or diagnose_forces(subject, in_full=in_full)
            # Whether digits are lost depends on sizes, too, without any length in the code.
            if not text and not property_id.startswith(("stability.", *_OF_TANGENTS)):
                text = diagnose_changes(subject)
            # A right tangent is no derivative of wrong forces, and says nothing of these.
            if not text and any(name.startswith(_OF_FORCES) for name in every):
                return ""
            tangent = diagnose_tangent(subject)
            return text + (OF_TANGENT if text else "of the tangent: ") + tangent if tangent else text
    except ContractError:
        return ""


def _diagnose_numbering(subject: Subject) -> str:
    state = flat_state()
    numbers, mesh = np.arange(len(state.along)), state.case.interface
    words: dict[bool, str] = {}  # {whether the forces are finite: how nodes are numbered}
    for name, step in (("along", 1), ("against", -1)):
        order = np.concatenate([numbers[nodes][::step] for nodes in state.sides])  # Its own inverse.
        sides = (Surface(order[side.faces]) for side in (mesh.slave, mesh.master))
        try:
            residual_of(subject, Interface(mesh.nodes[order], *sides), state.case.positions[order].reshape(-1))
            words[True] = f"{name} them"
        except NonFiniteError:
            words[False] = f"where nodes are numbered {name} the surfaces"
    return f"the forces are not finite {words[False]}, and finite {words[True]}" if len(words) > 1 else ""


def _diagnose_memory(subject: Subject) -> str:
    state = flat_state()
    interface, z = state.case.interface, state.case.z
    slid = z.copy()
    slid[: 2 * state.n_slave_nodes : 2] += _SLIDE
    others = {
        "at which the slave is tilted": flat_state(slope=1.0, depth=_TILT).case.z,
        "at which nodes face other segments": slid,
    }
    for call in ("residual", "tangent") if "tangent" in subject.provides else ("residual",):
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
