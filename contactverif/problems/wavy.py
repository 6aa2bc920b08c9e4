"""Two wavy half-planes in full contact without friction: a pressure that varies smoothly, and has no edge.

The pressure p̄ + p1 cos kx loads each body on its whole surface, so the exact field is elementary. A layer of springs ε̂
between the bodies (the penalty) takes a part p/ε̂ of the approach at each place. The profiles of the surfaces are chosen
so that the bodies fit: where they meet, the interface is flat, or a wave of given amplitude. Sides are planes of
symmetry; the far edges move as the exact field does there, so that nothing is cut off.

Each body has its own depth η = |y| ≥ 0: the upper one is 0 < y < H, the lower one −H < y < 0. The field is one of
linear elasticity: it is exact but for terms of the order of p1/E and of the slope of the surfaces, 1e-6 here.

Rule for the next editor: fields know no mesh and no formulation. Only `wavy_scene` makes bodies.

References
----------
K. L. Johnson, Contact Mechanics (1985), Sections 2.2 (stress function of a half-plane) and 13.2 (wavy surfaces).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import inf, pi

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.simple_bodies import grid_cells

UPPER, LOWER = 0, 1
COLUMNS = (6, 8)  # The number of cells along the upper and the lower surface of the coarsest mesh.
GRADING = 0.15  # The nodes of the lower body lie at W (t + GRADING t (1 − t)): no node meets one of the upper body.


@dataclass(frozen=True, slots=True)
class WavyProblem:
    """Two wavy bodies, their materials and the pressure between them. The first entry of a pair is the upper body.

    Attributes
    ----------
    wavelength : float
        The wavelength λ of the pressure, and the width W of the bodies.
    height : float
        The height H of each body.
    young, poisson : tuple[float, float]
        Young's moduli E, force per length squared, and Poisson's ratios ν, in plane strain.
    mean, wave : float
        The mean pressure p̄ and the amplitude p1 of its wave, force per length, p̄ > p1.
    penalty : float
        The distributed stiffness ε̂ between the bodies; infinite for multipliers.
    amplitude : float
        The amplitude A of the interface where the bodies meet, a length: y = A cos kx there, up to a constant.
    """

    wavelength: float = 4.0
    height: float = 2.0
    young: tuple[float, float] = (1.0, 3.0)
    poisson: tuple[float, float] = (0.3, 0.2)
    mean: float = 2e-6
    wave: float = 1e-6
    penalty: float = inf
    amplitude: float = 0.0

    @property
    def wave_number(self) -> float:
        """The wave number k = 2π/λ."""
        return 2 * pi / self.wavelength

    def plane_modulus(self, body: int) -> float:
        """Return E' = E/(1−ν²) of a body."""
        return self.young[body] / (1 - self.poisson[body] ** 2)

    def plane_ratio(self, body: int) -> float:
        """Return ν' = ν/(1−ν) of a body."""
        return self.poisson[body] / (1 - self.poisson[body])

    def oedometric_modulus(self, body: int) -> float:
        """Return M = E'/(1−ν'²): stress over strain without lateral strain."""
        return self.plane_modulus(body) / (1 - self.plane_ratio(body) ** 2)

    @property
    def approach(self) -> float:
        """The distance Δ = p̄ (H/M + H/M + 1/ε̂) by which the far edges approach, besides the wave."""
        moduli = (self.oedometric_modulus(body) for body in (UPPER, LOWER))
        return self.mean * (sum(self.height / modulus for modulus in moduli) + 1 / self.penalty)

    @property
    def wave_approach(self) -> float:
        """The amplitude p1 (2/kE' + 2/kE' + 1/ε̂) of the gap that the wave of the pressure closes."""
        moduli = (self.plane_modulus(body) for body in (UPPER, LOWER))
        return self.wave * (sum(2 / (self.wave_number * modulus) for modulus in moduli) + 1 / self.penalty)


def wavy_pressure(problem: WavyProblem, x: FloatArray) -> FloatArray:
    """Return the pressure p̄ + p1 cos kx, force per length, in the shape of x."""
    pressures: FloatArray = problem.mean + problem.wave * np.cos(problem.wave_number * np.asarray(x))
    return pressures


def wavy_displacements(problem: WavyProblem, body: int, places: FloatArray) -> FloatArray:
    """Return the displacements of a body, those of the interface included.

    With the depth η and u_η into the body:
    u_x = −p1/(E'k) sin kx [(1−kη) − ν'(1+kη)] e^{−kη} and
    u_η = p1/(E'k) cos kx [2 + (1+ν')kη] e^{−kη} + p̄(H−η)/M.
    The upper body moves down by the approach Δ too.

    Parameters
    ----------
    problem : WavyProblem
        Materials and pressure.
    body : int
        `UPPER` or `LOWER`.
    places : FloatArray, shape (..., 2)
        Places in the body, before they move. The waviness of the surface counts for nothing here.

    Returns
    -------
    FloatArray, shape (..., 2)
        The displacements, a length each.
    """
    k, modulus, ratio = problem.wave_number, problem.plane_modulus(body), problem.plane_ratio(body)
    into = _into(body)
    depth = into * places[..., 1]
    decay = problem.wave / (modulus * k) * np.exp(-k * depth)
    along = -decay * np.sin(k * places[..., 0]) * ((1 - k * depth) - ratio * (1 + k * depth))
    inward = decay * np.cos(k * places[..., 0]) * (2 + (1 + ratio) * k * depth)
    inward = inward + problem.mean * (problem.height - depth) / problem.oedometric_modulus(body)
    descent = problem.approach if body == UPPER else 0.0
    return np.stack([along, into * inward - descent], axis=-1)


