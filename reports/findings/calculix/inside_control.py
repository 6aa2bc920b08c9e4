"""The same strips with roles exchanged in their widths: the master is pressed, and the slave stays behind."""

from calculix_strips import press

for half in (0.3, 0.39, 0.41, 0.45):
    ended, moves = press([0.5 - half, 0.5 + half], [0, 1])
    print(f"slave of {2 * half:.2f} on a master edge of 1: {ended}, slave at {moves[0]:.6f}, {moves[1]:.6f}")
