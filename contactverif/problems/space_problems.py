"""Bodies in space with exact answers: shells shrunk onto each other, an egg-box in full contact, and Hertz' contact.

Each body is a surface of faces, extruded into tetrahedra or hexahedra (`space_blocks`). Planes of symmetry are held.

Sources: Lamé's hollow sphere and the half-space of Boussinesq: Timoshenko & Goodier, Theory of Elasticity, 3rd ed.
(1970), Articles 136 and 138; waves and Hertz: K. L. Johnson, Contact Mechanics (1985), Chapters 3, 4 and 13.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product
from math import hypot, inf, pi, sinh
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.interface import QUADRILATERAL, SPACE, TRIANGLE, Interface
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import traction_forces
from contactverif.mechanics.changed_scenes import exchange_roles
from contactverif.mechanics.scene import Scene
from contactverif.problems.flat_states import collect_on_faces
from contactverif.problems.problem import Problem, ProblemInstance, Variation
from contactverif.problems.space_blocks import extrude, rectangle, space_blocks


@dataclass(frozen=True, slots=True)
class Shells:
    """An octant of two thick spherical shells, the outer one too small for the inner one. First entries are the inner.

    The nodes of both contact surfaces lie a little outside of their spheres, so that facets enclose the volume of the
    ball. With nodes on the sphere facets lie h²/8R inside, which is more than the interference.
    """

    inner_radius: float = 1.0
    radius: float = 1.5  # The outer one of the inner shell
    outer_radius: float = 2.5
    interference: float = 0.05  # By how much the inner radius of the outer shell is smaller
    young: tuple[float, float] = (1000.0, 300.0)
    poisson: tuple[float, float] = (0.3, 0.2)
    penalty: float = 100.0

    def traction(self, *, inner_slave: bool, traits: Traits) -> float:
        """Return the exact radial force on the slave for each unit of its area before the fit, T > 0.

        T = ε̂ (r_i − r_o) f with the radii after the fit, and f = (r/R)² of the slave if areas are current ones. A
        traction T moves a sphere by Lamé's compliance; the master has T (R_slave/R_master)².
        """
        radii = self.radius, self.radius - self.interference
        compliances = []
        for radius, free, young, ratio in zip(
            radii, (self.inner_radius, self.outer_radius), self.young, self.poisson, strict=True
        ):
            cube = (free / radius) ** 3
            compliances.append(radius / young * ((1 - 2 * ratio) + (1 + ratio) / 2 * cube) / abs(1 - cube))
        slave = int(not inner_slave)
        shares = [(radii[slave] / radius) ** 2 for radius in radii]
        penalty = inf if traits.rules.enforcement == "multiplier" else self.penalty

        def depth(traction: float) -> float:
            """Return ε̂⁻¹ T/f less r_i − r_o, which increases with T."""
            after = [
                radius + sign * give * share * traction
                for radius, sign, give, share in zip(radii, (-1, 1), compliances, shares, strict=True)
            ]
            area = 1.0 if traits.rules.area == "reference" else (after[slave] / radii[slave]) ** 2
            return traction / penalty / area - (after[0] - after[1])

        from scipy.optimize import brentq  # It takes long to import, and the first rows of a run do not need it.

        return float(brentq(depth, 0.0, 2 * self.interference / sum(compliances), xtol=1e-300, rtol=1e-14))

    def scene(self, *, inner_slave: bool, refine: int = 2, whole: bool = False) -> Scene:
        """Return an octant of both shells, 4r faces along an edge of the inner one on 3r, or whole ones."""
        return _shells(self, inner_slave, refine, whole)


@cache
def _shells(shells: Shells, inner_slave: bool, refine: int, whole: bool) -> Scene:
    bodies = []
    for outer, (n_edges, n_layers) in enumerate(((4 * refine, 3 * refine), (3 * refine, 4 * refine))):
        contact = shells.radius - outer * shells.interference
        points, faces = _sphere(n_edges) if whole else _octant(n_edges)
        volume = float((points[faces[:, 0]] * np.cross(points[faces[:, 1]], points[faces[:, 2]])).sum()) / 6
        volume /= 8 if whole else 1
        radii = np.linspace(contact, shells.outer_radius if outer else shells.inner_radius, n_layers + 1)
        radii[0] *= (pi / 6 / volume) ** (1 / 3)
        nodes = (radii[:, None, None] * points).reshape(-1, 3)
        faces = faces[:, ::-1] if outer else faces
        cells = extrude(faces, len(points), n_layers)
        name, material = ("inner", "outer")[outer], (shells.young[outer], shells.poisson[outer])
        bodies.append(Body(nodes, cells, faces, *material, fixed=nodes == 0, name=name))
    order = bodies if inner_slave else bodies[::-1]
    facts = {"inner_slave": np.array(float(inner_slave))}
    name = f"spheres, {'inner' if inner_slave else 'outer'} slave"
    return Scene(tuple(order), penalty=shells.penalty, facts=facts, name=name)


def _octant(n_edges: int) -> tuple[FloatArray, IntArray]:
    """Return points (n, 3) of the unit sphere's octant and triangles, counter-clockwise seen from outside."""
    number: dict[tuple[int, int], int] = {}
    steps: list[tuple[int, int, int]] = []
    for i, j in product(range(n_edges + 1), repeat=2):
        if i + j <= n_edges:
            number[i, j] = len(steps)
            steps.append((i, j, n_edges - i - j))
    points = np.sin(np.array(steps) / n_edges * pi / 2)
    corners = [((i, j), (i + 1, j), (i, j + 1)) for i, j in number] + [
        ((i + 1, j), (i + 1, j + 1), (i, j + 1)) for i, j in number
    ]
    faces = [[number[each] for each in face] for face in corners if all(each in number for each in face)]
    return points / np.linalg.norm(points, axis=1)[:, None], np.array(faces)


