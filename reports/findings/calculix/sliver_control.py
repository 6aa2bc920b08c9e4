"""The same strips with roles exchanged: the short edge is a whole slave edge, and no part of one."""

from calculix_strips import press

for part in (1e-3, 2e-4, 1.1e-4, 0.9e-4, 5e-5):
    ended, moves = press([0, 1 - part, 1], [0, 1])
    print(f"a slave edge of {part:g} over a master edge of 1: {ended}, {moves[0]:.9f}, {moves[2]:.9f}")
