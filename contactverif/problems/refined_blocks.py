"""Two elastic blocks 4 × 1 with E = 1 and ν = 0.3 on meshes that are refined, or under a pressure that varies.

Refined meshes show the inf-sup constant: the blocks touch without a load, and cells grow away from the interface, since
a pressure of wavelength λ strains a body to a depth of λ/2.

The wave shows whether an interface locks. On top of the slave acts p̄ + p1 cos(2πx/L) with p1 = p̄/64. The mean p̄ keeps
every point closed, so that the answer to the wave is linear: the difference between the solutions with it and without.
`matching_answer` is that of two meshes whose nodes coincide, joined by springs; it knows no contact formulation.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import FloatArray, dense
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.mechanics.bodies import Rectangle
from contactverif.mechanics.scene import Scene
from contactverif.problems.blocks import two_blocks
from contactverif.problems.flat_states import collect

LENGTH, HEIGHT = 4.0, 1.0  # Of each block, lengths.
POISSON = 0.3
N_MESHES = 5
# The segments of slave and master on the coarsest mesh.
FAMILIES: Mapping[str, tuple[int, int]] = {"slave coarser, 2:3": (4, 6), "slave finer, 3:2": (6, 4), "matching": (4, 4)}
_GROWTH = 1.6  # The height of a row of cells over that of the row before.
PENALTY = 10.0  # The scale of the contact decision of multipliers.


@cache
def refined_blocks(n_slave: int, n_master: int) -> Scene:
    """Return two blocks that touch, with equal segments on each side; the fact "columns" (2,) has their numbers."""
    columns = [(np.linspace(0, LENGTH, n + 1), _row_lines(LENGTH / n)) for n in (n_slave, n_master)]
    (slave_x, up), (master_x, down) = columns
    slave, master = Rectangle(slave_x, up, poisson=POISSON), Rectangle(master_x, -down[::-1], poisson=POISSON)
    scene = two_blocks(slave, master, penalty=PENALTY, approach=0)
    return replace(scene, facts={"columns": np.array([n_slave, n_master], dtype=np.float64)})


@collect
def refinement_cases() -> Iterator[Case]:
    """Return the coarsest mesh of each family, by its name."""
    for name, columns in FAMILIES.items():
        yield replace(refined_blocks(*columns), name=name).case()


def refinements(case: Case) -> tuple[Scene, ...]:
    """Return the scenes of a family from coarse to fine, each with twice the segments of the one before."""
    n_slave, n_master = case.parameters["columns"].astype(int).tolist()
    return tuple(refined_blocks(n_slave * 2**level, n_master * 2**level) for level in range(N_MESHES))


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
_GAUSS = np.polynomial.legendre.leggauss(8)  # Exact to roundoff for an eighth of a wave.


@cache
def wave_blocks(n_slave: int, n_master: int, penalty: float, *, wave: float) -> Scene:
    """Return two blocks under the mean pressure and a wave of an amplitude, force per length; 0 leaves it out.

    The segments of the master shorten from left to right, unless both numbers agree. The penalty is ε̂ h/E, with the
    slave segment h. The facts are those of a uniform pressure without the wave, and "columns" (2,) and "stiffness" ().
    """
    distributed = penalty * n_slave / LENGTH
    uniform = _uniform_blocks(n_slave, n_master)
    numbers = {"columns": np.array([n_slave, n_master], dtype=np.float64), "stiffness": np.array(penalty)}
    if not wave:
        return replace(uniform, penalty=distributed, facts={**uniform.facts, **numbers})
    return replace(uniform, bodies=_wavy_bodies(n_slave, n_master, wave), penalty=distributed, facts=numbers)


@collect
def wave_cases() -> Iterator[Case]:
    """Return the scenes of both choices of the slave at all penalties, under the mean pressure."""
    for columns, penalty in product(COLUMNS, PENALTIES):
        yield replace(wave_blocks(*columns, penalty, wave=0.0), name=case_name(columns, penalty)).case()


def case_name(columns: tuple[int, int], penalty: float) -> str:
    """Return the name of the case with so many segments of slave and master and that ε̂ h/E."""
    return f"{columns[0]} on {columns[1]}, ε̂ = {penalty:.0e} E/h".replace("e+0", "e")


@dataclass(frozen=True, slots=True)
class WaveAnswer:
    """The answer of two blocks to the wave."""

    compliance: float  # The work of the wave's load on the displacements that it causes.
    pressure_range: float  # The largest minus the smallest pressure at the interface that it causes, over p1.


@cache
def matching_answer(n_columns: int, distributed: float) -> WaveAnswer:
    """Return the answer of matching meshes, whose gap is integrated exactly against a distributed stiffness."""
    scene = _uniform_blocks(n_columns, n_columns)
    interface, length = scene.interface, LENGTH / n_columns
    slave, master = np.split(np.arange(interface.n_nodes), [interface.n_slave_nodes])
    slave, master = (side[np.argsort(interface.nodes[side, 0])] for side in (slave, master))
    gaps = np.zeros((n_columns + 1, interface.n_unknowns))
    places = np.arange(n_columns + 1)
    gaps[places, 2 * slave + 1], gaps[places, 2 * master + 1] = 1.0, -1.0
    gaps = gaps @ dense(scene.transformation)
    mass = length / 6 * (np.diag(np.r_[2, np.full(n_columns - 1, 4.0), 2]) + np.eye(n_columns + 1, k=1))
    mass += length / 6 * np.eye(n_columns + 1, k=-1)
    # The pressure p is an unknown too, with M (g − p/ε̂) = 0: the matrix stays regular however stiff the springs are.
    transfer = gaps.T @ mass
    matrix = np.block([[dense(scene.stiffness), transfer], [transfer.T, -mass / distributed]])
    wavy = replace(scene, bodies=_wavy_bodies(n_columns, n_columns, WAVE), facts={})
    load = np.append(wavy.load - scene.load, np.zeros(len(mass)))
    change, pressures = np.split(linalg.solve(matrix, load, assume_a="sym"), [scene.n_free])
    return WaveAnswer(wave_work(scene, wavy, np.zeros_like(change), change), float(np.ptp(pressures)) / WAVE)


def wave_work(scene: Scene, wavy: Scene, before: FloatArray, after: FloatArray) -> float:
    """Return the work of the wave's load on the displacements between two solutions (n_free,)."""
    load = wavy.bodies[0].load - scene.bodies[0].load
    return float((load * (wavy.displacements(after)[0] - scene.displacements(before)[0])).sum())


