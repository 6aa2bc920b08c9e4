"""Refine Hertz' contact with springs of fixed stiffness, and see whose forces on the master converge.

A parabola is pressed on a flat. The exact pressure is that of a layer of springs between them. Formulations that pass
the patch test come nearer to its forces with each finer mesh. Those that fail it keep their error on the master.
"""

import matplotlib.pyplot as plt
import numpy as np

from contactverif import judge_case, load_formulation, load_properties

(question,) = load_properties(["accuracy.hertz"])
(case,) = (case for case in question.cases(None) if case.name == "parabola-layer")  # ε̂ = E/a on all meshes.
sizes = 2 / (np.array([16, 20, 26, 33]) + 1 / 3)  # Segments h/a of the parabola, which is the slave.
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for name, marker in {
    "nts-ar": "v",
    "vts-me": "^",
    "vts-me:n=4": "x",
    "vts-ppt": "o",
    "sts": "s",
    "mortar": "+",
}.items():
    errors = judge_case(question, case, load_formulation(name)).measurement.series["E_F of the master"]
    axes.loglog(sizes, errors, marker=marker, markerfacecolor="none", label=name)
    rate = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    print(f"{name:11} rate {rate:5.2f}, last error {errors[-1]:.1e}")
axes.set(xlabel="segment h/a", ylabel="error of the master's nodal forces", title="Hertz, ε̂ = E/a")
axes.set_xticks([0.06, 0.08, 0.1, 0.12], ["0.06", "0.08", "0.1", "0.12"])
axes.set_yticks([0.002, 0.005, 0.01, 0.02, 0.05], ["0.002", "0.005", "0.01", "0.02", "0.05"])
axes.minorticks_off()
figure.legend(loc="outside right center")
figure.savefig("hertz_rates.svg")
