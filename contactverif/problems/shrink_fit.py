"""Two rings that are shrunk onto each other: Lamé's solution, and the scene of a quarter of them, or of the whole.

The pressure between the rings is uniform, and so are the gap and the force, but the interface is bent. That makes the
rings the patch test of curved surfaces: a mesh of straight segments has an error there, which must vanish as it is
refined.

Lamé's formula is the limit of a small interference. `ShrinkFit.finite` has no such limit: the rings stay linear, as
they are in a scene, but contact is measured where they are after the fit. It differs by about δ/c.

One force acts on both rings where action equals reaction. Two half passes give each ring the pressure on that ring's
own radius, and after the fit the radii differ by the penetration. `ShrinkFit.half_passes` is their fit.

Rules for the next editor: `ShrinkFit` knows no mesh and no formulation, so that it can be used without the harness. The
scene holds a quarter, cut along both lines of symmetry, so that nothing but contact loads the rings. A cut has ends of
both surfaces, and the foot of the slave's end may lie just past that of the master; whole rings have no ends.

Source: S. P. Timoshenko & J. N. Goodier, Theory of Elasticity (1970), Section 28 (Lamé's thick-walled cylinder).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from math import inf, pi
from typing import Literal, NamedTuple, Self

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import traction_forces
from contactverif.mechanics.scene import Scene
from contactverif.problems.problem import Problem, ProblemInstance, Variation

Role = Literal["inner", "outer"]
Area = Literal["current", "reference"]
SEGMENTS = {"inner": 12, "outer": 16}  # Numbers of segments along the interface of a quarter, at refine = 1.
GRADE = 0.15  # Angles of the outer ring are graded by so much, so that nodes do not meet nodes of the other ring.
LAYERS = {"inner": 3, "outer": 6}  # Numbers of layers of cells across each ring, at refine = 1.
_FACTS = ("inner_radius", "radius", "outer_radius", "young", "poisson", "interference")  # The attributes of ShrinkFit.


class FiniteFit(NamedTuple):
    """The fit of two rings, measured where they are after it."""

    force: float  # The force on the slave for each unit of angle, pressure times radius.
    pressure: float  # The contact pressure over the length of the slave, force per length.
    master_force: float  # The force on the master for each unit of angle.


@dataclass(frozen=True, slots=True)
class ShrinkFit:
    """Two concentric rings in plane strain, the outer one too small for the inner one.

    Attributes
    ----------
    inner_radius, radius, outer_radius : float
        The radii a < c < b: the hole, the interface after the fit, and the outside, a length each.
    young : tuple[float, float]
        Young's moduli of the inner and the outer ring, force per length squared.
    poisson : tuple[float, float]
        Poisson's ratios of both.
    interference : float
        The interference δ: the outer radius of the inner ring less the inner radius of the outer ring, a length.

    Examples
    --------
    The pressure with springs of 1e3 and without springs between the rings:

    >>> from contactverif import ShrinkFit
    >>> round(ShrinkFit().pressure(1e3), 7), round(ShrinkFit().pressure(), 7)
    (0.0650872, 0.0696185)
    """

    inner_radius: float = 1.0
    radius: float = 1.5
    outer_radius: float = 2.5
    young: tuple[float, float] = (1000.0, 300.0)
    poisson: tuple[float, float] = (0.3, 0.2)
    interference: float = 1e-3

    @property
    def compliances(self) -> tuple[float, float]:
        """By how much a unit pressure presses the inner ring in, and the outer ring out, at the interface: lengths."""
        a, b, c = self.inner_radius, self.outer_radius, self.radius
        (inner, outer), (inner_ratio, outer_ratio) = zip(*map(_plane_strain, self.young, self.poisson), strict=True)
        return (
            c / inner * ((c**2 + a**2) / (c**2 - a**2) - inner_ratio),
            c / outer * ((b**2 + c**2) / (b**2 - c**2) + outer_ratio),
        )

    def pressure(self, penalty: float = inf) -> float:
        """Return the pressure p = δ / (c_i + c_o + 1/ε̂), force per length, with both compliances and the springs ε̂."""
        return self.interference / (sum(self.compliances) + 1 / penalty)

    @property
    def contact_radii(self) -> tuple[float, float]:
        """The outer radius of the inner ring and the inner radius of the outer ring before the fit; δ lies between.

        The rings share δ as their compliances, so that without springs both end near the radius c.
        """
        inner, outer = (self.interference * part / sum(self.compliances) for part in self.compliances)
        return self.radius + inner, self.radius - outer

    @property
    def _flexibilities(self) -> list[float]:
        """By how much a force of 1 for each unit of angle moves each ring at its contact radius."""
        return [replace(self, radius=c).compliances[ring] / c for ring, c in enumerate(self.contact_radii)]

    def finite(self, slave: Role, penalty: float = inf, area: Area = "current") -> FiniteFit:
        """Return the fit with contact measured after it.

        A force f for each unit of angle is a traction f/R on a ring of contact radius R, which moves by C(R) f/R with
        Lamé's compliance C. The springs ε̂ stand on the slave ring. They give way by p/ε̂ with p = f/r and r the radius
        of the slave, after the fit ("current") or before it ("reference"). All that adds up to δ.
        """
        radii, flexibilities, index = self.contact_radii, self._flexibilities, int(slave == "outer")
        outwards = (-flexibilities[0], flexibilities[1])[index] if area == "current" else 0.0

        def excess(force: float) -> float:
            springs = force / (radii[index] + outwards * force) / penalty
            return sum(flexibilities) * force + springs - self.interference

        force = _find_root(excess, 2 * self.pressure() * self.radius)
        return FiniteFit(force, force / (radii[index] + outwards * force), force)

    def half_passes(self, slave: Role, penalty: float = inf, area: Area = "current") -> FiniteFit:
        """Return the fit of two half passes, which give each ring the pressure on its own radius.

        With a pressure p the force for each unit of angle is f = p r on a ring of radius r after the fit, or of contact
        radius R before it. So f_i = p R_i/(1 + p C_i/R_i) on the inner ring, and f_o = p R_o/(1 − p C_o/R_o) on the
        outer one, or p R for lengths of the reference. By how much the rings give way, and the penetration p/ε̂, add up
        to δ. After the fit the radii differ by p/ε̂, and so the forces by p²/ε̂.
        """
        radii, flexibilities = self.contact_radii, self._flexibilities
        inwards = (1.0, -1.0) if area == "current" else (0.0, 0.0)

        def forces(pressure: float) -> list[float]:
            rings = zip(radii, flexibilities, inwards, strict=True)
            return [pressure * radius / (1 + sign * pressure * gives) for radius, gives, sign in rings]

        def excess(pressure: float) -> float:
            moves = [gives * force for gives, force in zip(flexibilities, forces(pressure), strict=True)]
            return sum(moves) + pressure / penalty - self.interference

        pressure = _find_root(excess, 2 * self.pressure())
        inner, outer = forces(pressure)
        return FiniteFit(inner, pressure, outer) if slave == "inner" else FiniteFit(outer, pressure, inner)

    def displacement(self, radius: FloatArray, ring: Role, penalty: float = inf) -> FloatArray:
        """Return the radial displacement (n,) of a ring at the radii (n,), a length, positive outwards."""
        radius = np.asarray(radius, dtype=np.float64)
        modulus, ratio, (mean, deviation) = self._constants(ring, penalty)
        return ((1 - ratio) * mean * radius + (1 + ratio) * deviation / radius) / modulus

    def stresses(self, radius: FloatArray, ring: Role, penalty: float = inf) -> FloatArray:
        """Return the radial and the hoop stress (n, 2) of a ring at the radii (n,), positive in tension."""
        radius = np.asarray(radius, dtype=np.float64)
        _, _, (mean, deviation) = self._constants(ring, penalty)
        return np.stack([mean - deviation / radius**2, mean + deviation / radius**2], axis=-1)

    def _constants(self, ring: Role, penalty: float) -> tuple[float, float, tuple[float, float]]:
        """Return E', ν' and Lamé's constants A and B of σ = A ∓ B/r² for a ring that is loaded at the interface."""
        if ring not in SEGMENTS:
            raise MisuseError("ring", repr(ring), "'inner' or 'outer'")
        index = int(ring == "outer")
        free = (self.inner_radius, self.outer_radius)[index]
        mean = self.pressure(penalty) * self.radius**2 / (free**2 - self.radius**2)
        return *_plane_strain(self.young[index], self.poisson[index]), (mean, mean * free**2)


