"""Two elastic blocks whose interface is a broken line, under the same pressure from all sides.

With equal materials the stress is hydrostatic and uniform, whatever the shape of the interface, and every facet of the
interface bears the same pressure. That makes the scene a patch test of kinked surfaces. Springs give way by p/ε̂ along
the normal of each facet. With two different normals a translation of one block does that, so that the uniform state is
exact for any penalty. With three or more it is the limit for ε̂ → ∞.

Rule for the next editor: nodes of both meshes lie at every kink, and nowhere else on one another.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import Self

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.traits import Traits
from contactverif.mechanics.bodies import grid_cells
from contactverif.mechanics.scene import Scene
from contactverif.problems.problem import Problem, ProblemInstance, Variation
from contactverif.problems.uniform_stress import pose_uniform

LAYERS = 2  # Layers of cells of each block.
LOWER, UPPER = (0.0, 0.3, 0.65, 1.0), (0.0, 0.2, 0.45, 0.75, 1.0)  # Shares of each facet at which nodes lie.

_FACTS = ("line", "height", "pressure", "young", "poisson")  # The attributes of KinkedPatch.


@dataclass(frozen=True, slots=True)
class KinkedPatch:
    """Two blocks on a broken line."""

    line: tuple[tuple[float, float], ...]  # The ends of the facets from left to right, a length each.
    height: float = 6.0  # The distance of bottom and top from y = 0, a length.
    pressure: float = 1e-6  # The pressure p on all sides, force per length.
    young: float = 1.0  # Young's modulus and Poisson's ratio of both blocks.
    poisson: float = 0.3

    @property
    def normals(self) -> FloatArray:
        """The unit normals (n_facets, 2) of the facets, upwards."""
        along = np.diff(np.array(self.line), axis=0)
        return np.asarray(np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None])

    @property
    def sharpest(self) -> float:
        """The tangent of half the largest angle φ between the normals of two facets that meet."""
        cosines = (self.normals[:-1] * self.normals[1:]).sum(axis=1)
        return float(np.sqrt((1 - cosines) / (1 + cosines)).max())

    @property
    def contraction(self) -> float:
        """The strain p (1 + ν)(1 − 2ν)/E by which both blocks become smaller in all directions."""
        return self.pressure * (1 + self.poisson) * (1 - 2 * self.poisson) / self.young

    def translation(self, penetration: float) -> FloatArray:
        """Return the translation (2,) of the upper block that penetrates every facet by as much, a length.

        With three or more normals it is the nearest by least squares.
        """
        return np.asarray(np.linalg.lstsq(self.normals, np.full(len(self.normals), -penetration))[0])

    def displacement(self, places: FloatArray, penetration: float, *, upper: bool) -> FloatArray:
        """Return the displacement (n, 2) of one block at places (n, 2): both contract, and the upper one moves down."""
        hinge = np.array([self.line[0][0], -self.height])
        displacement: FloatArray = -self.contraction * (places - hinge)
        return displacement + self.translation(penetration) if upper else displacement

    def cut(self, share: float = 0.25) -> Self:
        """Return the patch of a line with a third normal: one kink is cut off, from `share` of both facets."""
        if len(self.line) != 3:
            raise MisuseError("line", f"{len(self.line) - 1} facets", "two facets, which meet in one kink")
        first, kink, last = np.array(self.line)
        ends = (first, kink + share * (first - kink), kink + share * (last - kink), last)
        return replace(self, line=tuple((float(x), float(y)) for x, y in ends))


@cache
def kinked_patch(problem: KinkedPatch, *, upper_slave: bool = True, penalty: float = 1.0) -> Scene:
    """Return the scene of both blocks; the lower one stands on a hinge and a roller, the upper one on the lower one."""
    start = problem.translation(problem.pressure / penalty)
    bodies = _block(problem, upper=True, start=start), _block(problem, upper=False, start=np.zeros(2))
    facts = {name: np.array(getattr(problem, name)) for name in _FACTS}
    facts["upper_slave"] = np.array(float(upper_slave))
    return Scene(bodies if upper_slave else bodies[::-1], penalty=penalty, facts=facts)


def patch_of(case: Case) -> tuple[KinkedPatch, bool]:
    """Return the problem of a case of `kinked_patch`, and whether its upper block is the slave."""
    line = tuple((float(x), float(y)) for x, y in case.parameters["line"])
    numbers = {name: case.parameter(name) for name in _FACTS if name != "line"}
    return KinkedPatch(line, **numbers), bool(case.parameter("upper_slave"))


def exact_unknowns(problem: KinkedPatch, scene: Scene, penetration: float) -> FloatArray:
    """Return the unknowns q (n_free,) of the uniform state, which solves the scene if there are two normals.

    The penetration is p/ε̂, a length; 0 for multipliers.
    """
    parts = []
    for index, unknowns in zip(scene.bodies_in_reach, scene.unknowns, strict=True):
        body = scene.bodies[index]
        moves = problem.displacement(body.nodes, penetration, upper=body.name == "upper")
        parts.append(moves.reshape(-1)[unknowns])
    return np.concatenate(parts)


def _block(problem: KinkedPatch, *, upper: bool, start: FloatArray) -> Body:
    line, shares = np.array(problem.line), np.array(UPPER if upper else LOWER)
    parts = line[:-1, None] + shares[1:, None] * np.diff(line, axis=0)[:, None]  # (n_facets, n_nodes, 2)
    parts[:, -1] = line[1:]  # A kink is the same point to the last bit on both sides.
    edge = np.vstack([line[:1], parts.reshape(-1, 2)])
    far = np.column_stack([edge[:, 0], np.full(len(edge), problem.height if upper else -problem.height)])
    low, high = (edge, far) if upper else (far, edge)
    rows = [low + layer / LAYERS * (high - low) for layer in range(LAYERS)] + [high]
    number = np.arange((LAYERS + 1) * len(edge)).reshape(LAYERS + 1, len(edge))
    sides = [number[0], number[:, -1], number[-1, ::-1], number[::-1, 0]]  # Around the block, which is on the left.
    contact = sides.pop(0 if upper else 2)
    nodes = np.vstack(rows)
    load = np.zeros(nodes.shape)
    for side in sides:
        along = np.diff(nodes[side], axis=0)
        inwards = problem.pressure / 2 * np.column_stack([-along[:, 1], along[:, 0]])
        np.add.at(load, side[:-1], inwards)
        np.add.at(load, side[1:], inwards)
    fixed = np.zeros(nodes.shape, bool)
    if not upper:
        fixed[0] = fixed[len(edge) - 1, 1] = True
        load[fixed] = 0.0
    return Body(
        nodes,
        grid_cells(number),
        np.column_stack([contact[:-1], contact[1:]]),
        problem.young,
        problem.poisson,
        fixed=fixed,
        load=load,
        start=start,
        name="upper" if upper else "lower",
    )


_WIDTH, _HEIGHT = 8.0, 1.5  # Lengths of the zigzag with one tooth


def _pose(teeth: int, stiffness: float, traits: Traits, variation: Variation) -> ProblemInstance:
    """Return blocks on a zigzag of so many teeth: it has two normals, so that the uniform state is exact."""
    height = _HEIGHT * (1 + variation.grading / 4)
    places = range(2 * teeth + 1)
    line = tuple((_WIDTH * place / (2 * teeth), height / teeth * (place % 2)) for place in places)
    problem = KinkedPatch(line, pressure=1e-6 * variation.load)
    upper_slave = not variation.swapped
    shares = UPPER if upper_slave else LOWER
    segment = float(np.hypot(_WIDTH / 2, height)) / teeth / (len(shares) - 1)
    scene = kinked_patch(problem, upper_slave=upper_slave, penalty=stiffness * problem.young / segment)
    penetration = 0.0 if traits.rules.enforcement == "multiplier" else problem.pressure / scene.penalty
    return pose_uniform(scene, problem.pressure, exact_unknowns(problem, scene, penetration))


KINKED = Problem(
    label="two blocks on a zigzag",
    meshes=(1,),  # The uniform state is exact on every mesh.
    targets=(1e-2, 1e-5),
    pose=_pose,
    rank=4,
)
