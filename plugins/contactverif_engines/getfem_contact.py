"""GetFEM: small-strain contact of meshes that do not match, by penalty springs or by multipliers of the slave.

Source: the bricks `add_penalized_contact_between_nonmatching_meshes_brick` and
`add_integral_contact_between_nonmatching_meshes_brick` of GetFEM 5.4, in its manual "Small sliding contact with
friction bricks". Slaves are a mesh, and masters another one: nodes in the same place would become one in a mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from contactverif.contract.engine import EngineAnswer, EngineTraits, FloatArray, IntArray, SceneArrays
from contactverif_engines.filled import FilledScene, fill_rigid_bodies

_STEPS = 60
_CONVERGED = 1e-13  # The last step over the largest displacement.
_ROUNDED = 1e-9  # A step below this share that does not shrink any more is roundoff of a badly conditioned matrix.
_REGION = 1000  # The number of the contact faces; bodies have the numbers from 1.
# The corners of a cell in the order of GetFEM, which numbers those of a quadrilateral along lines.
_ORDERS = {3: [0, 1, 2], 4: [0, 1, 3, 2]}
_FACES = {3: [{1, 2}, {0, 2}, {0, 1}], 4: [{1, 3}, {0, 2}, {2, 3}, {0, 1}]}  # The corners of each face of a cell.
_SHAPES = {3: ("GT_PK(2,1)", "FEM_PK(2,1)", "IM_TRIANGLE"), 4: ("GT_QK(2,1)", "FEM_QK(2,1)", "IM_GAUSS_PARALLELEPIPED")}


@dataclass(frozen=True)
class GetFEM:
    """GetFEM with one of its contact bricks for small strains."""

    # Springs of the stiffness ε̂, or multipliers at the nodes of the slave with an augmentation of E/L. Where points of
    # an edge are open it changes the solution, as the manual says, so that bodies far away have no part in it.
    kind: Literal["penalty", "multiplier"] = "penalty"
    # The order of integration on the slave's edges: 1 to 19, and only odd numbers where cells are triangles.
    order: int = 5

    @property
    def traits(self) -> EngineTraits:
        """The statements: points that see the next edge of the other side are no exact integration.

        Loads are small because places are looked for where the bodies were, within a thirtieth of a cell or so.
        """
        return EngineTraits(self.kind, accuracy=1e-10, load_scale=2.0**-10)

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Make two meshes and a model, find its zero by Newton's method, and return its displacements."""
        import getfem as gf

        gf.util_trace_level(0)
        gf.util_warning_level(0)
        plane = fill_rigid_bodies(scene)
        is_slave = np.zeros(len(scene.axes), bool)
        is_slave[scene.body_of_node[scene.slave[:, 0]]] = True
        model = gf.Model("real")
        sides = [_Side(plane, wanted, edges) for wanted, edges in ((is_slave, scene.slave), (~is_slave, scene.master))]
        for side, name in zip(sides, ("u1", "u2"), strict=True):
            side.add_to(model, name, self.order)
        self._add_contact(model, sides[0], scene)
        moves = np.where(plane.fixed, plane.imposed, plane.start)
        for side, name in zip(sides, ("u1", "u2"), strict=True):
            model.set_variable(name, side.to_unknowns(moves))
        try:
            n_steps = _solve(model)
        except RuntimeError as error:  # The words of GetFEM, as those of a projection that did not converge
            return EngineAnswer(moves[: len(scene.nodes)].copy(), False, message=" ".join(str(error).split()))
        for side, name in zip(sides, ("u1", "u2"), strict=True):
            moves[side.node_numbers] = np.asarray(model.variable(name))[side.unknowns[side.node_numbers]]
        converged = n_steps <= _STEPS
        message = "" if converged else "Newton's method finds no zero"
        return EngineAnswer(moves[: len(scene.nodes)].copy(), converged, n_steps, message)

    def _add_contact(self, model: Any, slave: _Side, scene: SceneArrays) -> None:
        import getfem as gf

        if self.kind == "penalty":
            model.add_initialized_data("r", [float(scene.penalty)])
            model.add_penalized_contact_between_nonmatching_meshes_brick(
                slave.on_edges, "u1", "u2", "r", _REGION, _REGION
            )
            return
        model.add_initialized_data("r", [_augmentation(scene)])
        multipliers = gf.MeshFem(slave.mesh, 1)
        for count, (_, element, _) in _SHAPES.items():
            if len(cells := slave.cells_of[count]):
                multipliers.set_fem(gf.Fem(element), cells)
        model.add_filtered_fem_variable("pressure", multipliers, _REGION)
        model.add_integral_contact_between_nonmatching_meshes_brick(
            slave.on_edges, "u1", "u2", "pressure", "r", _REGION, _REGION
        )


