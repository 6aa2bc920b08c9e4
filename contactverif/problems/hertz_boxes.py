"""Hertz' contact in two boxes: a parabola on a flat, with the exact stresses of half-planes on the sides of both.

The boxes are |x| ≤ 4a, 0 ≤ η ≤ 8a with the depth η into each body; the contact is |x| ≤ a with a/R = 1e-3. Since the
sides carry the stresses of half-planes, no error of a finite size remains. Those of the multiplier's solution (1/ε̂ = 0)
are McEwan's. With a penalty ε̂ the pressure is that of a layer of springs, and the stresses are Flamant's, superposed.

Supports take no load in the exact solution. The far node of each body next to the axis has the exact displacement
along x, and displacements into each body are those relative to this named point. The flat is held there; the node half
as deep has the exact displacement along x too, so that the flat cannot turn. The parabola is held by contact alone, so
that the whole force is given.

What is left of a finite slope and of finite deformations is of the order a/R: 3e-4 in nodal forces.

Rules for the next editor: no node of one body meets one of the other in the contact. On each mesh the edges of the
contact divide segments one to two and two to one, so that errors fall evenly: with edges anywhere, where `mesh_scale`
puts them, they scatter by a factor of 3. Cells grow away from the contact by a share that falls like √h, so that the
error of the mesh itself falls like h.

Source: K. L. Johnson, Contact Mechanics (1985), Sections 2.3, 4.2(c) and 5.8.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache, partial
from itertools import product
from math import ceil, gcd, log1p, sqrt
from typing import Self

import numpy as np

from contactverif.contract.arrays import FloatArray, freeze
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import Solution, shape_integrals
from contactverif.mechanics.bodies import grid_cells
from contactverif.mechanics.scene import Scene
from contactverif.problems import hertz
from contactverif.problems.disk import grade
from contactverif.problems.flat_states import collect
from contactverif.problems.problem import (
    FORCES,
    ITERATIONS,
    MOTIONS,
    PRESSURE,
    Bound,
    Errors,
    Problem,
    ProblemInstance,
    Studies,
    Variation,
)

# Lengths over the half-width of the contact.
SIDE, DEPTH = 4.0, 8.0
ZONE = 0.28  # Equally long segments reach at least this far beyond the edges of the contact. They may touch.
COARSEST = 16  # Number of the parabola's segments across the contact on the coarsest mesh.
RATIO = 8 / 7  # The flat has at least so many segments for each of the parabola's.
GROWTH = 0.3  # Cells grow by this share of their distance from the zone on the coarsest mesh, by √h/h₀ of it on others.
CACHE_SIZE = 256  # The number of exact fields that are remembered: those of all meshes, penalties and bodies are 144.


@dataclass(frozen=True, slots=True)
class HertzBox:
    """The data of a parabola that is pressed on a flat."""

    half_width: float = 1.0  # The half-width a of the contact, a length.
    radius: float = 1000.0  # The radius R of the parabola y = x²/2R, a length.
    # Young's moduli, force per length squared, and Poisson's ratios of parabola and flat.
    young: tuple[float, float] = (1.0, 3.0)
    poisson: tuple[float, float] = (0.3, 0.2)
    mesh_scale: float = 1.0  # The half-width that meshes are made for, over that of the contact

    @property
    def stiffness(self) -> float:
        """The stiffness E* of both bodies together, 1/E* = Σ (1 − ν²)/E, force per length squared."""
        pairs = zip(self.young, self.poisson, strict=True)
        return 1 / sum((1 - poisson**2) / young for young, poisson in pairs)

    def pressure(self, penalty: float | None) -> hertz.LinePressure:
        """Return the exact pressure with the distributed penalty ε̂, or that of multipliers (None)."""
        return _pressure(self, penalty)


@cache
def _pressure(box: HertzBox, penalty: float | None) -> hertz.LinePressure:
    if penalty is None:
        return hertz.hertz_contact(box.half_width, box.radius, box.stiffness)
    return hertz.layer_contact(box.half_width, box.radius, box.stiffness, penalty)


@cache
def hertz_box(
    box: HertzBox = HertzBox(),
    *,
    penalty: float,
    rigid_layer: bool = False,
    across: int = COARSEST,
    parabola_is_slave: bool = True,
    name: str = "",
) -> Scene:
    """Return the scene. Its first guess lowers the parabola as it is by a²/2R, so that it penetrates for |x| < a.

    A rigid layer is the exact solution of multipliers, 1/ε̂ = 0. `across` is the number of the parabola's segments
    across the contact, 2a/h − 1/3.
    """
    if across < COARSEST:
        raise MisuseError("across", f"{across}", f"at least {COARSEST} segments across the contact")
    law = None if rigid_layer else penalty
    numbers = (0, 1) if parabola_is_slave else (1, 0)
    bodies = tuple(hertz_body(box, number, penalty=law, across=across) for number in numbers)
    return Scene(bodies, penalty=penalty, name=name)


@cache
def hertz_body(box: HertzBox, number: int, *, penalty: float | None, across: int = COARSEST) -> Body:
    """Return parabola (0) or flat (1) with its tractions and supports; the parabola lies above, y = x²/2R + η.

    The penalty is that of the exact solution; None is that of multipliers.
    """
    pressure, a = box.pressure(penalty), box.half_width
    x, depth, zone = (a * box.mesh_scale * lines for lines in mesh_lines(number, across))
    grid = np.arange(len(x) * len(depth)).reshape(len(depth), len(x))
    along, down = (part.reshape(-1) for part in np.meshgrid(x, depth))
    load = hertz.side_forces(pressure, x, depth).reshape(-1, 2)
    axis, is_parabola = int(np.abs(x).argmin()), number == 0
    supports = [grid[-1, axis]] if is_parabola else [grid[-1, axis], grid[len(depth) // 2, axis]]
    exact = hertz.displacements(pressure, along[supports], down[supports], box.young[number], box.poisson[number])
    fixed, imposed = np.zeros(load.shape, bool), np.zeros(load.shape)
    fixed[supports, 0], imposed[supports, 0] = True, exact[:, 0]
    fixed[supports[0], 1] = not is_parabola
    up = 1.0 if is_parabola else -1.0
    height = along**2 / (2 * box.radius) * (1 - down / depth[-1]) if is_parabola else 0.0
    walk = grid[0, :: int(up)]
    inside = walk[np.isin(along[walk], zone)]
    return Body(
        np.column_stack([along, up * down + height]),
        grid_cells(grid) if is_parabola else grid_cells(grid)[:, ::-1],
        np.column_stack([inside[:-1], inside[1:]]),
        box.young[number],
        box.poisson[number],
        fixed=fixed,
        imposed=imposed,
        load=load * [1, up],
        start=np.array([0.0, -(a**2) / (2 * box.radius) if is_parabola else 0.0]),
        name=("parabola", "flat")[number],
    )


def mesh_lines(number: int, across: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return columns x (n,) and rows η (m,) over a, and the nodes (n_contact,) of the zone among the columns.

    An edge of the contact divides a segment one to two, the other edge two to one, so that errors fall evenly with h.
    """
    count = across
    if number == 1:  # No node of the flat meets one of the parabola.
        count = ceil(RATIO * across)
        while gcd(3 * across + 1, 3 * count + 2) > 1:
            count += 1
    part = (number + 1) / 3
    size = 2 / (count + part)
    beyond = ceil(ZONE / size)
    zone = -1 + size * (np.arange(count + 2.0 * beyond + 2) - beyond - part)
    growth = GROWTH * sqrt(COARSEST / across)
    lengths = SIDE + zone[0], SIDE - zone[-1], DEPTH
    steps = [ceil(log1p(growth * length / size) / growth) for length in lengths]
    left, right, depth = (grade(length, size, parts, parts) for length, parts in zip(lengths, steps, strict=True))
    x: FloatArray = np.concatenate([zone[0] - left[:0:-1], zone, zone[-1] + right[1:]])
    return x, depth, np.array(zone, dtype=np.float64)


