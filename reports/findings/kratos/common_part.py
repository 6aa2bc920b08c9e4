"""Kratos 10.4.4: of the part that two faces share, the exact mortar segmentation loses some where edges meet."""

from kratos_faces import FACES, common_area

for name, (slave, master, right) in FACES.items():
    print(f"{name}: {common_area(slave, master):.6f} found, {right:.6f} right")