def _sphere(n_edges: int) -> tuple[FloatArray, IntArray]:
    """Return points and triangles of the whole unit sphere: eight mirror images of the octant."""
    octant, triangles = _octant(n_edges)
    signs = np.array([*product((1.0, -1.0), repeat=3)])
    everywhere = (signs[:, None] * octant + 0.0).reshape(-1, 3)
    points, number = np.unique(everywhere, axis=0, return_inverse=True)
    corners = number.reshape(8, -1)[:, triangles]  # (8, n_triangles, 3)
    return points, np.vstack([part[:, :: int(sign)] for part, sign in zip(corners, signs.prod(axis=1), strict=True)])


SHELLS = Shells()


def shell_cases() -> tuple[Case, ...]:
    """Return both shells, with either one as the slave."""
    return tuple(SHELLS.scene(inner_slave=inner_slave).case() for inner_slave in (True, False))


class EggMesh(NamedTuple):
    """The meshes of an egg-box: faces along both axes on the upper and on the lower block, times r."""

    name: str
    upper: tuple[int, int] = (4, 3)
    lower: tuple[int, int] = (3, 4)
    skew: float = 0.0  # By how much of a side nodes inside are moved, back and forth; where it is not 0 are no waves.


SKEWED, FINER = EggMesh(", skewed", skew=0.2), EggMesh(", 3 times finer", (3, 3), (9, 10), skew=0.2)
EGG_MESHES = EggMesh(""), SKEWED, FINER