def exact_displacements(box: HertzBox, penalty: float | None, number: int, x: FloatArray, across: int) -> FloatArray:
    """Return the exact displacements (n, 2) of the surface of a body at x (n,), along x and upwards.

    The flat's displacements are those relative to its named point, which the mesh (`across`) chooses; the parabola's
    are such that both surfaces fit. The penalty None is that of multipliers.
    """
    return _exact_displacements(box, penalty, number, _Places(x.tobytes(), x), across)


@dataclass(frozen=True, slots=True)
class _Places:
    """Places that are equal if their bytes are. The array is the caller's, whose strides may decide the last bit."""

    key: bytes
    x: FloatArray = field(compare=False)


@lru_cache(maxsize=CACHE_SIZE)
def _exact_displacements(box: HertzBox, penalty: float | None, number: int, places: _Places, across: int) -> FloatArray:
    """Return what `exact_displacements` does; both choices of the slave and all formulations ask for the same."""
    pressure, x = box.pressure(penalty), places.x
    young, poisson = box.young[number], box.poisson[number]
    moves = hertz.surface_displacements(pressure, x, young, poisson)
    if number == 1:
        lines, depth, _ = mesh_lines(1, across)
        named = box.half_width * box.mesh_scale * np.array([lines[np.abs(lines).argmin()], depth[-1]])
        moves -= [0, 1] * hertz.displacements(pressure, named[:1], named[1:], young, poisson)[0]
        return freeze(moves * [1, -1], np.float64)
    centre = np.zeros(1)
    below = exact_displacements(box, penalty, 1, centre, across)[0, 1]
    layer = 0.0 if penalty is None else pressure.peak / penalty
    moves[:, 1] += below - layer - hertz.surface_displacements(pressure, centre, young, poisson)[0, 1]
    return freeze(moves, np.float64)


