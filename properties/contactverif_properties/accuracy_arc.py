"""Ask whether springs between two concentric arcs press as they do between flats.

**Question.** Two concentric arcs penetrate each other by the same depth d everywhere. Do the forces and the reported
pressures tend to those of a uniform pressure ε̂ d as the mesh is refined, whether the slave is convex or concave?

**Why it matters.** No flat test sees what a formulation does where the surface bends. Here no body hides it: the
pressure is known at every place (`docs/concepts/curved-surfaces.md`).

**How it is judged.** The slave reaches from 10° to 80° in 96 equal segments, the master from 0° to 90° in 128 graded
ones, of radius R = 4 at d = R/40. Whatever the rule by which gaps are measured, the limit is the pressure ε̂ d on the
slave's arc. Its integral is compared with the total force on the slave, and on the master where the traits promise
`conserves_force`, over the length of that integral: at most 4e-3, where the formulations here have at most 1.4e-3 and
springs a quarter as stiff where the surface bends have 0.75.
The nodal forces of the slave are compared too (E_F, at most 1.2e-2, where 3.7e-3 is the largest), and the reported
pressures: their sum over the weights, and their root mean square error with the plugin's own weights (both at most
4e-3, where 6e-4 is the largest). Of two passes the slave's points count, or for the sum the points of both, whichever
comes nearer to the forces. Multipliers that are pressures are all ε̂ d here. Errors on meshes of a half and a
quarter of these segments are details.

The total is known from the traits only if `penalty` is "distributed" and `area` is stated. These formulations are asked
to pass.

**Undecided.** Never: the bounds are far above what a tie between two master segments changes.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import force_error, shape_integrals, traction_forces
from contactverif.problems.arcs import Arcs
from contactverif_properties.patch_flat import refuse_unknown_total
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.passes import nearest_sum

REFINEMENTS = (8, 16, 32)  # The last one is judged.
TOTAL, NODAL = 4e-3, 1.2e-2  # Three times the largest error of a right formulation.

_REASON = "Straight segments differ from an arc by the square of their length; three times the largest measured error."
SLAVE = Quantity("error of the total force on the slave", "1", f"{TOTAL:g}", _REASON)
MASTER = Quantity("error of the total force on the master", "1", f"{TOTAL:g}", _REASON)
FORCES = Quantity(
    "error of the slave's nodal forces",
    "1",
    f"{NODAL:g}",
    "A node's share of a segment differs by the length of the segment; three times the largest measured error.",
)
SUM = Quantity("error of the sum of reported pressures", "1", f"{TOTAL:g}", _REASON)
PRESSURE = Quantity("error of the reported pressures", "1", f"{TOTAL:g}", _REASON)


def measure_arcs(case: Case, subject: Subject) -> Measurement:
    """Compare forces and reported pressures with those of a uniform pressure on the slave's arc.

    Returns
    -------
    Measurement
        All relative, so dimensionless: the errors of the total forces, E_F of the slave's nodal forces, and the errors
        of what is reported, if anything is. Details: the same on coarser meshes.
    """
    arcs = Arcs.from_case(case)
    errors = {refine: _errors(arcs, refine, subject) for refine in REFINEMENTS}
    values = errors.pop(REFINEMENTS[-1])
    tolerances = {quantity: NODAL if quantity == FORCES else TOTAL for quantity in values}
    details = {
        f"{quantity.name}, m = {refine}": value for refine, part in errors.items() for quantity, value in part.items()
    }
    return Measurement(check_all(values, tolerances), details=details)


def _errors(arcs: Arcs, refine: int, subject: Subject) -> dict[Quantity, float]:
    """Return the errors {quantity: number} on one mesh."""
    case = arcs.case(refine)
    formulation, interface, n_slave = subject.for_case(case), case.interface, case.interface.n_slave_nodes
    case = case.with_multipliers(np.full(formulation.n_multipliers(interface), arcs.pressure))
    # Areas of the reference are those of the master's arc, on which the slave lies there.
    share = arcs.radius / arcs.slave_radius if subject.traits.area == "reference" else 1.0
    pairing = formulation.pair(interface, case.z)
    forces = -formulation.residual(interface, pairing, case.z)[: interface.n_unknowns].reshape(-1, 2)
    exact = share * arcs.slave_force
    totals = forces[:n_slave].sum(axis=0), -forces[n_slave:].sum(axis=0)
    slave, master = (float(np.linalg.norm(total - exact) / np.linalg.norm(exact)) for total in totals)
    values = {SLAVE: slave, FORCES: _nodal_error(arcs, case, forces, share)}
    if subject.traits.conserves_force:
        values[MASTER] = master
    if "contact_points" in formulation.provides:
        points = formulation.contact_points(interface, pairing, case.z)
        radial = forces[:n_slave] * case.positions[:n_slave] / arcs.slave_radius
        total = nearest_sum(points, abs(float(radial.sum())))
        values[SUM] = abs(total / (share * arcs.length * arcs.pressure) - 1)
        values[PRESSURE] = _pressure_error(points, arcs.pressure)
    return values


def _pressure_error(points: ContactPoints, pressure: float) -> float:
    """Return the root mean square of p/p_exact − 1 over the weights; infinite if no point of the slave has any."""
    counted = ~points.on_master & (points.weight > 0)
    if not counted.any():
        return np.inf
    errors = np.where(points.active, points.pressure, 0.0)[counted] / pressure - 1
    return float(np.sqrt(np.average(errors**2, weights=points.weight[counted])))


def _nodal_error(arcs: Arcs, case: Case, forces: FloatArray, share: float) -> float:
    """Return the error E_F of the slave's nodal forces."""
    towards = share * (-arcs.pressure if arcs.convex_slave else arcs.pressure)

    def traction(places: FloatArray) -> FloatArray:
        pressures: FloatArray = towards * places / np.linalg.norm(places, axis=1)[:, None]
        return pressures

    surface = case.interface.slave
    exact = traction_forces(surface, case.positions, traction)
    return force_error(forces, exact, shape_integrals(surface, case.positions))


@cache
def arc_cases() -> tuple[Case, ...]:
    """Return a convex and a concave slave on the coarsest mesh."""
    return tuple(
        Arcs(convex_slave=convex).case(1, name) for name, convex in (("convex slave", True), ("concave slave", False))
    )


ACCURACY_ARC = Property(
    id="accuracy.arc",
    family="accuracy",
    summary="Springs between two concentric arcs press with ε̂ d, and reported pressures say so.",
    quantities=(SLAVE, MASTER, FORCES, SUM, PRESSURE),
    cases=unless_given(arc_cases),
    measure=measure_arcs,
    promise=lambda traits: None if refuse_unknown_total(traits) else True,
    applicable=refuse_unknown_total,
)
