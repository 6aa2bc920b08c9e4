"""Tell the kind of mistake of a formulation that fails, as far as a rule knows it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contactverif.contract.errors import ContractError
from contactverif.contract.subject import Subject
from contactverif.diagnosis.force_patterns import diagnose_forces
from contactverif.diagnosis.scale_patterns import diagnose_scale
from contactverif.diagnosis.state_patterns import diagnose_memory
from contactverif.diagnosis.tangent_patterns import diagnose_tangent

OF_MEMORY = ("purity",)
OF_TANGENTS = ("tangent.", "newton.")
OF_DIGITS = ("stability.",)


def diagnose(subject: Subject, property_id: str, others: Sequence[str] = ()) -> str:
    """Return what kind of mistake a formulation makes that fails a property, in a sentence; empty if no rule knows it.

    For a property of tangents the tangent is looked at, for one of purity what calls change, else the forces. Where one
    of the other properties that fail is of forces, these come first: a tangent of wrong forces fits nothing.
    """
    try:
        with np.errstate(all="ignore"):
            if property_id.startswith(OF_MEMORY):  # Other patterns mean nothing then.
                return diagnose_memory(subject)
            every = (property_id, *others)
            if all(name.startswith(OF_TANGENTS) for name in every):
                return _introduce(diagnose_tangent(subject))
            in_full = property_id.startswith("patch.") or subject.traits.promises.patch.flat is True
            text = diagnose_forces(subject, in_full=in_full)
            # Whether digits are lost depends on sizes, too, without any length in the code.
            if not text and not property_id.startswith((*OF_DIGITS, *OF_TANGENTS)):
                text = diagnose_scale(subject)
            return text or (diagnose_tangent(subject) if property_id.startswith(OF_TANGENTS) else "")
    except ContractError:
        return ""


def _introduce(text: str) -> str:
    """Return what is said of a tangent where no property of forces fails; empty if there is nothing to say."""
    return f"only the tangent fails: {text}" if text else ""
