"""GetFEM 5.4.2: a master edge of 1e-4, away from the origin, ends the model with an exception.

The projection wants 1e-11 of the edge, and places are rounded by 1e-16 of their coordinates. All is 0.0476190 else.
"""

from getfem_blocks import press

for lower in ([0, 0.999, 1], [0, 0.9999, 1], [0, 0.99999, 1]):
    try:
        print(f"{lower}: pressure {press([0, 1], lower)[0]:.7f}")
    except RuntimeError as error:
        print(f"{lower}: {' '.join(str(error).split())}")
