"""The study that `accuracy.wavy` and `accuracy.wavy-curved` share: wavy half-planes in full contact on four meshes.

A case is one study: which body is the slave, and the penalty in units of E/h, with which it grows as the mesh is
refined. In two more studies one of the meshes is four times finer than the other. The case holds the coarsest scene;
the finer ones are made here. Each scene has the exact field of its own penalty, so that the errors are those of the
meshes alone.

Rule for the next editor: the exact field is in `contactverif.problems.wavy`, the errors are those of
`contactverif.problems.wavy_errors`. Bounds belong to the properties, with the measurements that they come from.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import inf, sqrt

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Surface
from contactverif.contract.property import Measurement, Quantity
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import fit_rate, solve_for_accuracy
from contactverif.mechanics.scene import Scene
from contactverif.problems.wavy import COLUMNS, LOWER, UPPER, WavyProblem, wavy_scene
from contactverif.problems.wavy_errors import (
    MASTER_FORCES,
    MASTER_MOTION,
    PRESSURE,
    SLAVE_FORCES,
    SLAVE_MOTION,
    wavy_errors,
    wavy_forces,
)

MESHES = (1, 2, 4, 8)  # The refinements r of the study.
# The cells along both surfaces where one mesh is four times finer, and r. No inner node meets a node for these r.
CONTRAST_COLUMNS, CONTRAST_MESHES = (4, 1), (6, 9, 13, 18)
SERIES = dict.fromkeys((SLAVE_FORCES, MASTER_FORCES, SLAVE_MOTION, MASTER_MOTION, PRESSURE), "1")

FORCE_RATE, MOTION_RATE, PRESSURE_RATE = "rate of forces", "rate of displacements", "rate of pressures"
LAST_PRESSURE = "pressure error on the finest mesh"


@dataclass(frozen=True, slots=True)
class WaveStudy:
    """One study: the parameters of a case.

    Attributes
    ----------
    slave : int
        The body that is the slave.
    stiffness : float
        The penalty ε̂h/E, with E of the upper body and the mean cell h of the coarser mesh.
    amplitude : float
        The amplitude of the interface where the bodies meet, a length.
    contrast : bool
        True if the mesh of the upper body is four times finer than that of the lower one.
    """

    slave: int
    stiffness: float
    amplitude: float = 0.0
    contrast: bool = False

    @property
    def columns(self) -> tuple[int, int]:
        """The numbers of cells along both surfaces at r = 1."""
        return CONTRAST_COLUMNS if self.contrast else COLUMNS

    @property
    def meshes(self) -> tuple[int, ...]:
        """The refinements r."""
        return CONTRAST_MESHES if self.contrast else MESHES

    @property
    def coarse_slave(self) -> bool:
        """True if the slave is the body whose mesh is four times coarser."""
        return self.contrast and self.slave == LOWER

    @classmethod
    def from_case(cls, case: Case) -> WaveStudy:
        """Return the study that a case of `study_cases` stands for."""
        return cls(
            int(case.parameter("slave")),
            case.parameter("stiffness"),
            case.parameter("amplitude"),
            bool(case.parameter("contrast")),
        )

    def penalty(self, refine: int) -> float:
        """Return the penalty ε̂ on a mesh."""
        problem = WavyProblem()
        return self.stiffness * problem.young[UPPER] * min(self.columns) * refine / problem.wavelength

    def least_penetration(self, refine: int) -> float:
        """Return (p̄ − p1)/ε̂, a length."""
        problem = self.problem(refine)
        return (problem.mean - problem.wave) / problem.penalty

    def problem(self, refine: int, *, multipliers: bool = False) -> WavyProblem:
        """Return the problem on a mesh, with its penalty, or without any for a formulation with multipliers."""
        return WavyProblem(penalty=inf if multipliers else self.penalty(refine), amplitude=self.amplitude)

    def scene(self, refine: int, *, multipliers: bool = False) -> Scene:
        """Return the scene on a mesh; with multipliers its penalty is the scale of the contact decision."""
        scene = wavy_scene(self.problem(refine, multipliers=multipliers), refine, self.slave, self.columns)
        return replace(scene, penalty=self.penalty(refine)) if multipliers else scene

    def case(self) -> Case:
        """Return the case: the coarsest scene, and the parameters."""
        facts = {name: getattr(self, name) for name in ("slave", "stiffness", "amplitude", "contrast")}
        words = ("finer", "coarser") if self.contrast else ("upper", "lower")
        name = f"{words[self.slave]} slave, {self.stiffness:g} E/h"
        scene = replace(self.scene(self.meshes[0]), facts={key: np.array(float(fact)) for key, fact in facts.items()})
        return replace(scene.case(), name=name)


@cache
def study_cases(amplitude: float, stiffnesses: tuple[float, ...]) -> tuple[Case, ...]:
    """Return the studies of an interface of that amplitude: both choices of the slave, penalties ε̂h/E as given."""
    return tuple(WaveStudy(*choice, amplitude).case() for choice in product((UPPER, LOWER), stiffnesses))


@cache
def contrast_cases(stiffness: float) -> tuple[Case, ...]:
    """Return the studies of a flat interface whose slave is four times finer, or coarser, than the master."""
    return tuple(WaveStudy(slave, stiffness, contrast=True).case() for slave in (UPPER, LOWER))


def measure_study(case: Case, subject: Subject, bounds: dict[str, float]) -> Measurement:
    """Solve a study on all meshes and fit the rates of its errors.

    Parameters
    ----------
    case : Case
        A case of `study_cases`.
    subject : Subject
        The formulation.
    bounds : dict[str, float]
        The least rates by name, FORCE_RATE, MOTION_RATE and PRESSURE_RATE, and the largest error of the pressure,
        LAST_PRESSURE, in units of kh/√24.

    Returns
    -------
    Measurement
        The rates, each the smaller one of both bodies, and the error of the pressure on the finest mesh, if pressures
        are reported. Details: iterations on the finest mesh. Series: the errors on each mesh. Undecided where Newton's
        method finds no solution on a mesh.
    """
    study, failures, errors, iterations = WaveStudy.from_case(case), "", [], 0
    multipliers = subject.traits.enforcement == "multiplier"
    for refine in study.meshes:
        scene, step = study.scene(refine, multipliers=multipliers), study.least_penetration(refine) / 16
        solution = solve_for_accuracy(scene, subject, step=step)
        iterations = solution.trace.n_iterations
        if not solution.balanced and not failures:
            failures = f"Newton's method finds no solution on mesh {refine}: {solution.trace.end.label}"
        errors.append(wavy_errors(solution, study.problem(refine, multipliers=multipliers), study.slave))
    measurement = _fit_rates(study, errors, bounds)
    return replace(measurement, undecided=failures, details={"iterations": float(iterations)})


def _fit_rates(study: WaveStudy, errors: list[dict[str, float]], bounds: dict[str, float]) -> Measurement:
    """Return rates and the last error of the pressure, with their bounds, from the errors on all meshes."""
    series = {name: np.array([each[name] for each in errors]) for name in SERIES if name in errors[0]}
    rates = {name: fit_rate([1 / refine for refine in study.meshes], values) for name, values in series.items()}
    values = {
        FORCE_RATE: min(rates[SLAVE_FORCES], rates[MASTER_FORCES]),
        MOTION_RATE: min(rates[SLAVE_MOTION], rates[MASTER_MOTION]),
    }
    tolerances = {name: bounds[name] for name in values}
    if PRESSURE in series:
        values |= {PRESSURE_RATE: rates[PRESSURE], LAST_PRESSURE: float(series[PRESSURE][-1])}
        tolerances |= {
            PRESSURE_RATE: bounds[PRESSURE_RATE],
            LAST_PRESSURE: bounds[LAST_PRESSURE] * constant_pressure_error(study),
        }
    # `judge` takes the formulas and the senses of the property.
    numbers = [Quantity(name, "1", "", "").check(value, tolerances[name]) for name, value in values.items()]
    return Measurement(numbers, series=series)


def constant_pressure_error(study: WaveStudy) -> float:
    """Return kh/√24 for the mean slave segment h of the finest mesh.

    It is the root mean square error, over the amplitude of the wave, of the best pressure that is constant on each
    slave segment: a slope p1 k sin kx leaves h/√12 of itself, and sin² has the mean 1/2.
    """
    segment = WavyProblem().wavelength / (study.columns[study.slave] * study.meshes[-1])
    return WavyProblem().wave_number * segment / sqrt(24)


def exact_study_forces(case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, 2) that push the nodes of the coarsest mesh, for pictures."""
    study, interface = WaveStudy.from_case(case), case.interface
    problem = study.problem(study.meshes[0])
    sides: tuple[tuple[Surface, int], ...] = ((interface.slave, study.slave), (interface.master, 1 - study.slave))
    forces = [wavy_forces(side, case.positions, problem, body) for side, body in sides]
    return forces[0] + forces[1]
