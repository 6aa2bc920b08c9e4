"""See the contact pressure of two rings that are shrunk onto each other converge to Lamé's.

The pressure is uniform and known, but the interface is bent. Formulations that are right get the mean pressure of a
mesh of straight segments with an error of second order. Springs that are too soft wherever the surface bends, here a
quarter as stiff, pass every flat patch test and never get it.
"""

from dataclasses import replace
from math import pi

import matplotlib.pyplot as plt
import numpy as np

from contactverif import ShrinkFit, load_formulation, shrink_fit, solve

PENALTY, REFINEMENTS = 100.0, (1, 2, 4, 8)
problem = ShrinkFit(interference=1e-2)
exact = problem.finite("inner", PENALTY).force * pi / 2  # The sum of radial forces over a quarter turn.

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for name, stiffness, style in (("sts", 1.0, "o-"), ("vts-ppt", 1.0, "s-"), ("nts-ar", 1.0, "x--"), ("sts", 0.25, "^-")):
    segments, errors = [], []
    for refine in REFINEMENTS:
        scene = replace(shrink_fit(problem, slave="inner", refine=refine), penalty=PENALTY)
        trace = solve(scene, load_formulation(name).with_penalty(stiffness * PENALTY))
        n_slave = scene.interface.n_slave_nodes
        forces, nodes = scene.nodal_forces(trace.solution)[:n_slave], scene.interface.nodes[:n_slave]
        radial = -(forces * nodes).sum(axis=1) / np.linalg.norm(nodes, axis=1)
        segments.append(len(scene.interface.slave))
        errors.append(abs(radial.sum() / exact - 1))
    label = name if stiffness == 1 else "springs a quarter as stiff where bent"
    order = np.log2(errors[-2] / errors[-1])
    print(f"{label:38} error {errors[0]:.1e} to {errors[-1]:.1e}, order {order:.1f} on the finest meshes")
    axes.loglog(segments, errors, style, label=label)
axes.set(xlabel="slave segments in a quarter", ylabel="error of the mean pressure, relative")
axes.set_xticks(segments, [str(number) for number in segments], minor=False)
axes.minorticks_off()
axes.legend()
figure.savefig("shrink_fit.svg")
