"""The area that Kratos finds two faces in the plane z = 0 share, by its own utility of exact integration."""

import KratosMultiphysics as Kratos

# The corners of a slave and of a master face, counter-clockwise from above, and the area that they share.
FACES = {
    "rectangles": ([(0, 1), (3, 1), (3, 3), (0, 3)], [(2, 0), (3, 0), (3, 2), (2, 2)], 1.0),
    "a triangle on a rectangle": ([(0, 3), (4, 3), (2, 4)], [(0, 0), (3, 0), (3, 4), (0, 4)], 1.75),
    "triangles": ([(0, 4), (1, 0), (3, 4)], [(4, 2), (4, 4), (1, 4)], 1.0),
    "triangles with a node in common": ([(0, 0), (3, 2), (1, 3)], [(2, 2), (0, 0), (2, 0)], 2 / 3),
}


def common_area(slave, master, tessellation=False):
    """Return the area that Kratos finds; `tessellation` is its option `consider_tessellation`, false by default."""
    part = Kratos.Model().CreateModelPart("Faces")
    part.AddNodalSolutionStepVariable(Kratos.NORMAL)
    values, conditions, first = part.CreateNewProperties(0), [], 1
    for number, (corners, up) in enumerate(((slave[::-1], -1.0), (master, 1.0)), 1):
        numbers = list(range(first, first + len(corners)))
        for node, (x, y) in zip(numbers, corners, strict=True):
            normal = Kratos.Array3([0.0, 0.0, up])
            part.CreateNewNode(node, float(x), float(y), 0.0).SetSolutionStepValue(Kratos.NORMAL, normal)
        conditions.append(part.CreateNewCondition(f"SurfaceCondition3D{len(corners)}N", number, numbers, values))
        conditions[-1].SetValue(Kratos.NORMAL, Kratos.Vector([0.0, 0.0, up]))
        first += len(corners)
    kind = f"3D{len(slave)}N" + (f"{len(master)}N" if len(master) != len(slave) else "")
    utility = getattr(Kratos, f"ExactMortarIntegrationUtility{kind}")(2, 1e10, 0, 1.0, tessellation)
    return utility.TestGetExactAreaIntegration(*conditions)
