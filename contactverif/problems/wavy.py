"""Two wavy half-planes in full contact without friction: a pressure that varies smoothly, and has no edge.

The pressure p̄ + p1 cos kx loads each body on its whole surface, so the exact field is elementary. A layer of springs ε̂
between the bodies (the penalty) takes a part p/ε̂ of the approach at each place. The profiles of the surfaces are chosen
so that the bodies fit: where they meet, the interface is flat, or a wave of given amplitude. Sides are planes of
symmetry; the far edges move as the exact field does there, so that nothing is cut off.

Each body has its own depth η = |y| ≥ 0: the upper one is 0 < y < H, the lower one −H < y < 0. The field is one of
linear elasticity: it is exact but for terms of the order of p1/E and of the slope of the surfaces, 1e-6 here.

Source: K. L. Johnson, Contact Mechanics (1985), Sections 2.2 (stress function of a half-plane) and 13.2 (wavy
surfaces).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import product
from math import inf, log1p, pi, sqrt
from typing import Self

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import traction_forces
from contactverif.mechanics.bodies import grid_cells
from contactverif.mechanics.scene import Scene
from contactverif.problems.flat_states import collect
from contactverif.problems.problem import FORCES, MOTIONS, PRESSURE, Bound, Problem, ProblemInstance, Studies, Variation

UPPER, LOWER = 0, 1
_INTO = (1.0, -1.0)  # The direction of y that goes into each body.
COLUMNS = (6, 8)  # The number of cells along the upper and the lower surface of the coarsest mesh.
MESHES = (1, 2, 4, 8)  # The refinements r of a study.
# The cells along both surfaces where one mesh is four times finer, and r. No inner node meets a node for these r.
CONTRAST_COLUMNS, CONTRAST_MESHES = (4, 1), (6, 9, 13, 18)
GRADING = 0.15  # The nodes of the lower body lie at W (t + grading t (1 − t)): no node meets one of the upper body.


@dataclass(frozen=True, slots=True)
class WavyProblem:
    """Two wavy bodies, their materials and the pressure between them. The first entry of a pair is the upper body."""

    wavelength: float = 4.0  # λ of the pressure, and the width W of the bodies
    height: float = 2.0  # H of each body
    young: tuple[float, float] = (1.0, 3.0)  # Force per length squared, in plane strain
    poisson: tuple[float, float] = (0.3, 0.2)
    mean: float = 2e-6  # The mean pressure p̄ > p1, force per length
    wave: float = 1e-6  # The amplitude p1 of its wave
    penalty: float = inf  # The distributed stiffness ε̂ between the bodies; infinite for multipliers
    amplitude: float = 0.0  # A of the interface where the bodies meet: y = A cos kx there, up to a constant

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
        compliances = (self.height / self.oedometric_modulus(body) for body in (UPPER, LOWER))
        return self.mean * (sum(compliances) + 1 / self.penalty)

    @property
    def wave_approach(self) -> float:
        """The amplitude p1 (2/kE' + 2/kE' + 1/ε̂) of the gap that the wave of the pressure closes."""
        compliances = (2 / (self.wave_number * self.plane_modulus(body)) for body in (UPPER, LOWER))
        return self.wave * (sum(compliances) + 1 / self.penalty)

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure p̄ + p1 cos kx, force per length, in the shape of x."""
        return self.mean + self.wave * np.cos(self.wave_number * np.asarray(x))

    def forces(self, interface: Interface, slave: int, positions: FloatArray) -> FloatArray:
        """Return the exact forces (n_nodes, 2) that push the nodes at positions (n_nodes, 2)."""

        def traction(body: int, places: FloatArray) -> FloatArray:
            pressure = self.pressure(places[:, 0])  # The surface is flat but for slopes of 1e-6.
            return np.column_stack([0 * pressure, _INTO[body] * pressure])

        sides = ((interface.slave, slave), (interface.master, 1 - slave))
        return np.add(*(traction_forces(side, positions, partial(traction, body)) for side, body in sides))

    def displacements(self, body: int, places: FloatArray) -> FloatArray:
        """Return the displacements (..., 2) of a body at reference places (..., 2), those of the interface included.

        With the depth η and u_η into the body: u_x = −p1/(E'k) sin kx [(1−kη) − ν'(1+kη)] e^{−kη} and u_η = p1/(E'k)
        cos kx [2 + (1+ν')kη] e^{−kη} + p̄(H−η)/M. The upper body moves down by the approach Δ too. The waviness of the
        surface counts for nothing here.
        """
        k, modulus, ratio, into = self.wave_number, self.plane_modulus(body), self.plane_ratio(body), _INTO[body]
        depth = into * places[..., 1]
        decay = self.wave / (modulus * k) * np.exp(-k * depth)
        along = -decay * np.sin(k * places[..., 0]) * ((1 - k * depth) - ratio * (1 + k * depth))
        inward = decay * np.cos(k * places[..., 0]) * (2 + (1 + ratio) * k * depth)
        inward = inward + self.mean * (self.height - depth) / self.oedometric_modulus(body)
        descent = self.approach if body == UPPER else 0.0
        return np.stack([along, into * inward - descent], axis=-1)

    def stresses(self, body: int, places: FloatArray) -> FloatArray:
        """Return the stresses σ_xx, σ_yy and σ_xy (..., 3) of a body at places (..., 2), positive in tension.

        With the depth η: σ_yy = −p̄ − p1 (1+kη) e^{−kη} cos kx, σ_xx = −p̄ν' − p1 (1−kη) e^{−kη} cos kx, and
        σ_xy = ± p1 kη e^{−kη} sin kx, + in the lower body.
        """
        k, into = self.wave_number, _INTO[body]
        depth = into * places[..., 1]
        wave = self.wave * np.exp(-k * depth)
        cosine, sine = np.cos(k * places[..., 0]), np.sin(k * places[..., 0])
        along = -self.mean * self.plane_ratio(body) - wave * (1 - k * depth) * cosine
        across = -self.mean - wave * (1 + k * depth) * cosine
        return np.stack([along, across, -into * wave * k * depth * sine], axis=-1)

    def profile(self, body: int) -> float:
        """Return the amplitude a of the surface y = a cos kx of a body before contact.

        The bodies share the layer's part: a = A ± (2p1/(kE') + p1/2ε̂), + for the lower body.
        """
        indentation = 2 * self.wave / (self.wave_number * self.plane_modulus(body))
        return self.amplitude - _INTO[body] * (indentation + self.wave / (2 * self.penalty))


