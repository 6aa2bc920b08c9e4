"""Two flat surfaces in NGSolve alone, with a triangle behind each segment, and the forces of springs between them."""

from itertools import pairwise

import ngsolve as ng
import numpy as np
from netgen.meshing import Element1D, Element2D, FaceDescriptor, Mesh, MeshPoint, Pnt


def push(upper, lower, depth, reach=100.0):
    """Return the force on each node of the upper surface, upwards; it lies so deep in the lower one."""
    mesh, n_upper = Mesh(dim=2), len(upper)
    for side, (name, places, y, tip) in enumerate(
        (("upper", upper, -depth, 1.0), ("lower", lower[::-1], 0.0, -1.0)), 1
    ):
        points = [mesh.Add(MeshPoint(Pnt(x, y, 0.0))) for x in places]
        mesh.Add(FaceDescriptor(surfnr=side, domin=side, bc=side))
        for (a, b), (p, q) in zip(pairwise(places), pairwise(points), strict=True):
            mesh.Add(Element2D(side, [p, q, mesh.Add(MeshPoint(Pnt((a + b) / 2, y + tip, 0.0)))]))
            mesh.Add(Element1D([p, q], index=side))
        mesh.SetBCName(side - 1, name)
    mesh = ng.Mesh(mesh)
    space = ng.VectorH1(mesh, order=1)
    u, place, form, moves = space.TrialFunction(), ng.CF((ng.x, ng.y)), ng.BilinearForm(space), ng.GridFunction(space)
    contact = ng.ContactBoundary(mesh.Boundaries("upper"), mesh.Boundaries("lower"))
    gap = (place + u - place.Other() - u.Other()) * contact.normal
    contact.AddEnergy(ng.IfPos(gap, gap * gap / 2, 0))
    contact.Update(moves, form, 5, reach)
    forces = moves.vec.CreateVector()
    form.Apply(moves.vec, forces)
    numbers = [space.GetDofNrs(ng.NodeId(ng.VERTEX, node))[1] for node in range(n_upper)]
    return -np.round(forces.FV().NumPy()[numbers], 6)
