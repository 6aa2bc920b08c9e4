"""The inf-sup constant of a formulation with multipliers: how well the bodies resist every pressure that it has.

The rows B of a formulation take displacements to gaps weighted by areas; their transpose takes pressures to nodal
forces. With S, the condensed stiffness of both bodies, the areas A of the multipliers and the mean slave segment h,

    B S⁻¹ Bᵀ λ = β² h A λ / E

has an eigenvalue β² for each multiplier. The smallest β says how much a pressure of unit size moves the bodies, in a
norm that depends on the mesh: h Σ a λ² stands for the norm of H^(−1/2), of which it is a lower bound. A family of
meshes is stable if β does not fall as h does. An eigenvalue of 0 is a pressure that moves nothing.

Rule for the next editor: rows are taken from the residual, never from a formulation's tangent.

Source: Brezzi & Fortin, Mixed and Hybrid Finite Element Methods (1991), Section II; as a numerical test Chapelle &
Bathe, Computers & Structures 47 (1993) 537–545.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.subject import CheckedFormulation
from contactverif.mechanics.accuracy import shape_integrals
from contactverif.mechanics.scene import Scene

# A singular value below this share of the largest one is 0. Differences are exact to u^(2/3), and no constant that was
# ever measured on meshes of a hundred segments is below 1e-4 of the largest singular value.
ZERO_SHARE = UNIT_ROUNDOFF**0.5
_BATCH = 64  # The number of states in one call, so that their contact points fit into memory.


@dataclass(frozen=True, slots=True)
class InfSup:
    """The smallest eigenvalue of one mesh, by force rows or by gap rows, whichever is smaller."""

    segment: float  # The mean slave segment h, or the root of the mean slave face, a length.
    n_multipliers: int
    n_zero: int  # The number of independent pressures that move nothing.
    constant: float  # The smallest β that is not 0, dimensionless; 0 if all are.


def inf_sup_constant(scene: Scene, formulation: CheckedFormulation, *, nodal: bool) -> InfSup:
    """Return the inf-sup constant of a formulation between two bodies whose flat sides touch."""
    interface = scene.interface
    forces = force_rows(scene, formulation)
    gaps = gap_rows(scene, formulation)
    # Each gap row becomes as large on the slave as its force row, since a constraint may have any factor.
    n = interface.dim * interface.n_slave_nodes
    now, then = (np.linalg.norm(rows[:, :n], axis=1) for rows in (gaps, forces))
    gaps = gaps * (then / np.where(now > 0, now, np.inf))[:, None]
    on_slave = forces.reshape(len(forces), -1, interface.dim)[:, : interface.n_slave_nodes]
    lengths = np.ones(len(forces))
    if nodal:  # Unit pressures, not forces: each stands for half of the segments beside the nodes that it pushes.
        sizes = np.linalg.norm(on_slave, axis=2)
        totals = sizes.sum(axis=1)
        integrals = shape_integrals(interface.slave, interface.nodes)[: interface.n_slave_nodes]
        lengths = sizes @ integrals / np.where(totals > 0, totals, 1.0)
    areas = lengths * np.linalg.norm(on_slave.sum(axis=1), axis=1)
    young = min(body.young for body in scene.bodies if not body.rigid)
    segment = float(interface.slave.measures(interface.nodes).mean()) ** (1 / (interface.dim - 1))
    factor = linalg.cholesky(dense(scene.stiffness), lower=True)
    scale = lengths * np.sqrt(young / segment) / np.sqrt(np.where(areas > 0, areas, np.inf))
    both = []
    for rows in (forces, gaps):
        loads = (rows @ dense(scene.transformation)).T * scale
        sizes = linalg.svdvals(linalg.solve_triangular(factor, loads, lower=True))
        resisted = sizes[sizes > ZERO_SHARE * sizes.max(initial=0.0)]
        both.append((len(forces) - len(resisted), float(resisted.min(initial=np.inf))))
    smallest = min(constant for _, constant in both)
    return InfSup(segment, len(forces), max(count for count, _ in both), smallest if np.isfinite(smallest) else 0.0)


def force_rows(scene: Scene, formulation: CheckedFormulation) -> FloatArray:
    """Return the nodal forces (n_multipliers, n_unknowns) of unit multipliers, in the reference positions."""
    n, count = scene.interface.n_unknowns, formulation.n_multipliers(scene.interface)
    shifts = np.zeros((count + 1, n + count))
    shifts[1:, n:] = np.eye(count)
    forces = _residuals(scene, formulation, shifts)
    rows: FloatArray = forces[1:, :n] - forces[0, :n]
    return rows


def gap_rows(scene: Scene, formulation: CheckedFormulation) -> FloatArray:
    """Return the derivatives (n_multipliers, n_unknowns) of the constraint rows, in the reference positions.

    They are central differences. Of nodes that touch, only what moves across the interface opens or closes a gap.
    """
    interface, across = scene.interface, scene.bodies[0].frame[:, -1]
    n, n_nodes, count = interface.n_unknowns, interface.n_nodes, formulation.n_multipliers(interface)
    shortest = min(float(side.heights(interface.nodes).min()) for side in (interface.slave, interface.master))
    step = shortest * UNIT_ROUNDOFF ** (1 / 3)
    shifts = np.zeros((n_nodes, n + count))
    for direction, part in enumerate(across):
        shifts[np.arange(n_nodes), interface.dim * np.arange(n_nodes) + direction] = step * part
    values = _residuals(scene, formulation, np.concatenate([shifts, -shifts]))[:, n:]
    derivatives = (values[:n_nodes] - values[n_nodes:]).T / (2 * step)
    rows: FloatArray = (derivatives[:, :, None] * across).reshape(len(derivatives), n)
    return rows


def _residuals(scene: Scene, formulation: CheckedFormulation, shifts: FloatArray) -> FloatArray:
    """Return residuals near the reference with multipliers of 1, where every point that faces something is active."""
    interface = scene.interface
    state = np.concatenate([interface.nodes.reshape(-1), np.ones(formulation.n_multipliers(interface))])
    pairing = formulation.pair(interface, state)
    batches = (state + shifts[start : start + _BATCH] for start in range(0, len(shifts), _BATCH))
    return np.concatenate([formulation.residual(interface, pairing, batch) for batch in batches])
