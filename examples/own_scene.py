"""Press bodies of your own together, from scikit-fem meshes with named boundaries.

A punch of triangles is pressed into a block of quadrilaterals. `solve` returns every iterate of Newton's method; the
scene gives displacements and stresses of the bodies.
"""

import matplotlib.pyplot as plt
import numpy as np
import skfem

from contactverif import Scene, body_from_mesh, load_formulation, solve

BOUNDARIES = {
    "top": lambda x: np.isclose(x[1], x[1].max()),
    "bottom": lambda x: np.isclose(x[1], x[1].min()),
}
block = skfem.MeshQuad.init_tensor(np.linspace(0, 6, 13), np.linspace(-2, 0, 5)).with_boundaries(BOUNDARIES)
punch = skfem.MeshTri.init_tensor(np.linspace(2, 4, 8), np.linspace(0, 1, 5)).with_boundaries(BOUNDARIES)

scene = Scene(
    (
        body_from_mesh(
            punch,
            contact="bottom",
            supports={"top": "both"},
            displacements={"top": (0.0, -0.02)},
            young=2e4,
            poisson=0.3,
        ),
        body_from_mesh(block, contact="top", supports={"bottom": "both"}, young=1e4, poisson=0.3),
    ),
    penalty=1e5,
)
trace = solve(scene, load_formulation("vts-ppt").with_penalty(scene.penalty))
print(f"{trace.end.label} after {trace.n_iterations} iterations")

stresses = scene.stresses(trace.solution)
print(f"largest pressure in the block: {-stresses[1][..., 1].min():.0f}")

figure, axes = plt.subplots(figsize=(7, 4))
for body, displacements in zip(scene.bodies, scene.displacements(trace.solution), strict=True):
    corners = (body.nodes + 10 * displacements)[body.cells]
    for cell in corners:
        axes.fill(*cell.T, facecolor="#dde6ee", edgecolor="#45607a", linewidth=0.8)
axes.set(aspect="equal", title="displacements × 10")
figure.savefig("own_scene.svg")
