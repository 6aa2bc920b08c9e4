"""The equations of a scene and a formulation: residual, derivative, and what roundoff alone may do to the residual.

With multipliers the unknowns u are those of the scene, q, and the multipliers behind them; the system is a saddle
point. Where contact forces are differentiated, a difference for each unknown is the derivative. Two matrices are
cheaper: the formulation's own tangent, and differences along which all nodes move at once that are too far apart to act
on the same node. Neither can be trusted, but one more difference, along a random direction in which all unknowns move,
shows an error in any entry.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Self

import numpy as np
from scipy import linalg, sparse

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.errors import ContractError
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import PLANE
from contactverif.contract.subject import CheckedFormulation, lazy
from contactverif.mechanics.linear import Step, solve_step
from contactverif.mechanics.scene import Scene

# An error of a matrix by this share of its rows makes each iterate of Newton's method a million times better.
AGREEMENT = 1e-6
# Forces that change by as much either way, but for this share, have no kink in between.
KINK = 1e-3
ROUNDOFF_FACTOR = 8.0  # Forces are rounded, and a residual is zero, by so many units of roundoff of the largest terms.
MANY_UNKNOWNS = 200  # From so many on, products of sparse matrices take less time than those of full ones.
# Forces at a node depend on its neighbours, on the segments or faces that these face, and on the neighbours of those:
# the diagonals of the largest boxes around one of the slave and around one of the master together, times this.
REACH = 1.5
_SEED = 2009


@dataclass(frozen=True, eq=False)
class Differences:
    """Central differences of contact forces in one state."""

    forces: Callable[[FloatArray], FloatArray]  # The contact forces (..., n) in states (..., n).
    z: FloatArray  # (n,) The state: positions, then multipliers.
    steps: FloatArray  # (n,) The step of each unknown, in its own unit.
    sizes: FloatArray  # (n,) What each unknown is rounded like, in its own unit: the largest one of its kind.
    n_positions: int  # The number of unknowns that are positions.
    dim: int = PLANE  # The number of positions of a node.

    def away_from_kinks(self) -> Self:
        """Return differences with smaller steps, if forces have a kink within these: where contact begins, for one.

        With ρ the roundoff of positions over the step, the steps are ρ^¼ or √ρ times as large. Where these have kinks,
        too, the steps stay. Without a kink, forces change along the random direction as they do against it.
        """
        forces, rounding = self.forces(self.z), UNIT_ROUNDOFF * float((self.sizes / self.steps)[0])
        for power in (0.0, 0.25, 0.5):
            smaller = replace(self, steps=self.steps * rounding**power)
            _, before, after = smaller._probe
            change = np.abs(after - before).max(initial=0.0)
            rounded = float((smaller.sizes / smaller.steps)[0]) * change + np.abs(forces).max(initial=0.0)
            bend = np.abs(before - 2 * forces + after).max(initial=0.0)  # Four forces, each of which is rounded.
            if not bend > KINK * change + 4 * ROUNDOFF_FACTOR * UNIT_ROUNDOFF * rounded:
                return smaller
        return self

    def by_unknown(self) -> FloatArray:
        """Return the derivative (n, n), by a difference for each unknown."""
        return np.asarray((self._along(np.diag(self.steps)) / self.steps[:, None]).T)

    def by_groups(self, reach: float) -> FloatArray | None:
        """Return the derivative (n, n) of a state without multipliers, if forces reach no farther than a length.

        Nodes move at once if no node is within `reach` of two of them. None if that is no less work than `by_unknown`.
        """
        dim, positions = self.dim, self.z.reshape(-1, self.dim)
        n_nodes, distances = len(positions), np.linalg.norm(positions[:, None] - positions[None], axis=-1)
        groups = np.full(n_nodes, -1)
        for node, near in enumerate(distances <= 2 * reach):
            others = groups[near]
            groups[node] = np.setdiff1d(np.arange(len(others) + 1), others)[0]
        n_groups = int(groups.max()) + 1
        if 2 * n_groups > n_nodes:
            return None
        shifts = np.zeros((n_groups, dim, n_nodes, dim))
        for component in range(dim):
            shifts[groups, component, np.arange(n_nodes), component] = self.steps.reshape(-1, dim)[:, component]
        changes = self._along(shifts.reshape(dim * n_groups, -1)).reshape(n_groups, dim, n_nodes, dim)
        rows, columns = np.nonzero(distances <= reach)
        derivative = np.zeros((n_nodes, dim, n_nodes, dim))
        derivative[rows, :, columns, :] = changes[groups[columns], :, rows, :].transpose(0, 2, 1)
        return derivative.reshape(len(self.z), -1) / self.steps

    def confirm(self, matrix: Any) -> bool:
        """Return whether a matrix (n, n), dense or sparse, is the derivative, by one difference in a random direction.

        The change of a force may differ from that of the matrix by `AGREEMENT` of its terms, and by roundoff. A force
        along an inclined normal is rounded in both of its components.
        """
        (direction, before, after), terms = self._probe, abs(matrix)
        rounded = terms @ self.sizes + np.maximum(np.abs(before), np.abs(after))
        allowed = AGREEMENT * (terms @ np.abs(direction)) + ROUNDOFF_FACTOR * UNIT_ROUNDOFF * rounded
        of_nodes = allowed[: self.n_positions].reshape(-1, self.dim)
        of_nodes[:] = of_nodes.max(axis=1, keepdims=True)
        return bool((np.abs(matrix @ direction - (after - before) / 2) <= allowed).all())

    @lazy
    def _probe(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a direction (n,), half a step to a step of every unknown, and the forces against it and along it."""
        random, n = np.random.default_rng(_SEED), len(self.z)
        direction: FloatArray = self.steps * random.uniform(0.5, 1.0, n) * random.choice([-1.0, 1.0], n)
        return direction, *self.forces(np.stack([self.z - direction, self.z + direction]))

    def _along(self, shifts: FloatArray) -> FloatArray:
        """Return half the change (k, n) of the forces from z − shift to z + shift, for each shift of (k, n)."""
        forces = self.forces(np.concatenate([self.z + shifts, self.z - shifts]))
        return np.asarray((forces[: len(shifts)] - forces[len(shifts) :]) / 2)