BOX = HertzBox()
PEAK, WIDTH = "peak", "half-width"  # Kinds of error
MESHES = (COARSEST, 20, 26, 33, 66)  # Two octaves: numbers of the parabola's segments across the contact.
# The penalties of studies: their stiffness, and whether that is ε̂ over E/a, the same on all meshes, or ε̂ over E/h.
PENALTIES = {"layer": (1.0, True), "soft": (1.0, False), "stiff": (100.0, False)}


_FACTS = ("parabola_is_slave", "stiffness", "fixed")  # The attributes of HertzStudy that a case has.


@dataclass(frozen=True, slots=True)
class HertzStudy:
    """One choice of slave and penalty, on meshes of any fineness."""

    parabola_is_slave: bool
    stiffness: float  # The penalty ε̂ over E/h, with E and the segments h of the parabola
    fixed: bool = False  # The stiffness is ε̂ over E/a instead, with the half-width a, the same on all meshes.
    box: HertzBox = BOX
    meshes: tuple[int, ...] = MESHES  # The numbers of the parabola's segments across the contact

    def size(self, across: int) -> float:
        """Return half the length of the parabola's segments over the half-width of the contact."""
        return 1 / (across + 1 / 3)

    def penalty(self, across: int) -> float:
        """Return the penalty ε̂ on a mesh."""
        length = self.box.half_width if self.fixed else 2 * self.box.half_width / (across + 1 / 3)
        return self.stiffness * self.box.young[0] / length

    def pose(self, across: int, traits: Traits) -> ProblemInstance:
        """Return the problem on a mesh. With a penalty, Newton's method starts at the exact displacements."""
        multipliers, box, penalty = traits.rules.enforcement == "multiplier", self.box, self.penalty(across)
        numbers = (0, 1) if self.parabola_is_slave else (1, 0)
        law = None if multipliers else penalty
        scene = hertz_box(
            box, penalty=penalty, rigid_layer=multipliers, across=across, parabola_is_slave=self.parabola_is_slave
        )
        interface, pressure = scene.interface, box.pressure(law)
        sides = np.split(np.arange(interface.n_nodes), [interface.n_slave_nodes])

        def forces(positions: FloatArray) -> FloatArray:  # ∫ N_i p ds
            forces = np.zeros(positions.shape)
            for number, nodes in zip(numbers, sides, strict=True):
                order = nodes[np.argsort(positions[nodes, 0])]
                forces[order, 1] = (1.0 if number == 0 else -1.0) * pressure.nodal_forces(positions[order, 0])
            return forces

        start = None
        if not multipliers:  # Exact gaps of multipliers are 0 and do not say what is in contact; penetration does.
            exact = np.zeros(interface.nodes.shape)
            for number, nodes in zip(numbers, sides, strict=True):
                exact[nodes] = exact_displacements(box, law, number, interface.nodes[nodes, 0], across)
            start = scene.transformation.T @ exact.reshape(-1)
        return ProblemInstance(
            scene=scene,
            forces=forces,
            motions=(lambda places: exact_displacements(box, law, numbers[0], places[:, 0], across),),
            pressure=lambda places: pressure.pressure(places[:, 0]),
            pressure_scale=pressure.peak,
            deformed=False,
            further=partial(_shape_errors, forces(interface.nodes)),
            start=start,
            best=self._best(across, pressure, multipliers),
        )

    def _best(self, across: int, pressure: hertz.LinePressure, multipliers: bool) -> Errors:
        """Return what the mesh allows: linear pressures, pressures that are constant on segments, and their length.

        Segments of the parabola are chords, whose distances from it have the root mean square h²/(√180 · 2R). They add
        ε̂ times that to pressures; multipliers are as stiff as can be.
        """
        numbers = (0, 1) if self.parabola_is_slave else (1, 0)
        slave, master = (self.box.half_width * mesh_lines(number, across)[2] for number in numbers)
        penalty = HertzStudy(self.parabola_is_slave, *PENALTIES["stiff"]).penalty(across) if multipliers else None
        chord = (2 * self.box.half_width * self.size(across)) ** 2 / (sqrt(180) * 2 * self.box.radius)
        facets = (penalty or self.penalty(across)) * chord
        constant = pressure.constant_error(slave) * sqrt(pressure.square / (2 * self.box.half_width))
        slave_error, master_error = map(pressure.linear_error, (slave, master))
        return {
            **dict(zip(FORCES, (slave_error, master_error), strict=True)),
            **dict.fromkeys((MOTIONS[0], PEAK), slave_error),
            PRESSURE: (constant + facets) / pressure.peak,
            WIDTH: (slave[1] - slave[0]) / self.box.half_width,
        }

    def group(self, traits: Traits) -> str:
        """Return the word of the penalty, and the slave if it is stiff; multipliers are as stiff as can be."""
        penalties = {penalty: word for word, penalty in PENALTIES.items()}
        word = "stiff" if traits.rules.enforcement == "multiplier" else penalties[self.stiffness, self.fixed]
        return word if word != "stiff" else f"{'parabola' if self.parabola_is_slave else 'flat'} {word}"

    @classmethod
    def from_case(cls, case: Case) -> Self:
        """Return the study that a case stands for."""
        slave, stiffness, fixed = map(case.parameter, _FACTS)
        return cls(bool(slave), stiffness, bool(fixed))


