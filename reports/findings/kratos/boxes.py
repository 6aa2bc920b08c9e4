"""Kratos 10.4.4: its default search finds no pair of edges that overlap by more than about a fifth of an edge.

It says that it has converged, and the blocks are as deep in each other as before. Half of the overlap would be right.
"""

from kratos_blocks import press

for overlap in (0.1, 0.2, 0.25, 0.3):
    converged, pressures, gap = press([0, 1, 2], [0, 2], {}, overlap=overlap, pushed=0.0)
    print(f"overlap {overlap}: converged {converged}, pressures {[round(p, 6) for p in pressures]}, gap {gap:.1e}")
