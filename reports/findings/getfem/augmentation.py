"""GetFEM 5.4.2: with multipliers in an integral the penalty of the augmentation decides the solution of hard contact.

A block of one segment is pressed onto one of two segments, which is wider, so that the pressure is not uniform.
"""

from getfem_blocks import press

for penalty in (2.0, 4.0, 8.0, 16.0):
    pressures = press([0, 4], [-1, 2, 5], penalty=penalty, multiplier=True)
    print(f"penalty {penalty:g}: pressure {pressures[0]:.6f}")