def _shape_errors(exact: FloatArray, solution: Solution) -> Errors:
    """Return the errors of the largest pressure on the slave and of 2 √(Σ F x² / Σ F), which is a for Hertz."""
    interface, numbers = solution.interface, []
    lengths = shape_integrals(interface.slave, interface.nodes)
    counted = lengths > 0
    for forces in (solution.forces, exact):
        pushes = np.abs(forces[counted, 1])
        total = pushes.sum()
        width = 2 * np.sqrt(pushes @ interface.nodes[counted, 0] ** 2 / total) if total > 0 else 0.0
        numbers.append((float((pushes / lengths[counted]).max()), float(width)))
    return {kind: abs(computed / right - 1) for kind, computed, right in zip((PEAK, WIDTH), *numbers, strict=True)}


@collect
def hertz_cases() -> Iterator[Case]:
    """Return six studies, each as the scene of its coarsest mesh: either body as the slave, three penalties."""
    for slave, (word, penalty) in product(("parabola", "flat"), PENALTIES.items()):
        study = HertzStudy(slave == "parabola", *penalty)
        coarsest = partial(hertz_box, BOX, penalty=study.penalty(COARSEST), name=f"{slave}-{word}")
        facts = {name: np.array(float(getattr(study, name))) for name in _FACTS}
        yield replace(coarsest(parabola_is_slave=study.parabola_is_slave), facts=facts).case()


