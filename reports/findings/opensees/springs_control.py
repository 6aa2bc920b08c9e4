"""The same on edges of one length: the pressure is uniform but for the ends, which press on the corners alone."""

from opensees_blocks import press

for upper in ([0, 1, 2], [0, 2]):
    converged, pressures = press(upper, [-0.01, 2.01])
    print(f"{upper}: converged {converged}, pressures {[round(p, 6) for p in pressures]}")
