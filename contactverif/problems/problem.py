"""The parts that problems with an exact answer have in common: scenes on meshes, errors, and studies on finer meshes.

It is no part of `contract`, because scenes and solutions belong to mechanics, of which a contract knows nothing.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError, describe_error, place_of_error
from contactverif.contract.interface import PLANE
from contactverif.contract.property import Quantity
from contactverif.contract.traits import Traits
from contactverif.mechanics import accuracy
from contactverif.mechanics.accuracy import Field, Solution
from contactverif.mechanics.scene import Scene

Errors = dict[str, float]  # {kind of error: number, dimensionless}; a kind that is not reported is not there.

# Kinds of error. A pair is that of slave and master.
FORCES = "slave forces", "master forces"
MOTIONS = "slave displacement", "master displacement"
PRESSURE, ITERATIONS = "pressure", "iterations"

DEPTHS = {"near": 1, "deep": 10, "deepest": 1000}  # {start of Newton's method in a bench: depth over the guess}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ProblemInstance:
    """A problem on one mesh, at one penalty, for formulations of some traits, with its exact answer."""

    scene: Scene  # Its penalty is ε̂. With multipliers it is the scale of the contact decision.
    forces: Callable[[FloatArray], FloatArray]  # From positions (n_nodes, dim) to the exact forces that push the nodes
    motions: tuple[Field, ...] = ()  # Exact displacements at reference places of the slave, and of the master if known
    pressure: Field  # The exact pressure at current places of the slave
    pressure_scale: float  # The pressure that errors of pressures are divided by
    parts: int = 1  # The number of equal parts of a segment, in each of which displacements are smooth
    deformed: bool = True  # Forces are distributed over current lengths, not over those of the reference.
    further: Callable[[Solution], Errors] = lambda _: {}  # Further kinds of error
    # (n_free,): the first iterate of a property, which asks for the solution alone; None for the guess of the scene
    start: FloatArray | None = None
    # From a number to the iterate (n_free,) that is so many times as deep as the guess; None for as many times its
    # displacements
    sink: Callable[[float], FloatArray] | None = None
    step: float | None = None  # The step of differences, a length, where a formulation has no tangent
    best: Mapping[str, float] = field(default_factory=dict)  # The least errors that the mesh allows, where known

    @property
    def starts(self) -> dict[str, FloatArray]:
        """The first iterates (n_free,) of a bench, the same for all formulations: near is the guess of the scene."""
        sink = self.sink or (lambda times: times * self.scene.start)
        return {name: sink(times) if times > 1 else self.scene.start for name, times in DEPTHS.items()}

    @property
    def first_guess(self) -> Case:
        """The first guess of the scene, with its penalty."""
        return Case(self.scene.interface, self.scene.positions(self.scene.start), self.scene.penalty)

    def exact_forces(self, state: Case) -> FloatArray:
        """Return the exact forces (n_nodes, dim) that push the nodes in a state of this mesh."""
        positions = state.positions if self.deformed else state.interface.nodes
        return _check_field("forces", self.forces, "a force for each node", positions.shape[1])(positions)

    @property
    def best_pressure(self) -> float:
        """The error of the best continuous pressure that is linear between the slave's nodes, as `errors` counts it."""
        guess = self.first_guess
        return accuracy.best_pressure_error(guess.interface.slave, guess.positions, self._pressure, self.pressure_scale)

    @property
    def _pressure(self) -> Field:
        return _check_field("pressure", self.pressure, "a number for each place")

    def errors(self, solution: Solution) -> Errors:
        """Return the errors of a solution by kind."""
        interface = solution.interface
        surfaces = interface.slave, interface.master
        positions = solution.state.positions if self.deformed else interface.nodes
        exact, errors = self.exact_forces(solution.state), {}
        for kind, surface in zip(FORCES, surfaces, strict=True):
            errors[kind] = accuracy.force_error(solution.forces, exact, accuracy.shape_integrals(surface, positions))
        for kind, surface, motion in zip(MOTIONS, surfaces, self.motions, strict=False):
            checked = _check_field("motions", motion, "a vector for each place", interface.dim)
            moves = interface.nodes, solution.displacements
            errors[kind] = accuracy.displacement_error(surface, *moves, checked, self.parts)
        pressure = accuracy.pressure_error(solution, self._pressure, self.pressure_scale)
        if pressure is not None:
            errors[PRESSURE] = pressure
        return errors | self.further(solution)