# Right formulations reach 1.2, 1.4, 2.2 and 2.2 times P1, strangers among them. One that closes a segment when its last
# point closes has 2.6 on the layer, and the rate 1.4. Wrong ones with up to five points a segment have 4.1 and more
# there; with eight Gauss points they have 1.8, and their rate tells.
_SIZES = {"layer": 3.0, "soft": 3.0, "parabola stiff": 3.0, "flat stiff": 8.0}
_RATES = {"layer": 1.1, "soft": 0.85, "parabola stiff": 0.75, "flat stiff": 0.75}
_LARGE = {"layer": 1.5, "soft": 1.5, "parabola stiff": 2.5, "flat stiff": 2.5}
_SAME = {"": 1}
_MOVES = {"layer": 1.5, "": 1.0}
_MIDDLE = "The pressure is smooth there, so that it is better than the mean; right ones have at most 0.4 P1."
_SMOOTHER = "Displacements are smoother than pressures; right ones have 0.6 P1 on the layer and 0.34 P1 elsewhere."
_LINEAR = (
    "P1 is the L2 error of the best continuous linear pressure on the side's nodes; right ones reach 1.2 to 2.2 P1."
)
_ROOT = "Asked where the error is above 1.5 or 2.5 P1. The pressure's edge allows 1, on a layer of fixed stiffness 1.5."
_P0 = "P0 is the error of the best constant pressures on slave segments; facets add ε̂h²/(√180 · 2R p0)."
HERTZ_STUDIES = Studies(
    cases=hertz_cases,
    read=HertzStudy.from_case,
    bounds=(
        *(
            Bound(name=f"error of {kind}", kinds=(kind,), limits=_SIZES, of_best=" P1", reason=_LINEAR)
            for kind in FORCES
        ),
        *(
            Bound(name=f"rate of {kind}", kinds=(kind,), rate=True, limits=_RATES, only_above=_LARGE, reason=_ROOT)
            for kind in FORCES
        ),
        Bound(name="error of reported pressures", kinds=(PRESSURE,), limits=_SAME, of_best=" P0 + facets", reason=_P0),
        Bound(name="error of the peak", kinds=(PEAK,), limits=_SAME, of_best=" P1", reason=_MIDDLE),
        Bound(name="error of displacements", kinds=MOTIONS[:1], limits=_MOVES, of_best=" P1", reason=_SMOOTHER),
        Bound(name="error of the half-width", kinds=(WIDTH,), limits=_SAME, of_best=" h/a", reason="A segment."),
    ),
    series={
        "E_F of the slave": FORCES[0],
        "E_F of the master": FORCES[1],
        "reported pressures": PRESSURE,
        "peak": PEAK,
        "half-width": WIDTH,
        "displacements": MOTIONS[0],
        "iterations": ITERATIONS,
    },
    nearly=1e-4,  # Newton's method may alternate over a kink at an edge, where residuals are small.
)


def _pose(across: int, stiffness: float, traits: Traits, variation: Variation) -> ProblemInstance:
    """Return the problem with about so many segments across the contact, whose edge lies anywhere in a segment."""
    count = max(COARSEST, round(across * variation.size))
    box = replace(BOX, mesh_scale=1 + 2 * variation.shift / count, radius=BOX.radius / variation.load)
    instance = HertzStudy(not variation.swapped, stiffness, box=box).pose(count, traits)
    return replace(instance, start=None)


HERTZ = Problem(
    label="Hertz' contact in boxes", meshes=(20, 40, 80), targets=(2e-2, 1e-2, 5e-3, 1e-3), pose=_pose, rank=2
)
