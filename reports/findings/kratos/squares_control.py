"""The same blocks with an absolute tolerance that is a square of a force: the unit does not matter."""

from kratos_blocks import press

OPTIONS = {"search_parameters": {"search_factor": 1e4}}

exact = press([0, 2], [-1, 0, 1.2, 3], OPTIONS, tolerances=(1e-20, 1e-40))[1][0]
for young in (1e6, 1.0, 1e-6, 1e-12):
    pressures = press([0, 2], [-1, 0, 1.2, 3], OPTIONS, young=young, tolerances=(1e-20, (1e-10 * young) ** 2))[1]
    print(f"E {young:g}: pressure / E {pressures[0]:.12f}, wrong by {pressures[0] / exact - 1:.1e}")
