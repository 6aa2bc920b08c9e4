"""The same blocks with a radius of search that is as large as all of them: 0.05 everywhere."""

from kratos_blocks import press

for upper, lower in (([0, 1, 5, 6], [0, 1, 6]), ([0, 1, 2], [0, 2]), ([0, 1, 16], [0, 16])):
    converged, pressures, _ = press(upper, lower, {"search_parameters": {"search_factor": 1e4}})
    print(f"{upper} on {lower}: converged {converged}, pressures {[round(p, 6) for p in pressures]}")
