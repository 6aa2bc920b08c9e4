"""Tell at which size of the mesh the forces stop to grow with it: there an absolute length is in the code."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.subject import Subject
from contactverif.diagnosis.flat_state import DEPTH, flat_state

POWERS = range(0, 49, 4)  # The mesh is as many times smaller, and then larger, as 2 to these powers.
# A power of two changes no rounding, and an absolute length in the code soon changes forces by far more than this.
SAME = 2.0**-20


def diagnose_scale(subject: Subject) -> str:
    """Return at which size of the mesh forces over size are others than before; empty if they never are."""
    if subject.traits.rules.enforcement != "penalty":
        return ""
    reference = _forces(subject, 1.0)
    for sign, word in ((-1, "smaller"), (1, "larger")):
        for power in POWERS[1:]:
            factor = 2.0 ** (sign * power)
            forces = _forces(subject, factor)
            if np.abs(forces - reference).max() > SAME * np.abs(reference).max():
                sizes = f"gaps of {factor * DEPTH:.1e} on segments of about {factor:.1e}"
                return f"forces do not scale with a mesh 2^{power} times {word} ({sizes}): look for an absolute length"
    return ""


def _forces(subject: Subject, factor: float) -> FloatArray:
    """Return the forces (n_unknowns,) on a mesh of another size, over the square of its size."""
    case = flat_state().case
    interface, z = case.interface.at(case.interface.nodes * factor), case.z * factor
    formulation = subject.for_interface(interface, case.penalty)
    forces: FloatArray = formulation.residual(interface, formulation.pair(interface, z), z)
    return forces / factor**2  # A force is ε̂ |g| times a length.
