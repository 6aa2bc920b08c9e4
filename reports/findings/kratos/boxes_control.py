"""The same blocks with a search without boxes: half of the overlap is the strain, and E is 1."""

from kratos_blocks import press

for overlap in (0.1, 0.2, 0.25, 0.3):
    settings = {"search_parameters": {"type_search": "in_radius"}}
    converged, pressures, gap = press([0, 1, 2], [0, 2], settings, overlap=overlap, pushed=0.0)
    print(f"overlap {overlap}: converged {converged}, pressures {[round(p, 6) for p in pressures]}, gap {gap:.1e}")
