"""Kratos 10.4.4: of the part that two faces share, the exact mortar segmentation loses some where edges meet."""

from kratos_faces import FACES, common_area

for name, (slave, master, right) in FACES.items():
    areas = " and ".join(f"{common_area(slave, master, tessellation):.6f}" for tessellation in (False, True))
    print(f"{name}: {areas} found, {right:.6f} right")
