"""Makes punch.msh: a punch on a wider base, flat, nodes not matching. Needs gmsh, which contactverif does not.

The punch is drawn clockwise and its line runs against it, so that reading the file needs the cells beside the lines.
"""

from pathlib import Path

import gmsh


def block(corners, divisions, quads):
    """Add a structured rectangle and return its lines and its surface."""
    geo = gmsh.model.geo
    points = [geo.addPoint(x, y, 0) for x, y in corners]
    lines = [geo.addLine(points[k], points[(k + 1) % 4]) for k in range(4)]
    for k, line in enumerate(lines):
        geo.mesh.setTransfiniteCurve(line, divisions[k % 2] + 1)
    surface = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    geo.mesh.setTransfiniteSurface(surface)
    if quads:
        geo.mesh.setRecombine(2, surface)
    return lines, surface


gmsh.initialize()
base_lines, base = block([(0, 0), (10, 0), (10, 4), (0, 4)], (11, 3), quads=True)
punch_lines, punch = block([(3, 4), (3, 7), (7, 7), (7, 4)], (3, 5), quads=False)
gmsh.model.geo.synchronize()
for number, (dim, entity, name) in enumerate(
    [(1, punch_lines[3], "punch"), (1, base_lines[2], "base"), (2, punch, "punch body"), (2, base, "base body")], 1
):
    gmsh.model.addPhysicalGroup(dim, [-entity if name == "punch" else entity], tag=number, name=name)
gmsh.model.mesh.generate(2)
gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
gmsh.write(str(Path(__file__).with_name("punch.msh")))
gmsh.finalize()
