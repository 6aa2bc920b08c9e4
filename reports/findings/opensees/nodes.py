"""OpenSees 3.7.1: where nodes lie on nodes, it finds no equilibrium; roundoff decides which of two edges is touched."""

from opensees_blocks import press

for upper, lower in (([0, 2], [0, 2]), ([0, 1, 2], [0, 2]), ([0, 1, 2], [0, 1, 2])):
    converged, pressures = press(upper, lower)
    print(f"{upper} on {lower}: converged {converged}, pressures {[round(p, 6) for p in pressures]}")