def _find_root(excess: Callable[[float], float], high: float) -> float:
    from scipy.optimize import brentq  # It takes long to import, and the first rows of a run do not need it.

    return float(brentq(excess, 0.0, high, xtol=1e-300, rtol=1e-14))


def _plane_strain(young: float, poisson: float) -> tuple[float, float]:
    """Return E' = E/(1 − ν²) and ν' = ν/(1 − ν), with which the formulas of plane stress hold in plane strain."""
    return young / (1 - poisson**2), poisson / (1 - poisson)


@cache
def shrink_fit(
    problem: ShrinkFit = ShrinkFit(),
    *,
    slave: Role = "inner",
    refine: float = 1,
    grading: float = GRADE,
    quarters: Literal[1, 4] = 1,
) -> Scene:
    """Return the scene of a quarter of both rings, or of whole rings.

    Parameters
    ----------
    problem : ShrinkFit
        Radii, materials and interference.
    slave : Literal['inner', 'outer']
        The ring that is the slave.
    refine : float
        The number of parts that each side of each cell is divided into; numbers of cells are rounded.
    grading : float
        The share by which the angles of the outer ring are graded.
    quarters : Literal[1, 4]
        The number of quarters.

    Returns
    -------
    Scene
        The rings, the slave first. The penalty is 1; a study chooses its own. The facts are the attributes of the
        problem and "outer_slave", 1 or 0; `RingStudy.from_case` reads them.
    """
    if slave not in SEGMENTS:
        raise MisuseError("slave", repr(slave), "'inner' or 'outer'")
    order: tuple[Role, Role] = ("inner", "outer") if slave == "inner" else ("outer", "inner")
    facts = {name: np.array(getattr(problem, name)) for name in _FACTS}
    facts["outer_slave"] = np.array(float(slave == "outer"))
    return Scene(tuple(_ring(problem, ring, refine, grading, quarters) for ring in order), facts=facts)


