"""ipctk 1.6.1: the distance of a point from a line in the plane loses digits with the distance from the origin.

The error is that of products of whole coordinates, uX²/(ℓd), not that of rounded positions, uX/d.
"""

from fractions import Fraction

import ipctk
import numpy as np

GAP = 1e-3


def worst_error(shift: float, gap: float) -> float:
    """Return the largest relative error of a squared distance, over 200 random segments of length 1."""
    random, worst = np.random.default_rng(0), 0.0
    for _ in range(200):
        angle = random.uniform(0, 2 * np.pi)
        along, normal = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        a = shift + random.uniform(-1, 1, 2)
        b, p = a + along, a + 0.3 * along + gap * normal
        (px, py), (ax, ay), (bx, by) = (tuple(map(Fraction, each.tolist())) for each in (p, a, b))
        exact = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) ** 2 / ((bx - ax) ** 2 + (by - ay) ** 2)
        worst = max(worst, abs(float(Fraction(ipctk.point_line_distance(p, a, b)) / exact - 1)))
    return worst


if __name__ == "__main__":
    for shift in (0.0, 10.0, 100.0, 1000.0):
        print(f"at {shift:6}: error {worst_error(shift, GAP):.1e}, rounded positions {2 * shift * 2**-53 / GAP:.1e}")
