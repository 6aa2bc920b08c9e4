"""OpenSees 3.7.1: each node has a spring of the same stiffness, so that nodes of short edges press too much."""

from opensees_blocks import press

for upper in ([0, 0.2, 2], [0, 0.5, 2]):
    converged, pressures = press(upper, [-0.01, 2.01])
    print(f"{upper}: converged {converged}, pressures {[round(p, 6) for p in pressures]}, which should be equal")
