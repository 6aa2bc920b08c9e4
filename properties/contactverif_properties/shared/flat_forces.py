"""The forces of a flat state that penetrates uniformly, judged by as much as a formulation's traits make known.

On a flat interface with a uniform penetration all rules for gaps agree, so every formulation is asked something:

- The forces have no part along the surface, and push the slave out of the master. That holds for every law.
- The total is ε̂ |g| A where the traits `penalty` and `area` state the springs.
- The force on each node is the consistent one where `passes_flat_patch` is not False.

A position is rounded at its distance X from the origin. A formulation that says that it is stable under translation
rounds it at the interface's diameter D instead, and gets the smaller tolerance.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif_properties.shared.roundoff import ratio
from contactverif_properties.shared.uniform_pressure import forces_of_gap, forces_of_penetration, unit_forces

_TOLERANCE = "u(8Z/|g| + 4N)"
_REASON = (
    "A gap is a difference of positions, each rounded to uZ, and N forces are summed. Z is the largest coordinate X, "
    "and the diameter D where the trait `translation_stable` is True."
)
ALONG = Quantity("force along the surface", "1", _TOLERANCE, f"{_REASON} A flat surface pushes across itself alone.")
TOTAL = Quantity("error of the total force", "1", _TOLERANCE, _REASON)
NODAL = Quantity("error of a nodal force", "1", _TOLERANCE, _REASON)
FLAT_QUANTITIES = (ALONG, TOTAL, NODAL)
VACUOUS = "the gap is smaller than the rounding of positions that far from the origin"


def knows_total(traits: Traits) -> bool:
    """Return whether the traits say what the total force of a uniform penetration is."""
    return traits.penalty == "distributed" and traits.area is not None and traits.enforcement != "barrier"


def promise_flat_forces(traits: Traits) -> bool | None:
    """Return True where the traits promise what is asked, the patch test or at least the total; else None."""
    return True if traits.passes_flat_patch or (traits.passes_flat_patch is False and knows_total(traits)) else None


def measure_flat(case: Case, subject: Subject) -> Measurement:
    """Compare the forces of a uniform penetration with what is known about them.

    Parameters
    ----------
    case : Case
        A state of `contactverif.problems.flat_states`.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        All dimensionless. The part of the slave's force along the surface over Σ|F|; the error of the total force over
        ε̂ |g| A; the largest error of a nodal force over ε̂ |g| L.
    """
    penetration, traits = case.parameter("penetration"), subject.traits
    size = case.diameter if traits.translation_stable else case.largest_coordinate
    tolerance = UNIT_ROUNDOFF * (8 * size / penetration + 4 * case.n_segments)
    if tolerance >= 1:
        return Measurement(undecided=VACUOUS)
    exact = exact_forces(case)
    slave = uniform_forces(case, subject)[: case.interface.n_slave_nodes]
    along, normal = case.parameters["direction"], _normal(case)
    values = {ALONG: ratio(abs(float((slave @ along).sum())), float(np.abs(slave).sum()))}
    tolerances = {ALONG: tolerance}
    push, whole = float((slave @ normal).sum()), float(np.linalg.norm(exact[: len(slave)].sum(axis=0)))
    broken = "" if push > 0 else "nothing pushes the slave out of the master"
    if knows_total(traits):
        values[TOTAL], tolerances[TOTAL] = abs(push / whole - 1), tolerance
    if traits.passes_flat_patch is not False:
        forces, largest = forces_of_gap(case, subject, exact)
        values[NODAL] = float(np.linalg.norm(forces - exact, axis=1).max()) / whole
        tolerances[NODAL] = tolerance * largest
    return Measurement(check_all(values, tolerances), broken=broken)


def exact_forces(case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, 2) of the pressure ε̂ |g| that push the nodes of a flat state.

    A case without the parameter `weights` has no other surface than the flat one.
    """
    if "weights" not in case.parameters:
        return forces_of_penetration(case)
    sides = np.where(np.arange(case.interface.n_nodes) < case.interface.n_slave_nodes, 1.0, -1.0)
    pressure = case.penalty * case.parameter("penetration")
    forces: FloatArray = pressure * (sides * case.parameters["weights"])[:, None] * _normal(case)
    return forces


def uniform_forces(case: Case, subject: Subject) -> FloatArray:
    """Return the forces (n_nodes, 2) that push the nodes; multipliers, if any, are all ε̂ |g|."""
    formulation, interface = subject.for_case(case), case.interface
    count = formulation.n_multipliers(interface)
    state = case.with_multipliers(np.full(count, case.penalty * case.parameter("penetration")))
    pairing = formulation.pair(interface, state.z)
    if count:
        return -(unit_forces(state, formulation, pairing) @ state.multipliers).reshape(-1, 2)
    return -formulation.residual(interface, pairing, state.z).reshape(-1, 2)


def _normal(case: Case) -> FloatArray:
    """Return the unit normal (2,) out of the master: to the left of the way the slave runs."""
    along = case.parameters["direction"]
    return np.array([-along[1], along[0]])