def wavy_stresses(problem: WavyProblem, body: int, places: FloatArray) -> FloatArray:
    """Return the stresses of a body.

    With the depth η: σ_yy = −p̄ − p1 (1+kη) e^{−kη} cos kx, σ_xx = −p̄ν' − p1 (1−kη) e^{−kη} cos kx, and
    σ_xy = ± p1 kη e^{−kη} sin kx, + in the lower body.

    Parameters
    ----------
    problem : WavyProblem
        Materials and pressure.
    body : int
        `UPPER` or `LOWER`.
    places : FloatArray, shape (..., 2)
        Places in the body.

    Returns
    -------
    FloatArray, shape (..., 3)
        The stresses σ_xx, σ_yy and σ_xy, force per length squared, positive in tension.
    """
    k, into = problem.wave_number, _into(body)
    depth = into * places[..., 1]
    wave = problem.wave * np.exp(-k * depth)
    cosine, sine = np.cos(k * places[..., 0]), np.sin(k * places[..., 0])
    along = -problem.mean * problem.plane_ratio(body) - wave * (1 - k * depth) * cosine
    across = -problem.mean - wave * (1 + k * depth) * cosine
    return np.stack([along, across, -into * wave * k * depth * sine], axis=-1)


def wavy_profile(problem: WavyProblem, body: int) -> float:
    """Return the amplitude a of the surface y = a cos kx of a body before contact.

    The bodies share the layer's part: a = A ± (2p1/(kE') + p1/2ε̂), + for the lower body.
    """
    indentation = 2 * problem.wave / (problem.wave_number * problem.plane_modulus(body))
    return problem.amplitude - _into(body) * (indentation + problem.wave / (2 * problem.penalty))


def _into(body: int) -> float:
    """Return the direction of y that goes into the body."""
    return 1.0 if body == UPPER else -1.0


@lru_cache(maxsize=128)
def wavy_scene(problem: WavyProblem, refine: int = 1, slave: int = UPPER, columns: tuple[int, int] = COLUMNS) -> Scene:
    """Return two wavy bodies of quadrilaterals whose meshes do not match.

    The scene is remembered, so that its bodies are condensed once.

    Parameters
    ----------
    problem : WavyProblem
        Materials, pressure and penalty. The scene has the penalty 1 if that of the problem is infinite.
    refine : int
        The number r of parts that each of the columns is divided into.
    slave : int
        The body that is the slave, `UPPER` or `LOWER`.
    columns : tuple[int, int]
        The numbers of cells along the upper and the lower surface at r = 1. Those of the upper body have equal widths,
        those of the lower one become narrower. Cells are about square.

    Returns
    -------
    Scene
        The upper body first.

    Raises
    ------
    MisuseError
        As `Body` and `Scene` do.
    """
    bodies = tuple(_wavy_body(problem, body, columns[body] * refine) for body in (UPPER, LOWER))
    penalty = problem.penalty if np.isfinite(problem.penalty) else 1.0
    return Scene(bodies, (slave,), (1 - slave,), penalty=penalty, name="wavy")


@lru_cache(maxsize=128)
def _wavy_body(problem: WavyProblem, body: int, n_columns: int) -> Body:
    """Return one of the bodies, the same for both choices of the slave: cells are about square, edges move exactly."""
    t = np.linspace(0.0, 1.0, n_columns + 1)
    x = problem.wavelength * (t if body == UPPER else t + GRADING * t * (1 - t))
    into, rows = _into(body), max(1, round(problem.height * (len(x) - 1) / problem.wavelength))
    depth = np.linspace(0.0, problem.height, rows + 1)
    levels = into * (depth if body == UPPER else depth[::-1])  # From bottom to top
    flat = np.stack(np.meshgrid(x, levels), axis=-1)  # (n_rows, n_columns, 2)
    fade = 1 - np.abs(flat[..., 1]) / problem.height
    nodes = flat.copy()
    nodes[..., 1] += wavy_profile(problem, body) * np.cos(problem.wave_number * flat[..., 0]) * fade
    number = np.arange(len(x) * len(levels)).reshape(len(levels), len(x))
    near, far = (number[0], number[-1]) if body == UPPER else (number[-1][::-1], number[0])
    fixed, imposed = np.zeros((number.size, 2), bool), np.zeros((number.size, 2))
    fixed[number[:, [0, -1]], 0] = fixed[far] = True
    imposed[far] = wavy_displacements(problem, body, flat.reshape(-1, 2)[far])
    imposed[number[:, [0, -1]], 0] = 0.0  # sin kx is rounded there.
    # The first guess penetrates everywhere: Newton's method begins with all in contact.
    down = problem.approach + 2 * problem.wave_approach if body == UPPER else 0.0
    return Body(
        nodes=nodes.reshape(-1, 2),
        cells=grid_cells(number),
        contact=np.column_stack([near[:-1], near[1:]]),
        young=problem.young[body],
        poisson=problem.poisson[body],
        fixed=fixed,
        imposed=imposed,
        start=np.array([0.0, -down]),
        name="upper body" if body == UPPER else "lower body",
    )
