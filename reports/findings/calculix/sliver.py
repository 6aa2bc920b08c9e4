"""CalculiX 2.20: a part that a master edge shares with a slave edge is left out if it is shorter than 1e-4 of that.

Strips are pressed together by 0.01. Right are 0.005025126 at both ends of the slave.
"""

from calculix_strips import press

for part in (1e-3, 2e-4, 1.1e-4, 0.9e-4, 5e-5):
    ended, moves = press([0, 1], [0, 1 - part, 1])
    print(f"a master edge of {part:g} under a slave edge of 1: {ended}, {moves[0]:.9f}, {moves[1]:.9f}")
