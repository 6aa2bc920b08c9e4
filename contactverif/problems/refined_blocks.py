"""Two elastic blocks 4 × 1 with E = 1 and ν = 0.3 on meshes that are refined, or under a pressure that varies.

Refined meshes show the inf-sup constant: the blocks touch without a load, and cells grow away from the interface, since
a pressure of wavelength λ strains a body to a depth of λ/2.

The wave shows whether an interface locks. On top of the slave acts p̄ + p1 cos(2πx/L) with p1 = p̄/64. The mean p̄ keeps
every point closed, so that the answer to the wave is linear: the difference between the solutions with it and without.
`matching_answer` is that of two meshes whose nodes coincide, joined by springs; it knows no contact formulation.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import FloatArray, dense
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.interface import SEGMENT, Surface
from contactverif.mechanics.accuracy import mass_matrix, traction_forces
from contactverif.mechanics.bodies import Rectangle
from contactverif.mechanics.scene import Scene
from contactverif.problems.blocks import two_blocks
from contactverif.problems.flat_states import collect, collect_on_faces
from contactverif.problems.space_blocks import facing_grids, space_blocks

LENGTH, HEIGHT = 4.0, 1.0  # Of each block, lengths.
POISSON = 0.3
N_MESHES, N_SPACE_MESHES = 5, 3
# The segments of slave and master on the coarsest mesh.
FAMILIES: Mapping[str, tuple[int, int]] = {"slave coarser, 2:3": (4, 6), "slave finer, 3:2": (6, 4), "matching": (4, 4)}
_GROWTH = 1.6  # The height of a row of cells over that of the row before.
PENALTY = 10.0  # The scale of the contact decision of multipliers.


@cache
def refined_blocks(n_slave: int, n_master: int, corners: int = SEGMENT) -> Scene:
    """Return two blocks that touch, with equal segments on each side; the fact "columns" (2,) has their numbers.

    Faces with 3 or 4 corners make blocks in space, as wide as two faces of the coarser side. Their cells are cubes at
    the interface. Rollers at the sides mirror them, so this is a part of a wide block.
    """
    columns = [(np.linspace(0, LENGTH, n + 1), _row_lines(LENGTH / n)) for n in (n_slave, n_master)]
    (slave_x, up), (master_x, down) = columns
    if corners == SEGMENT:
        slave, master = Rectangle(slave_x, up, poisson=POISSON), Rectangle(master_x, -down[::-1], poisson=POISSON)
        scene = two_blocks(slave, master, penalty=PENALTY, approach=0)
    else:
        scene = _blocks_in_space((slave_x, master_x), (up, down), 2 * LENGTH / min(n_slave, n_master), corners)
    return replace(scene, facts={"columns": np.array([n_slave, n_master], dtype=np.float64)})


def _refinement_cases(corners: int) -> Iterator[Case]:
    """Return the coarsest mesh of each family, by its name."""
    for name, columns in FAMILIES.items():
        yield replace(refined_blocks(*columns, corners), name=name).case()


refinement_cases = collect(partial(_refinement_cases, SEGMENT))
refinement_space_cases = collect_on_faces(_refinement_cases)


def refinements(case: Case) -> tuple[Scene, ...]:
    """Return the scenes of a family from coarse to fine, each with twice the segments of the one before."""
    n_slave, n_master = case.parameters["columns"].astype(int).tolist()
    corners = case.interface.slave.faces.shape[1]
    n_meshes = N_MESHES if corners == SEGMENT else N_SPACE_MESHES
    return tuple(refined_blocks(n_slave * 2**level, n_master * 2**level, corners) for level in range(n_meshes))


def _blocks_in_space(
    x: Sequence[FloatArray], levels: Sequence[FloatArray], width: float, corners: int, pressure: float | None = None
) -> Scene:
    """Return two blocks with squares at the interface, or these cut in two; without a pressure the slave is held."""
    slave_y, master_y = (np.linspace(0, width, round((len(lines) - 1) * width / LENGTH) + 1) for lines in x)
    interface, plane = facing_grids((x[0], slave_y), (x[1], master_y), corners)
    low, high = plane.min(axis=0), plane.max(axis=0)
    return space_blocks(
        interface,
        plane,
        np.array([low, [high[0], low[1]], high, [low[0], high[1]]]),
        layers=(np.diff(levels[0]).tolist(), np.diff(levels[1]).tolist()),
        materials=((1.0, POISSON),) * 2,
        penalty=PENALTY,
        pressure=pressure,
        approach=0.0 if pressure is None else None,
    )


def _row_lines(first: float) -> FloatArray:
    lines, height = [0.0], first
    while lines[-1] + height < HEIGHT:
        lines.append(lines[-1] + height)
        height *= _GROWTH
    if len(lines) > 1 and HEIGHT - lines[-1] < (lines[-1] - lines[-2]) / 2:  # No thin last row.
        lines.pop()
    return np.array([*lines, HEIGHT])


N_ROWS = 4
GRADING = 0.15  # The master's segments become shorter from left to right, so that inner nodes face no node.
MEAN_PRESSURE = 2.0**-7  # The mean pressure p̄ over E: blocks are 1 % shorter.
WAVE = MEAN_PRESSURE / 64  # The amplitude p1.
COLUMNS = ((8, 12), (12, 8))  # The segments of slave and master.
SOFT = 10.0  # The softest penalty ε̂ h/E, h the slave segment. Nothing locks there.
PENALTIES = (SOFT, 1e2, 1e4, 1e6, 1e8)


@cache
def wave_blocks(n_slave: int, n_master: int, penalty: float, *, wave: float, corners: int = SEGMENT) -> Scene:
    """Return two blocks under the mean pressure and a wave of an amplitude, force per length or area; 0 leaves it out.

    The segments of the master shorten from left to right, unless both numbers agree. The penalty is ε̂ h/E, with the
    slave segment h. The facts are those of a uniform pressure without the wave, and "columns" (2,) and "stiffness" ().
    Faces with 3 or 4 corners make blocks in space, as wide as they are high.
    """
    distributed = penalty * n_slave / LENGTH
    uniform = _uniform_blocks(n_slave, n_master, corners)
    numbers = {"columns": np.array([n_slave, n_master], dtype=np.float64), "stiffness": np.array(penalty)}
    if not wave:
        return replace(uniform, penalty=distributed, facts={**uniform.facts, **numbers})
    return replace(uniform, bodies=_wavy_bodies(n_slave, n_master, wave, corners), penalty=distributed, facts=numbers)


def _wave_cases(corners: int) -> Iterator[Case]:
    """Return the scenes of both choices of the slave under the mean pressure, at all penalties or in space at two."""
    for columns, penalty in product(COLUMNS, PENALTIES if corners == SEGMENT else PENALTIES[1::3]):
        scene = wave_blocks(*columns, penalty, wave=0.0, corners=corners)
        yield replace(scene, name=case_name(columns, penalty)).case()


wave_cases = collect(partial(_wave_cases, SEGMENT))
wave_space_cases = collect_on_faces(_wave_cases)


def case_name(columns: tuple[int, int], penalty: float) -> str:
    """Return the name of the case with so many segments of slave and master and that ε̂ h/E."""
    return f"{columns[0]} on {columns[1]}, ε̂ = {penalty:.0e} E/h".replace("e+0", "e")


@dataclass(frozen=True, slots=True)
class WaveAnswer:
    """The answer of two blocks to the wave."""

    compliance: float  # The work of the wave's load on the displacements that it causes.
    pressure_range: float  # The largest minus the smallest pressure at the interface that it causes, over p1.


@cache
def matching_answer(n_columns: int, distributed: float, corners: int = SEGMENT) -> WaveAnswer:
    """Return the answer of matching meshes, whose gap is integrated exactly against a distributed stiffness."""
    scene = _uniform_blocks(n_columns, n_columns, corners)
    interface = scene.interface
    sides = np.split(np.arange(interface.n_nodes), [interface.n_slave_nodes])
    slave, master = (side[np.lexsort(interface.nodes[side].T)] for side in sides)
    gaps, places = np.zeros((len(slave), interface.n_unknowns)), np.arange(len(slave))
    gaps[places, interface.dim * (slave + 1) - 1], gaps[places, interface.dim * (master + 1) - 1] = 1.0, -1.0
    gaps = gaps @ dense(scene.transformation)
    mass = mass_matrix(interface.slave, interface.nodes).toarray()[np.ix_(slave, slave)]
    # The pressure p is an unknown too, with M (g − p/ε̂) = 0: the matrix stays regular however stiff the springs are.
    transfer = gaps.T @ mass
    matrix = np.block([[dense(scene.stiffness), transfer], [transfer.T, -mass / distributed]])
    wavy = replace(scene, bodies=_wavy_bodies(n_columns, n_columns, WAVE, corners), facts={})
    load = np.append(wavy.load - scene.load, np.zeros(len(mass)))
    change, pressures = np.split(linalg.solve(matrix, load, assume_a="sym"), [scene.n_free])
    return WaveAnswer(wave_work(scene, wavy, np.zeros_like(change), change), float(np.ptp(pressures)) / WAVE)


def wave_work(scene: Scene, wavy: Scene, before: FloatArray, after: FloatArray) -> float:
    """Return the work of the wave's load on the displacements between two solutions (n_free,)."""
    load = wavy.bodies[0].load - scene.bodies[0].load
    return float((load * (wavy.displacements(after)[0] - scene.displacements(before)[0])).sum())


