"""Stiffness, condensation and stresses against scikit-fem's own assembly, plain numpy and exact fields."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from math import cos, sin
from typing import Any

import numpy as np
import pytest
import skfem
from pressed_blocks import LEANING, in_triangles
from scipy.linalg import block_diag
from skfem.models.elasticity import lame_parameters, linear_elasticity

from contactverif import Body, MisuseError, Placing, Rectangle, Scene, block, body_from_mesh, rigid_surface
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.mechanics import bulk
from contactverif.mechanics.bulk import assemble_stiffness, condense, loose_modes
from contactverif.problems.blocks import exact_unknowns, two_blocks


def distort(body: Body, seed: int = 0) -> Body:
    """Return the block with its inner nodes moved, and random nodal forces and imposed displacements."""
    random = np.random.default_rng(seed)
    inside = np.ones(len(body.nodes), bool)
    inside[np.unique(boundary_edges(body))] = False
    nodes = body.nodes + 0.15 * random.uniform(-1, 1, body.nodes.shape) * inside[:, None]
    imposed = np.where(body.fixed, random.normal(size=body.fixed.shape), 0.0)
    return replace(body, nodes=nodes, imposed=imposed, load=random.normal(size=body.fixed.shape))


def boundary_edges(body: Body) -> FloatArray:
    """Return the edges (n, 2) that one cell alone has."""
    edges = np.sort(np.stack([body.cells, np.roll(body.cells, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    every, counts = np.unique(edges, axis=0, return_counts=True)
    return every[counts == 1]


def a_block(**more: Any) -> Body:
    """Return a block of nine cells; options are those of `Rectangle`, `Placing` and `block`."""
    options = {"contact": "bottom", "young": 3.0, "poisson": 0.3, "approach": 0.1} | more
    material = {name: options.pop(name) for name in ("young", "poisson")}
    placing = Placing(**{name: options.pop(name) for name in ("axis", "shift") if name in options})
    return block(Rectangle([0, 1, 2.5, 4], [0, 1, 2, 3.5], **material), placing=placing, **options)


BODIES = {
    "rectangles": a_block(),
    "quadrilaterals": distort(a_block()),
    "triangles": in_triangles(distort(a_block())),
    "rotated": distort(a_block(axis=LEANING, shift=(1, -2))),
    "rotated triangles": in_triangles(distort(a_block(axis=LEANING))),
    "top": distort(a_block(contact="top")),
    "free sides": distort(a_block(approach=None, pressure=2.0, free_sides=True)),
    "nearly incompressible": distort(a_block(poisson=0.499)),
    "auxetic": distort(a_block(poisson=-0.9)),
}
every_body = pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)


def by_skfem(body: Body) -> FloatArray:
    """Return K (2 n_nodes, 2 n_nodes) in the body's axes, assembled form by form; unknown 2 × node + component."""
    triangles = body.cells.shape[1] == 3
    kind, element = (skfem.MeshTri, skfem.ElementTriP1()) if triangles else (skfem.MeshQuad, skfem.ElementQuad1())
    mesh = kind(np.ascontiguousarray(body.nodes.T), np.ascontiguousarray(body.cells.T))
    basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=2)
    matrix = linear_elasticity(*lame_parameters(body.young, body.poisson)).assemble(basis).toarray()
    order = basis.nodal_dofs.T.reshape(-1)
    turn = np.kron(np.eye(len(body.nodes)), body.frame)  # from the body's axes to the global ones
    in_body_axes: FloatArray = turn.T @ matrix[np.ix_(order, order)] @ turn
    return in_body_axes


def size_over_cell(body: Body) -> float:
    """Return X over the shortest edge of a cell: what a relative error of a coordinate becomes in a gradient."""
    corners = body.nodes[body.cells]
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)
    return float(np.abs(body.nodes).max() / edges.min())


@every_body
def test_the_stiffness_is_that_of_skfem(body: Body) -> None:
    matrix = dense(assemble_stiffness(body)[0])
    expected = by_skfem(body)
    # differences of coordinates lose X/h
    assert np.abs(matrix - expected).max() <= 4 * UNIT_ROUNDOFF * size_over_cell(body) * expected.max()


