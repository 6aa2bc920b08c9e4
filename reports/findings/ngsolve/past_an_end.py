"""NGSolve 6.2: points beyond a free end of the other surface are pushed by its last node, however far away it is.

Springs of 1 push a segment of 1 that lies 0.1 deep by 0.05 at each of its nodes where it faces the other surface.
"""

from ngsolve_surfaces import push

for start in (0.0, 3.0, 10.0):
    print(f"from {start:g} to {start + 1:g}, over a surface from -1 to 2: {push([start, start + 1], [-1, 2], 0.1)}")
