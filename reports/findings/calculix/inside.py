"""CalculiX 2.20: a master surface that lies within the middle of one slave edge is not found.

Strips are pressed together by 0.01. It says that it converged, and the slave goes through the master.
"""

from calculix_strips import press

for half in (0.3, 0.39, 0.41, 0.45):
    ended, moves = press([0, 1], [0.5 - half, 0.5 + half])
    print(f"master of {2 * half:.2f} under a slave edge of 1: {ended}, slave at {moves[0]:.6f}, {moves[1]:.6f}")