@dataclass(slots=True)
class System:
    """The equations S q − g + R(z(u)) = 0 of a scene and a formulation.

    S is the stiffness of the bodies, g their load, and R the contact forces on the unknowns. The scene's symbols are
    those of `contactverif.mechanics.scene`; each method takes the unknowns u (n,).
    """

    scene: Scene
    formulation: CheckedFormulation
    factor: float = 1.0  # The share of loads and imposed displacements.
    # False differentiates the residual on the frozen pairing, even if the formulation has a tangent.
    use_tangent: bool = True
    # The step of differences in positions, a length; None for the one that suits smooth residuals.
    difference_step: float | None = None
    # True takes any matrix that one difference confirms in place of differences for each unknown.
    any_matrix: bool = False
    n_multipliers: int = field(init=False)  # The number of multipliers of the formulation on the scene's interface.
    # (n_unknowns + n_multipliers, n) The scene's transformation from unknowns to positions, with the multipliers
    # behind both.
    transformation: Any = field(init=False)
    stiffness: Any = field(init=False)  # (n, n) The scene's stiffness, 0 for multipliers.
    _sizes: tuple[Any, Any] = field(init=False)  # The absolute values of both, the transformation transposed.

    def __post_init__(self) -> None:
        scene, count = self.scene, self.formulation.n_multipliers(self.scene.interface)
        self.n_multipliers, self.transformation, self.stiffness = count, scene.transformation, scene.stiffness
        if count:
            self.transformation, self.stiffness = (
                linalg.block_diag(matrix, value * np.eye(count))
                if isinstance(matrix, np.ndarray)
                else sparse.csr_array(sparse.block_diag([matrix, value * sparse.eye_array(count)]))
                for matrix, value in ((self.transformation, 1.0), (self.stiffness, 0.0))
            )
        self._sizes = abs(self.transformation).T, abs(scene.stiffness)

    @property
    def size(self) -> int:
        """The number n of unknowns u: n_free + n_multipliers."""
        return self.scene.n_free + self.n_multipliers

    def state(self, u: FloatArray) -> FloatArray:
        """Return the state z that a formulation gets: positions, then multipliers."""
        n_free = self.scene.n_free
        return np.concatenate([self.scene.positions(u[:n_free], self.factor), u[n_free:]])

    def pair(self, u: FloatArray) -> Pairing | None:
        """Return the pairing, None if the formulation has none."""
        return self.formulation.pair(self.scene.interface, self.state(u))

    def forces(self, u: FloatArray, pairing: Pairing | None) -> FloatArray:
        """Return the residual of the formulation alone, (n_unknowns + n_multipliers,)."""
        return self.formulation.residual(self.scene.interface, pairing, self.state(u))

    def tangent(self, u: FloatArray, pairing: Pairing | None) -> Any:
        """Return the derivative of `forces`; differences where it must not ask for a tangent."""
        if self._asks_tangent:
            return self.formulation.tangent(self.scene.interface, pairing, self.state(u))
        return self._differences(pairing, self.state(u))

    def forces_and_tangent(self, u: FloatArray, pairing: Pairing | None) -> tuple[FloatArray, Any]:
        """Return `forces` and `tangent`, in one call where that is offered."""
        return self.forces_and_tangents([u], pairing)[0]

    def forces_and_tangents(
        self, states: Sequence[FloatArray], pairing: Pairing | None
    ) -> list[tuple[FloatArray, Any]]:
        """Return `forces` and `tangent` at each of some unknowns u, in one call where that is offered."""
        if not (self._asks_tangent and "residual_and_tangent" in self.formulation.provides):
            return [(self.forces(u, pairing), self.tangent(u, pairing)) for u in states]
        interface = self.scene.interface
        return self.formulation.answers([("residual_and_tangent", interface, pairing, self.state(u)) for u in states])

    @property
    def _asks_tangent(self) -> bool:
        return self.use_tangent and "tangent" in self.formulation.provides

    def residual(self, u: FloatArray, pairing: Pairing | None) -> FloatArray:
        """Return the residual (n,): forces out of balance, then constraint rows."""
        return self.balance(u, self.forces(u, pairing))

    def balance(self, u: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the residual (n,) where the formulation returns these forces."""
        n_free = self.scene.n_free
        residual: FloatArray = self.transformation.T @ forces
        residual[:n_free] += self.scene.bulk_forces(u[:n_free], self.factor)
        return residual

    def matrix(self, u: FloatArray, pairing: Pairing | None) -> tuple[Any, FloatArray]:
        """Return the derivative (n, n) of the residual, and the part (n,) of it that roundoff alone may cause.

        The residual of a formulation without a tangent is differentiated on the frozen pairing.
        """
        return self.assemble(u, pairing, *self.forces_and_tangent(u, pairing))

    def assemble(
        self, u: FloatArray, pairing: Pairing | None, forces: FloatArray, tangent: Any
    ) -> tuple[Any, FloatArray]:
        """Return what `matrix` does, with the `forces` and the `tangent` at the unknowns u."""
        contact = self.contact_stiffness(u, pairing, tangent)
        return self.stiffness + contact, self.floor(u, contact, forces)

    def contact_stiffness(self, u: FloatArray, pairing: Pairing | None, tangent: Any) -> Any:
        """Return the derivative (n, n) of the contact forces on the unknowns, of a `tangent`; None asks for that."""
        tangent = self.tangent(u, pairing) if tangent is None else tangent
        if not isinstance(self.transformation, np.ndarray):
            return self.transformation.T @ sparse.csr_array(tangent) @ self.transformation
        if len(self.transformation) < MANY_UNKNOWNS:
            return self.transformation.T @ dense(tangent) @ self.transformation
        transformation = sparse.csr_array(self.transformation)  # It has an entry or two in a row.
        return (transformation.T @ sparse.csr_array(tangent) @ transformation).toarray()

    def floor(self, u: FloatArray, contact: Any, forces: FloatArray) -> FloatArray:
        """Return the part of the residual (n,) that roundoff of positions and forces alone may cause.

        `contact` (n, n) is the derivative of the contact forces at u, or nearby.
        """
        scene, n_free = self.scene, self.scene.n_free
        # A gap is rounded like the largest coordinate, even where the node that it is measured from moves no force.
        largest = np.abs(scene.positions(u[:n_free], self.factor)).max()
        sizes = np.full(self.size, largest)
        sizes[n_free:] = np.abs(u[n_free:]).max(initial=0.0)  # This includes multipliers that become inactive.
        # A force along an inclined normal is rounded in both of its components.
        to_unknowns, stiffness = self._sizes
        terms = abs(contact) @ sizes + to_unknowns @ np.abs(forces)
        # A displacement below uX moves no node. Displacements of a body that nothing presses shrink by 1e-16 in each
        # iteration, and so do its forces: counted over those displacements alone, they would never be small.
        displacements = np.maximum(np.abs(u[:n_free]), UNIT_ROUNDOFF * largest)
        terms[:n_free] += stiffness @ displacements + self.factor * np.abs(scene.load)
        return np.asarray(ROUNDOFF_FACTOR * UNIT_ROUNDOFF * terms)

    def step(self, matrix: Any, right: FloatArray, floor: FloatArray | None = None) -> Step:
        """Solve matrix · step = right; roundoff alone may cause `floor` (n,) of the right-hand side."""
        return solve_step(matrix, right, self.scene.n_free, floor)

    def _differences(self, pairing: Pairing | None, z: FloatArray) -> Any:
        """Return the derivative (n_unknowns, n_unknowns) of the contact forces at z, by central differences."""
        interface, formulation = self.scene.interface, self.formulation
        positions, multipliers = z[: interface.n_unknowns], z[interface.n_unknowns :]
        nodes, sides = positions.reshape(-1, interface.dim), (interface.slave, interface.master)
        shortest, largest = min(side.heights(nodes).min() for side in sides), float(np.abs(positions).max())
        smooth = shortest * (UNIT_ROUNDOFF * largest / shortest) ** (1 / 3)
        steps = np.full(z.size, smooth if self.difference_step is None else self.difference_step)
        sizes = np.full(z.size, largest)
        if len(multipliers):  # The residual is linear in them: a step of their size, or of the bodies' stiffness.
            size = np.abs(multipliers).max() or (abs(self.scene.stiffness).max() if self.scene.n_free else 0.0)
            steps[len(positions) :] = sizes[len(positions) :] = size or 1.0
        residual = partial(formulation.residual, interface, pairing)
        differences = Differences(residual, z, steps, sizes, len(positions), interface.dim)
        if not self.any_matrix:
            return differences.by_unknown()
        differences, matrix = differences.away_from_kinks(), None
        if "tangent" in formulation.provides:
            with suppress(ContractError):  # A tangent that breaks the contract is no fault of the forces.
                matrix = formulation.tangent(interface, pairing, z)
        if matrix is not None and differences.confirm(matrix):
            return matrix
        reach = REACH * sum(np.linalg.norm(np.ptp(nodes[side.faces], axis=1), axis=1).max() for side in sides)
        groups = None if len(multipliers) else differences.by_groups(reach)
        return groups if groups is not None and differences.confirm(groups) else differences.by_unknown()
