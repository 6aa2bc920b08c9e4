"""The same blocks with the handler "Lagrange": 0.05 with every number of nodes, and a hundredth more at the ends."""

from opensees_blocks import press

for n in (25, 33, 34, 36, 60):
    upper, lower = [2 * i / n for i in range(n + 1)], [-0.01 + 2.02 * i / (n - 1) for i in range(n)]
    converged, pressures = press(upper, lower, handler="Lagrange")
    print(f"{2 * n + 1} nodes: converged {converged}, pressures of {min(pressures):.6f} to {max(pressures):.6f}")
