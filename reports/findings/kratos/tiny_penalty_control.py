"""The same blocks in the same units with the penalty that Kratos chooses by itself, E/h: 0.0625 in all."""

from kratos_blocks import press

SETTINGS = {"search_parameters": {"search_factor": 1e4}}

for unit in (1.0, 2.0**16, 2.0**17):
    scene = ([0, 1, 2, 3], [-1, 4], SETTINGS)
    converged, pressures, gap = press(*scene, unit=unit, young=1 / unit, tolerances=(1e-20, 1e-24))
    mean = sum(pressures) / 3
    print(f"penalty {1 / unit**2:.0e}: converged {converged}, pressure / E {mean:.6f}, gap / h {gap:.6f}")
