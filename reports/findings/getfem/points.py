"""GetFEM 5.4.2: points of a slave edge that see two master edges are no exact integration, with few or many points.

The pressure of springs of 10 is 0.1 / (2 + 1/10) = 0.047619 everywhere.
"""

from getfem_blocks import press

for order in (2, 5, 9, 15):
    pressures = press([0, 1, 2], [0, 0.7, 2], order)
    print(f"order {order}: pressures {[round(p, 7) for p in pressures]}, which should be 0.0476190")
