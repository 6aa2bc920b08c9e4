"""Blocks that overlap by less, where places are found: the pressure is (0.1 + overlap) / (2 + 1/10)."""

from getfem_blocks import press

for overlap in (0.0, 0.01, 0.02, 0.03):
    pressures = press([0, 1, 2], [0, 2], overlap=overlap)
    print(f"overlap {overlap}: pressures {[round(p, 7) for p in pressures]}, exact {(0.1 + overlap) / 2.1:.7f}")
