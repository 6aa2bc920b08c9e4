"""The same slave on a master edge that is as long as both of its edges, and on matching ones: 0.0476190 everywhere."""

from getfem_blocks import press

for lower in ([0, 2], [0, 1, 2], [0, 0.4, 1, 2]):
    pressures = press([0, 1, 2] if len(lower) < 4 else lower, lower)
    print(f"{lower}: pressures {[round(p, 7) for p in pressures]}")
