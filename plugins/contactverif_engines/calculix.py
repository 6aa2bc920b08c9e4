"""CalculiX (ccx): surfaces that touch by penalty springs or by multipliers of its mortar method.

Source: G. Dhondt, CalculiX CrunchiX USER'S MANUAL version 2.20, keywords *CONTACT PAIR, *SURFACE BEHAVIOR, *CONTROLS.
The deck of a plane scene is a layer of solids, since ccx knows contact in three dimensions alone. All displacements
across it are held, so that it is in plane strain. ccx reads 20 characters of a number, and prints 7 digits.
"""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from contactverif.contract.engine import BoolArray, EngineAnswer, EngineTraits, FloatArray, IntArray, SceneArrays
from contactverif_engines.filled import FilledScene, fill_rigid_bodies

FIELD = 20  # The characters of a number that ccx reads.
Kind = Literal["surface", "nodes", "mortar", "linmortar"]
_TYPES = {"surface": "SURFACE TO SURFACE", "nodes": "NODE TO SURFACE", "mortar": "MORTAR", "linmortar": "LINMORTAR"}
# The faces of C3D4, C3D6 and C3D8 by their corners, as the manual numbers them.
_FACES = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    6: ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
_STIFF = 1e7  # The stiffness of springs that stand for supports, over E times a length.
# The least E, and E times a body's size squared, in the unit of force of the deck: ccx takes a residual below 1e-6 for
# 0, in whatever unit, and its mortar methods need a large E.
LEAST_MODULUS, LEAST_FORCE = 1e9, 1e10
# The share of the mean force that may be out of balance, and of the step by which it may be corrected (5e-3 and 1e-2 by
# default); the fifth number is the first one after nine iterations, the last one a residual without further tests.
_FIELD = "{0}, 1e-8, , , {0}, , , 1e-20"
_PLANE, _SPACE = "1e-8", "1e-5"  # In space stiff springs leave a roundoff of 1e-6 behind corrections of 1e-13.


