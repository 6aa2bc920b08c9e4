"""fedoo: a spring at each node of the slave, on the edge of the master that a search chooses.

Source: the class `Contact` of fedoo 1.1, its documentation and `fedoo/constraint/contact.py`. Springs have one
stiffness for all nodes, whatever the lengths of their edges.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from contactverif.contract.engine import EngineAnswer, EngineTraits, FloatArray, IntArray, SceneArrays
from contactverif_engines.filled import FilledScene, deepen, fill_rigid_bodies

_STEPS = 60
_CONVERGED = 1e-11  # The norm of the last step over that of all displacements.
_AXES = ("DispX", "DispY")


@dataclass(frozen=True)
class Fedoo:
    """The code fedoo with springs of nodes."""

    # The edges at the nearest node, the same found in buckets, as fedoo chooses by itself, or the edges near a node.
    search: Literal["nearest", "bucket", "ipctk"] = "nearest"
    once: bool = False  # Look for pairs once in an increment, as fedoo does by itself, or in each iteration.
    increments: int = 1  # The number of steps in which loads and imposed displacements grow.
    tol: float = 0.1  # The part of an edge by which a node may lie past its end; 0.1 is the default of fedoo.

    # Springs of nodes are ε̂ in the mean alone, and no uniform pressure is promised.
    traits = EngineTraits("penalty", accuracy=1e-9, load_scale=2.0**-10)

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Make a problem of small strains, solve it by the method of Newton and Raphson, and read its displacements."""
        with warnings.catch_warnings():  # It warns that its solver of linear systems is slow.
            warnings.simplefilter("ignore")
            import fedoo

            plane = fill_rigid_bodies(scene)
            space = fedoo.ModelingSpace("2D", name="")
            bodies = _make_bodies(fedoo, plane, space)
            contacts = self._make_contacts(fedoo, plane, space)
            problem = fedoo.problem.NonLinear(fedoo.Assembly.sum(*bodies, *contacts, name=""), name="")
            _add_supports_and_loads(problem, plane)
            start = np.where(plane.fixed, 0.0, deepen(plane))
            problem.set_dof("Disp", start.T)
            for contact in contacts:
                contact.set_disp(start.T)
            problem.set_nr_criterion("Displacement", tol=_CONVERGED, max_subiter=_STEPS)
            message = self._run(problem)
        moves = np.array(problem.get_disp().T[: len(scene.nodes)])
        return EngineAnswer(moves, not message, message=message)

    def _make_contacts(self, fedoo: Any, plane: FilledScene, space: Any) -> list[Any]:
        """Return the contact of each slave body with all masters, its springs as stiff as ε̂ in the mean.

        fedoo has its normals on the left of an edge, so that edges are turned around.
        """
        scene, contacts = plane.scene, []
        kind = "search_nearest" if self.search == "nearest" else self.search
        bodies = scene.body_of_node[scene.slave[:, 0]]
        for edges in (scene.slave[bodies == body] for body in np.unique(bodies)):
            slave = np.unique(edges)
            surface = fedoo.Mesh(plane.nodes.copy(), scene.master[:, ::-1].copy(), "lin2", name="")
            contact = fedoo.constraint.Contact(slave, surface, search_algorithm=kind, name="", space=space)
            contact.eps_n = float(scene.penalty) * float(_lengths(scene, edges).sum()) / len(slave)
            contact.max_dist = 2 * float(_lengths(scene, scene.master).max())
            contact.contact_search_once, contact.tol = self.once, self.tol
            contacts.append(contact)
        return contacts

    def _run(self, problem: Any) -> str:
        """Solve the problem, and return why it has no solution; empty if it has one."""
        step = 1 / self.increments
        try:
            problem.nlsolve(dt=step, update_dt=False, print_info=0, save_at_exact_time=False, interval_output=10**9)
        except RuntimeError as error:
            return str(error)
        return ""


def _make_bodies(fedoo: Any, plane: FilledScene, space: Any) -> list[Any]:
    assemblies = []
    for body, material in enumerate(plane.materials):
        for kind, (cells, bodies) in zip(("tri3", "quad4"), plane.cells, strict=True):
            if (bodies == body).any():
                law = fedoo.constitutivelaw.ElasticIsotrop(*material)
                form = fedoo.weakform.StressEquilibrium(law, nlgeom=False, space=space)
                mesh = fedoo.Mesh(plane.nodes.copy(), cells[bodies == body].copy(), kind, name="")
                assemblies.append(fedoo.Assembly.create(form, mesh, name=""))
    return assemblies


def _add_supports_and_loads(problem: Any, plane: FilledScene) -> None:
    for axis, name in enumerate(_AXES):
        if (supported := np.flatnonzero(plane.fixed[:, axis])).size:
            problem.bc.add("Dirichlet", supported, name, plane.imposed[supported, axis])
        if (loaded := np.flatnonzero(plane.load[:, axis])).size:
            problem.bc.add("Neumann", loaded, name, plane.load[loaded, axis])


def _lengths(scene: SceneArrays, edges: IntArray) -> FloatArray:
    lengths: FloatArray = np.linalg.norm(np.diff(scene.nodes[edges], axis=1)[:, 0], axis=1)
    return lengths
