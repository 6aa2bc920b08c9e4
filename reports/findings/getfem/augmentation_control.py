"""The same blocks with a penalty so small that all points are closed, and matching ones with any: all are the same."""

from getfem_blocks import press

for penalty in (1e-4, 1e-2, 1.0):
    pressures = press([0, 4], [-1, 2, 5], penalty=penalty, multiplier=True)
    print(f"penalty {penalty:g}: pressure {pressures[0]:.6f}")
for penalty in (1e-2, 1.0, 16.0):
    pressures = press([0, 2], [-1, 0, 2, 3], penalty=penalty, multiplier=True)
    print(f"matching, penalty {penalty:g}: pressure {pressures[0]:.6f}")
