"""The same strips with springs, face to face: the unit of force changes nothing."""

from calculix_strips import press

for modulus in (1.0, 1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10):
    ended, moves = press([0, 1, 2], [0, 0.7, 2], modulus=modulus)
    print(f"E = {modulus:g}: {ended}, slave at {', '.join(f'{move:.6f}' for move in moves)}")
