"""Meshes from elsewhere: every format that is promised, every way to be wrong, each with its message."""

import gzip
from collections.abc import Callable
from pathlib import Path

import meshlane
import numpy as np
import pytest

from contactverif import Interface, MisuseError
from contactverif.meshes.mesh_file import check_facing, read_interface

Capture = pytest.CaptureFixture[str]
PUNCH = Path(__file__).parents[1] / "data" / "punch.msh"
# Two blocks, one above the other, a gap of 0.5 between them; lines of the lower one run left to right.
POINTS = [[0, 0], [4, 0], [4, 1], [2, 1], [0, 1], [1, 1.5], [3, 1.5], [3, 2.5], [1, 2.5]]
UPPER, LOWER = [[5, 6]], [[4, 3], [3, 2]]
CELLS = [[0, 1, 2, 4], [8, 7, 6, 5]]  # the upper one clockwise
NAMES = {"punch": np.array([1, 1]), "base": np.array([2, 1]), "bodies": np.array([3, 2])}


def blocks(
    *, points: object = POINTS, upper: object = UPPER, lower: object = LOWER, cells: object = (), line: str = "line"
) -> meshlane.Mesh:
    """Return the two blocks in memory, their groups as physical groups; without cells unless they are given."""
    parts = [(line, np.array(upper)), (line, np.array(lower))] + ([("quad", np.array(cells))] if len(cells) else [])
    tags = [np.full(len(data), number) for number, (_, data) in enumerate(parts, 1)]
    points = np.column_stack([points, np.zeros(len(points))]) if np.shape(points)[1] == 2 else np.array(points)
    return meshlane.Mesh(
        points, parts, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags}, field_data=dict(NAMES)
    )


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Interface]:
    """Return a function that writes a mesh as .msh 2.2 and reads its interface; the punch is the slave."""

    def written_and_read(mesh: meshlane.Mesh, *, slave: str = "punch", master: str = "base", **more: bool) -> Interface:
        meshlane.write(tmp_path / "mesh.msh", mesh, file_format="gmsh22", binary=False)
        return read_interface(tmp_path / "mesh.msh", slave=slave, master=master, **more)

    return written_and_read


def points_of(interface: Interface) -> tuple[list[list[float]], list[list[float]]]:
    """Return the points of one open chain a side, in walking order."""
    sides = []
    for surface in (interface.slave, interface.master):
        segments = surface.segments[surface.chain_order]
        assert np.array_equal(segments[1:, 0], segments[:-1, 1])
        sides.append(interface.nodes[[segments[0, 0], *segments[:, 1]]].tolist())
    return sides[0], sides[1]


RIGHT = ([[1.0, 1.5], [3.0, 1.5]], [[4.0, 1.0], [2.0, 1.0], [0.0, 1.0]])


def test_the_punch_of_the_documentation() -> None:
    interface = read_interface(PUNCH, slave="punch", master="base")
    assert (len(interface.slave), len(interface.master)) == (5, 11)
    slave, master = points_of(interface)
    assert [slave[0], slave[-1], master[0], master[-1]] == [[3, 4], [7, 4], [10, 4], [0, 4]]
    assert not {x for x, _ in slave} & {x for x, _ in master}
    swapped = read_interface(str(PUNCH), slave="base", master="punch")
    assert points_of(swapped) == (master, slave)


@pytest.mark.parametrize("upper", [[[5, 6]], [[6, 5]]])
@pytest.mark.parametrize("lower", [[[4, 3], [3, 2]], [[2, 3], [3, 4]], [[4, 3], [2, 3]], [[3, 2], [4, 3]]])
def test_cells_tell_the_side_whatever_the_order_of_the_lines(
    upper: list[list[int]], lower: list[list[int]], read: Callable[..., Interface]
) -> None:
    assert points_of(read(blocks(upper=upper, lower=lower, cells=[[0, 1, 2, 3], [8, 7, 6, 5]]))) == RIGHT


def test_one_cell_beside_a_chain_tells_all_of_it(read: Callable[..., Interface]) -> None:
    mesh = blocks(cells=[[0, 1, 2, 3], [8, 7, 6, 5]])  # nothing beside the line from node 4 to node 3
    assert points_of(read(mesh)) == RIGHT