class _Side:
    """The bodies of a side as a mesh of GetFEM, with the numbers of its unknowns."""

    def __init__(self, plane: FilledScene, wanted: Any, edges: IntArray) -> None:
        import getfem as gf

        self.plane, self.mesh = plane, gf.Mesh("empty", 2)
        self.cells_of: dict[int, list[int]] = {3: [], 4: []}
        corners_of, self.bodies = dict[int, IntArray](), dict[int, list[int]]()
        faces, sides = [], {frozenset(edge) for edge in edges.tolist()}
        for cells, bodies in plane.cells:
            count = cells.shape[1]
            shape = gf.GeoTrans(_SHAPES[count][0])
            for cell, body in zip(cells[wanted[bodies]], bodies[wanted[bodies]].tolist(), strict=True):
                corners = cell[_ORDERS[count]]
                number = int(np.ravel(self.mesh.add_convex(shape, np.ascontiguousarray(plane.nodes[corners].T)))[0])
                corners_of[number] = corners
                self.cells_of[count].append(number)
                self.bodies.setdefault(body, []).append(number)
                ends = {frozenset((int(a), int(b))) for a, b in zip(cell, np.roll(cell, -1), strict=True)} & sides
                faces += [(number, {corners.tolist().index(node) for node in end}) for end in ends]
        for body, numbers in self.bodies.items():
            self.mesh.set_region(body + 1, np.array([numbers, [-1] * len(numbers)]))
        pairs = [(number, _FACES[3 if number in self.cells_of[3] else 4].index(ends)) for number, ends in faces]
        self.mesh.set_region(_REGION, np.array(pairs).reshape(-1, 2).T)
        self.field, self.in_cells, self.on_edges = gf.MeshFem(self.mesh, 2), gf.MeshIm(self.mesh), gf.MeshIm(self.mesh)
        for count, (_, element, _) in _SHAPES.items():
            if self.cells_of[count]:
                self.field.set_fem(gf.Fem(element), self.cells_of[count])
        self.unknowns = np.full(plane.nodes.shape, -1)
        for number, corners in corners_of.items():
            self.unknowns[corners] = np.asarray(self.field.basic_dof_from_cvid(number)[0]).reshape(-1, 2)
        self.node_numbers = np.flatnonzero(self.unknowns[:, 0] >= 0)

    def add_to(self, model: Any, name: str, order: int) -> None:
        """Add the displacements of the side, its materials, supports and loads to a model."""
        import getfem as gf

        for count, (_, _, rule) in _SHAPES.items():
            if self.cells_of[count]:
                exact, finer = (f"{rule}(2,{n})" if count == 4 else f"{rule}({n})" for n in (3, order))
                self.in_cells.set_integ(gf.Integ(exact), self.cells_of[count])
                self.on_edges.set_integ(gf.Integ(finer), self.cells_of[count])
        model.add_fem_variable(name, self.field)
        for body in self.bodies:
            young, poisson = self.plane.materials[body]
            lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
            names = [f"{word}{body}" for word in ("lambda", "mu")]
            for word, value in zip(names, lame, strict=True):
                model.add_initialized_data(word, [value])
            model.add_isotropic_linearized_elasticity_brick(self.in_cells, name, *names, body + 1)
        model.add_explicit_rhs(name, self.to_unknowns(self.plane.load))
        supports = np.argwhere(self.plane.fixed & (self.unknowns >= 0)).tolist()
        if supports:
            selection = gf.Spmat("empty", len(supports), self.field.nbdof())
            for row, (node, part) in enumerate(supports):
                selection.add(row, int(self.unknowns[node, part]), 1.0)
            values = np.array([self.plane.imposed[node, part] for node, part in supports])
            model.add_variable(f"reactions_of_{name}", len(supports))
            model.add_constraint_with_multipliers(name, f"reactions_of_{name}", selection, values)

    def to_unknowns(self, values: FloatArray) -> FloatArray:
        """Return values of nodes (n, 2) as a vector of unknowns."""
        vector = np.zeros(self.field.nbdof())
        vector[self.unknowns[self.node_numbers]] = values[self.node_numbers]
        return vector


def _augmentation(scene: SceneArrays) -> float:
    """Return the largest E over the length of the slave, of those surfaces alone that are near the other side."""
    ends, masters = scene.nodes[scene.slave], np.unique(scene.master)
    ways = np.linalg.norm(ends.mean(axis=1)[:, None] - scene.nodes[masters], axis=2)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    others = scene.nodes[scene.master]
    near = ways.min(axis=1) <= lengths + np.linalg.norm(others[:, 1] - others[:, 0], axis=1).max()
    near |= ~near.any()
    bodies = np.unique(scene.body_of_node[np.concatenate([scene.slave[near, 0], masters[ways[near].argmin(axis=1)]])])
    return float(scene.young[bodies[~scene.rigid[bodies]]].max() / lengths[near].sum())


def _solve(model: Any) -> int:
    """Move the model to a zero by Newton's method, and return the number of steps; too large if there is none."""
    import getfem as gf

    before = np.inf
    for count in range(1, _STEPS + 1):
        model.assembly()
        values = np.asarray(model.from_variables())
        change = np.asarray(gf.linsolve_mumps(model.tangent_matrix(), model.rhs())).reshape(-1)
        model.to_variables(values + change)
        moved = [np.asarray(model.variable(name)) for name in ("u1", "u2")]
        places = [model.interval_of_variable(name) for name in ("u1", "u2")]
        steps = [np.abs(change[first : first + size]).max() for first, size in places]
        size, largest = float(max(steps)), float(max(np.abs(part).max() for part in moved))
        if not np.isfinite(size):
            break
        if size <= _CONVERGED * largest or (size >= before / 2 and size <= _ROUNDED * largest):
            return count
        before = size
    return _STEPS + 1
