"""A user's own mesh file becomes a `Scene`: the cells beside slave and master lines or faces are elastic bodies.

Cells that share nodes are one body, and lines or faces without cells beside them are a rigid one.

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
from contactverif.contract.interface import ONE_SIDED, PLANE, Surface, mean_normal, unit_normals, ways_to_master
from contactverif.mechanics.bodies import turn_counter_clockwise
from contactverif.mechanics.scene import Scene
from contactverif.meshes.cell_sides import CellSides, describe, label_bodies, plane_cells
from contactverif.meshes.mesh_file import Flip, MeshSides, read_sides
from contactverif.meshes.plain_mesh import find_group

YOUNG, POISSON = 1.0, 0.3  # The material of a body that the user says nothing about.
STIFFNESS = 1.0  # The distributed stiffness ε̂ h / E of a scene, soft enough for Newton's method on bent surfaces.
AWAY = 0.7  # A boundary looks away from the contact if the cosine between its normal and the opposite one is larger.
CLOSED = 0.8  # The supports push the slave until this share of its nodes would touch.
LEAST_DEPTH = 0.01  # They push it further by this share of its height, so that pressures are not zero.
DEEPEST = 0.02  # No node is pushed deeper than this share of the height: linear elasticity is meant for small strains.

_SOLIDS = "tetra", "hexahedron", "wedge", "pyramid"  # Parts of the names of cells with a volume.
_SHAPES = {4: "tetrahedra", 5: "pyramids", 6: "wedges", 8: "hexahedra"}
_KINDS = {(2, 3): "triangle", (2, 4): "quad", (3, 4): "tetra", (3, 8): "hexahedron"}

Material = tuple[float, float]
Support = tuple[float | None, ...]


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
    """Read the two bodies around the interface between two groups of 2-node lines, or of faces, from a mesh file.

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
    supports : Mapping[str, tuple[float | None, ...]] | None
        {group: displacement along x and y, in space z, a length each}; None where the nodes of the group are free.

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
        each_way = ", ".join(f"{move:.3g}" for move in moves[0]) if len(moves) == 1 else ""
        way = f"moved by ({each_way})" if each_way else "moved by several ways"
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
        """The mean normal (dim,) of the contact boundary, out of the body; 0 around a ring."""
        normal = mean_normal(Surface(self.contact), self.nodes)
        length = np.linalg.norm(normal)
        return normal / length if length > ONE_SIDED else np.zeros(len(normal))


def _parts(sides: MeshSides) -> list[_Part]:
    """Return the bodies that slave or master lines belong to, slaves first, without material and supports."""
    dim = sides.points.shape[1]
    if dim == PLANE:
        blocks = [turn_counter_clockwise(sides.points, each) for each in plane_cells(sides.mesh.cells).values()]
    else:
        solids = {
            kind: data for kind, data in sides.mesh.cells.items() if any(name in kind.lower() for name in _SOLIDS)
        }
        blocks = [_turn_outside(sides.points, data) for data in solids.values()]
    labels = label_bodies([*blocks, sides.slave, sides.master], len(sides.points))
    of_slave, of_master = np.unique(labels[sides.slave]), np.unique(labels[sides.master])
    if both := set(of_slave.tolist()) & set(of_master.tolist()):
        node = sides.slave[np.isin(labels[sides.slave[:, 0]], list(both))][0, 0]
        word = "lines" if dim == PLANE else "faces"
        actual = f"{word} of the body that has slave {word} too, at {describe(sides.points[node])}"
        raise MisuseError("--master", actual, "slave and master on bodies without a common node")
    parts = []
    for side, lines, its_labels in (("slave", sides.slave, of_slave), ("master", sides.master, of_master)):
        for label in its_labels:
            cells = _one_shape([block[labels[block[:, 0]] == label] for block in blocks], dim)
            edges = lines[labels[lines[:, 0]] == label]
            numbers = np.unique(np.concatenate([cells.reshape(-1), edges.reshape(-1)]))
            its_cells, contact = np.searchsorted(numbers, cells), np.searchsorted(numbers, edges)
            shape, rigid = (len(numbers), dim), not len(cells)
            fixed, imposed = np.full(shape, rigid), np.zeros(shape)
            parts.append(_Part(side, numbers, sides.points[numbers], its_cells, contact, fixed, imposed))
    return parts


