"""The same blocks with next to no augmentation, and matching blocks with all of it: the unit does not matter."""

from kratos_blocks import press

SEARCH = {"search_factor": 1e4}
NONE = {"search_parameters": SEARCH, "advance_ALM_parameters": {"stiffness_factor": 1e-8, "penalty_scale_factor": 1e8}}

for unit in (1.0, 64.0):
    converged, pressures, gap = press([0, 2], [-1, 0, 1.2, 3], NONE, unit=unit)
    print(f"no augmentation, unit {unit:g}: converged {converged}, pressure {pressures[0]:.6f}, mean gap {gap:.6f}")
for unit in (1.0, 64.0):
    converged, pressures, gap = press([0, 2], [-2, 0, 2, 4], {"search_parameters": SEARCH}, unit=unit)
    print(f"matching, unit {unit:g}: converged {converged}, pressure {pressures[0]:.6f}, mean gap {gap:.6f}")
for unit in (1.0, 64.0):
    augmented = {"stiffness_factor": 1 / unit, "penalty_scale_factor": unit}
    settings = {"search_parameters": SEARCH, "advance_ALM_parameters": augmented}
    converged, pressures, gap = press([0, 2], [-1, 0, 1.2, 3], settings, unit=unit)
    print(f"penalty {1 / unit:g} E/h, unit {unit:g}: pressure {pressures[0]:.6f}, mean gap {gap:.6f}")
