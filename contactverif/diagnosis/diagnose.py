"""Tell the kind of mistake of a formulation that fails, as far as a rule knows it."""

from __future__ import annotations

import numpy as np

from contactverif.contract.errors import ContractError
from contactverif.contract.subject import Subject
from contactverif.diagnosis.force_patterns import diagnose_forces
from contactverif.diagnosis.scale_patterns import diagnose_scale
from contactverif.diagnosis.tangent_patterns import diagnose_tangent

# The properties of which a failure says that answers cannot be relied on. Then a pattern in them means nothing.
NO_ANSWERS = ("purity", "purity.long")
OF_TANGENTS = ("tangent.", "newton.")
OF_DIGITS = ("stability.",)


def diagnose(subject: Subject, property_id: str) -> str:
    """Return what kind of mistake a formulation makes, in a sentence.

    Parameters
    ----------
    subject : Subject
        A formulation that fails.
    property_id : str
        The property whose failure is to be explained. For one of tangents the tangent is looked at, else the forces.

    Returns
    -------
    str
        The sentence; empty if no rule knows the mistake, or the formulation has no answer where the rules ask.
    """
    if property_id in NO_ANSWERS:
        return ""
    try:
        with np.errstate(all="ignore"):
            if property_id.startswith(OF_TANGENTS):  # Forces that are wrong have a tangent that fits them.
                return diagnose_tangent(subject)
            in_full = property_id.startswith("patch.") or subject.traits.promises.patch.flat is True
            text = diagnose_forces(subject, in_full=in_full)
            # Whether digits are lost depends on sizes, too, without any length in the code.
            return text or ("" if property_id.startswith(OF_DIGITS) else diagnose_scale(subject))
    except ContractError:
        return ""