def parts(body: Body) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the numbers of the unknowns that are free on the contact boundary, free elsewhere, and fixed."""
    kind = np.where(np.isin(np.arange(len(body.nodes)), body.contact)[:, None], 0, 1) * np.ones((1, 2), int)
    kind = np.where(body.fixed, 2, kind).reshape(-1)
    unknowns, interior, fixed = (np.flatnonzero(kind == number) for number in range(3))
    return unknowns, interior, fixed


@every_body
def test_the_condensed_stiffness_is_the_schur_complement(body: Body) -> None:
    unknowns, interior, _ = parts(body)
    matrix = by_skfem(body)
    inside = matrix[np.ix_(interior, interior)]
    across = matrix[np.ix_(interior, unknowns)]
    expected = matrix[np.ix_(unknowns, unknowns)] - across.T @ np.linalg.solve(inside, across)
    condensed = condense(body)
    assert condensed.unknowns.tolist() == unknowns.tolist()
    assert np.array_equal(condensed.stiffness, condensed.stiffness.T)
    bound = UNIT_ROUNDOFF * size_over_cell(body) * np.linalg.cond(inside) * np.abs(matrix).max()
    assert np.abs(condensed.stiffness - expected).max() <= bound


@every_body
@pytest.mark.parametrize("factor", [1.0, 0.25])
def test_condensed_and_recovered_is_the_full_solution(body: Body, factor: float) -> None:
    unknowns, interior, fixed = parts(body)
    body = replace(body, imposed=np.where(body.fixed, np.arange(body.fixed.size).reshape(-1, 2) / 7, 0.0))
    matrix, u = by_skfem(body), factor * body.imposed.reshape(-1)
    pushed = np.random.default_rng(1).normal(size=len(unknowns))  # Forces of somebody else on the contact boundary.
    right = factor * body.load.reshape(-1) - matrix @ u
    right[unknowns] += pushed
    free = np.sort(np.concatenate([unknowns, interior]))
    inside = matrix[np.ix_(free, free)]
    # free sides hang on one component alone: springs at the contact boundary hold the body, in both ways of solving
    springs = np.zeros(len(u))
    springs[unknowns] = body.young
    u[free] = np.linalg.solve(inside + np.diag(springs[free]), right[free])
    assert np.array_equal(u[fixed], factor * body.imposed.reshape(-1)[fixed])

    condensed = condense(body)
    q = np.linalg.solve(condensed.stiffness + body.young * np.eye(len(unknowns)), factor * condensed.load + pushed)
    bound = UNIT_ROUNDOFF * size_over_cell(body) * np.linalg.cond(inside + np.diag(springs[free]))
    assert np.abs(q - u[unknowns]).max() <= bound * np.abs(u).max()
    recovered = condensed.displacements(q, factor)
    assert np.abs(recovered - u.reshape(-1, 2) @ body.frame.T).max() <= bound * np.abs(u).max()


@every_body
def test_dense_and_sparse_agree(body: Body, monkeypatch: pytest.MonkeyPatch) -> None:
    dense = condense(body)
    monkeypatch.setattr(bulk, "DENSE_LIMIT", 0)
    bulk.forget_condensed()
    again = condense(replace(body))
    inside = by_skfem(body)[np.ix_(parts(body)[1], parts(body)[1])]
    bound = 2 * UNIT_ROUNDOFF * np.linalg.cond(inside)
    assert isinstance(again.stiffness, np.ndarray)
    assert np.abs(dense.stiffness - again.stiffness).max() <= bound * np.abs(inside).max()
    assert np.abs(dense.load - again.load).max() <= bound * np.abs(inside).max() * np.abs(body.imposed).max()
    q = np.arange(len(dense.unknowns)) / 3
    moved = dense.displacements(q)
    assert np.abs(moved - again.displacements(q)).max() <= bound * np.abs(moved).max()


def test_a_body_is_condensed_once() -> None:
    body, twin = a_block(), a_block()
    assert condense(body) is condense(body)
    assert condense(body) is not condense(twin)
    stiffer, floor = a_block(young=30.0), rigid_surface([[5, 0], [-1, 0]])
    assert np.abs(condense(stiffer).stiffness).max() > 9 * np.abs(condense(body).stiffness).max()
    scenes = [Scene((body, floor), penalty=penalty) for penalty in (1.0, 2.0)]
    assert scenes[0].condensed_bodies[0] is scenes[1].condensed_bodies[0] is condense(body)


def test_bodies_without_unknowns_or_without_an_inside() -> None:
    floor = condense(rigid_surface([[4, 0], [1, 0], [0, 0]], displacement=(0.5, 0.25), axis=(0, 1)))
    assert floor.stiffness.shape == (0, 0)
    assert floor.displacements(np.zeros(0), 0.5).tolist() == [[-0.125, 0.25]] * 3
    assert floor.stresses(np.zeros(0)).shape == (0, 1, 3)
    # one cell: the sides and the top are held
    fixed_body = block(Rectangle([0, 1], [0, 1]), contact="bottom", approach=0.0)
    layer = condense(fixed_body)
    assert layer.unknowns.tolist() == [1, 3]
    expected = by_skfem(fixed_body)[np.ix_([1, 3], [1, 3])]
    assert np.abs(layer.stiffness - expected).max() <= 4 * UNIT_ROUNDOFF * expected.max()


# --- stresses ---------------------------------------------------------------------------------------------------


@every_body
def test_stresses_of_a_linear_field(body: Body) -> None:
    """All nodes moved as u = A x: the stress is C : sym A, whatever the cells."""
    gradient = np.array([[0.3, -0.7], [0.2, 0.5]])
    u = body.nodes @ gradient.T
    fixed_body = replace(body, fixed=np.ones(body.fixed.shape, bool), imposed=u @ body.frame)
    strain = (gradient + gradient.T) / 2
    lame, shear = lame_parameters(body.young, body.poisson)
    stress = body.frame.T @ (lame * np.trace(strain) * np.eye(2) + 2 * shear * strain) @ body.frame
    stresses = condense(fixed_body).stresses(np.zeros(0))
    assert (len(stresses), stresses.shape[2]) == (len(body.cells), 3)
    bound = 4 * UNIT_ROUNDOFF * size_over_cell(body) * body.oedometric_modulus
    assert np.abs(stresses - [stress[0, 0], stress[1, 1], stress[0, 1]]).max() <= bound
    assert np.abs(condense(fixed_body).stresses(np.zeros(0), 0.5) - stresses / 2).max() <= bound


@pytest.mark.parametrize("axis", [(1.0, 0.0), LEANING, (0.0, -1.0)], ids=["upright", "leaning", "hanging"])
@pytest.mark.parametrize("cells", ["quadrilaterals", "triangles"])
def test_stresses_of_a_uniform_pressure(axis: tuple[float, float], cells: str) -> None:
    """Between rollers σ_nn = −p and σ_tt = −p ν/(1−ν), recovered from the contact boundary alone."""
    p, penalty, poisson = 0.5, 10.0, (0.3, 0.2)
    scene = two_blocks(
        Rectangle([0, 1, 2.5, 4], [0, 1, 2, 3.5], young=1.0, poisson=poisson[0]),
        Rectangle([0, 2, 3, 4], [-3, -1, 0], young=3.0, poisson=poisson[1]),
        penalty=penalty,
        pressure=p,
        placing=Placing(axis, (1.0, -2.0)),
    )
    if cells == "triangles":
        scene = replace(scene, bodies=tuple(map(in_triangles, scene.bodies)))
    recovered = scene.stresses(exact_unknowns(scene, p, penalty))
    for body, stresses, nu in zip(scene.bodies, recovered, poisson, strict=True):
        interior = parts(body)[1]
        inside = by_skfem(body)[np.ix_(interior, interior)]
        bound = UNIT_ROUNDOFF * size_over_cell(body) * np.linalg.cond(inside) * p
        assert np.abs(stresses - [-p * nu / (1 - nu), -p, 0]).max() <= bound


# --- bodies that hang on nothing --------------------------------------------------------------------------------


def with_a_loose_part(seed: int) -> Body:
    """Return the block, and a second one that nobody holds, somewhere else."""
    random = np.random.default_rng(seed)
    body, n = a_block(poisson=float(random.uniform(0, 0.45))), int(random.integers(2, 5))
    other = block(Rectangle(np.arange(n) * random.uniform(0.3, 3), np.arange(3.0)), contact="top", approach=0.0)
    none = np.zeros(other.nodes.shape, bool)
    arrays = {name: np.vstack([getattr(body, name), none]) for name in ("fixed", "imposed", "load")}
    nodes = np.vstack([body.nodes, other.nodes + random.uniform(5, 9, 2)])
    cells = np.vstack([body.cells, other.cells + len(body.nodes)])
    return replace(body, nodes=nodes, cells=cells, name="punch", **arrays)


@pytest.mark.parametrize("dense", [bulk.DENSE_LIMIT, 0], ids=["dense", "sparse"])
def test_a_loose_part_is_found_whatever_roundoff_makes_of_it(dense: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bulk, "DENSE_LIMIT", dense)
    for seed in range(40):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # nobody may rely on scipy's warnings
            with pytest.raises(MisuseError) as error:
                condense(with_a_loose_part(seed))
        assert str(error.value) == (
            "punch: cells: found a part that hangs neither on a support nor on the contact boundary; "
            "needed one connected mesh, or supports for each part"
        )


@pytest.mark.parametrize("dense", [2000, 0], ids=["dense", "sparse"])
def test_a_long_thin_bar_is_not_loose(dense: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bulk, "DENSE_LIMIT", dense)
    bar = block(Rectangle([0, 1], np.arange(400.0)), contact="bottom", free_sides=True, pressure=1.0)
    condensed = condense(replace(bar, fixed=np.zeros_like(bar.fixed)))
    # the contact boundary alone carries the load on top, whose resultant is 1
    assert abs(condensed.load[1::2].sum() + 1) <= UNIT_ROUNDOFF * 400.0**4  # cond of a bar: (length / thickness)^4


def test_what_is_loose_is_said() -> None:
    flat = block(Rectangle([0, 1, 2], [0, 1]), contact="bottom", pressure=1.0, name="punch")
    bent = replace(flat, nodes=np.where(np.arange(6)[:, None] == 1, (1.0, -0.25), flat.nodes))
    none = np.zeros_like(flat.fixed)
    single_support = none.copy()
    single_support[4, 0] = True
    up = none.copy()
    up[:, 1] = True
    assert loose_modes(flat) == []
    assert loose_modes(replace(flat, fixed=none)) == ["move along its first axis"]
    assert loose_modes(replace(flat, fixed=up)) == ["move along its first axis"]
    assert loose_modes(replace(flat, fixed=single_support)) == []  # contact holds the rest
    assert loose_modes(replace(bent, fixed=none)) == []  # a wedge cannot slide
    ring = np.array([[cos(angle), sin(angle)] for angle in np.arange(8) * np.pi / 4])
    numbers = np.arange(8)
    disc = Body(
        nodes=np.vstack([2 * ring, ring]),
        cells=np.column_stack([numbers, (numbers + 1) % 8, (numbers + 1) % 8 + 8, numbers + 8]),
        contact=np.column_stack([numbers, (numbers + 1) % 8]),
    )
    assert loose_modes(disc) == []  # an octagon in a hole cannot even turn
    assert loose_modes(replace(flat, fixed=none, axis=(0.0, 1.0))) == ["move along its second axis"]
    single = replace(flat, contact=flat.contact[:1], fixed=none)
    assert loose_modes(single) == ["move along its first axis"]


# --- bodies from a mesh -----------------------------------------------------------------------------------------

QUADS = skfem.MeshQuad.init_tensor(np.array([0, 1, 2.5]), np.array([0, 1, 1.75])).with_defaults()
WEDGE = skfem.MeshTri(
    np.array([[0.0, 4, 0, 2, 0, 2], [0, 0, 3, 0, 1.5, 1.5]]), np.array([[0, 3, 4, 4], [3, 1, 5, 3], [4, 5, 2, 5]])
).with_boundaries(
    {
        "base": lambda x: x[1] < 1e-9,
        "wall": lambda x: x[0] < 1e-9,
        "slope": lambda x: abs(x[0] / 4 + x[1] / 3 - 1) < 1e-9,
        "nothing": lambda x: x[0] > 99,
    }
)


def make_body(mesh: Any = QUADS, **more: Any) -> Body:
    options: Mapping[str, Any] = {"contact": "bottom", "supports": {"top": "both"}} | more
    return body_from_mesh(mesh, **options)


def edges_at(body: Body) -> list[list[list[float]]]:
    """Return the contact edges by the positions of their nodes, sorted."""
    return sorted(body.nodes[body.contact].tolist())


def test_a_body_from_quadrilaterals() -> None:
    body = make_body(
        supports={"top": "across", "left": "along", "right": "both"},
        displacements={"top": (0.0, -0.25)},
        pressures={"left": 2.0},
        young=3.0,
        poisson=0.25,
        name="punch",
    )
    assert (body.young, body.poisson, body.name) == (3, 0.25, "punch")
    assert edges_at(body) == [[[0, 0], [1, 0]], [[1, 0], [2.5, 0]]]
    x, y = body.nodes.T
    assert body.fixed[:, 0].tolist() == ((x == 0) | (x == 2.5)).tolist()
    assert body.fixed[:, 1].tolist() == ((y == 1.75) | (x == 2.5)).tolist()
    assert body.imposed[:, 1].tolist() == np.where((y == 1.75) & (x < 2.5), -0.25, 0).tolist()
    lengths = {0: 0.5, 1: 0.875, 1.75: 0.375}  # half of the edges beside a node
    assert body.load.tolist() == [[2 * lengths[b] if a == 0 else 0, 0] for a, b in body.nodes.tolist()]


def test_a_body_from_triangles() -> None:
    sides = np.diff(WEDGE.p.T[WEDGE.t.T], axis=1)
    assert {*np.sign(np.linalg.det(sides))} == {-1, 1}  # skfem sorts the nodes of a cell, whichever way it then runs
    body = make_body(WEDGE, contact="base", supports={"wall": "along"}, pressures={"slope": 2.0, "wall": 1.0})
    assert edges_at(body) == [[[0, 0], [2, 0]], [[2, 0], [4, 0]]]
    corners = body.nodes[body.cells]
    assert (np.linalg.det(np.diff(corners, axis=1)) > 0).all()
    # towards the body: 2 × (−3, −4) on the slope, whose normal is (3, 4)/5 and length 5; 3 × (1, 0) on the wall
    assert body.load.sum(axis=0).tolist() == [-6 + 3, -8]
    moment = body.nodes[:, 0] * body.load[:, 1] - body.nodes[:, 1] * body.load[:, 0]
    assert moment.sum() == 2 * -8 + 1.5 * 6 - 1.5 * 3  # each acts in the middle of its side


def test_clockwise_cells_are_turned() -> None:
    turned = QUADS.t.copy()
    turned[:, 1] = turned[::-1, 1]
    mixed = skfem.MeshQuad(QUADS.p, turned).with_defaults()
    assert (mixed.t[:, 1] != QUADS.t[:, 1]).any()
    difference = dense(assemble_stiffness(make_body(mixed))[0]) - dense(assemble_stiffness(make_body())[0])
    assert np.abs(difference).max() <= 4 * UNIT_ROUNDOFF * assemble_stiffness(make_body())[0].max()
    assert edges_at(make_body(mixed)) == edges_at(make_body())


EMPTY = QUADS.with_boundaries({"nothing": lambda x: x[0] > 99})
CUT = QUADS.with_boundaries({"cut": lambda x: x[0] == 1}, boundaries_only=False)
EXTRA = skfem.MeshQuad(np.column_stack([QUADS.p, [1, 1.2]]), QUADS.t, validate=False).with_defaults()
TAGS = "needed one of bottom, left, right, top"
FINITE = "found NaN or infinity; needed finite numbers"
ORDER = "needed a MeshTri or a MeshQuad of first order"
EDGES = "mesh: found no edges on boundary 'nothing'; needed a boundary that has some"
INSIDE = (
    "mesh: contact: found the edge from node 3 to node 4; needed edges of the boundary, each with the body on its left"
)
POISSON = "Poisson's ratio above −1 and below 0.5 (an incompressible body has no stiffness matrix in displacements)"
WRONG: list[tuple[dict[str, Any], str]] = [
    ({"contact": "botom"}, f"mesh: found no boundary 'botom'; {TAGS}"),
    ({"supports": {"tp": "both"}}, f"mesh: found no boundary 'tp'; {TAGS}"),
    ({"pressures": {"tp": 1.0}}, f"mesh: found no boundary 'tp'; {TAGS}"),
    (
        {"mesh": skfem.MeshQuad()},
        "mesh: found no boundary 'bottom'; needed a mesh with named boundaries (mesh.with_boundaries)",
    ),
    ({"supports": {"top": "all"}}, "supports['top']: found 'all'; needed 'along', 'across' or 'both'"),
    ({"supports": ["top"]}, "supports: found a list; needed {boundary: 'along', 'across' or 'both'}"),
    (
        {"displacements": {"left": (0, 1)}},
        "displacements['left']: found no supports there; needed a boundary that supports name",
    ),
    (
        {"supports": {"top": "across"}, "displacements": {"top": (1, 0)}},
        "displacements['top']: found a displacement of a free component; needed 0 where nothing is fixed",
    ),
    ({"displacements": {"top": (1,)}}, "displacements['top']: found (1,); needed two numbers, along and across"),
    ({"displacements": {"top": (np.nan, 0)}}, f"mesh: imposed: {FINITE}"),
    ({"pressures": {"top": np.nan}}, f"mesh: load: {FINITE}"),
    ({"pressures": {"top": "1"}}, "pressures['top']: found '1'; needed a number"),
    ({"mesh": EMPTY, "contact": "nothing"}, EDGES),
    ({"mesh": EMPTY, "supports": {"nothing": "both"}}, EDGES),
    ({"mesh": CUT, "contact": "cut"}, INSIDE),
    ({"mesh": skfem.MeshQuad2().with_defaults()}, f"mesh: found a MeshQuad2; {ORDER}"),
    ({"mesh": skfem.MeshTet()}, f"mesh: found a MeshTet1; {ORDER}"),
    ({"mesh": "punch.msh"}, f"mesh: found a str; {ORDER}"),
    ({"young": 0, "name": "punch"}, "punch: young: found 0; needed Young's modulus > 0"),
    ({"poisson": 0.5}, f"mesh: poisson: found 0.5; needed {POISSON}"),
    ({"mesh": QUADS.translated((np.nan, 0.0))}, f"mesh: nodes: {FINITE}"),
    ({"mesh": EXTRA}, "mesh: nodes: found node 9 in no cell; needed every node in a cell"),
]


@pytest.mark.parametrize(("options", "message"), WRONG)
def test_wrong_meshes_of_a_body(options: dict[str, Any], message: str) -> None:
    with pytest.raises(MisuseError) as error:
        make_body(**options)
    assert str(error.value) == message


def test_a_boundary_in_two_parts_that_nothing_couples_is_condensed_all_the_same() -> None:
    """Two separate meshes of one body: the order of elimination may not keep the boundary at its end."""
    mesh = block(Rectangle(np.linspace(0, 4, 25), np.linspace(0, 1, 16)), contact="top", approach=0.0)
    shift = len(mesh.nodes)
    arrays = {name: np.tile(getattr(mesh, name), (2, 1)) for name in ("fixed", "imposed", "load")}
    arrays |= {name: np.vstack([getattr(mesh, name), getattr(mesh, name) + shift]) for name in ("cells", "contact")}
    two = replace(mesh, nodes=np.vstack([mesh.nodes, mesh.nodes + [10.0, 0.0]]), **arrays)
    half, both = condense(mesh).stiffness, condense(two).stiffness
    np.testing.assert_allclose(both, block_diag(half, half), atol=1e-12 * np.abs(half).max())
