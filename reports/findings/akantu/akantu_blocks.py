"""Two blocks of Akantu that overlap by 0.1: a slave edge from 1/2 to any place, on a master edge from 0 to 4."""

import tempfile
from pathlib import Path
from typing import Any

import akantu

NODES = ("0 -1", "4 -1", "4 0", "0 0", "0.5 -0.1", "{0} -0.1", "{0} 0.9", "0.5 0.9")
ELEMENTS = ("1 2 1 1 5 6", "1 2 2 2 3 4", "3 2 3 3 1 2 3 4", "3 2 3 3 5 6 7 8")
NAMES = ('1 1 "slave"', '1 2 "master"', '2 3 "body"')
RULES = """
material elastic [
  name = body
  rho = 1.
  E = 1e-9
  nu = 0.
]
contact_detector [
  type = explicit
  slave = slave
  master = master
  projection_tolerance = 1e-12
  max_iterations = 100
  extension_tolerance = 1e-3
]
contact_resolution penalty_linear [
  name = springs
  mu = 0.
  epsilon_n = 1.
  is_master_deformable = {}
]
"""


def write_mesh(end: float) -> str:
    """Return the mesh in the format of Gmsh."""
    lines = [
        "$MeshFormat",
        "2.2 0 8",
        "$EndMeshFormat",
        "$PhysicalNames",
        "3",
        *NAMES,
        "$EndPhysicalNames",
        "$Nodes",
        "8",
    ]
    lines += [f"{number} {place.format(end)} 0" for number, place in enumerate(NODES, 1)]
    lines += ["$EndNodes", "$Elements", "4", *(f"{number} {words}" for number, words in enumerate(ELEMENTS, 1))]
    return "\n".join([*lines, "$EndElements", ""])


def make_blocks(end: float, deformable: bool = True) -> tuple[Any, Any]:
    """Return two soft blocks in contact, with springs of a stiffness of 1 for each length, and their mesh."""
    with tempfile.TemporaryDirectory() as name:
        folder, mesh = Path(name), akantu.Mesh(2)
        (folder / "two.msh").write_text(write_mesh(end))
        (folder / "rules.dat").write_text(RULES.format(str(deformable).lower()))
        akantu.parseInput(str(folder / "rules.dat"))
        mesh.read(str(folder / "two.msh"))
    blocks = akantu.CouplerSolidContact(mesh)
    blocks.initFull(_analysis_method=akantu._static)
    detector = blocks.getContactMechanicsModel().getContactDetector()
    detector.setSurfaceSelector(akantu.PhysicalSurfaceSelector(mesh))
    return blocks, mesh
