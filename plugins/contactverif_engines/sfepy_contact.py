"""sfepy: springs in the Gauss points of all edges of both sides, each side pushed by its own points alone.

Source: the term `dw_contact` of sfepy 2026.3, its documentation and `sfepy/mechanics/extmods/contres.c`. Edges of both
sides are one region. A point is pushed by the depth to which it is in an edge, and the edge is not pushed back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contactverif.contract.engine import EngineAnswer, EngineTraits, IntArray, SceneArrays
from contactverif_engines.filled import FilledScene, deepen, fill_rigid_bodies

_STEPS = 200
_CONVERGED = 1e-10  # The norm of the residual over the size of forces.
_ROUNDED = 2.0**-53  # The share of the largest coordinate by which a gap may be rounded.


@dataclass(frozen=True)
class SfePy:
    """The code sfepy with penalty springs."""

    order: int = 2  # The order of integration on each edge.

    # Points of an edge that ends beyond the other side are no exact integration.
    traits = EngineTraits("penalty", accuracy=1e-8, load_scale=2.0**-10)

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Make a problem, find its zero by Newton's method, and return its displacements."""
        from sfepy.base.base import IndexedStruct, output
        from sfepy.discrete import Problem
        from sfepy.solvers.ls import ScipyDirect
        from sfepy.solvers.nls import Newton

        output.set_output(quiet=True)
        plane = fill_rigid_bodies(scene)
        if (cells := _cells_of_one_kind(plane)) is None:
            start = np.where(scene.fixed, scene.imposed, 0.0)
            return EngineAnswer(start, False, message="a field has triangles or quadrilaterals, and not both")
        status, model = IndexedStruct(), _Model(plane, *cells)
        problem = Problem("scene", equations=model.write_equations(self.order))
        problem.set_bcs(ebcs=model.write_supports())
        options = {"i_max": _STEPS, "eps_a": _small_force(scene), "eps_r": 1.0, "lin_red": None}
        search = {"ls_on": 1.0, "ls_red": 0.5, "ls_red_warp": 0.5}  # As in the example of sfepy with two bodies.
        problem.set_solver(Newton(options | search, lin_solver=ScipyDirect({}), status=status))
        guess = deepen(plane) + plane.start
        try:
            state = problem.solve(state0=guess.reshape(-1), save_results=False, verbose=False)
        except (OverflowError, MemoryError) as error:  # The search has squares between bodies that fly apart.
            return EngineAnswer(guess[: len(scene.nodes)].copy(), False, message=f"bodies fly apart: {error}")
        moves = np.array(state()).reshape(-1, 2)[: len(scene.nodes)]
        converged = status["condition"] == 0
        message = "" if converged else f"no convergence in {status['n_iter']} iterations"
        return EngineAnswer(np.ascontiguousarray(moves), converged, int(status["n_iter"]), message)


class _Model:
    def __init__(self, plane: FilledScene, cells: IntArray, bodies: IntArray) -> None:
        from sfepy.discrete import FieldVariable
        from sfepy.discrete.fem import FEDomain, Field, Mesh

        kind, order = f"2_{cells.shape[1]}", np.argsort(bodies, kind="stable")
        self.plane, self.bodies, corners = plane, bodies[order], cells[order].astype(np.int32)
        mesh = Mesh.from_data("scene", plane.nodes.copy(), None, [corners], [self.bodies], [kind])
        self.domain = FEDomain("domain", mesh)
        everything = self.domain.create_region("All", "all")
        field = Field.from_args("displacement", np.float64, "vector", everything, approx_order=1)
        self.unknown = FieldVariable("u", "unknown", field)
        self.test = FieldVariable("v", "test", field, primary_var_name="u")

    def write_equations(self, order: int) -> Any:
        """Return the balance of the stresses of all bodies, contact and loads."""
        from sfepy.discrete import Equation, Equations, Integral, Material
        from sfepy.mechanics.matcoefs import stiffness_from_youngpoisson
        from sfepy.terms import Term

        plane, both = self.plane, {"v": self.test, "u": self.unknown}
        springs = Material("springs", values={".stiffness": float(plane.scene.penalty)})
        edges = self._make_region("facet", self._contact_edges(), "Contact")
        total = Term.new("dw_contact(springs.stiffness, v, u)", Integral("i", order), edges, springs=springs, **both)
        for body, material in enumerate(plane.materials):
            solid = Material("solid", values={"D": stiffness_from_youngpoisson(2, *material, plane="strain")})
            region = self._make_region("cell", np.flatnonzero(self.bodies == body), f"Body{body}")
            total = total + Term.new("dw_lin_elastic(solid.D, v, u)", Integral("j", 2), region, solid=solid, **both)
        if (loaded := np.flatnonzero(plane.load.any(axis=1))).size:
            push = Material("push", values={".force": plane.load[loaded]})
            region = self._make_region("vertex", loaded, "Loaded")
            total = total - Term.new("dw_point_load(push.force, v)", Integral("k", 0), region, push=push, v=self.test)
        return Equations([Equation("balance", total)])

    def write_supports(self) -> Any:
        from sfepy.discrete import Function
        from sfepy.discrete.conditions import Conditions, EssentialBC

        conditions = []
        for part, name in enumerate("xy"):
            if (nodes := np.flatnonzero(self.plane.fixed[:, part])).size:
                values = self.plane.imposed[nodes, part]
                function = Function(name, lambda ts, coors, values=values, **more: values)
                region = self._make_region("vertex", nodes, f"Held_{name}")
                conditions.append(EssentialBC(name, region, {f"u.{part}": function}))
        return Conditions(conditions)

    def _make_region(self, kind: str, numbers: IntArray, name: str) -> Any:
        from sfepy.discrete.common.region import Region

        make = {"vertex": Region.from_vertices, "facet": Region.from_facets, "cell": Region.from_cells}[kind]
        region = make(numbers.astype(np.uint32), self.domain, name, kind=kind)
        region.update_shape()
        self.domain.regions.append(region)
        return region

    def _contact_edges(self) -> IntArray:
        ends = self.domain.cmesh.get_conn(1, 0).indices.reshape(-1, 2).tolist()
        number = {frozenset(pair): index for index, pair in enumerate(ends)}
        edges = np.vstack([self.plane.scene.slave, self.plane.scene.master]).tolist()
        return np.sort(np.array([number[frozenset(edge)] for edge in edges], np.uint32))


def _cells_of_one_kind(plane: FilledScene) -> tuple[IntArray, IntArray] | None:
    """Return the cells and the body of each, quadrilaterals of rigid bodies halved where others are triangles."""
    (triangles, bodies), (quads, body_of_quad) = plane.cells
    if not len(triangles):
        return quads, body_of_quad
    if not plane.scene.rigid[body_of_quad].all():
        return None
    halves = np.vstack([triangles, quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return halves, np.concatenate([bodies, body_of_quad, body_of_quad])


def _small_force(scene: SceneArrays) -> float:
    """Return a small share of loads or reactions; without either, what rounded coordinates make of springs."""
    softest = min(float(scene.young[~scene.rigid].min()), float(scene.penalty) * float(scene.unit))
    if force := max(float(np.abs(scene.load).sum()), softest * float(np.abs(scene.imposed).max(initial=0.0))):
        return _CONVERGED * force
    return _ROUNDED * float(scene.penalty) * float(scene.unit) * float(np.abs(scene.nodes).max())