@cache
def _ring(problem: ShrinkFit, ring: Role, refine: float, grading: float, quarters: int) -> Body:
    """Return a ring or a quarter, held away from contact; nodes ring by ring from the inside, each from angle 0."""
    index = int(ring == "outer")
    contact = problem.contact_radii[index]
    limits = (contact, problem.outer_radius) if index else (problem.inner_radius, contact)
    n_segments, n_layers = round(SEGMENTS[ring] * refine), round(LAYERS[ring] * refine)
    radii, shares = np.linspace(*limits, n_layers + 1), np.linspace(0, 1, n_segments + 1)
    angles = pi / 2 * (shares + (grading if index else 0.0) * shares * (1 - shares))
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])  # A row times this matrix is turned by a quarter.
    quarter = np.column_stack([np.cos(angles), np.sin(angles)])[:-1]
    whole, parts = quarters == 4, [quarter @ np.linalg.matrix_power(turn, k) for k in range(quarters)]
    directions = np.vstack(parts if whole else [*parts, [[0.0, 1.0]]])
    number = np.arange((n_layers + 1) * len(directions)).reshape(n_layers + 1, -1)
    fixed = np.zeros((*number.shape, 2), bool)
    if whole:
        free = fixed[-1 if index else 0]  # The circle without contact.
        free[:: 2 * n_segments, 1] = free[n_segments :: 2 * n_segments, 0] = True
        number = np.hstack([number, number[:, :1]])  # The last column is the first one.
    else:
        fixed[:, 0, 1] = fixed[:, -1, 0] = True
    edge = number[0, ::-1] if index else number[-1]
    return Body(
        (radii[:, None, None] * directions).reshape(-1, 2),
        np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4),
        np.column_stack([edge[:-1], edge[1:]]),
        problem.young[index],
        problem.poisson[index],
        fixed=fixed.reshape(-1, 2),
        name=ring,
    )


