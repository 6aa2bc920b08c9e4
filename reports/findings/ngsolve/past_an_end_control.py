"""The same with a largest distance of 0.5 for the search: whoever faces nothing is free."""

from ngsolve_surfaces import push

for start in (0.0, 3.0, 10.0):
    forces = push([start, start + 1], [-1, 2], 0.1, reach=0.5)
    print(f"from {start:g} to {start + 1:g}, over a surface from -1 to 2: {forces}")
