"""Kratos 10.4.4: the penalty is multiplied by the gap, integrated over half a segment, and not divided by its length.

So springs are h/2 times as stiff as the number that is given, and on a graded slave a uniform pressure is not found.
"""

from kratos_blocks import press

PENALTY = 10.0
SETTINGS = {"advance_ALM_parameters": {"manual_ALM": True, "penalty": PENALTY}}

for h in (0.5, 1.0, 2.0, 4.0):
    converged, pressures, gap = press([0, h, 2 * h], [0, h, 2 * h], SETTINGS, "Penalty")
    print(f"h = {h:3}: converged {converged}, pressure / (penalty × depth) = {pressures[0] / (-gap * PENALTY):.6f}")
converged, pressures, gap = press([0, 1, 4], [0, 1, 4], SETTINGS, "Penalty")
print(
    f"segments of 1 and 3: converged {converged}, pressures {[round(p, 6) for p in pressures]}, which should be equal"
)
