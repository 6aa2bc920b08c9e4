"""Two blocks in GetFEM alone, one on the other, of height 1 and E = 1, pressed together by 0.1."""

from itertools import pairwise

import getfem as gf

BOTTOM, TOP = 3, 2  # The faces of a quadrilateral, as GetFEM numbers them


def block(columns, low, face):
    """Return a mesh of rectangles between these places x, with its contact faces 1, its other end 2, and sides 3."""
    mesh = gf.Mesh("empty", 2)
    for a, b in pairwise(columns):
        mesh.add_convex(gf.GeoTrans("GT_QK(2,1)"), [[a, b, a, b], [low, low, low + 1, low + 1]])
    cells = mesh.cvid()
    mesh.set_region(1, [cells, [face] * len(cells)])
    mesh.set_region(2, [cells, [TOP + BOTTOM - face] * len(cells)])
    mesh.set_region(3, [[cells[0], cells[-1]], [1, 0]])
    return mesh


def press(upper, lower, order=5, overlap=0.0, penalty=10.0, multiplier=False):
    """Return the pressure of each element of the upper block, which overlaps the lower one at the start by so much.

    With multipliers the penalty is that of the augmentation.
    """
    gf.util_trace_level(0)
    model = gf.Model("real")
    model.add_initialized_data("lame", [0.0])
    model.add_initialized_data("shear", [0.5])
    model.add_initialized_data("penalty", [penalty])
    model.add_initialized_data("push", [0.0, -0.1])
    model.add_initialized_data("hold", [0.0, 0.0])
    meshes, rules, fields = (block(upper, -overlap, BOTTOM), block(lower, -1, TOP)), [], []
    for name, mesh, move in zip(("u1", "u2"), meshes, ("push", "hold"), strict=True):
        field, rule = gf.MeshFem(mesh, 2), gf.MeshIm(mesh, gf.Integ(f"IM_GAUSS_PARALLELEPIPED(2,{order})"))
        field.set_fem(gf.Fem("FEM_QK(2,1)"))
        model.add_fem_variable(name, field)
        model.add_isotropic_linearized_elasticity_brick(rule, name, "lame", "shear")
        model.add_Dirichlet_condition_with_multipliers(rule, name, field, 2, move)
        model.add_normal_Dirichlet_condition_with_multipliers(rule, name, 1, 3)
        rules.append(rule)
        fields.append(field)
    if multiplier:
        pressures = gf.MeshFem(meshes[0], 1)
        pressures.set_fem(gf.Fem("FEM_QK(2,1)"))
        model.add_filtered_fem_variable("pressure", pressures, 1)
        model.add_integral_contact_between_nonmatching_meshes_brick(rules[0], "u1", "u2", "pressure", "penalty", 1, 1)
    else:
        model.add_penalized_contact_between_nonmatching_meshes_brick(rules[0], "u1", "u2", "penalty", 1, 1)
    model.solve("max_res", 1e-12, "max_iter", 50, "lsolver", "mumps")
    y = model.variable("u1")[1::2]
    numbers = [fields[0].basic_dof_from_cvid(cell)[0][1::2] // 2 for cell in meshes[0].cvid()]
    return [float((y[d[0]] + y[d[1]] - y[d[2]] - y[d[3]]) / 2) for d in numbers]