def _check_field(name: str, exact: Field, needed: str, *components: int) -> Field:
    """Return an exact field that refuses values of another shape, and names an exception with its file and line."""

    def values(places: FloatArray) -> FloatArray:
        try:
            exact_values = np.asarray(exact(places))
        except Exception as error:  # A stranger's function may raise what it likes.
            cause = f"{describe_error(error)}{place_of_error(error)}"
            raise MisuseError(f"ProblemInstance.{name}", cause, "values at all places") from error
        shape = (len(places), *components)
        if exact_values.shape != shape:
            raise MisuseError(f"ProblemInstance.{name}", f"shape {exact_values.shape}", f"{shape}, {needed}")
        return exact_values

    return values


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """A draw of what a problem leaves open, so that no result depends on one mesh. The default is the mesh itself."""

    size: float = 1.0  # The number of segments over that of the mesh, 0.8 to 1.2
    shift: float = 0.0  # The place of an edge or of the master's nodes, −1/2 to 1/2 of a segment
    grading: float = 0.0  # How much the master's segments grow along the surface, −1 to 1
    load: float = 1.0  # The factor of the load
    swapped: bool = False  # The other body is the slave.


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A problem that `contactverif bench` can solve: what an entry point of the group `contactverif.problems` names.

    `pose` takes a mesh, a penalty ε̂ in E/h, the traits of a formulation, and a variation, of which it uses what it can.
    E is Young's modulus of the softer body, h the mean segment of the mesh.
    """

    label: str  # What is solved, in words: "two rings shrunk onto each other"
    meshes: tuple[int, ...]  # From coarse to fine
    targets: tuple[float, ...]  # The errors of forces that cost is measured at, from large to small
    pose: Callable[[int, float, Traits, Variation], ProblemInstance]
    rank: int = 100  # Pages show problems of lower rank first.
    dim: int = PLANE  # 3 in space, where the faces are triangles


class Study(Protocol):
    """A problem on finer and finer meshes, as a property asks it."""

    @property
    def meshes(self) -> tuple[int, ...]:
        """The meshes, from coarse to fine."""

    def size(self, mesh: int) -> float:
        """Return the size of the cells of a mesh, in any unit."""

    def pose(self, mesh: int, traits: Traits) -> ProblemInstance:
        """Return the problem on a mesh for formulations of these traits."""

    def group(self, traits: Traits) -> str:
        """Return the key of the bounds that hold for formulations of these traits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bound:
    """The bound of one number of a study: the rate at which errors fall, or their size on the finest mesh."""

    name: str
    kinds: tuple[str, ...]  # The kinds of error. The least rate counts, or the largest error.
    limits: Mapping[str, float]  # {group of studies: limit}; the group "" is for all that are not named.
    reason: str
    rate: bool = False  # The number is a rate, which is at least the limit.
    # {group: multiple}: a rate is asked only where the error on the finest mesh is above this multiple of the best
    # approximation's error, and no error there is above its limit. Groups that are not named are asked anyway.
    only_above: Mapping[str, float] = field(default_factory=dict)
    of_best: str = ""  # The formula of the best approximation's error, if the limit is a multiple of that

    @property
    def quantity(self) -> Quantity:
        """The number as a property declares it."""
        limits = ", ".join(f"{group} {limit:g}{self.of_best}".lstrip() for group, limit in self.limits.items())
        return Quantity(self.name, limits, self.reason, sense="at least" if self.rate else "at most")

    def limit(self, group: str) -> float:
        """Return the limit for a group of studies."""
        return self.limits[group if group in self.limits else ""]

    def size(self, errors: Mapping[str, float]) -> float:
        """Return the largest of its errors on the finest mesh, those of a solution or of the best approximation."""
        return max(errors[kind] for kind in self.kinds)

    def tolerance(self, group: str, best: Mapping[str, float]) -> float:
        """Return the tolerance for a group of studies on a finest mesh with these best approximations."""
        return self.limit(group) * (self.size(best) if self.of_best else 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Studies:
    """The studies of a problem, and what is asked of them."""

    cases: Callable[[], tuple[Case, ...]]  # The coarsest mesh of each study, with its parameters
    read: Callable[[Case], Study]  # The study of a case
    bounds: tuple[Bound, ...]
    series: Mapping[str, str]  # {name in reports: kind of error} of what is kept of all meshes
    nearly: float = 0.0  # An iterate that is out of balance by this share of the largest exact force is a solution.

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The numbers that are judged."""
        return tuple(bound.quantity for bound in self.bounds)
