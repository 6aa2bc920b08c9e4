"""Kratos 10.4.4: a penalty below 2.2e-16, in whatever unit, becomes 1, and contact may be lost with "converged".

Blocks are pressed together by 0.1 h with a millionth of E/h, in units in which E is small and lengths are large.
"""

from kratos_blocks import press

OPTIONS = {"stiffness_factor": 1e-6, "penalty_scale_factor": 1e6}
SETTINGS = {"search_parameters": {"search_factor": 1e4}, "advance_ALM_parameters": OPTIONS}

for unit in (1.0, 2.0**16, 2.0**17):
    scene = ([0, 1, 2, 3], [-1, 4], SETTINGS)
    converged, pressures, gap = press(*scene, unit=unit, young=1 / unit, tolerances=(1e-20, 1e-24))
    mean = sum(pressures) / 3
    print(f"penalty {1e-6 / unit**2:.0e}: converged {converged}, pressure / E {mean:.6f}, gap / h {gap:.6f}")
