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

References
----------
K. L. Johnson, Contact Mechanics (1985), Sections 2.3, 4.2(c) and 5.8.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache, lru_cache, partial
from itertools import product
from math import ceil, gcd, log1p, sqrt

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray, freeze
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import Solution, shape_integrals
from contactverif.mechanics.scene import Scene
from contactverif.problems.disk import grade
from contactverif.problems.hertz import (
    LinePressure,
    displacements,
    hertz_contact,
    layer_contact,
    side_forces,
    surface_displacements,
)
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

    def pressure(self, penalty: float | None) -> LinePressure:
        """Return the exact pressure with the distributed penalty ε̂, or that of multipliers (None)."""
        return _pressure(self, penalty)


@cache
def _pressure(box: HertzBox, penalty: float | None) -> LinePressure:
    if penalty is None:
        return hertz_contact(box.half_width, box.radius, box.stiffness)
    return layer_contact(box.half_width, box.radius, box.stiffness, penalty)


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
    bodies = hertz_body(box, 0, penalty=law, across=across), hertz_body(box, 1, penalty=law, across=across)
    return Scene(bodies if parabola_is_slave else bodies[::-1], penalty=penalty, name=name)


@cache
def hertz_body(box: HertzBox, number: int, *, penalty: float | None, across: int = COARSEST) -> Body:
    """Return parabola (0) or flat (1) with its tractions and supports; the parabola lies above, y = x²/2R + η.

    The penalty is that of the exact solution; None is that of multipliers.
    """
    pressure, a = box.pressure(penalty), box.half_width
    x, depth, zone = (a * box.mesh_scale * lines for lines in mesh_lines(number, across))
    grid = np.arange(len(x) * len(depth)).reshape(len(depth), len(x))
    along, down = (part.reshape(-1) for part in np.meshgrid(x, depth))
    load = side_forces(pressure, x, depth).reshape(-1, 2)
    axis = int(np.abs(x).argmin())
    supports = [grid[-1, axis], grid[len(depth) // 2, axis]]
    exact = displacements(pressure, along[supports], down[supports], box.young[number], box.poisson[number])
    fixed, imposed = np.zeros(load.shape, bool), np.zeros(load.shape)
    if number == 0:
        supports = supports[:1]
    else:
        fixed[supports[0], 1] = True
    fixed[supports, 0], imposed[supports, 0] = True, exact[: len(supports), 0]
    up = 1.0 if number == 0 else -1.0
    height = along**2 / (2 * box.radius) * (1 - down / depth[-1]) if number == 0 else 0.0
    walk = grid[0] if number == 0 else grid[0, ::-1]
    inside = walk[np.isin(along[walk], zone)]
    corners = (grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1])
    cells = np.stack(corners[:: int(up)], axis=-1).reshape(-1, 4)
    return Body(
        np.column_stack([along, up * down + height]),
        cells,
        np.column_stack([inside[:-1], inside[1:]]),
        box.young[number],
        box.poisson[number],
        fixed=fixed,
        imposed=imposed,
        load=load * [1, up],
        start=np.array([0.0, -(a**2) / (2 * box.radius) if number == 0 else 0.0]),
        name=("parabola", "flat")[number],
    )


def mesh_lines(number: int, across: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return columns x (n,) and rows η (m,) over a, and the nodes (n_contact,) of the zone among the columns.

    An edge of the contact divides a segment one to two, the other edge two to one, so that errors fall evenly with h.
    """
    count = segments_across(number, across)
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


def segments_across(number: int, across: int) -> int:
    """Return how many whole segments of parabola (0) or flat (1) lie across the contact: of the parabola `across`.

    The number of the flat is such that no node of one side meets one of the other.
    """
    if number == 0:
        return across
    count = ceil(RATIO * across)
    while gcd(3 * across + 1, 3 * count + 2) > 1:
        count += 1
    return count


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
    moves = surface_displacements(pressure, x, young, poisson)
    if number == 1:
        lines, depth, _ = mesh_lines(1, across)
        named = box.half_width * box.mesh_scale * np.array([lines[np.abs(lines).argmin()], depth[-1]])
        moves -= [0, 1] * displacements(pressure, named[:1], named[1:], young, poisson)[0]
        return freeze(moves * [1, -1], np.float64)
    centre = np.zeros(1)
    below = exact_displacements(box, penalty, 1, centre, across)[0, 1]
    layer = 0.0 if penalty is None else pressure.peak / penalty
    moves[:, 1] += below - layer - surface_displacements(pressure, centre, young, poisson)[0, 1]
    return freeze(moves, np.float64)


def exact_forces(
    box: HertzBox, penalty: float | None, interface: Interface, parabola_is_slave: bool, positions: FloatArray
) -> FloatArray:
    """Return the exact forces ∫ N_i p ds (n_nodes, 2) that push the nodes at positions (n_nodes, 2)."""
    pressure, forces = box.pressure(penalty), np.zeros(positions.shape)
    for number, nodes in _sides(interface, parabola_is_slave):
        order = nodes[np.argsort(positions[nodes, 0])]
        forces[order, 1] = (1.0 if number == 0 else -1.0) * pressure.nodal_forces(positions[order, 0])
    return forces


def exact_moves(box: HertzBox, penalty: float | None, scene: Scene, parabola_is_slave: bool, across: int) -> FloatArray:
    """Return the exact displacements (n_nodes, 2) of the nodes of a scene of `hertz_box`, along x and upwards."""
    places = scene.interface.nodes
    moves = np.zeros(places.shape)
    for number, nodes in _sides(scene.interface, parabola_is_slave):
        moves[nodes] = exact_displacements(box, penalty, number, places[nodes, 0], across)
    return moves


def _sides(interface: Interface, parabola_is_slave: bool) -> list[tuple[int, IntArray]]:
    """Return the number of the body, parabola (0) or flat (1), and its nodes, of the slave and of the master."""
    slave, master = np.split(np.arange(interface.n_nodes), [interface.n_slave_nodes])
    return [(0, slave), (1, master)] if parabola_is_slave else [(1, slave), (0, master)]


BOX = HertzBox()
PEAK, WIDTH = "peak", "half-width"  # Kinds of error
MESHES = (COARSEST, 20, 26, 33, 66)  # Two octaves: numbers of the parabola's segments across the contact.
# The penalties of studies: their stiffness, and whether that is ε̂ over E/a, the same on all meshes, or ε̂ over E/h.
PENALTIES = {"layer": (1.0, True), "soft": (1.0, False), "stiff": (100.0, False)}


@dataclass(frozen=True, slots=True)
class HertzStudy:
    """One choice of slave and penalty, on meshes of any fineness."""

    parabola_is_slave: bool
    stiffness: float  # The penalty ε̂ over E/h, with E and the segments h of the parabola
    fixed: bool = False  # The stiffness is ε̂ over E/a instead, with the half-width a, the same on all meshes.
    box: HertzBox = BOX

    @property
    def meshes(self) -> tuple[int, ...]:
        """The numbers of the parabola's segments across the contact."""
        return MESHES

    def size(self, across: int) -> float:
        """Return half the length of the parabola's segments over the half-width of the contact."""
        return 1 / (across + 1 / 3)

    def penalty(self, across: int) -> float:
        """Return the penalty ε̂ on a mesh."""
        length = self.box.half_width if self.fixed else 2 * self.box.half_width / (across + 1 / 3)
        return self.stiffness * self.box.young[0] / length

    def pose(self, across: int, traits: Traits) -> ProblemInstance:
        """Return the problem on a mesh. With a penalty, Newton's method starts at the exact displacements."""
        multipliers, role = traits.rules.enforcement == "multiplier", self.parabola_is_slave
        penalty = self.penalty(across)
        law = None if multipliers else penalty
        scene = hertz_box(self.box, penalty=penalty, rigid_layer=multipliers, across=across, parabola_is_slave=role)
        start, pressure = None, self.box.pressure(law)
        if not multipliers:  # Exact gaps of multipliers are 0 and do not say what is in contact; penetration does.
            start = scene.transformation.T @ exact_moves(self.box, law, scene, role, across).reshape(-1)

        def motion(places: FloatArray) -> FloatArray:
            return exact_displacements(self.box, law, 0 if role else 1, places[:, 0], across)

        forces = partial(exact_forces, self.box, law, scene.interface, role)
        return ProblemInstance(
            scene=scene,
            forces=forces,
            motions=(motion,),
            pressure=lambda places: pressure.pressure(places[:, 0]),
            pressure_scale=pressure.peak,
            deformed=False,
            further=partial(_shape_errors, forces(scene.interface.nodes)),
            start=start,
            best=self._best(across, pressure, multipliers),
        )

    def _best(self, across: int, pressure: LinePressure, multipliers: bool) -> Errors:
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
        return {
            FORCES[0]: pressure.linear_error(slave),
            FORCES[1]: pressure.linear_error(master),
            MOTIONS[0]: pressure.linear_error(slave),
            PEAK: pressure.linear_error(slave),
            PRESSURE: (constant + facets) / pressure.peak,
            WIDTH: (slave[1] - slave[0]) / self.box.half_width,
        }

    def group(self, traits: Traits) -> str:
        """Return the word of the penalty, and the slave if it is stiff; multipliers are as stiff as can be."""
        penalties = {penalty: word for word, penalty in PENALTIES.items()}
        word = "stiff" if traits.rules.enforcement == "multiplier" else penalties[self.stiffness, self.fixed]
        return word if word != "stiff" else f"{'parabola' if self.parabola_is_slave else 'flat'} {word}"

    @classmethod
    def from_case(cls, case: Case) -> HertzStudy:
        """Return the study that a case stands for."""
        slave, stiffness, fixed = map(case.parameter, ("parabola_is_slave", "stiffness", "fixed"))
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


@cache
def hertz_cases() -> tuple[Case, ...]:
    """Return six studies, each as the scene of its coarsest mesh: either body as the slave, three penalties."""
    cases = []
    for slave, (word, penalty) in product(("parabola", "flat"), PENALTIES.items()):
        study = HertzStudy(slave == "parabola", *penalty)
        role = study.parabola_is_slave
        scene = hertz_box(BOX, penalty=study.penalty(COARSEST), parabola_is_slave=role, name=f"{slave}-{word}")
        facts = {name: np.array(float(getattr(study, name))) for name in ("parabola_is_slave", "stiffness", "fixed")}
        cases.append(replace(scene, facts=facts).case())
    return tuple(cases)


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
    label="Hertz' contact in boxes",
    meshes=(20, 40, 80),
    targets=(2e-2, 1e-2, 5e-3, 1e-3),
    pose=_pose,
    rank=2,
)