def _turn_outside(points: FloatArray, cells: IntArray) -> IntArray:
    """Return cells (n_cells, n_corners), of tetrahedra and hexahedra those turned that are inside out."""
    if cells.shape[1] not in (4, 8):
        return cells
    ends, turned = ([1, 2, 3], [0, 2, 1, 3]) if cells.shape[1] == 4 else ([1, 3, 4], [4, 5, 6, 7, 0, 1, 2, 3])
    volumes = np.linalg.det(points[cells[:, ends]] - points[cells[:, :1]])
    return np.where(volumes[:, None] < 0, cells[:, turned], cells)


def _one_shape(blocks: list[IntArray], dim: int) -> IntArray:
    """Return cells (n_cells, n_corners) of one shape.

    In the plane a quadrilateral is two triangles where there are triangles too. In space there are no such bodies.
    """
    blocks = [block for block in blocks if len(block)]
    if not blocks:
        return np.zeros((0, 2**dim), dtype=np.int64)
    if dim != PLANE:
        shapes = sorted({block.shape[1] for block in blocks})
        if shapes not in ([4], [8]):
            listed = " and ".join(_SHAPES.get(count, f"cells of {count} nodes") for count in shapes)
            raise MisuseError("--mesh", f"a body of {listed}", "tetrahedra alone or hexahedra alone, of first order")
        return np.vstack(blocks)
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
        if len(displacement) != sides.points.shape[1]:
            numbers = ",".join(["free" if value is None else f"{value:g}" for value in displacement])
            raise MisuseError("--support", f"{name}={numbers}", f"{sides.points.shape[1]} numbers, one along each axis")
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
    kind = _KINDS[part.nodes.shape[1], part.cells.shape[1]]
    outer = CellSides.collect({kind: part.cells}, part.nodes).around(part.contact)
    normals = unit_normals(part.nodes[outer])
    far = np.unique(outer[normals @ part.normal < -AWAY] if part.normal.any() else outer)
    if not len(far):
        actual = f"none for the {part.side} body, no boundary of which looks away from the contact"
        zeros = ",".join("0" * part.nodes.shape[1])
        raise MisuseError("--support", actual, f"--support GROUP={zeros}, a group on its boundary")
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
    elastic, dim = [part for part in parts if len(part.cells)], parts[0].nodes.shape[1]
    if not elastic:
        actual = "no 2-D cells beside the lines" if dim == PLANE else "no tetrahedra or hexahedra behind the faces"
        raise MisuseError("--mesh", f"{actual} of slave or master", "the cells of a body")
    sizes = [Surface(part.contact).measures(part.nodes) for part in parts[:n_slaves]]
    length = float(np.concatenate(sizes).mean()) ** (1 / (dim - 1))
    penalty = STIFFNESS * min(part.material[0] for part in elastic) / length
    indices = range(len(bodies))
    return Scene(bodies, tuple(indices[:n_slaves]), tuple(indices[n_slaves:]), penalty)


def parse_material(text: str) -> tuple[str, Material]:
    """Return the group and the material of GROUP=E,ν."""
    needed = "GROUP=E,ν such as base=1000,0.3"
    name, (young, poisson) = _parse(text, "--material", needed, (2,))
    if young is None or poisson is None:
        raise MisuseError("--material", repr(text), needed)
    return name, (young, poisson)


def parse_support(text: str) -> tuple[str, Support]:
    """Return the group and the displacement of GROUP=X,Y or GROUP=X,Y,Z, each a number or `free`."""
    needed = "GROUP=X,Y such as base=0,0 or lid=free,-0.1; in space GROUP=X,Y,Z"
    return _parse(text, "--support", needed, (2, 3))


def _parse(text: str, option: str, needed: str, counts: tuple[int, ...]) -> tuple[str, Support]:
    """Return the name and the numbers of NAME=NUMBER,NUMBER, as many as `counts` allows, None for `free`."""
    name, _, words = text.rpartition("=")
    try:
        numbers = [None if word.strip() == "free" else float(word) for word in words.split(",")]
    except ValueError:
        numbers = []
    if not name or len(numbers) not in counts or not all(number is None or isfinite(number) for number in numbers):
        raise MisuseError(option, repr(text), needed)
    return name, tuple(numbers)