@dataclass(frozen=True, slots=True)
class EggBox:
    """Two blocks on rollers, one with the surface h cos(πx/w) cos(πy/l), pressed together until all is in contact.

    First entries are the upper block, which has the waves. The mean pressure is 1.5 times the amplitude of its wave.
    """

    stiffness: float  # The penalty ε̂, force per area per length
    corners: int = QUADRILATERAL  # 4 for hexahedra, 3 for tetrahedra
    upper_slave: bool = True
    mesh: EggMesh = EGG_MESHES[0]
    load: float = 1.5  # The mean pressure over the amplitude
    sides: tuple[float, float] = (2.0, 1.5)  # w, l
    heights: tuple[float, float] = (1.5, 2.0)
    young: tuple[float, float] = (1000.0, 300.0)
    poisson: tuple[float, float] = (0.3, 0.2)
    wave: float = 1e-3  # h

    def amplitude(self, penalty: float) -> float:
        """Return the amplitude of the pressure, h/(C + C + 1/ε̂) with the compliance C of each block to the wave.

        With q² = (π/w)² + (π/l)² it is (1 − ν)/(Gq) 2 sinh² qH/(sinh 2qH + 2qH).
        """
        q, compliance = hypot(*(pi / side for side in self.sides)), 1 / penalty
        for height, young, ratio in zip(self.heights, self.young, self.poisson, strict=True):
            layer = 2 * sinh(q * height) ** 2 / (sinh(2 * q * height) + 2 * q * height)
            compliance += (1 - ratio) * 2 * (1 + ratio) / (young * q) * layer
        return self.wave / compliance

    def cosines(self, places: FloatArray) -> FloatArray:
        """Return cos(πx/w) cos(πy/l) (n,) at places (n, 3)."""
        x, y = places[:, 0], places[:, 1]
        return np.asarray(np.cos(pi * x / self.sides[0]) * np.cos(pi * y / self.sides[1]))

    def pose(self, refine: int, traits: Traits) -> ProblemInstance:
        """Return the problem on its mesh, refined by r."""
        penalty = inf if traits.rules.enforcement == "multiplier" else self.stiffness
        wave = self.amplitude(penalty)
        amplitude = 0.0 if self.mesh.skew else wave
        mean, scene = self.load * wave, _egg_box(self, refine, penalty)
        interface, upper = scene.interface, int(not self.upper_slave)

        def pressure(places: FloatArray) -> FloatArray:
            return mean + amplitude * self.cosines(places)

        def traction(sign: float, places: FloatArray) -> FloatArray:
            return sign * pressure(places)[:, None] * [0.0, 0.0, 1.0]

        def forces(positions: FloatArray) -> FloatArray:
            flat = positions * [1.0, 1.0, 0.0]
            sides = zip((interface.slave, interface.master), ((1.0, -1.0), (-1.0, 1.0))[upper], strict=True)
            return np.add(*(traction_forces(side, flat, partial(traction, sign)) for side, sign in sides))

        return ProblemInstance(
            scene=scene, forces=forces, pressure=pressure, pressure_scale=wave, deformed=False,
            step=(mean - amplitude) / self.stiffness / 16,
        )  # fmt: skip

    @classmethod
    def from_case(cls, case: Case) -> "EggBox":
        """Return the problem that a case stands for."""
        corners, mesh = case.interface.slave.faces.shape[1], EGG_MESHES[int(case.parameter("mesh"))]
        return cls(case.penalty, corners, bool(case.parameter("upper_slave")), mesh=mesh)


@cache
def _egg_box(box: EggBox, refine: int, penalty: float) -> Scene:
    grids = []
    for counts in (box.mesh.upper, box.mesh.lower):
        x, y = (np.linspace(0.0, side, n * refine + 1) for side, n in zip(box.sides, counts, strict=True))
        points, faces = rectangle(x, y, box.corners)
        i, j = np.indices((len(x), len(y))).reshape(2, -1)
        inside = np.all((points > 0) & (points < box.sides), axis=1, keepdims=True)
        signs = np.stack([(-1.0) ** (i + j), (-1.0) ** i], axis=1)
        grids.append((points + box.mesh.skew * signs * inside * [x[1], y[1]], faces))
    (slave, below), (master, above) = grids
    nodes = [np.column_stack([points, np.zeros(len(points))]) for points in (slave, master)]
    if not box.mesh.skew:
        nodes[0][:, 2] = -box.wave * box.cosines(nodes[0])
    interface = Interface.from_faces(nodes[0], below[:, ::-1], nodes[1], above)
    mean = box.load * box.amplitude(penalty)
    moduli = (e * (1 - v) / ((1 + v) * (1 - 2 * v)) for e, v in zip(box.young, box.poisson, strict=True))
    approach = mean * (1 / penalty + sum(h / m for h, m in zip(box.heights, moduli, strict=True)))
    corners = np.array([[0.0, 0.0], [box.sides[0], 0.0], box.sides, [0.0, box.sides[1]]])
    layers = tuple([height / (4 * refine)] * (4 * refine) for height in box.heights)
    scene = space_blocks(
        interface, np.vstack([slave, master]), corners, layers=(layers[0], layers[1]),
        materials=((box.young[0], box.poisson[0]), (box.young[1], box.poisson[1])), penalty=box.stiffness,
        approach=approach,
    )  # fmt: skip
    return scene if box.upper_slave else exchange_roles(scene)


