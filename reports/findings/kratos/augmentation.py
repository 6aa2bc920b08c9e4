"""Kratos 10.4.4: the penalty of the augmentation, and so the unit of length, decides the solution of hard contact.

A block of one segment is pressed onto one of three segments, which is wider, so that the pressure is not uniform.
"""

from kratos_blocks import press

SEARCH = {"search_factor": 1e4}

for unit in (1.0, 64.0):
    converged, pressures, gap = press([0, 2], [-1, 0, 1.2, 3], {"search_parameters": SEARCH}, unit=unit)
    print(f"unit {unit:g}: converged {converged}, pressure {pressures[0]:.6f}, mean gap {gap:.6f}")
for factor in (1.0, 1e2, 1e4):
    augmented = {"stiffness_factor": factor, "penalty_scale_factor": 1 / factor}
    settings = {"search_parameters": SEARCH, "advance_ALM_parameters": augmented}
    converged, pressures, gap = press([0, 2], [-1, 0, 1.2, 3], settings)
    print(f"penalty {factor:g} E/h: converged {converged}, pressure {pressures[0]:.6f}, mean gap {gap:.6f}")
