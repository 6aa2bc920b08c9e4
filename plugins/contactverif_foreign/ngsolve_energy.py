"""The contact energy of the library NGSolve as a formulation: springs in the points of integration of slave edges.

Each point finds its place on the other boundary as the surfaces lie now, and the gap along the normal there is squared.
Both are then fixed, so that forces and stiffness are the derivatives of that energy. They stay inside NGSolve: a
pairing is a `Handle`. A surface needs cells behind it, on which nothing depends, and each segment gets a triangle.
"""

from importlib.util import find_spec
from math import inf
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.formulation import Handle, Pairing, check_count, choose
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Evidence, Promises, Traits


class Energy(NamedTuple):
    """The energy of NGSolve with the places that its points have found."""

    form: Any  # The bilinear form
    contact: Any  # The boundary of contact, which the form does not keep alive.
    moves: Any  # The field of displacements
    numbers: IntArray  # (n_unknowns,) The unknowns of NGSolve of the nodes of both surfaces

    def move(self, interface: Interface, z: FloatArray) -> None:
        """Take the positions z (n_unknowns,)."""
        self.moves.vec.FV().NumPy()[self.numbers] = z - interface.nodes.ravel()


class NGSolveContact:
    """Penalty springs of NGSolve's class `ContactBoundary`."""

    traits = Traits(Promises(conserves_force=True), evidence=Evidence(source="NGSolve, class ContactBoundary"))

    def __init__(self, penalty: float, is_energy: bool, order: int, reach: float) -> None:
        import netgen.meshing
        import ngsolve  # An optional dependency.

        self.penalty, self.is_energy, self.order, self.reach = penalty, is_energy, order, reach
        self._ng, self._meshing = ngsolve, netgen.meshing

    def pair(self, interface: Interface, z: FloatArray) -> dict[str, Handle]:
        """Return the energy with the places that its points find at a state."""
        ng, mesh = self._ng, self._make_mesh(interface)
        space = ng.VectorH1(mesh, order=1)
        vertices = (ng.NodeId(ng.VERTEX, node) for node in range(interface.n_nodes))
        numbers = np.array([space.GetDofNrs(vertex)[part] for vertex in vertices for part in (0, 1)])
        contact = ng.ContactBoundary(mesh.Boundaries("slave"), mesh.Boundaries("master"))
        (u, v), place = space.TnT(), ng.CF((ng.x, ng.y))
        depth = (place + u - place.Other() - u.Other()) * contact.normal
        if self.is_energy:
            contact.AddEnergy(ng.IfPos(depth, self.penalty / 2 * depth * depth, 0))
        else:
            contact.AddIntegrator(ng.IfPos(depth, self.penalty * depth, 0) * (v - v.Other()) * contact.normal)
        energy = Energy(ng.BilinearForm(space), contact, ng.GridFunction(space), numbers)
        energy.move(interface, z)
        # No place is farther away. With a distance of 1e100 or more NGSolve may take another one than the nearest.
        farthest = 2.0 * float(np.linalg.norm(np.ptp(z.reshape(-1, 2), axis=0)))
        reach = self.reach * float(interface.master.lengths(interface.nodes).max())
        contact.Update(energy.moves, energy.form, self.order, min(reach, farthest))
        return {"energy": Handle(energy)}

    def residual(self, interface: Interface, pairing: Pairing, z: FloatArray) -> FloatArray:
        """Return the derivative of the energy."""
        energy: Energy = pairing.handle
        energy.move(interface, z)
        forces = energy.moves.vec.CreateVector()
        energy.form.Apply(energy.moves.vec, forces)
        return np.array(forces.FV().NumPy()[energy.numbers])

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray) -> sparse.csr_array:
        """Return the second derivative of the energy, in which places and normals are fixed."""
        energy: Energy = pairing.handle
        energy.move(interface, z)
        energy.form.AssembleLinearization(energy.moves.vec)
        rows, columns, values = (np.array(part) for part in energy.form.mat.COO())
        whole = sparse.csr_array((values, (rows, columns)), shape=(len(energy.moves.vec),) * 2)
        return whole[energy.numbers][:, energy.numbers]

    def _make_mesh(self, interface: Interface) -> Any:
        meshing, mesh = self._meshing, self._meshing.Mesh(dim=2)
        points = [mesh.Add(meshing.MeshPoint(meshing.Pnt(x, y, 0.0))) for x, y in interface.nodes.tolist()]
        for side, (name, surface) in enumerate((("slave", interface.slave), ("master", interface.master)), start=1):
            mesh.Add(meshing.FaceDescriptor(surfnr=side, domin=side, bc=side))
            mesh.SetMaterial(side, name)
            ends = interface.nodes[surface.segments]
            along = ends[:, 1] - ends[:, 0]
            tips = ends.mean(axis=1) + np.column_stack([-along[:, 1], along[:, 0]]) / 2  # On the left, in the body
            for segment, (x, y) in zip(surface.segments.tolist(), tips.tolist(), strict=True):
                edge = [points[node] for node in segment]
                tip = mesh.Add(meshing.MeshPoint(meshing.Pnt(x, y, 0.0)))
                mesh.Add(meshing.Element2D(side, [*edge, tip]))
                mesh.Add(meshing.Element1D(edge, index=side))
            mesh.SetBCName(side - 1, name)
        return self._ng.Mesh(mesh)


def ngsolve(*, penalty: float, kind: str, order: int = 5, reach: float = inf) -> NGSolveContact:
    """Return the contact of NGSolve with the energy ε̂/2 × depth².

    Parameters
    ----------
    penalty : float
        The stiffness ε̂, a force per length per length of depth.
    kind : str
        What NGSolve is given: the "energy" of springs, or their "work" in a virtual displacement.
    order : int
        The order of integration on each slave segment, ≥ 0.
    reach : float
        The largest distance of a place from its point, over the longest master segment in the reference configuration.
        NGSolve has no default; a far body with long segments would change a finite one.

    Raises
    ------
    MisuseError
        If there is no such kind, NGSolve is not installed, or the order is negative.
    """
    is_energy = choose("kind", kind, {"energy": True, "work": False})
    if find_spec("ngsolve") is None:
        raise MisuseError("ngsolve", "no such package", "pip install 'contactverif[ngsolve]'")
    return NGSolveContact(penalty, is_energy, check_count(order, "order", least=0), reach)