@collect_on_faces
def egg_box_cases(corners: int) -> Iterator[Case]:
    """Return the coarsest mesh of each egg-box, either block as the slave: with waves, skewed, and finer below.

    Quadrilaterals have two penalties, and they alone are skewed at the same size.
    """
    choices = [(1e2, 0), (1e4, 0), (1e2, 1), (1e2, 2)] if corners == QUADRILATERAL else [(1e2, 0), (1e2, 2)]
    for (stiffness, mesh), upper in product(choices, (True, False)):
        facts = {"upper_slave": np.array(float(upper)), "mesh": np.array(float(mesh))}
        scene = EggBox(stiffness, corners, upper, EGG_MESHES[mesh]).pose(1, Traits()).scene
        name = f"{'upper' if upper else 'lower'} slave, ε̂ = {stiffness:g}{EGG_MESHES[mesh].name}"
        yield replace(scene, facts=facts, name=name).case()


@dataclass(frozen=True, slots=True)
class HertzPoint:
    """A rigid paraboloid pressed into a quarter of a box by a²/R; the far sides move as those of a half-space do."""

    radius: float = 100.0  # R of the paraboloid
    contact_radius: float = 1.0  # a
    young: float = 1.0
    poisson: float = 0.3
    side: float = 3.0  # Of the box
    stiffness: float = 10.0  # ε̂ h/E
    fine: float = 1.2  # The mesh is fine up to here, and becomes coarser beyond.
    ratio: float = 1.4  # Of neighbours there

    @property
    def peak(self) -> float:
        """The largest pressure p0 = 2 E' a/(π R) with E' = E/(1 − ν²)."""
        return 2 * self.young / (1 - self.poisson**2) * self.contact_radius / (pi * self.radius)

    def pressure(self, places: FloatArray) -> FloatArray:
        """Return Hertz' pressure p0 √(1 − ρ²/a²) (n,) at places (n, 3)."""
        share = (places[:, :2] ** 2).sum(axis=1) / self.contact_radius**2
        return np.asarray(self.peak * np.sqrt(np.maximum(0.0, 1 - share)))

    def displacements(self, places: FloatArray) -> FloatArray:
        """Return the displacements (n, 3) of a half-space z < 0 away from the contact: Boussinesq's, by quadrature."""
        points, weights = np.polynomial.legendre.leggauss(20)
        angle, turn = (points + 1) * pi / 4, np.linspace(0, 2 * pi, 40, endpoint=False)
        ring = self.contact_radius * np.sin(angle)
        sources = np.stack([np.outer(ring, np.cos(turn)).ravel(), np.outer(ring, np.sin(turn)).ravel()], axis=1)
        share = self.peak * np.cos(angle) * ring * weights * pi / 4 * self.contact_radius * np.cos(angle)
        loads = np.repeat(share * 2 * pi / len(turn), len(turn))
        arms, depth = places[:, None, :2] - sources, -places[:, 2:]
        far = np.sqrt((arms**2).sum(axis=-1) + depth**2)
        factor, ratio = (1 + self.poisson) / (2 * pi * self.young), self.poisson
        down = (factor * (2 * (1 - ratio) / far + depth**2 / far**3) * loads).sum(axis=1)
        outwards = factor * (depth / far**3 - (1 - 2 * ratio) / (far * (far + depth))) * loads
        return np.column_stack([(outwards[..., None] * arms).sum(axis=1), -down])

    def pose(self, cells: int, traits: Traits) -> ProblemInstance:
        """Return the problem with so many cells along the fine part; the flat box is the slave."""
        scene = _hertz_point(self, cells)
        interface, nodes = scene.interface, scene.interface.nodes

        def traction(sign: float, places: FloatArray) -> FloatArray:
            # The paraboloid reaches past the planes of symmetry, where the box ends.
            pressures = self.pressure(places) * (places[:, :2] >= 0).all(axis=1)
            return sign * pressures[:, None] * [0.0, 0.0, 1.0]

        def forces(_: FloatArray) -> FloatArray:
            sides = (interface.slave, -1.0), (interface.master, 1.0)
            return np.add(*(traction_forces(side, nodes, partial(traction, sign), parts=16) for side, sign in sides))

        return ProblemInstance(
            scene=scene, forces=forces, pressure=self.pressure, pressure_scale=self.peak, deformed=False
        )


