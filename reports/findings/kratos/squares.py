"""Kratos 10.4.4: `contact_residual_criterion` compares its tolerances with squares of residuals, in the unit of force.

An absolute tolerance of 1e-16 of E h leaves residuals of 1e-8 E h where E is 1, and of any size where E is small.
"""

from kratos_blocks import press

OPTIONS = {"search_parameters": {"search_factor": 1e4}}

exact = press([0, 2], [-1, 0, 1.2, 3], OPTIONS, tolerances=(1e-20, 1e-40))[1][0]
for young in (1e6, 1.0, 1e-6, 1e-12):
    pressures = press([0, 2], [-1, 0, 1.2, 3], OPTIONS, young=young, tolerances=(1e-20, 1e-16 * young))[1]
    print(f"E {young:g}: pressure / E {pressures[0]:.12f}, wrong by {pressures[0] / exact - 1:.1e}")