def test_without_cells_a_chain_runs_as_its_first_line(read: Callable[..., Interface], capfd: Capture) -> None:
    capfd.readouterr()
    assert points_of(read(blocks(lower=[[2, 3], [4, 3]]))) == RIGHT
    assert capfd.readouterr().err == (
        "--master: turned to run as the first of its 2 lines: 1\n"
        "--slave: no cells beside it; its body is taken to lie towards (0, 1) (--flip slave turns it)\n"
        "--master: no cells beside it; its body is taken to lie towards (0, -1) (--flip master turns it)\n"
    )
    with pytest.raises(MisuseError, match=r"bodies on the same side: that of the slave lies towards \(0, 1\), that of"):
        read(blocks(lower=[[4, 3], [2, 3]]))


def test_flip_exchanges_the_orientation(read: Callable[..., Interface]) -> None:
    lines_only = blocks(upper=[[6, 5]])
    assert points_of(read(lines_only, flip="both")) == RIGHT
    assert points_of(read(lines_only)) == (RIGHT[0][::-1], RIGHT[1][::-1])
    rigid_base = blocks(cells=[[8, 7, 6, 5]])  # the base is lines alone, which run the wrong way
    with pytest.raises(MisuseError, match=r"bodies on the same side: .*: --flip master turns that one"):
        read(rigid_base)
    assert points_of(read(rigid_base, flip="master")) == RIGHT
    with pytest.raises(MisuseError, match="--flip: found both, and cells beside all lines of the slave; needed a side"):
        read_interface(PUNCH, slave="punch", master="base", flip="both")


def test_gmsh_turns_the_lines_of_a_negative_curve(tmp_path: Path) -> None:
    text = PUNCH.read_text()
    assert "8 3 4 0 7 4 0 1 -1 2 8 -5" in text  # curve 8 is in group 1 against its direction
    start, end = text.index("$Elements"), text.index("$EndElements")
    lines_only = text[start:end].splitlines()[2:20]  # the blocks of the two groups, 11 and 5 lines
    (tmp_path / "lines.msh").write_text("\n".join([text[:start] + "$Elements", "2 16 1 16", *lines_only, text[end:]]))
    interface = read_interface(tmp_path / "lines.msh", slave="punch", master="base")
    assert points_of(interface) == points_of(read_interface(PUNCH, slave="punch", master="base"))


ABAQUS = """*NODE
1, 0, 1\n2, 2, 1\n3, 4, 1\n4, 1, 1\n5, 3, 1\n6, 1, 2\n7, 3, 2\n8, 0, 0\n9, 4, 0
*ELEMENT, TYPE=T2D2
1, 1, 2\n2, 2, 3\n3, 4, 5
*ELEMENT, TYPE=CPS4R
4, 4, 5, 7, 6
*ELEMENT, TYPE=CPS3
5, 8, 2, 1\n6, 8, 9, 2\n7, 9, 3, 2
*ELSET, ELSET=Base\n1, 2
*ELSET, ELSET=Punch\n3, 4
"""


def test_abaqus_sets_may_hold_cells_beside_the_lines(tmp_path: Path) -> None:
    (tmp_path / "mesh.inp").write_text(ABAQUS)
    interface = read_interface(tmp_path / "mesh.inp", slave="Punch", master="Base")
    assert points_of(interface) == ([[1, 1], [3, 1]], [[4, 1], [2, 1], [0, 1]])
    assert points_of(read_interface(tmp_path / "mesh.inp", slave="PUNCH", master="base")) == points_of(interface)
    with pytest.raises(MisuseError, match=r"--slave: found 'punsh', which is no group of the file; needed 'Punch'\?"):
        read_interface(tmp_path / "mesh.inp", slave="punsh", master="Base")


def test_second_order_cells_tell_the_side_by_their_corners(read: Callable[..., Interface]) -> None:
    points = [*POINTS, [2, 1.5], [2, 2], [1, 2]]
    mesh = blocks(points=points, lower=[[2, 3], [3, 4]], upper=[[6, 5]])
    mesh.cells.append(meshlane.CellBlock("triangle6", np.array([[5, 6, 8, 9, 10, 11]])))
    mesh.cell_data = {key: [*value, np.array([9])] for key, value in mesh.cell_data.items()}
    assert points_of(read(mesh)) == RIGHT


