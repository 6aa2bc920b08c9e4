"""The patch test on an interface alone: is a uniform pressure transmitted exactly, on both sides? Is its sum right?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import Pairing, Traits
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.oracle import uniform_pressure_weights
from contactverif.strategies import flat_cases
from contactverif_properties import roundoff
from contactverif_properties.anywhere import no_barrier
from contactverif_properties.kinks import excuse

ERROR = roundoff.gap_quantity("error of a nodal force")
TOTAL = roundoff.gap_quantity("error of the total force")


def consistent_forces(case: Case, pressure: float) -> FloatArray:
    """The forces (n_nodes, 2) by which a uniform pressure pushes a flat interface, exact to the last digit."""
    weights = uniform_pressure_weights(case.interface, case.parameters["along"])
    along = case.parameters["direction"]
    normal = np.array([-along[1], along[0]])  # out of the master: to the left of the way the slave runs
    sides = np.where(np.arange(len(weights)) < case.interface.n_slave_nodes, 1.0, -1.0)
    forces: FloatArray = pressure * (sides * weights)[:, None] * normal
    return forces


def exact_forces(case: Case) -> FloatArray:
    """The consistent forces (n_nodes, 2) of the pressure ε̂ |g|."""
    return consistent_forces(case, case.penalty * case.parameter("penetration"))


def transmitted(case: Case, subject: Subject) -> Measurement:
    """Nodal forces of a uniform penetration against the exact consistent ones.

    Returns
    -------
    Measurement
        Largest |F − F_exact| / (ε̂ |g| L) over the nodes of both surfaces, dimensionless. Of multipliers the
        distribution is judged, apart from the size of the forces: of uniform ones if they are pressures; if they are
        nodal forces, of those that come nearest to the exact forces.

    Source: Zavarise & De Lorenzis (2009), Figs. 8, 16 and 20; exact forces in rationals (`contactverif.oracle`).
    """
    formulation = subject.for_case(case)
    exact = exact_forces(case)
    size = float(np.linalg.norm(exact[: case.interface.n_slave_nodes].sum(axis=0)))
    tolerance = roundoff.of_gap(case, case.parameter("penetration"))
    if formulation.n_multipliers(case.interface):
        forces, largest = _by_multipliers(case, subject, formulation, exact)
        tolerance *= largest
    else:
        forces = -formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)
    error = float(np.linalg.norm(forces.reshape(-1, 2) - exact, axis=1).max())
    return Measurement({ERROR.name: error / size}, {ERROR.name: tolerance})


def _by_multipliers(
    case: Case, subject: Subject, formulation: CheckedFormulation, exact: FloatArray
) -> tuple[FloatArray, float]:
    """Forces (n_unknowns,) of the multipliers that are asked about, and their largest over the mean of their sizes."""
    uniform = np.full(formulation.n_multipliers(case.interface), case.penalty * case.parameter("penetration"))
    pressed = case.with_multipliers(uniform)
    transfer = -force_columns(pressed, formulation, formulation.pair(case.interface, pressed.z))
    if subject.traits.penalty == "nodal":
        multipliers = np.linalg.lstsq(transfer, exact.reshape(-1), rcond=None)[0]
        mean = float(np.abs(multipliers).mean())
        return transfer @ multipliers, float(np.abs(multipliers).max()) / mean if mean > 0 else 1.0
    forces: FloatArray = transfer @ uniform
    n = 2 * case.interface.n_slave_nodes
    total, wanted = (side[:n].reshape(-1, 2).sum(axis=0) for side in (forces, exact.reshape(-1)))
    found = float(total @ wanted)
    return forces * (float(wanted @ wanted) / found if found > 0 else 1.0), 1.0


def force_columns(case: Case, formulation: CheckedFormulation, pairing: Pairing | None) -> FloatArray:
    """(n_unknowns, n_multipliers): what a unit of each multiplier adds to the position rows of the residual.

    The residual is affine in the multipliers on a frozen pairing; what it holds without any, as one that is augmented
    by a penalty does, is taken off. It is asked with a multiplier as large as those of the case, a power of two: a
    unit beside a large penalty force would be lost in roundoff.
    """
    n, count = case.interface.n_unknowns, case.n_multipliers
    largest = float(np.abs(case.z[n:]).max(initial=0.0))
    size = 2.0 ** round(np.log2(largest)) if largest > 0 else 1.0
    multipliers = np.vstack([size * np.eye(count), np.zeros(count)])
    states = np.hstack([np.broadcast_to(case.z[:n], (count + 1, n)), multipliers])
    forces = formulation.residual(case.interface, pairing, states)[:, :n]
    columns: FloatArray = (forces[:-1] - forces[-1]).T / size
    return columns


def resultant(case: Case, subject: Subject) -> Measurement:
    """The total force on the slave against ε̂ |g| × its area, in the configuration that the traits name.

    Multipliers that are pressures are all ε̂ |g| here.

    The reference is scaled by a power of two, so that the two configurations differ; each method of distributed springs
    has to get this right, whether it passes the patch test or not.

    Returns
    -------
    Measurement
        |ΣF − ε̂ |g| A n| / (ε̂ |g| A) over the slave nodes, dimensionless; A the current or the reference length.
    """
    stretch = 2.0 ** int(np.random.default_rng(case.seed).integers(-2, 3))
    interface = case.interface.at(case.interface.nodes * stretch)
    formulation = subject.for_case(case)
    count = formulation.n_multipliers(interface)
    case = case.with_multipliers(np.full(count, case.penalty * case.parameter("penetration")))
    pairing = formulation.pair(interface, case.z)
    if count:
        columns = force_columns(replace(case, interface=interface), formulation, pairing)
        forces = -(columns @ case.z[interface.n_unknowns :]).reshape(-1, 2)
    else:
        forces = -formulation.residual(interface, pairing, case.z).reshape(-1, 2)
    exact = exact_forces(case)[: interface.n_slave_nodes].sum(axis=0)
    if subject.traits.area == "reference":
        exact = exact * stretch
    error = float(np.linalg.norm(forces[: interface.n_slave_nodes].sum(axis=0) - exact))
    value, tolerance = error / float(np.linalg.norm(exact)), roundoff.of_gap(case, case.parameter("penetration"))
    undecided = ""
    if value > tolerance:  # a node that faces a free end exactly is over the master or not as roundoff will have it
        there, rounding = replace(case, interface=interface), 64 * UNIT_ROUNDOFF * case.largest_coordinate
        undecided = excuse(there, formulation, formulation.pair(interface, case.z), rounding, {"forces": error})
    return Measurement({TOTAL.name: value}, {TOTAL.name: tolerance}, undecided)


def _area_is_stated(traits: Traits) -> str:
    if traits.penalty == "nodal":
        return "there are no distributed springs"
    if traits.penalty is None or traits.area is None:
        return "the traits `penalty` and `area` are not both stated, so the total is unknown"
    return no_barrier(traits)


FLAT_TRANSMISSION = Property(
    id="patch.flat.transmission",
    family="patch",
    summary="a uniform penetration of a flat interface gives the exact consistent nodal forces on both sides",
    quantities=(ERROR,),
    cases=flat_cases,
    measure=transmitted,
    promise=lambda traits: traits.passes_flat_patch,
    applicable=no_barrier,
    exact=exact_forces,
)
FLAT_RESULTANT = Property(
    id="patch.flat.resultant",
    family="patch",
    summary="a uniform penetration of a flat interface gives the total force penalty × penetration × area",
    quantities=(TOTAL,),
    cases=flat_cases,
    measure=resultant,
    promise=lambda traits: None if _area_is_stated(traits) else True,
    applicable=_area_is_stated,
)