@cache
def _hertz_point(point: HertzPoint, cells: int) -> Scene:
    size, side, ratio = point.fine / cells, point.side, point.ratio
    lines, depths, step = [*np.linspace(0.0, point.fine, cells + 1)], [0.0], size * ratio
    while lines[-1] < side:
        lines.append(lines[-1] + step)
        step *= ratio
    along = np.array(lines)
    along[cells + 1 :] = point.fine + (along[cells + 1 :] - point.fine) * (side - point.fine) / (along[-1] - point.fine)
    step = size
    while depths[-1] < side:
        depths.append(depths[-1] + step)
        step *= ratio
    depth = np.array(depths) * side / depths[-1]
    flat, faces = rectangle(along, along, TRIANGLE)
    nodes = np.column_stack([np.tile(flat, (len(depth), 1)), np.repeat(-depth, len(flat))])
    far = (nodes[:, 0] == side) | (nodes[:, 1] == side) | (nodes[:, 2] == -side)
    fixed, imposed = far[:, None] | (nodes == 0) & [True, True, False], np.zeros(nodes.shape)
    imposed[far] = np.where(nodes[far] * [1, 1, 0] + [0, 0, 1] == 0, 0.0, point.displacements(nodes[far]))
    contact = faces[(flat[faces] <= point.fine).all(axis=(1, 2))]
    box = Body(
        nodes, extrude(faces, len(flat), len(depth) - 1), contact, point.young, point.poisson,
        fixed=fixed, imposed=imposed, name="box",
    )  # fmt: skip
    n_master = int(cells * 5 / 3) + 1
    across = np.linspace(-0.15, 1.45, n_master + 1)
    places, below = rectangle(across, across, TRIANGLE)
    heights = (places**2).sum(axis=1) / (2 * point.radius) - point.contact_radius**2 / point.radius
    points = np.column_stack([places, heights])
    rigid = Body(
        points, np.zeros((0, 8), np.int64), below[:, ::-1], fixed=np.ones(points.shape, bool), name="paraboloid"
    )
    penalty = point.stiffness * point.young / size
    return Scene((box, rigid), penalty=penalty, name="Hertz' contact on a point")


HERTZ_POINT, HERTZ_CELLS = HertzPoint(), 5


def hertz_point_cases() -> tuple[Case, ...]:
    """Return the paraboloid on the box."""
    return (HERTZ_POINT.pose(HERTZ_CELLS, Traits()).scene.case(),)


def _pose_egg_box(refine: int, stiffness: float, traits: Traits, variation: Variation) -> ProblemInstance:
    box = EggBox(0.0)
    penalty = stiffness * min(box.young) * 4 * refine / box.sides[0]
    return EggBox(penalty, TRIANGLE, not variation.swapped, load=1.5 * variation.load).pose(refine, traits)


def _pose_hertz_point(cells: int, stiffness: float, traits: Traits, variation: Variation) -> ProblemInstance:
    radius = HERTZ_POINT.radius / variation.load
    return replace(HERTZ_POINT, stiffness=stiffness, radius=radius).pose(cells, traits)


EGG_BOX = Problem(
    label="an egg-box in space, in full contact",
    meshes=(1, 2, 3),
    targets=(2e-1, 1e-1, 5e-2),
    pose=_pose_egg_box,
    rank=5,
    dim=SPACE,
)
HERTZ_IN_SPACE = Problem(
    label="Hertz' contact on a point",
    meshes=(3, 5, 7),
    targets=(2e-1, 1e-1, 5e-2),
    pose=_pose_hertz_point,
    rank=6,
    dim=SPACE,
)