def test_closed_chains_need_no_facing(read: Callable[..., Interface]) -> None:
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    points = np.vstack([square, 2 * square])
    inner, outer = [[0, 1], [1, 2], [3, 2], [3, 0]], [[5, 4], [6, 5], [7, 6], [4, 7]]
    interface = read(blocks(points=points, upper=inner, lower=outer))
    assert (interface.slave.neighbours >= 0).all()
    assert interface.slave.segments.tolist() == [[0, 1], [1, 2], [2, 3], [3, 0]]
    assert interface.master.segments.tolist() == [[5, 4], [6, 5], [7, 6], [4, 7]]


def with_z(z: float) -> list[list[float]]:
    return [[x, y, z if (x, y) == (4, 1) else 3.0] for x, y in POINTS]


def test_a_plane_may_be_a_little_rough(read: Callable[..., Interface]) -> None:
    assert points_of(read(blocks(points=with_z(3 + 1e-12), lower=[[2, 3], [3, 4]]))) == RIGHT


NAN = [[0, 0], [4, 0], [4, 1], [np.nan, 1], *POINTS[4:]]
TWIN = [*POINTS[:5], [1, 1.5], [3, 1.5], [3, 1.5], [2, 1.5]]
SPLIT = [*POINTS[:4], [0, 1], [1, 1.5], [3, 1.5], [2, 1], [1, 2.5]]
BETWEEN = blocks(points=[*POINTS, [2, 3], [2, 0]], upper=[[3, 4]], lower=[[5, 6]], cells=[[0, 1, 3, 4], [4, 3, 7, 8]])
BOTH_SIDES = r"--slave: found a line with cells on both sides, at \(2, 1\); needed lines on the boundary"
CHANGES = r"--master: found a chain that changes the side of its body, at \("
WRONG = {
    "line3": (blocks(upper=[[5, 6, 7]], lower=[[4, 2, 3]], line="line3"), "--slave: found 'punch' with elements line3"),
    "z": (blocks(points=with_z(1.0)), "--mesh: found lines of a mesh of 4 × 0.5 × 2; needed lines in a plane"),
    "nan": (blocks(points=NAN), "--mesh: found NaN or infinity among its coordinates"),
    "shared": (blocks(upper=[[3, 6]]), r"--master: found a node of the slave surface too, at \(2, 1\)"),
    "branch": (blocks(lower=[[4, 3], [3, 2], [3, 0]]), r"--master: found 3 lines that meet at \(2, 1\); needed chains"),
    "twice": (blocks(lower=[[4, 3], [3, 4]]), "--master: found the same line twice"),
    "point": (blocks(lower=[[4, 4]]), "--master: found segment 0 that begins and ends"),
    "zero": (blocks(points=TWIN, upper=[[6, 7]]), "--slave: found segment 0 of zero length"),
    "split": (blocks(points=SPLIT, lower=[[4, 3], [7, 2]]), r"--master: found coincident nodes .* at \(2.0, 1.0\)"),
    "between": (BETWEEN, BOTH_SIDES),
    "sides": (blocks(lower=[[4, 3], [3, 2]], cells=[[0, 1, 3, 4], [3, 2, 7, 8]]), CHANGES),
}


@pytest.mark.parametrize(("mesh", "message"), WRONG.values(), ids=WRONG)
def test_wrong_meshes(mesh: meshlane.Mesh, message: str, read: Callable[..., Interface]) -> None:
    with pytest.raises(MisuseError, match=message):
        read(mesh)


UNKNOWN = "which is no group of the file; needed"