@dataclass(frozen=True)
class CalculiX:
    """CalculiX with one of its kinds of contact."""

    # "surface": face-to-face springs; "nodes": a spring at each slave node; "mortar" and "linmortar": dual mortar
    # methods. All have linear springs of the stiffness ε̂.
    kind: Kind = "surface"
    program: str = "ccx"
    dim: int = 2  # 3 takes scenes in space.

    @property
    def traits(self) -> EngineTraits:
        """The statements: what the manual states, and the digits that are printed."""
        passes, turns = None if self.kind == "nodes" else True, self.kind in ("surface", "nodes")
        return EngineTraits(
            "penalty", accuracy=1e-6, inclined_supports=turns, passes_flat_patch=passes, dimensions=(self.dim,)
        )

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Write a deck, run ccx on it, and read the displacements that it prints."""
        layer = make_layer(in_larger_units(scene))
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder, "scene.inp")
            deck.write_text("\n".join(write_deck(layer, self.kind)) + "\n", encoding="ascii")
            run = subprocess.run(
                [self.program, "scene"], cwd=folder, capture_output=True, text=True, errors="replace", check=False
            )
            printed = deck.with_suffix(".dat")
            text = printed.read_text(errors="replace") if printed.exists() else ""
            history = deck.with_suffix(".sta")
            steps = history.read_text(errors="replace") if history.exists() else ""
        displacements, time = read_displacements(text, *scene.nodes.shape)
        converged = run.returncode == 0 and time == 1.0
        iterations = sum(int(line.split()[3]) for line in steps.splitlines() if line.split()[:1] == ["1"])
        message = "" if converged else _complaint(run.stdout)
        return EngineAnswer(displacements, converged, iterations or -1, message)


def in_larger_units(scene: SceneArrays) -> SceneArrays:
    """Return the scene with forces in a unit in which moduli and forces are large; its displacements are the same."""
    factor = 2.0 ** round(np.log2(max(LEAST_MODULUS, LEAST_FORCE / scene.unit**2) / scene.young[~scene.rigid].max()))
    forces = {name: getattr(scene, name) * factor for name in ("young", "load", "penalty")}
    return replace(scene, **forces)


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """A layer of solids over a plane scene, as thick as its largest body; the front has the first nodes.

    A scene in space is its own layer: n nodes, and three components.
    """

    plane: FilledScene
    nodes: FloatArray  # (2 n, 3)
    # Wedges (n, 6), then bricks (n, 8), each with the body of each; in space tetrahedra (n, 4) are the first.
    solids: tuple[tuple[IntArray, IntArray], ...]
    # (n_faces, 4): the faces of the slave, seen from outside of its body counter-clockwise; −1 is a triangle's fourth.
    slave: IntArray
    master: IntArray
    frames: FloatArray  # (2 n, 2, 2), as those of the plane; the rest, too.
    fixed: BoolArray  # (2 n, 2)
    imposed: FloatArray  # (2 n, 2)
    load: FloatArray  # (2 n, 2), that of the thickness, half of it on each side.

    @property
    def is_plane(self) -> bool:
        """True if displacements across the layer are held."""
        return bool(self.fixed.shape[1] == 2)


def make_layer(scene: SceneArrays) -> Layer:
    """Return the layer of a scene."""
    plane, thickness = fill_rigid_bodies(scene), scene.unit
    if scene.nodes.shape[1] == 3:
        rest = plane.frames, plane.fixed, plane.imposed, plane.load
        return Layer(plane, plane.nodes, plane.cells, scene.slave, scene.master, *rest)
    count = len(plane.nodes)
    frames, fixed, imposed, load = (
        np.concatenate([each, each]) for each in (plane.frames, plane.fixed, plane.imposed, plane.load)
    )
    return Layer(
        plane,
        np.vstack([np.column_stack([plane.nodes, np.full(count, z)]) for z in (0.0, thickness)]),
        tuple((np.hstack([cells, cells + count]), bodies) for cells, bodies in plane.cells),
        np.hstack([scene.slave, scene.slave[:, ::-1] + count]),
        np.hstack([scene.master, scene.master[:, ::-1] + count]),
        frames,
        fixed,
        imposed,
        load * thickness / 2,
    )


def write_deck(layer: Layer, kind: Kind) -> list[str]:
    """Return the lines of the deck."""
    scene = layer.plane.scene
    tension = 1e-12 * float(scene.penalty) * scene.unit  # Springs at nodes keep it far from contact: none to speak of.
    share = _PLANE if layer.is_plane else _SPACE
    stiffness = _number(scene.penalty) + (f", {_number(tension)}" if kind == "nodes" else "")
    return [
        "*NODE, NSET=ALL",
        *(", ".join([str(n), *map(_number, node)]) for n, node in enumerate(layer.nodes.tolist(), start=1)),
        *_elements_and_surfaces(layer),
        *_materials(layer),
        *_turned_nodes(layer),
        *(_springs_across(layer) if layer.is_plane and kind in ("mortar", "linmortar") else ()),
        *("*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", stiffness),
        *(f"*CONTACT PAIR, INTERACTION=TOUCH, TYPE={_TYPES[kind]}", "SLAVE, MASTER"),
        *("*STEP, INC=1000", "*STATIC", "1., 1.", "*CONTROLS, PARAMETERS=FIELD", _FIELD.format(share)),
        *_supports_and_loads(layer, kind),
        *("*NODE PRINT, NSET=ALL, GLOBAL=YES", "U", "*END STEP"),
    ]


def _elements_and_surfaces(layer: Layer) -> list[str]:
    lines, number, faces = [], 1, dict[frozenset[int], tuple[int, int]]()
    for cells, bodies in layer.solids:
        corners = cells.shape[1]
        for body in np.unique(bodies):
            lines.append(f"*ELEMENT, TYPE=C3D{corners}, ELSET=B{body}")
            for cell in cells[bodies == body]:
                lines.append(", ".join(map(str, [number, *(cell + 1).tolist()])))
                sides = enumerate(_FACES[corners], start=1)
                faces |= {frozenset(cell[list(places)].tolist()): (number, side) for side, places in sides}
                number += 1
    for name, surface in (("SLAVE", layer.slave), ("MASTER", layer.master)):
        lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
        lines += ["{}, S{}".format(*faces[frozenset(face) - {-1}]) for face in surface.tolist()]
    return lines


def _materials(layer: Layer) -> list[str]:
    lines = []
    for body, (young, poisson) in enumerate(layer.plane.materials):
        lines += [f"*MATERIAL, NAME=M{body}", "*ELASTIC", f"{_number(young)}, {_number(poisson)}"]
        lines.append(f"*SOLID SECTION, ELSET=B{body}, MATERIAL=M{body}")
    return lines


def _springs_across(layer: Layer) -> list[str]:
    """Hold the slave's nodes across the layer by springs: at supports the mortar methods find no pivot."""
    stiffness = _STIFF * float(layer.plane.scene.young.max()) * layer.plane.scene.unit
    first = sum(len(cells) for cells, _ in layer.solids) + 1
    nodes = enumerate(np.unique(layer.slave).tolist(), start=first)
    lines = ["*ELEMENT, TYPE=SPRING1, ELSET=ACROSS", *(f"{number}, {node + 1}" for number, node in nodes)]
    return [*lines, "*SPRING, ELSET=ACROSS", "3", _number(stiffness)]


