"""Kratos 10.4.4: with its default search slave nodes far from the middle of a long master segment carry nothing.

It says that it has converged. The blocks are pressed together by 0.1, so that the pressure is 0.05 everywhere.
"""

from kratos_blocks import press

for upper, lower in (([0, 1, 5, 6], [0, 1, 6]), ([0, 1, 2], [0, 2]), ([0, 1, 16], [0, 16])):
    converged, pressures, _ = press(upper, lower, {})
    print(f"{upper} on {lower}: converged {converged}, pressures {[round(p, 6) for p in pressures]}")
