"""See why one penalty is not enough for a patch test.

NTS-AR fails case C′ at any penalty. Two passes of NTS-AR fail too, but their error falls as the penalty grows, because
the gaps lock. VTS-PPT is at roundoff at every penalty. The error is that of the vertical stress in the bodies.
"""

import matplotlib.pyplot as plt
import numpy as np

from contactverif import load_formulation, load_scene, solve

PRESSURE = 100.0
PENALTIES = 10.0 ** np.arange(3, 9)

figure, axes = plt.subplots(figsize=(7, 4))
for name in ("nts-ar", "two-pass/nts-ar", "vts-ppt"):
    errors = []
    for penalty in PENALTIES:
        scene = load_scene(f"c-prime:penalty={penalty:g}")
        trace = solve(scene, load_formulation(name).with_penalty(scene.penalty))
        vertical = np.concatenate([stress[..., 1].ravel() for stress in scene.stresses(trace.solution)])
        errors.append(np.abs(vertical + PRESSURE).max() / PRESSURE)
    print(f"{name:16} error at the softest penalty {errors[0]:.0e}, at the stiffest {errors[-1]:.0e}")
    axes.loglog(PENALTIES, errors, marker="o", label=name)
axes.set(xlabel="penalty", ylabel="error of the stress, relative")
axes.legend()
figure.savefig("locking.svg")