def _supports_and_loads(layer: Layer, kind: Kind) -> list[str]:
    sprung = set(np.unique(layer.slave).tolist()) if kind in ("mortar", "linmortar") else set[int]()
    across = range(len(layer.nodes)) if layer.is_plane else ()
    lines = ["*BOUNDARY", *(f"{node + 1}, 3, 3" for node in across if node not in sprung)]
    for node, part in np.argwhere(layer.fixed).tolist():
        lines.append(f"{node + 1}, {part + 1}, {part + 1}, {_number(layer.imposed[node, part])}")
    loaded = np.argwhere(layer.load != 0).tolist()
    loads = [f"{node + 1}, {part + 1}, {_number(layer.load[node, part])}" for node, part in loaded]
    return [*lines, "*CLOAD", *loads] if loads else lines


def _turned_nodes(layer: Layer) -> list[str]:
    lines: list[str] = []
    dim = layer.fixed.shape[1]
    turned = np.flatnonzero((layer.frames != np.eye(dim)).any(axis=(1, 2)))
    axes, groups = np.unique(layer.frames[turned].reshape(-1, dim * dim), axis=0, return_inverse=True)
    for group, axis in enumerate(axes):
        lines.append(f"*NSET, NSET=T{group}")
        lines += [str(node + 1) for node in turned[groups.reshape(-1) == group].tolist()]
        lines.append(f"*TRANSFORM, NSET=T{group}, TYPE=R")
        frame = np.pad(axis.reshape(dim, dim), ((0, 3 - dim), (0, 0)))
        lines.append(", ".join(map(_number, frame[:, :2].T.reshape(-1))))
    return lines


def _number(value: float) -> str:
    """Return a number with all the digits that ccx reads."""
    text = repr(float(value))
    return text if len(text) <= FIELD else f"{value:.{FIELD - 7}e}"


def read_displacements(text: str, n_nodes: int, dim: int = 2) -> tuple[FloatArray, float]:
    """Return the displacements (n_nodes, dim) of the front that were printed last, and the time; 0 if none were."""
    displacements, time = np.zeros((n_nodes, dim)), 0.0
    for line in text.splitlines():
        words = line.split()
        if "displacements" in words:
            time = float(words[-1])
        elif len(words) == 4 and 1 <= int(words[0]) <= n_nodes:
            displacements[int(words[0]) - 1] = list(map(float, words[1 : dim + 1]))
    return displacements, time


def _complaint(text: str) -> str:
    lines = [line.strip() for line in text.splitlines()]
    wrong = next((i for i, line in enumerate(lines) if "*ERROR" in line), None)
    return " ".join(lines[wrong : wrong + 2]) if wrong is not None else (lines or ["no words"])[-1]
