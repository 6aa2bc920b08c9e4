"""The same slaves on masters whose nodes are a hundredth away."""

from opensees_blocks import press

for upper, lower in (([0, 2], [-0.01, 2.01]), ([0, 1, 2], [-0.01, 2.01]), ([0, 1, 2], [-0.01, 1.01, 2.01])):
    converged, pressures = press(upper, lower)
    print(f"{upper} on {lower}: converged {converged}, pressures {[round(p, 6) for p in pressures]}")