@cache
def _uniform_blocks(n_slave: int, n_master: int) -> Scene:
    rows = np.linspace(0, HEIGHT, N_ROWS + 1)
    slave_x, t = LENGTH * (np.linspace(0, 1, n_slave + 1) - 0.5), np.linspace(0, 1, n_master + 1)
    master_x = LENGTH * (t - 0.5 + (GRADING * t * (1 - t) if n_slave != n_master else 0))
    return two_blocks(
        Rectangle(slave_x, rows, poisson=POISSON),
        Rectangle(master_x, rows - HEIGHT, poisson=POISSON),
        pressure=MEAN_PRESSURE,
    )


@cache
def _wavy_bodies(n_slave: int, n_master: int, wave: float) -> tuple[Body, Body]:
    """Return both blocks, the slave with the load of a wave of that amplitude on its top."""
    slave, master = _uniform_blocks(n_slave, n_master).bodies
    top = np.flatnonzero(slave.nodes[:, 1] == HEIGHT)
    x, (points, weights) = slave.nodes[top, 0], _GAUSS
    share = (points + 1) / 2  # (n_points,)
    places = x[:-1, None] + np.diff(x)[:, None] * share  # (n_segments, n_points)
    forces = np.cos(2 * np.pi * places / LENGTH) * np.diff(x)[:, None] * weights / 2
    nodal = np.zeros(len(x))  # ∫N cos(2πx/L) dx
    nodal[:-1] += forces @ (1 - share)
    nodal[1:] += forces @ share
    load = np.array(slave.load)
    load[top, 1] -= wave * nodal
    return replace(slave, load=load), master
