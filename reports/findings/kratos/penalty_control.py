"""The same blocks with the multipliers of Kratos: the pressure of hard contact, 0.1/2, on every mesh."""

from kratos_blocks import press

for upper in ([0, 0.5, 1], [0, 4, 8], [0, 1, 4]):
    converged, pressures, gap = press(upper, upper, {})
    print(f"{upper}: converged {converged}, pressures {[round(p, 6) for p in pressures]}, gap {gap:.1e}")