@cache
def _uniform_blocks(n_slave: int, n_master: int, corners: int) -> Scene:
    rows = np.linspace(0, HEIGHT, N_ROWS + 1)
    slave_x, t = LENGTH * (np.linspace(0, 1, n_slave + 1) - 0.5), np.linspace(0, 1, n_master + 1)
    master_x = LENGTH * (t - 0.5 + (GRADING * t * (1 - t) if n_slave != n_master else 0))
    if corners != SEGMENT:
        return _blocks_in_space((slave_x, master_x), (rows, rows), HEIGHT, corners, MEAN_PRESSURE)
    return two_blocks(
        Rectangle(slave_x, rows, poisson=POISSON),
        Rectangle(master_x, rows - HEIGHT, poisson=POISSON),
        pressure=MEAN_PRESSURE,
    )


@cache
def _wavy_bodies(n_slave: int, n_master: int, wave: float, corners: int) -> tuple[Body, Body]:
    """Return both blocks, the slave with the load of a wave of that amplitude on its top."""
    slave, master = _uniform_blocks(n_slave, n_master, corners).bodies

    def traction(places: FloatArray) -> FloatArray:
        return np.outer(np.cos(2 * np.pi * places[:, 0] / LENGTH), np.eye(slave.dim)[-1])

    top = Surface(slave.contact + len(slave.nodes) - len(slave.contact_nodes))
    return replace(slave, load=slave.load - wave * traction_forces(top, slave.nodes, traction)), master
