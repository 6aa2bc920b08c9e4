"""The same short master edges at the origin, where places have more digits: 0.0476190 everywhere."""

from getfem_blocks import press

for lower in ([0, 1e-3, 1], [0, 1e-4, 1], [0, 1e-5, 1]):
    print(f"{lower}: pressure {press([0, 1], lower)[0]:.7f}")
