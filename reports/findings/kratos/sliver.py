"""Kratos 10.4.4: a pair of edges that share less than 1e-5 of an edge is left out, and nothing says so.

The blocks are pressed together by 0.1, so that the pressure is 0.05 everywhere. A node of the slave is a little beyond
one of the master.
"""

from kratos_blocks import press

SETTINGS = {"search_parameters": {"search_factor": 1e4}}

for part in (1e-4, 2e-5, 1e-5, 1e-6):
    converged, pressures, _ = press([0, 1 + part, 3], [0, 1, 2, 3], SETTINGS, tolerances=(1e-20, 1e-24))
    print(f"{part:.0e}: converged {converged}, wrong by {max(abs(p / 0.05 - 1) for p in pressures):.0e}")