@pytest.mark.parametrize(
    ("slave", "master", "message"),
    [
        ("pnch", "base", rf"--slave: found 'pnch', {UNKNOWN} 'punch'\? The groups are .*'base'"),
        ("zzz", "base", rf"--slave: found 'zzz', {UNKNOWN} one of '1' \(line\), "),
        ("punch", "base body", "--master: found 'base body' with elements quad; needed a group of lines of two nodes"),
        ("punch", "punch", "--master: found 'punch', which is the slave too"),
        ("punch", "1", "--master: found '1', which is the slave too"),
    ],
)
def test_wrong_groups(slave: str, master: str, message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        read_interface(PUNCH, slave=slave, master=master)


def test_a_file_without_groups(tmp_path: Path) -> None:
    mesh = blocks()
    mesh.cell_data, mesh.field_data = {}, {}
    meshlane.write(tmp_path / "mesh.vtk", mesh)
    with pytest.raises(MisuseError, match=f"--slave: found 'punch', {UNKNOWN} a group of line or vertex"):
        read_interface(tmp_path / "mesh.vtk", slave="punch", master="base")


@pytest.mark.parametrize("name", ["mesh.msh", "mesh.vtk", "mesh.inp", "mesh.unheard-of", "mesh"])
@pytest.mark.parametrize("text", ["", "junk\n", "$MeshFormat\n4.1 0 8\n", PUNCH.read_text()[:900]])
def test_unreadable_files(name: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(MisuseError, match="--mesh: found "):
        read_interface(tmp_path / name, slave="punch", master="base")
    assert capsys.readouterr() == ("", "")  # meshlane prints; the message is ours to print


def test_no_such_file(tmp_path: Path) -> None:
    for path, words in ((tmp_path / "none.msh", "which does not exist"), (tmp_path, "which is a folder")):
        with pytest.raises(MisuseError, match=f"--mesh: found .*, {words}; needed a mesh file"):
            read_interface(path, slave="punch", master="base")


def test_facing_is_asked_of_the_whole_surface() -> None:
    roof = [[0, 2], [1, 1], [2, 2]]  # one of its normals alone is square to the base's
    check_facing(Interface.from_chains(roof, [[2, 0], [0, 0]]))
    for wrong in ([[0, 0], [2, 0]], [[3, 0], [3, 2]]):
        with pytest.raises(MisuseError, match="bodies on the same side"):
            check_facing(Interface.from_chains(roof, wrong))


# Files as they come from elsewhere. The base is at y = 0, the punch at y = 0.05 above it; both are 1 wide.
def two_squares(*, base: int = 3, punch: int = 6, axes: str = "xy") -> meshlane.Mesh:
    """Return a square of two cells under one of a cell; `base` and `punch` are the first nodes of the groups."""
    corners = [[0, -1], [0.5, -1], [1, -1], [0, 0], [0.5, 0], [1, 0], [0.1, 0.05], [0.9, 0.05], [0.1, 1], [0.9, 1]]
    points = np.zeros((10, 3))
    points[:, ["xyz".index(axis) for axis in axes]] = corners
    lower = [[0, 1], [1, 2]] if base == 0 else [[3, 4], [4, 5]]
    upper = [[8, 9]] if punch == 8 else [[6, 7]]
    parts = [
        ("line", np.array(upper)),
        ("line", np.array(lower)),
        ("quad", np.array([[0, 1, 4, 3], [1, 2, 5, 4], [6, 7, 9, 8]])),
    ]
    tags = [np.full(len(data), number) for number, (_, data) in enumerate(parts, 1)]
    names = {"punch": np.array([1, 1]), "base": np.array([2, 1])}
    return meshlane.Mesh(points, parts, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags}, field_data=names)


SIDES = ([[0.1, 0.05], [0.9, 0.05]], [[1, 0], [0.5, 0], [0, 0]])


@pytest.mark.parametrize("axes", ["xy", "xz", "yz"])
def test_a_mesh_may_lie_in_any_plane_of_two_axes(axes: str, read: Callable[..., Interface], capfd: Capture) -> None:
    assert points_of(read(two_squares(axes=axes))) == SIDES
    words = f"the mesh lies in a plane of its {axes[0]} and {axes[1]}, which are x and y here\n"
    assert capfd.readouterr().err == ("" if axes == "xy" else words)


def test_surfaces_that_turn_their_backs_to_each_other(read: Callable[..., Interface], capfd: Capture) -> None:
    backs = r"--mesh: found the slave at \(0.5, 1\) and the master at \(0.5, -1\), with both bodies between"
    with pytest.raises(MisuseError, match=backs):
        read(two_squares(base=0, punch=8))
    deep = two_squares()
    deep.points[6:8, 1] = -0.9  # A shrink fit: 0.9 of the base is in the punch.
    assert points_of(read(deep))[0] == [[0.1, -0.9], [0.9, -0.9]]
    lines_only = two_squares(base=0, punch=8)
    lines_only.cells[:] = lines_only.cells[:2]
    lines_only.cells[0].data[:] = [[9, 8]]
    lines_only.cell_data = {key: parts[:2] for key, parts in lines_only.cell_data.items()}
    read(lines_only)
    assert "turn their backs to each other, or overlap by more than a line's length" in capfd.readouterr().err


def test_faces_that_turn_their_backs_to_each_other(tmp_path: Path) -> None:
    cube = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    points = np.vstack([cube, cube * [0.5, 0.5, 1] + [0.25, 0.25, 1.1]])
    solids = np.array([[0, 1, 3, 2, 4, 5, 7, 6]]) + [[0], [8]]
    faces = {"inner": ([[8, 10, 11, 9]], [[4, 5, 7, 6]]), "outer": ([[12, 13, 15, 14]], [[0, 2, 3, 1]])}
    for name, (upper, lower) in faces.items():
        parts = [("quad", np.array(upper)), ("quad", np.array(lower)), ("hexahedron", solids)]
        mesh = meshlane.Mesh(
            points, parts, cell_data={"role": [np.full(len(data), k) for k, (_, data) in enumerate(parts)]}
        )
        mesh.write(tmp_path / f"{name}.vtu")
    groups = {"slave": "role=0", "master": "role=1"}
    assert len(read_interface(tmp_path / "inner.vtu", **groups).slave) == 1
    with pytest.raises(
        MisuseError, match=r"--mesh: found the slave at \(0.5, 0.5, 2.1\) and the master at \(0.5, 0.5, 0\)"
    ):
        read_interface(tmp_path / "outer.vtu", **groups)


def test_a_set_of_nodes_is_the_boundary_between_them(tmp_path: Path) -> None:
    mesh = two_squares()
    mesh.cells[:], mesh.cell_data = mesh.cells[2:], {}
    mesh.point_sets = {"punch": np.array([6, 7]), "base": np.array([3, 4, 5, 1]), "single": np.array([0])}
    mesh.write(tmp_path / "mesh.inp")
    assert points_of(read_interface(tmp_path / "mesh.inp", slave="punch", master="base")) == SIDES
    with pytest.raises(MisuseError, match="--slave: found 'single', a set of 1 nodes without an edge or a face"):
        read_interface(tmp_path / "mesh.inp", slave="single", master="base")


@pytest.mark.parametrize("head", [b"\xef\xbb\xbf", b" \n", b"\x1f\x8b"], ids=["mark", "blank", "gzip"])
def test_what_stands_before_a_file(head: bytes, tmp_path: Path) -> None:
    data, name = PUNCH.read_bytes(), "a.msh" + ".gz" * (head == b"\x1f\x8b")
    (tmp_path / name).write_bytes(gzip.compress(data) if name.endswith("gz") else head + data)
    assert len(read_interface(tmp_path / name, slave="punch", master="base").slave) == 5


def test_two_files_of_a_surface_each(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    for name, z, nodes in (("base", 0.0, [0, 1, 2]), ("punch", 0.1, [0, 2, 1])):
        meshlane.Mesh(points + [0, 0, z], [("triangle", np.array([nodes]))]).write(tmp_path / f"{name}.stl")
    slave, master = str(tmp_path / "punch.stl"), str(tmp_path / "base.stl")
    interface = read_interface(None, slave=slave, master=master)
    assert interface.nodes[:, 2].tolist() == [0.1, 0.1, 0.1, 0, 0, 0]


def test_a_hole_in_a_chain_is_said(read: Callable[..., Interface], capfd: Capture) -> None:
    read(blocks(points=[*POINTS, [1.5, 1]], lower=[[2, 3], [9, 4]]))
    assert capfd.readouterr().err.startswith("--master is several chains: no line from (2, 1) to (1.5, 1)\n")