@lru_cache(maxsize=128)  # The bodies of a scene are condensed once.
def wavy_scene(
    problem: WavyProblem,
    refine: int = 1,
    slave: int = UPPER,
    columns: tuple[int, int] = COLUMNS,
    grading: float = GRADING,
    growth: float = 0.0,
) -> Scene:
    """Return two wavy bodies of quadrilaterals whose meshes do not match, the upper body first.

    `columns` are the numbers of cells along the upper and the lower surface at refine = 1. Those of the upper body have
    equal widths, those of the lower one become narrower. Each row of cells is higher by the share `growth` than the one
    nearer to the interface. The penalty is 1 if that of the problem is infinite.
    """
    bodies = tuple(_wavy_body(problem, body, columns[body] * refine, grading, growth) for body in (UPPER, LOWER))
    penalty = problem.penalty if np.isfinite(problem.penalty) else 1.0
    return Scene(bodies, (slave,), (1 - slave,), penalty=penalty, name="wavy")


@lru_cache(maxsize=128)
def _wavy_body(problem: WavyProblem, body: int, n_columns: int, grading: float, growth: float) -> Body:
    """Return one of the bodies, the same for both choices of the slave: cells are about square, edges move exactly."""
    t = np.linspace(0.0, 1.0, n_columns + 1)
    x = problem.wavelength * (t if body == UPPER else t + grading * t * (1 - t))
    n_rows = problem.height * n_columns / problem.wavelength  # If they are alike; fewer that grow.
    n_rows = max(1, round(log1p(growth * n_rows) / log1p(growth) if growth else n_rows))
    depth = np.linspace(0.0, problem.height, n_rows + 1)
    if growth:
        powers = np.expm1(log1p(growth) * np.arange(n_rows + 1))
        depth = problem.height * powers / powers[-1]
    levels = _INTO[body] * (depth if body == UPPER else depth[::-1])  # From bottom to top
    flat = np.stack(np.meshgrid(x, levels), axis=-1)  # (n_rows, n_columns, 2)
    fade = 1 - np.abs(flat[..., 1]) / problem.height
    nodes = flat.copy()
    nodes[..., 1] += problem.profile(body) * np.cos(problem.wave_number * flat[..., 0]) * fade
    number = np.arange(len(x) * len(levels)).reshape(len(levels), len(x))
    near, far = (number[0], number[-1]) if body == UPPER else (number[-1][::-1], number[0])
    fixed, imposed = np.zeros((number.size, 2), bool), np.zeros((number.size, 2))
    fixed[number[:, [0, -1]], 0] = fixed[far] = True
    imposed[far] = problem.displacements(body, flat.reshape(-1, 2)[far])
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


