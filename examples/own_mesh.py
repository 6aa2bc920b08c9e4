"""Verify formulations on the interface of your own mesh, in any format that meshlane reads.

The slave and the master are physical groups of line elements. The harness keeps the mesh and draws random states on it.
On the command line: `contactverif verify vts-ppt --mesh punch.msh --slave punch --master base`.
"""

import meshlane
import numpy as np

from contactverif import load_formulation, load_properties, read_interface, verify

# A punch of two triangles on a base of two squares. A real mesh comes from a mesh generator.
points = np.array([[0, 0], [2, 0], [4, 0], [0, -1], [2, -1], [4, -1], [1, 0], [2.5, 0], [3, 0], [2, 1]], float)
mesh = meshlane.Mesh(
    np.column_stack([points, np.zeros(len(points))]),
    [
        ("quad", [[3, 4, 1, 0], [4, 5, 2, 1]]),
        ("triangle", [[6, 7, 9], [7, 8, 9]]),
        ("line", [[6, 7], [7, 8]]),
        ("line", [[0, 1], [1, 2]]),
    ],
    cell_data={"gmsh:physical": [[3, 3], [4, 4], [1, 1], [2, 2]], "gmsh:geometrical": [[3, 3], [4, 4], [1, 1], [2, 2]]},
    field_data={"punch": np.array([1, 1]), "base": np.array([2, 1])},
)
mesh.write("punch.msh", file_format="gmsh22", binary=False)

interface = read_interface("punch.msh", slave="punch", master="base")
print(f"{len(interface.slave)} slave segments on {len(interface.master)} master segments")
result = verify(
    [load_formulation("vts-me"), load_formulation("vts-ppt")],
    load_properties(["patch.flat.transmission", "balance.force"]),
    place=interface,
    examples=20,
    seed=1,
)
for row in result.rows:
    print(f"{row.formulation:8} {row.property_id:24} {row.verdict}")
