"""A strip of three cells in GetFEM alone, without contact: two of length 4 and a thin one between them."""

import getfem as gf
import numpy as np


def pull(width, along=0):
    """Return how far both sides of the thin cell move along x (0) or y (1) where the end is pulled by 0.8."""
    gf.util_trace_level(0)
    mesh = gf.Mesh("empty", 2)
    for a, b in ((0.0, 4.0), (4.0, 4.0 + width), (4.0 + width, 8.0 + width)):
        corners = np.array([[a, b, a, b], [0.0, 0.0, 2.0, 2.0]])
        mesh.add_convex(gf.GeoTrans("GT_QK(2,1)"), corners if along == 0 else corners[::-1][:, [0, 2, 1, 3]])
    first, last = ((1, 0), (3, 2))[along]  # The faces of a quadrilateral, as GetFEM numbers them
    mesh.set_region(1, [[0], [first]])
    mesh.set_region(2, [[2], [last]])
    field, rule = gf.MeshFem(mesh, 2), gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(2,3)"))
    field.set_fem(gf.Fem("FEM_QK(2,1)"))
    model = gf.Model("real")
    model.add_fem_variable("u", field)
    end = [0.8, 0.0] if along == 0 else [0.0, 0.8]
    for name, value in (("lame", [0.0]), ("shear", [0.5]), ("hold", [0.0, 0.0]), ("pull", end)):
        model.add_initialized_data(name, value)
    model.add_isotropic_linearized_elasticity_brick(rule, "u", "lame", "shear")
    model.add_Dirichlet_condition_with_multipliers(rule, "u", field, 1, "hold")
    model.add_Dirichlet_condition_with_multipliers(rule, "u", field, 2, "pull")
    model.solve("lsolver", "mumps")
    moves, places = model.variable("u")[along::2], field.basic_dof_nodes()[along, along::2]
    sides = [np.abs(places - x) <= width / 4 for x in (4.0, 4.0 + width)]
    return [round(float(moves[side].mean()), 6) for side in sides]
