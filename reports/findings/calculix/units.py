"""CalculiX 2.20: mortar contact depends on the unit of force where forces are small, and says that it converged.

Two slave edges on two master edges, as wide as each other, are pressed together by 0.01: all nodes move alike.
"""

from calculix_strips import press

for kind in ("MORTAR", "LINMORTAR"):
    for modulus in (1.0, 1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10):
        ended, moves = press([0, 1, 2], [0, 0.7, 2], kind, modulus)
        print(f"{kind}, E = {modulus:g}: {ended}, slave at {', '.join(f'{move:.6f}' for move in moves)}")