_FACTS = ("slave", "stiffness", "amplitude", "contrast")  # The attributes of WavyStudy that a case has.


@dataclass(frozen=True, slots=True)
class WavyStudy:
    """Wavy half-planes on several meshes, with a penalty that grows as E/h; each has the exact field of its penalty."""

    slave: int  # UPPER or LOWER
    stiffness: float  # The penalty ε̂h/E, with E of the upper body and the mean cell h of the coarser mesh
    amplitude: float = 0.0  # That of the interface where the bodies meet, a length
    contrast: bool = False  # The mesh of the upper body is four times finer than that of the lower one.
    own_columns: tuple[int, int] = (0, 0)  # The numbers of cells along both surfaces at r = 1, if they are others
    grading: float = GRADING  # That of the lower body
    load: float = 1.0  # The factor of the mean pressure
    growth: float = 0.0  # By how much each row of cells is higher than the one nearer to the interface

    @property
    def columns(self) -> tuple[int, int]:
        """The numbers of cells along both surfaces at r = 1."""
        if all(self.own_columns):
            return self.own_columns
        return CONTRAST_COLUMNS if self.contrast else COLUMNS

    @property
    def meshes(self) -> tuple[int, ...]:
        """The refinements r."""
        return CONTRAST_MESHES if self.contrast else MESHES

    def size(self, refine: int) -> float:
        """Return 1/r."""
        return 1 / refine

    def penalty(self, refine: int) -> float:
        """Return the penalty ε̂ on a mesh."""
        problem = WavyProblem()
        return self.stiffness * problem.young[UPPER] * min(self.columns) * refine / problem.wavelength

    def pose(self, refine: int, traits: Traits) -> ProblemInstance:
        """Return the problem on a mesh."""
        penalty = self.penalty(refine)
        law = inf if traits.rules.enforcement == "multiplier" else penalty
        problem = WavyProblem(penalty=law, amplitude=self.amplitude, mean=self.load * WavyProblem().mean)
        scene = wavy_scene(problem, refine, self.slave, self.columns, self.grading, self.growth)
        scene = scene if law == penalty else replace(scene, penalty=penalty)

        def motion(body: int, places: FloatArray) -> FloatArray:
            return problem.displacements(body, places * [1.0, 0.0])

        # A pressure that is constant on each slave segment leaves h/√12 of a slope p1 k sin kx, and sin² has the
        # mean 1/2.
        segment = problem.wavelength / (self.columns[self.slave] * refine)
        return ProblemInstance(
            scene=scene,
            forces=partial(problem.forces, scene.interface, self.slave),
            motions=(partial(motion, self.slave), partial(motion, 1 - self.slave)),
            pressure=lambda places: problem.pressure(places[:, 0]),
            pressure_scale=problem.wave,
            step=(problem.mean - problem.wave) / penalty / 16,
            best={PRESSURE: problem.wave_number * segment / sqrt(24)},
        )

    def group(self, traits: Traits) -> str:
        """Return which slave is finer or coarser, if the meshes differ by a factor of four."""
        return ("finer slave", "coarser slave")[self.slave] if self.contrast else ""

    @property
    def case(self) -> Case:
        """The coarsest scene, with the attributes as parameters."""
        facts = {name: np.array(float(getattr(self, name))) for name in _FACTS}
        scene = self.pose(self.meshes[0], Traits()).scene
        name = f"{self.group(Traits()) or ('upper slave', 'lower slave')[self.slave]}, {self.stiffness:g} E/h"
        return replace(scene, facts=facts, name=name).case()

    @classmethod
    def from_case(cls, case: Case) -> Self:
        """Return the study that a case stands for."""
        slave, stiffness, amplitude, contrast = map(case.parameter, _FACTS)
        return cls(int(slave), stiffness, amplitude, bool(contrast))