@dataclass(frozen=True, slots=True)
class RingStudy:
    """Two rings at one penalty, the same on all meshes."""

    problem: ShrinkFit
    slave: Role
    penalty: float  # The distributed stiffness ε̂

    def fit(self, traits: Traits) -> FiniteFit:
        """Return the exact fit for formulations of these traits, the first of `fits`."""
        return self.fits(traits)[0]

    def fits(self, traits: Traits) -> tuple[FiniteFit, ...]:
        """Return the exact fits for formulations of these traits: one, or two where the traits leave open which.

        Forces that prefer no side and are not in balance are those of half passes. Where one side is preferred, the
        other one gets the force of that side, which is in balance between circles even if it is not elsewhere.
        """
        multiplier = traits.rules.enforcement == "multiplier"
        unbiased, balanced = traits.promises.unbiased, traits.promises.conserves_force
        kinds = [self.problem.finite, self.problem.half_passes]
        if multiplier or balanced or unbiased is False:
            kinds = kinds[:1]
        elif unbiased and balanced is False:
            kinds = kinds[1:]
        area: Area = "reference" if traits.rules.area == "reference" else "current"
        return tuple(fit(self.slave, inf if multiplier else self.penalty, area) for fit in kinds)

    def pose(
        self, refine: float, traits: Traits, grading: float = GRADE, quarters: Literal[1, 4] = 1
    ) -> ProblemInstance:
        """Return the problem on a mesh.

        The ends of a quarter are held across their line of symmetry, and bear what contact does there.
        """
        fit, ring = self.fit(traits), int(self.slave == "outer")
        scene = shrink_fit(self.problem, slave=self.slave, refine=refine, grading=grading, quarters=quarters)
        scene = replace(scene, penalty=self.penalty)
        outwards = (1 if ring else -1) * self.problem._flexibilities[ring] * fit.force

        def motion(places: FloatArray) -> FloatArray:
            return np.asarray(outwards * places / np.linalg.norm(places, axis=1)[:, None])

        def traction(of_master: bool, places: FloatArray) -> FloatArray:
            radii = np.linalg.norm(places, axis=1)[:, None]
            towards = -1.0 if (self.slave == "inner") is not of_master else 1.0
            return np.asarray(towards * (fit.master_force / radii if of_master else fit.pressure) * places / radii)

        def forces(positions: FloatArray) -> FloatArray:
            sides = ((scene.interface.slave, False), (scene.interface.master, True))
            return np.add(
                *(traction_forces(side, positions, partial(traction, of_master)) for side, of_master in sides)
            )

        return ProblemInstance(
            scene=scene,
            forces=forces,
            motions=(motion,),
            pressure=lambda places: np.full(len(places), fit.pressure),
            pressure_scale=fit.pressure,
        )

    @classmethod
    def from_case(cls, case: Case) -> Self:
        """Return the study that a case of a scene of `shrink_fit` stands for, on whatever mesh."""
        facts = {name: case.parameters[name].tolist() for name in _FACTS}
        facts |= {name: tuple(facts[name]) for name in ("young", "poisson")}
        return cls(ShrinkFit(**facts), "outer" if case.parameter("outer_slave") else "inner", case.penalty)


FIT = ShrinkFit(interference=1e-2)  # The interference is larger than the height of a facet.


def _pose(segments: int, stiffness: float, traits: Traits, variation: Variation) -> ProblemInstance:
    problem = replace(FIT, interference=FIT.interference * variation.load)
    refine = segments * variation.size / SEGMENTS["inner"]
    penalty = stiffness * min(problem.young) * SEGMENTS["inner"] * refine / (pi / 2 * problem.radius)
    study = RingStudy(problem, "outer" if variation.swapped else "inner", penalty)
    instance = study.pose(refine, traits, GRADE + 0.1 * variation.grading)
    scene = instance.scene

    def sink(times: float) -> FloatArray:
        """Return the unknowns (n_free,) with the inner ring's surface moved outwards."""
        nodes, way = scene.interface.nodes, (times - 1) * problem.interference
        of_slave = np.arange(len(nodes)) < scene.interface.n_slave_nodes
        inner = ~of_slave if variation.swapped else of_slave
        moves = np.where(inner, way / np.linalg.norm(nodes, axis=1), 0.0)[:, None] * nodes
        return np.asarray(scene.transformation.T @ moves.reshape(-1))

    return replace(instance, sink=sink)


RINGS = Problem(
    label="two rings shrunk onto each other",
    meshes=(15, 30, 60, 120, 240),
    targets=(2e-1, 1e-1, 1e-2, 1e-3),
    pose=_pose,
    rank=3,
)
