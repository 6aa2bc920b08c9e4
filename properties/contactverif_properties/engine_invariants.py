"""Two scenes that have the same answer, as a whole code solves them: mirrored, in other units, beside other bodies."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import cos, degrees, radians, sin

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, Cases, random_source
from contactverif.contract.interface import PLANE
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import SOLVE, EngineSubject, Subject
from contactverif.mechanics import changed_scenes
from contactverif.mechanics.accuracy import Solution, solve_by_engine
from contactverif.mechanics.bodies import Placing, Rectangle, block
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.strategies.solids import closed_cases
from contactverif.strategies.space_solids import space_closed_cases
from contactverif_properties.patch_solved import engine_tolerance

CHANGE = Quantity(
    "change of the forces",
    "2 (a (1 + M U/(ℓ p)) + 1e-12 κ)",
    "Both displacements are wrong by their accuracy a, which strains the shortest segment.",
)
LENGTH, MODULUS = 2.0**6, 4.0**-8  # Other units, and another one of force, which is their product
DISTANCE = 64.0  # The distance of a far body over the size of the interface.
ANGLES = (17.3, 45.0, 90.0, 135.0)  # Degrees
IMAGE = np.array([-1.0, 1.0, 1.0])


# Blocks that are pressed together and tilted, all of the interface in contact; or a scene that is given.
_tilted_scenes = random_source("contactverif_properties.engine_scenes.scenes")(lambda scene=None: closed_cases(scene))
_define_for_codes = partial(
    Property.define,
    quantities=(CHANGE,),
    cases=Cases.random(_tilted_scenes),
    cases_in_space=Cases.random(space_closed_cases),
    needs=frozenset({SOLVE}),
    bodies=True,
)


def _compare_scenes(
    case: Case,
    subject: Subject,
    changed: Scene,
    action: str,
    back: Callable[[int, FloatArray], FloatArray] = lambda body, forces: forces,
) -> Measurement:
    """Solve a scene and a changed one, and return the largest change of a force, taken `back`, over p L."""
    assert isinstance(subject, EngineSubject)
    scene = scene_of(case)
    first, second = (solve_by_engine(item, subject)[0] for item in (scene, changed))
    if reason := first.no_solution or second.no_solution:
        return Measurement(undecided=reason)
    pairs = enumerate(zip(_by_body(scene, first), _by_body(changed, second), strict=False))
    largest = max(float(np.abs(back(body, there) - here).max(initial=0.0)) for body, (here, there) in pairs)
    total = float(np.linalg.norm(first.forces[: scene.interface.n_slave_nodes].sum(axis=0)))
    if total == 0:
        return Measurement([CHANGE.check(largest, 0.0)], idle=True).after(action)
    length = float(scene.interface.slave.measures(scene.interface.nodes).sum())
    tolerance = 2 * engine_tolerance(scene, first, subject.engine_traits.accuracy, total / length)
    return Measurement([CHANGE.check(largest / total, tolerance)]).after(action)


def _by_body(scene: Scene, solution: Solution) -> list[FloatArray]:
    """Return the forces of all nodes of each body, 0 off the interface."""
    values, first = [np.zeros(body.nodes.shape) for body in scene.bodies], 0
    for index in scene.bodies_in_reach:
        nodes = scene.bodies[index].contact_nodes
        values[index][nodes] = solution.forces[first : first + len(nodes)]
        first += len(nodes)
    return values


def _of_seed(case: Case) -> np.random.Generator:
    return np.random.default_rng([case.seed, 28])


@_define_for_codes(id="engine.purity")
def engine_purity(case: Case, subject: Subject) -> Measurement:
    """A scene that is solved again has the same solution, also after another one.

    **Question.** A random scene of two blocks is solved, then another one, and then the first one again. Are the forces
    that the bodies need the same?

    **Why it matters.** A code that keeps a search, a mesh or a penalty of an earlier job answers by chance.

    **How it is judged.** Changes of nodal forces count over p L, the force on the slave. The tolerance is twice that of
    a patch test, as both solutions are as accurate as the code states.

    **Undecided.** Where the code finds no solution.
    """
    assert isinstance(subject, EngineSubject)
    solve_by_engine(changed_scenes.mirror(scene_of(case)), subject)
    return _compare_scenes(case, subject, scene_of(case), "solved again, after its mirror image")


@_define_for_codes(id="engine.mirror")
def engine_mirror(case: Case, subject: Subject) -> Measurement:
    """The mirror image of a scene has the mirror image of its solution.

    **Question.** A random scene of two blocks is mirrored. Are the forces that the bodies need the old ones, mirrored?

    **Why it matters.** Left and right are alike in mechanics. A code that treats the first node of an edge otherwise
    than the second gives an unsymmetric answer to a symmetric part.

    **How it is judged.** As in `engine.purity`.

    **Undecided.** Where the code finds no solution.
    """
    changed = changed_scenes.mirror(scene_of(case))
    return _compare_scenes(
        case, subject, changed, "mirrored from x to −x", lambda _, forces: forces * IMAGE[: forces.shape[1]]
    )


@_define_for_codes(id="engine.renumbering")
def engine_renumbering(case: Case, subject: Subject) -> Measurement:
    """Other numbers of nodes, cells and edges change nothing.

    **Question.** Nodes, cells and contact edges of a random scene get other numbers, and in space faces begin at other
    corners. Are the forces that the bodies need the old ones?

    **Why it matters.** A mesh generator numbers as it likes.

    **How it is judged.** As in `engine.purity`.

    **Undecided.** Where the code finds no solution.
    """
    changed, numbers = changed_scenes.renumber(scene_of(case), _of_seed(case))
    action = "with nodes, cells and edges in other numbers"
    return _compare_scenes(case, subject, changed, action, lambda body, forces: forces[numbers[body]])


@_define_for_codes(id="engine.units")
def engine_units(case: Case, subject: Subject) -> Measurement:
    """Other units of length and force change nothing but the numbers.

    **Question.** All lengths of a random scene are 64 times as large, and all moduli 1/65536, so that forces are
    1/1024. Are the forces that the bodies need the old ones, times that?

    **Why it matters.** A user of millimetres must not get another answer than a user of metres. Absolute tolerances of
    a search or of a convergence test are such mistakes.

    **How it is judged.** As in `engine.purity`.

    **Undecided.** Where the code finds no solution.
    """
    changed = changed_scenes.change_units(scene_of(case), LENGTH, MODULUS)
    factor = LENGTH ** (changed.dim - 1) * MODULUS
    action = f"with all lengths times {LENGTH:g} and all moduli times {MODULUS:.4g}"
    return _compare_scenes(case, subject, changed, action, lambda _, forces: forces / factor)


@_define_for_codes(id="engine.swap", role="trait", promise=lambda traits: traits.promises.unbiased)
def engine_swap(case: Case, subject: Subject) -> Measurement:
    """Slave and master may exchange their roles.

    **Question.** The slave of a random scene becomes the master, and the master the slave. Are the forces that the
    bodies need the old ones?

    **Why it matters.** An analyst must choose one surface as the slave, and often no choice is natural. Most codes give
    another answer then, and promise nothing.

    **How it is judged.** As in `engine.purity`.

    **Undecided.** Where the code finds no solution.
    """
    changed = changed_scenes.exchange_roles(scene_of(case))
    return _compare_scenes(case, subject, changed, "with slave and master exchanged")


@_define_for_codes(id="engine.objectivity")
def engine_objectivity(case: Case, subject: Subject) -> Measurement:
    """A scene that is turned has the solution that is turned.

    **Question.** A random scene of two blocks is turned by 17.3°, 45°, 90° or 135°, in space about two axes, with its
    supports. Are the forces that the bodies need the old ones, turned?

    **Why it matters.** No machine is built along the axes of its drawing.

    **How it is judged.** As in `engine.purity`.

    **Undecided.** Where the code finds no solution, and where it takes no inclined supports.
    """
    assert isinstance(subject, EngineSubject)
    if not subject.engine_traits.inclined_supports:
        return Measurement(undecided="the code takes no inclined supports")
    angle, dim = radians(float(_of_seed(case).choice(ANGLES))), case.interface.dim
    rotation = np.array([[cos(angle), -sin(angle), 0.0], [sin(angle), cos(angle), 0.0], [0.0, 0.0, 1.0]])
    rotation = rotation[:dim, :dim] if dim == PLANE else rotation @ np.roll(rotation, 1, axis=(0, 1))
    return _compare_scenes(
        case,
        subject,
        changed_scenes.turn(scene_of(case), rotation),
        f"turned by {degrees(angle):.4g}°",
        lambda _, forces: forces @ rotation,
    )


@_define_for_codes(id="engine.remote")
def engine_remote(case: Case, subject: Subject) -> Measurement:
    """A body that touches nothing, far away, changes nothing.

    **Question.** One more slave block, held, is added far from a random scene. Are the forces that the bodies need
    those of before?

    **Why it matters.** Parts of an assembly that do not touch have nothing to do with each other. A code that scales
    its penalty or its search by the mean of all elements couples them.

    **How it is judged.** As in `engine.purity`.

    **Undecided.** Where the code finds no solution.
    """
    scene = scene_of(case)
    low, high = scene.interface.nodes.min(axis=0), scene.interface.nodes.max(axis=0)
    size = float(np.abs(high - low).max())
    if scene.dim == PLANE:
        along_x, along_y = scene.bodies[0].frame[:, 0].tolist()  # Some codes take no inclined supports.
        place = Placing((along_x, along_y), (float(low[0]) + DISTANCE * size, float(high[1])))
        mesh = Rectangle([0, size / 3, size], [0, size])
        far = block(mesh, contact="bottom", approach=0.0, placing=place, name="far")
    else:  # A copy of the slave, whose far side is held where it is.
        slave = scene.bodies[scene.slave[0]]
        far = replace(slave, nodes=slave.nodes + DISTANCE * size * slave.frame[:, 0], imposed=0 * slave.imposed)
    changed = replace(scene, bodies=(*scene.bodies, far), slave=(*scene.slave, len(scene.bodies)), facts={})
    return _compare_scenes(case, subject, changed, f"beside a block {DISTANCE:g} sizes away")
