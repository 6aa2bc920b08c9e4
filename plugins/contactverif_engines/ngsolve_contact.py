"""NGSolve: a contact energy of penalty springs, in the points of integration of the slave's edges.

Source: the class `ContactBoundary` of NGSolve 6.2, and its tutorial of contact problems: each point finds the nearest
place of the other boundary, and the gap along the normal there is squared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contactverif.contract.engine import EngineAnswer, EngineTraits, SceneArrays
from contactverif_engines.filled import FilledScene, fill_rigid_bodies

_STEPS = 60
_CONVERGED = 1e-13  # The last step over the largest displacement.


@dataclass(frozen=True)
class NGSolve:
    """NGSolve with penalty springs."""

    order: int = 5  # The order of integration of the energy on each edge of the slave.

    # Points that see the next edge of the other side are no exact integration.
    traits = EngineTraits("penalty", accuracy=1e-10)

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Make a mesh, find the minimum of the energy by Newton's method, and return its displacements."""
        import ngsolve as ng

        plane = fill_rigid_bodies(scene)
        mesh, count = _make_mesh(plane), len(plane.nodes)
        space = ng.VectorH1(mesh, order=1)
        numbers = np.array([[space.GetDofNrs(ng.NodeId(ng.VERTEX, n))[part] for part in (0, 1)] for n in range(count)])
        free = ng.BitArray(space.ndof)
        free.Set()
        for node, part in np.argwhere(plane.fixed).tolist():
            free.Clear(int(numbers[node, part]))
        u = space.TrialFunction()
        young, poisson = np.transpose(plane.materials)
        lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))  # λ and μ.
        names = [f"body{body}" for body in range(len(young))]
        first, second = (mesh.MaterialCF(dict(zip(names, values.tolist(), strict=True))) for values in lame)
        energy, strain = ng.BilinearForm(space), ng.Sym(ng.Grad(u))
        energy += ng.Variation((second * ng.InnerProduct(strain, strain) + first / 2 * ng.Trace(strain) ** 2) * ng.dx)
        contact = ng.ContactBoundary(mesh.Boundaries("slave"), mesh.Boundaries("master"))
        place = ng.CF((ng.x, ng.y))
        depth = (place + u - place.Other() - u.Other()) * contact.normal
        contact.AddEnergy(ng.IfPos(depth, float(scene.penalty) / 2 * depth * depth, 0))
        moves, load = ng.GridFunction(space), np.zeros(space.ndof)
        values = moves.vec.FV().NumPy()
        values[numbers] = np.where(plane.fixed, plane.imposed, plane.start)
        load[numbers] = plane.load
        n_steps = self._minimise(energy, contact, moves, free, load, float(scene.unit))
        answer = np.array(values[numbers][: len(scene.nodes)])
        converged = n_steps <= _STEPS
        return EngineAnswer(answer, converged, n_steps, "" if converged else "Newton's method finds no minimum")

    def _minimise(self, energy: Any, contact: Any, moves: Any, free: Any, load: Any, reach: float) -> int:
        """Move to the minimum of an energy under a load, and return the number of steps; too large if there is none."""
        residual, change = moves.vec.CreateVector(), moves.vec.CreateVector()
        values = moves.vec.FV().NumPy()
        for count in range(_STEPS):
            contact.Update(moves, energy, self.order, reach)
            energy.Apply(moves.vec, residual)
            energy.AssembleLinearization(moves.vec)
            residual.FV().NumPy()[:] -= load
            change.data = energy.mat.Inverse(free) * residual
            moves.vec.data -= change
            size = float(np.abs(change.FV().NumPy()).max())
            if not np.isfinite(size):
                break
            if size <= _CONVERGED * float(np.abs(values).max()):
                return count + 1
        return _STEPS + 1


def _make_mesh(plane: FilledScene) -> Any:
    import ngsolve as ng
    from netgen.meshing import Element1D, Element2D, FaceDescriptor, MeshPoint, Pnt
    from netgen.meshing import Mesh as NetgenMesh

    scene, mesh = plane.scene, NetgenMesh(dim=2)
    points = [mesh.Add(MeshPoint(Pnt(x, y, 0.0))) for x, y in plane.nodes.tolist()]
    for body in range(len(scene.axes)):
        mesh.Add(FaceDescriptor(surfnr=body + 1, domin=body + 1, bc=body + 1))
        mesh.SetMaterial(body + 1, f"body{body}")
    for cells, bodies in plane.cells:
        for cell, body in zip(cells.tolist(), bodies.tolist(), strict=True):
            mesh.Add(Element2D(body + 1, [points[node] for node in cell]))
    for index, (name, side) in enumerate((("slave", scene.slave), ("master", scene.master)), start=1):
        for edge in side.tolist():
            mesh.Add(Element1D([points[node] for node in edge], index=index))
        mesh.SetBCName(index - 1, name)
    return ng.Mesh(mesh)