@collect
def flat_cases() -> Iterator[Case]:
    """Return both choices of the slave at two penalties, then a slave four times finer, and one four times coarser."""
    for slave, stiffness in product((UPPER, LOWER), (10.0, 1e3)):
        yield WavyStudy(slave, stiffness).case
    for slave in (UPPER, LOWER):
        yield WavyStudy(slave, 10.0, contrast=True).case


# Facets of the two meshes are up to this amplitude, a length, × k²h²/8 apart: 1 to 10 times p/ε̂ at 100 E/h.
CURVED_AMPLITUDE = 1e-6


@collect
def curved_cases() -> Iterator[Case]:
    """Return both choices of the slave at two penalties, on a curved interface."""
    for slave, stiffness in product((UPPER, LOWER), (10.0, 100.0)):
        yield WavyStudy(slave, stiffness, CURVED_AMPLITUDE).case


_SERIES = {
    "slave force error": FORCES[0],
    "master force error": FORCES[1],
    "slave displacement error": MOTIONS[0],
    "master displacement error": MOTIONS[1],
    "pressure error": PRESSURE,
}
_PRESSURE_RATE = Bound(
    name="rate of pressures",
    kinds=(PRESSURE,),
    rate=True,
    limits={"": 0.9},
    reason="Constant pressures on segments have the rate 1.",
)
_FORCE_RATE = partial(Bound, name="rate of forces", kinds=FORCES, rate=True)
_MOTION_RATE = partial(Bound, name="rate of displacements", kinds=MOTIONS, rate=True)
_LAST_PRESSURE = partial(Bound, name="pressure error on the finest mesh", kinds=(PRESSURE,), of_best="kh/√24")
WAVY_STUDIES = Studies(
    cases=flat_cases,
    read=WavyStudy.from_case,
    series=_SERIES,
    bounds=(
        _FORCE_RATE(
            limits={"": 1.1, "finer slave": 0.8, "coarser slave": 0.8},
            reason="Right ones: at least 1.22, and 0.95 where pressures belong to the coarser side; wrong ones: 0.58.",
        ),
        _MOTION_RATE(
            limits={"": 1.8, "finer slave": 1.6, "coarser slave": 1.6},
            reason="The rate of linear elements is 2; right ones: at least 1.89 and 1.72.",
        ),
        _PRESSURE_RATE,
        _LAST_PRESSURE(
            limits={"": 2.0},
            reason="The best pressure that is constant on each segment h is off by kh/√24 of the wave; twice that is "
            "allowed.",
        ),
    ),
)
CURVED_STUDIES = Studies(
    cases=curved_cases,
    read=WavyStudy.from_case,
    series=_SERIES,
    bounds=(
        _FORCE_RATE(limits={"": 1.0}, reason="Right ones: at least 1.13."),
        _MOTION_RATE(limits={"": 1.8}, reason="The rate of linear elements is 2; right ones: at least 1.89."),
        _PRESSURE_RATE,
        _LAST_PRESSURE(
            limits={"": 4.0},
            reason="Twice that of `accuracy.wavy`: facets that cross add as much as constant pressures do.",
        ),
    ),
)


def pose_wavy(
    segments: int, stiffness: float, traits: Traits, variation: Variation, growth: float = 0.0
) -> ProblemInstance:
    """Return the problem with about so many segments along the upper body, and a third more along the lower one.

    Rows of cells have equal heights, or grow by the share `growth` from one to the next.
    """
    wanted, grading = segments * variation.size, GRADING + 0.1 * variation.grading
    columns = round(wanted), round(wanted * COLUMNS[LOWER] / COLUMNS[UPPER])
    body = LOWER if variation.swapped else UPPER
    study = WavyStudy(body, stiffness, own_columns=columns, grading=grading, load=variation.load, growth=growth)
    return study.pose(1, traits)


WAVY = Problem(
    label="two wavy half-planes in full contact",
    meshes=(8, 16, 32, 64, 128, 256),
    targets=(1e-2, 1e-3, 1e-4, 1e-5),
    pose=pose_wavy,
    rank=1,
)
