"""See what an exact tangent is worth: Fig. 30 of Zavarise & De Lorenzis (2009).

Case C is solved twice: with the tangent that is exact for VTS-ME only (the paper's basic version), and with the exact
tangent of VTS-PPT. The first converges linearly, the second quadratically.
"""

import matplotlib.pyplot as plt

from contactverif import load_formulation, load_scene, solve

scene = load_scene("c:penalty=1e4,sides=free,lowered=0,ratio=0.5")
figure, axes = plt.subplots(figsize=(7, 4))
for name, label in (("vts-ppt-basic", "basic"), ("vts-ppt", "exact tangent")):
    trace = solve(scene, load_formulation(name).with_penalty(scene.penalty))
    print(f"{name}: {trace.end.label} after {trace.n_iterations} iterations")
    axes.semilogy(trace.residuals, marker="o", label=label)
axes.set(xlabel="iteration", ylabel="largest force out of balance")
axes.legend()
figure.savefig("figure_30.svg")
