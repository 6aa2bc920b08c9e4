"""Get the smallest mesh on which a formulation fails, as arrays, and draw it.

The harness judges random meshes first. Then it shrinks the one that failed until nothing can be left out. A failure
that the formulation states itself, as here, is shrunk only if the script asks for it.
"""

import matplotlib.pyplot as plt

from contactverif import verify

result = verify("vts-me", "patch.flat.transmission", examples=50, seed=1, shrink="all")
(row,) = result.rows
case = row.shrunk.case
nodes = case.positions
print(f"{row.reason}")
print(f"{len(case.interface.slave)} slave segment on {len(case.interface.master)} master segments")

figure, axes = plt.subplots(figsize=(7, 2.5))
for surface, label, marker in ((case.interface.slave, "slave", "o"), (case.interface.master, "master", "s")):
    for number, segment in enumerate(surface.segments):
        axes.plot(*nodes[segment].T, marker=marker, color=f"C{label == 'master':d}", label=None if number else label)
for number, place in enumerate(nodes):
    axes.annotate(str(number), place, xytext=(4, 6), textcoords="offset points")
axes.margins(0.1, 0.5)
axes.legend()
figure.savefig("smallest_failing_mesh.svg")
