"""See an interface lock: the same two blocks at three penalties, once with springs at many points and once with mortar.

A pressure of p̄ (1 + 0.8 cos(2πx/L)), with the mean p̄ = E/128, presses on an interface of 8 on 12 segments. With stiff
springs, segment-to-segment has more conditions than the surfaces can follow. Most of its points open, and few of them
carry the load.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from contactverif import Rectangle, Scene, block, load_formulation, solve

MEAN, LENGTH, N_SLAVE, N_MASTER = 1 / 128, 4.0, 8, 12
rows, t = np.linspace(0, 1, 5), np.linspace(-0.5, 0.5, N_MASTER + 1)
slave_x = LENGTH * np.linspace(-0.5, 0.5, N_SLAVE + 1)
master_x = LENGTH * (t + 0.15 * (0.25 - t**2))  # No node faces a node.
slave = block(Rectangle(slave_x, rows, poisson=0.3), contact="bottom", pressure=MEAN, lowered=MEAN / 20)
master = block(Rectangle(master_x, rows - 1, poisson=0.3), contact="top", approach=0.0)
shape = np.sinc(1 / N_SLAVE) ** 2  # What a node's shape function leaves of a wave.
wave = 1 + 0.8 * shape * np.cos(2 * np.pi * slave.nodes[:, :1] / LENGTH)
scene = Scene((replace(slave, load=slave.load * wave), master))

figure, panels = plt.subplots(1, 2, figsize=(10, 4), sharey=True, layout="constrained")
for name, axes in zip(("sts", "mortar"), panels, strict=True):
    start = None
    for power in range(1, 7):  # Each penalty starts from the solution at the one before.
        penalty = 10.0**power * N_SLAVE / LENGTH
        softer = replace(scene, penalty=penalty)
        formulation = load_formulation(name).with_penalty(penalty)
        trace = solve(softer, formulation, start=start)
        start = trace.solution
        if power in (1, 2, 6):
            points = formulation.contact_points(scene.interface, formulation.pair(scene.interface, trace.z), trace.z)
            pressure, order = points.pressure / MEAN, np.argsort(points.position[:, 0])
            width = 4.5 / power**0.7  # Softer penalties have wider lines, since those of mortar cover each other.
            axes.plot(points.position[order, 0], pressure[order], lw=width, marker=".", label=f"1e{power} E/h")
            print(
                f"{name:6} at 1e{power} E/h: pressures from {pressure.min():.2f} to {pressure.max():.2f} times the mean"
            )
    axes.set(title=name, xlabel="x")
panels[0].set_ylabel("pressure over its mean")
panels[1].legend(title="penalty")
figure.savefig("stiff_springs.svg")
