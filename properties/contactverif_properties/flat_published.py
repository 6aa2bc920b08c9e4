"""Ask whether the forces that a formulation states of itself on named flat cases come out, right or wrong.

**Question.** The trait `published_forces` gives the nodal forces of a uniform penetration on named cases, as fractions:
those of the reference paper for A1, A2, B and C, or an author's own. Does the formulation give just these?

**Why it matters.** A formulation that states that it fails the patch test fails by a known amount. Two wrong codes of
the same method fail by different amounts, and a promise to fail hides the difference. The table shows it.

**How it is judged.** The measured number is the largest |F − F_stated| over all nodes, over the forces of all slave
nodes. Forces are over penalty × penetration, with the penalty in the formulation's own unit. With multipliers, they are
those of unit multipliers. On a case of which nothing is stated the consistent forces are asked of a formulation that
promises them, and nothing of any other. The tolerance is u(8X/|g| + 4N): a gap is a difference of coordinates, and N
forces are summed.

**Undecided.** Never: at a kink of a flat interface both partners give the same gap and the same force.

**Source.** Zavarise & De Lorenzis (2009), Figs. 8, 16 and 20.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError
from contactverif.contract.property import Measurement, Property
from contactverif.contract.published_forces import parse_forces
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.problems.named_states import FLAT_NAMES, named_case
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import Cases, unless_given
from contactverif_properties.shared.roundoff import gap_quantity, gap_tolerance
from contactverif_properties.shared.uniform_pressure import consistent_forces, unit_forces

FORCE = gap_quantity("difference from the stated forces")


def measure_published(case: Case, subject: Subject) -> Measurement:
    """Compare the forces of a uniform penetration with those that the traits state.

    Parameters
    ----------
    case : Case
        A flat case with a name.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The largest |F − F_stated| over Σ|F_stated| of the slave nodes, dimensionless; nothing where nothing is stated.

    Raises
    ------
    ContractError
        If forces are stated on a case that does not exist, or not one for each node.
    """
    stated = _stated_forces(case, subject.traits)
    if stated is None:
        return Measurement(idle=True)
    forces = _forces_of_unit(case, subject)
    n_slave = case.interface.n_slave_nodes
    error = float(np.linalg.norm(forces - stated, axis=1).max() / np.abs(stated[:n_slave]).sum())
    return Measurement([FORCE.check(error, gap_tolerance(case, case.parameter("penetration")))])


def _stated_forces(case: Case, traits: Traits) -> FloatArray | None:
    """Return the forces (n_nodes, 2) that must come out; None if that is not known."""
    if strangers := traits.published_forces.keys() - set(FLAT_NAMES):
        needed = f"names of flat cases: {', '.join(FLAT_NAMES)}"
        raise ContractError(f"Traits.published_forces: found {', '.join(sorted(strangers))}; needed {needed}")
    if case.name not in traits.published_forces:
        consistent = traits.passes_flat_patch and traits.penalty == "distributed"
        return consistent_forces(case, 1.0) if consistent else None
    slave, master = parse_forces(traits.published_forces[case.name])
    slave_x, master_x = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    if (len(slave), len(master)) != (len(slave_x), len(master_x)):
        counts = f"{len(slave)} and {len(master)} forces on {case.name}"
        needed = f"{len(slave_x)} on the slave nodes and {len(master_x)} on the master nodes"
        raise ContractError(f"Traits.published_forces: found {counts}; needed {needed}")
    from_left = np.append(np.argsort(slave_x), len(slave_x) + np.argsort(master_x))
    forces = np.zeros((len(from_left), 2))
    forces[from_left, 1] = [*map(float, slave), *(-float(force) for force in master)]
    return forces


def _forces_of_unit(case: Case, subject: Subject) -> FloatArray:
    """Return the forces (n_nodes, 2) over penalty × penetration, or those of unit multipliers."""
    formulation = subject.for_case(case)
    state = case.with_multipliers(np.ones(formulation.n_multipliers(case.interface)))
    pairing = formulation.pair(state.interface, state.z)
    if state.n_multipliers:
        forces: FloatArray = -unit_forces(state, formulation, pairing).sum(axis=1)
    else:
        unit = subject.penalty(case) * case.parameter("penetration")
        forces = -formulation.residual(case.interface, pairing, case.z) / unit
    return forces.reshape(-1, 2)


def refuse_unstated_forces(traits: Traits) -> str:
    """Return why no forces are known, or an empty string if the traits state some."""
    return refuse_barrier(traits) or ("" if traits.published_forces else "the traits state no forces of named cases")


def _named_flats() -> Cases:
    return tuple(map(named_case, FLAT_NAMES))


FLAT_PUBLISHED = Property(
    id="patch.flat.published",
    family="patch",
    summary="The forces that the traits state of named flat cases, right or wrong, come out exactly.",
    quantities=(FORCE,),
    cases=unless_given(_named_flats),
    measure=measure_published,
    promise=lambda traits: None if refuse_unstated_forces(traits) else True,
    applicable=refuse_unstated_forces,
    least_contact=0.0,  # Nothing is asked on a case of which nothing is stated, and one table is better than none.
)
