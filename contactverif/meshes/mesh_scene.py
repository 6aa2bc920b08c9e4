"""A user's own mesh file becomes a `Scene`: the cells beside slave and master lines are elastic bodies.

Cells that share nodes are one body, and lines without cells beside them are a rigid one.

Rule for the next editor: an error is said in terms of the options of the command line.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import ONE_SIDED, Surface, mean_normal, ways_to_master
from contactverif.mechanics.bodies import turn_counter_clockwise
from contactverif.mechanics.scene import Scene
from contactverif.meshes.cell_sides import describe, label_bodies, plane_cells
from contactverif.meshes.mesh_file import Flip, MeshSides, read_sides
from contactverif.meshes.plain_mesh import find_group

YOUNG, POISSON = 1.0, 0.3  # The material of a body that the user says nothing about.
STIFFNESS = 1.0  # The distributed stiffness ε̂ h / E of a scene, soft enough for Newton's method on bent surfaces.
AWAY = 0.7  # A boundary looks away from the contact if the cosine between its normal and the opposite one is larger.
CLOSED = 0.8  # The supports push the slave until this share of its nodes would touch.
LEAST_DEPTH = 0.01  # They push it further by this share of its height, so that pressures are not zero.
DEEPEST = 0.02  # No node is pushed deeper than this share of the height: linear elasticity is meant for small strains.

Material = tuple[float, float]
Support = tuple[float | None, float | None]


def read_scene(
    path: str | Path | None,
    *,
    slave: str | None = None,
    master: str | None = None,
    pair: int = 0,
    flip: Flip | None = None,
    materials: Mapping[str, Material] | None = None,
    supports: Mapping[str, Support] | None = None,
) -> Scene:
    """Read the two bodies around the interface between two groups of 2-node lines from a mesh file.

    A body whose supports are not given is held where its boundary looks away from the contact. That of the slave is
    pushed towards the master, unless some given support moves. What the reader has to say goes to standard error.

    Parameters
    ----------
    path, slave, master : str | None
        As in `read_interface`, where `path` may be a Path.
    pair : int
        As in `read_interface`.
    flip : {"slave", "master", "both"} | None
        As in `read_interface`.
    materials : Mapping[str, tuple[float, float]] | None
        {group: (Young's modulus, Poisson's ratio)}. The bodies to which members of the group belong have this
        material; the others have that of the file, or else E = 1, ν = 0.3.
    supports : Mapping[str, tuple[float | None, float | None]] | None
        {group: displacement along x and y, a length each}; None where the nodes of the group are free to move.

    Returns
    -------
    Scene
        The bodies, with a penalty of E/h.

    Raises
    ------
    MisuseError
        If the file, a group, a material, or a body cannot be used.

    Examples
    --------
    ::

        scene = read_scene("punch.msh", slave="punch", master="base", materials={"base body": (1000.0, 0.3)})
    """
    sides = read_sides(path, slave=slave, master=master, pair=pair, flip=flip)
    scene = scene_of(sides, materials or {}, supports or {})
    sys.stderr.write(sides.words)
    return scene


def scene_of(sides: MeshSides, materials: Mapping[str, Material], supports: Mapping[str, Support]) -> Scene:
    """Return the scene of the sides of a mesh; arguments and errors are those of `read_scene`."""
    if sides.points.shape[1] == 3:
        raise MisuseError("--mesh", "faces in space", "lines in a plane: bodies in space are not solved")
    parts = _parts(sides)
    _set_materials(sides, parts, sides.mesh.materials, given=False)
    _set_materials(sides, parts, materials, given=True)
    _set_supports(sides, parts, supports)
    for part in parts:
        if len(part.cells) and not part.has_supports:
            part.fixed[_far_nodes(part)] = True
    scene = _scene(parts)
    if not any(part.imposed.any() for part in parts):
        _push_slaves(parts, scene)
        scene = _scene(parts)
    if any(part.has_supports for part in parts) and (gap := scene.gap_at_rest()) >= 0:
        place = f"{abs(gap):.3g} apart" if np.isfinite(gap) else "side by side"
        needed = "supports that move slave and master onto each other"
        raise MisuseError("--support", f"supports that leave the bodies {place}", needed)
    return scene


def describe_bodies(scene: Scene) -> list[str]:
    """Return a line for each body of a scene: its cells, its material, its supports and how they move."""
    lines = []
    for index, body in enumerate(scene.bodies):
        side = "slave" if index in scene.slave else "master"
        words = f"{len(body.cells)} cells, E = {body.young:g}, ν = {body.poisson:g}" if not body.rigid else "rigid"
        supports = body.fixed.any(axis=1)
        moves = np.unique(np.round(body.imposed[supports], 12), axis=0)
        way = f"moved by ({moves[0, 0]:.3g}, {moves[0, 1]:.3g})" if len(moves) == 1 else "moved by several ways"
        lines.append(f"{side}: {words}, {supports.sum()} nodes held" + (f", {way}" if moves.any() else ""))
    return lines


@dataclass(slots=True, eq=False)
class _Part:
    """A body while it is put together, on the nodes of the mesh."""

    side: str  # "slave" or "master"
    numbers: IntArray  # (n_nodes,) The points of the mesh that are its nodes, ascending.
    nodes: FloatArray
    cells: IntArray
    contact: IntArray
    fixed: BoolArray
    imposed: FloatArray
    material: Material = (YOUNG, POISSON)
    material_of: str = ""  # The group that says the material.
    has_supports: bool = False  # The user says its supports.

    @property
    def normal(self) -> FloatArray:
        """The mean normal (2,) of the contact boundary, out of the body; 0 around a ring."""
        normal = mean_normal(Surface(self.contact), self.nodes)
        length = np.hypot(*normal)
        return normal / length if length > ONE_SIDED else np.zeros(2)


def _parts(sides: MeshSides) -> list[_Part]:
    """Return the bodies that slave or master lines belong to, slaves first, without material and supports."""
    corners = plane_cells(sides.mesh.cells).values()
    blocks = [turn_counter_clockwise(sides.points, each) for each in corners]
    labels = label_bodies([*blocks, sides.slave, sides.master], len(sides.points))
    of_slave, of_master = np.unique(labels[sides.slave]), np.unique(labels[sides.master])
    if both := set(of_slave.tolist()) & set(of_master.tolist()):
        node = sides.slave[np.isin(labels[sides.slave[:, 0]], list(both))][0, 0]
        actual = f"lines of the body that has slave lines too, at {describe(sides.points[node])}"
        raise MisuseError("--master", actual, "slave and master on bodies without a common node")
    parts = []
    for side, lines, its_labels in (("slave", sides.slave, of_slave), ("master", sides.master, of_master)):
        for label in its_labels:
            cells = _one_shape([block[labels[block[:, 0]] == label] for block in blocks])
            edges = lines[labels[lines[:, 0]] == label]
            numbers = np.unique(np.concatenate([cells.reshape(-1), edges.reshape(-1)]))
            its_cells, contact = np.searchsorted(numbers, cells), np.searchsorted(numbers, edges)
            shape, rigid = (len(numbers), 2), not len(cells)
            fixed, imposed = np.full(shape, rigid), np.zeros(shape)
            parts.append(_Part(side, numbers, sides.points[numbers], its_cells, contact, fixed, imposed))
    return parts


def _one_shape(blocks: list[IntArray]) -> IntArray:
    """Return cells (n_cells, 3 or 4) of one shape: where there are triangles too, a quadrilateral is two triangles."""
    blocks = [block for block in blocks if len(block)]
    if not blocks:
        return np.zeros((0, 4), dtype=np.int64)
    if wrong := {block.shape[1] for block in blocks} - {3, 4}:
        raise MisuseError("--mesh", f"cells with {min(wrong)} corners", "triangles or quadrilaterals")
    if len({block.shape[1] for block in blocks}) > 1:
        blocks = [np.vstack([block[:, :3], block[:, [0, 2, 3]]]) if block.shape[1] == 4 else block for block in blocks]
    return np.vstack(blocks)


def _points_of_group(sides: MeshSides, option: str, name: str) -> IntArray:
    group = sides.mesh.groups[find_group(sides.mesh, option, name)]
    return np.unique(np.concatenate([data.reshape(-1) for data in group.values()]))


def _set_materials(sides: MeshSides, parts: list[_Part], materials: Mapping[str, Material], *, given: bool) -> None:
    """Give bodies their material; what the user gives goes before what the file says."""
    for part in parts:
        part.material_of = ""
    for name, (young, poisson) in materials.items():
        points = _points_of_group(sides, "--material", name)
        bodies = [part for part in parts if len(part.cells) and np.isin(part.numbers, points).any()]
        if not bodies and given:
            actual = f"{name!r}, no member of which belongs to an elastic body"
            raise MisuseError("--material", actual, "a group with members in the body of slave or master")
        if not (0 < young < np.inf and -1 < poisson < 0.5):
            needed = "Young's modulus E > 0 and Poisson's ratio −1 < ν < 0.5"
            raise MisuseError("--material", f"E = {young:g}, ν = {poisson:g} of {name!r}", needed)
        for part in bodies:
            if part.material_of and part.material != (young, poisson):
                actual = f"two materials of one body, those of {part.material_of!r} and {name!r}"
                raise MisuseError("--material", actual, "one for each body, whose cells share nodes")
            part.material, part.material_of = (young, poisson), name


def _set_supports(sides: MeshSides, parts: list[_Part], supports: Mapping[str, Support]) -> None:
    for name, displacement in supports.items():
        points = _points_of_group(sides, "--support", name)
        if not any(np.isin(part.numbers, points).any() for part in parts):
            needed = "a group with nodes of the body of slave or master"
            raise MisuseError("--support", f"{name!r}, which has no node of these bodies", needed)
        for part in parts:
            nodes = np.isin(part.numbers, points)
            part.has_supports |= bool(nodes.any())
            for component, value in enumerate(displacement):
                if value is not None:
                    part.fixed[nodes, component] = True
                    # A rigid body moves as a whole.
                    part.imposed[nodes if len(part.cells) else slice(None), component] = value


def _far_nodes(part: _Part) -> IntArray:
    """Return the nodes on the boundary that looks away from the contact; around a ring, on all other boundary."""
    edges = np.stack([part.cells, np.roll(part.cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    n_nodes = len(part.nodes)
    keys, reverse = edges @ [n_nodes, 1], edges @ [1, n_nodes]
    edges = edges[~np.isin(keys, reverse) & ~np.isin(keys, part.contact @ [n_nodes, 1])]
    along = np.diff(part.nodes[edges], axis=1)[:, 0]
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    far = np.unique(edges[normals @ part.normal < -AWAY] if part.normal.any() else edges)
    if not len(far):
        actual = f"none for the {part.side} body, no boundary of which looks away from the contact"
        raise MisuseError("--support", actual, "--support GROUP=0,0, a group on its boundary")
    return far


def _push_slaves(parts: list[_Part], scene: Scene) -> None:
    ways, directions = ways_to_master(scene.interface)
    seen = np.isfinite(ways)
    slaves = [part for part in parts if part.side == "slave"]
    # Around a ring there is no direction; an interference fit is in contact without one.
    if not seen.any() or not all(part.normal.any() and not part.has_supports for part in slaves):
        return
    direction = directions[0]
    pushed = max(parts, key=lambda part: (len(part.cells) > 0, part.side == "slave"))  # A slave, if it is elastic.
    height = float(np.ptp(pushed.nodes @ direction))
    closed = float(np.quantile(ways[seen], CLOSED)) + LEAST_DEPTH * height
    way = min(closed, float(ways[seen].min()) + DEEPEST * height)
    for part in slaves:
        part.imposed[part.fixed.all(axis=1)] = max(way, 0.0) * direction + 0.0


def _scene(parts: list[_Part]) -> Scene:
    arrays = [(part.nodes, part.cells, part.contact, *part.material, part.fixed, part.imposed) for part in parts]
    bodies = tuple(Body(*each, name=f"{part.side} body") for each, part in zip(arrays, parts, strict=True))
    n_slaves = sum(part.side == "slave" for part in parts)
    elastic = [part for part in parts if len(part.cells)]
    if not elastic:
        raise MisuseError("--mesh", "no 2-D cells beside the lines of slave or master", "the cells of a body")
    segments = [np.diff(part.nodes[part.contact], axis=1)[:, 0] for part in parts[:n_slaves]]
    length = float(np.hypot(*np.vstack(segments).T).mean())
    penalty = STIFFNESS * min(part.material[0] for part in elastic) / length
    indices = range(len(bodies))
    return Scene(bodies, tuple(indices[:n_slaves]), tuple(indices[n_slaves:]), penalty)


def parse_material(text: str) -> tuple[str, Material]:
    """Return the group and the material of GROUP=E,ν."""
    needed = "GROUP=E,ν such as base=1000,0.3"
    name, (young, poisson) = _parse(text, "--material", needed)
    if young is None or poisson is None:
        raise MisuseError("--material", repr(text), needed)
    return name, (young, poisson)


def parse_support(text: str) -> tuple[str, Support]:
    """Return the group and the displacement of GROUP=X,Y, each a number or `free`."""
    return _parse(text, "--support", "GROUP=X,Y such as base=0,0 or lid=free,-0.1")


def _parse(text: str, option: str, needed: str) -> tuple[str, Support]:
    """Return the name and the two numbers of NAME=NUMBER,NUMBER, None for `free`."""
    name, _, words = text.rpartition("=")
    try:
        numbers = [None if word.strip() == "free" else float(word) for word in words.split(",")]
    except ValueError:
        numbers = []
    if not name or len(numbers) != 2 or not all(number is None or isfinite(number) for number in numbers):
        raise MisuseError(option, repr(text), needed)
    return name, (numbers[0], numbers[1])
