"""What the reproduction of the reference paper found: arrays and words. Who fills it computes; who shows it does not.

Every formulation goes by two names: `formulation`, as typed on the command line, and `legend`, as in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif_reports.draw.solved_scene import Solution, SolvedScene


class Said(IntEnum):
    """How a statement of the paper stands to what was found. The numbers are those of the netCDF file."""

    AGREES = 0
    DIFFERS = 1
    SILENT = 2
    DEFECT = 3

    @property
    def mark(self) -> str:
        """One word for a table."""
        return {0: "agrees", 1: "differs", 2: "silent", 3: "defect"}[self]

    @classmethod
    def of(cls, agrees: bool) -> Said:
        """Of a statement that can be checked."""
        return cls.AGREES if agrees else cls.DIFFERS


@dataclass(frozen=True, slots=True)
class Member:
    """A formulation and how it is drawn: `pen` is its number among the pens, the same in every figure."""

    legend: str
    formulation: str
    pen: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """What a formulation transmits of a uniform pressure p = 1, in rationals; forces per unit of thickness over p.

    Attributes
    ----------
    slave, master : tuple[Fraction, ...]
        On the nodes from left to right, as they are transferred to the other surface.
    points : tuple[Fraction, ...]
        At the virtual slave nodes, empty where the formulation says none.
    rounding : float
        Largest difference of a computed float from its rational.
    printed : tuple[Fraction, ...]
        What the paper prints for the master, empty where it is silent.
    """

    member: Member
    slave: tuple[Fraction, ...]
    master: tuple[Fraction, ...]
    points: tuple[Fraction, ...] = ()
    rounding: float = 0.0
    printed: tuple[Fraction, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class ForceTable:
    """One case: lengths of the segments, the exact consistent forces (first row), what each formulation makes of it."""

    case: str
    title: str
    figure: str
    slave: tuple[float, ...]
    master: tuple[float, ...]
    exact: Forces
    rows: tuple[Forces, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """The pressure that one formulation leaves on a scene.

    Attributes
    ----------
    x : FloatArray, shape (n_points,)
        Reference coordinates, a length.
    pressure : FloatArray, shape (n_points,)
        Over the exact pressure.
    at_points : bool
        At the formulation's own contact points; else nodal forces over the nodes' shares of the interface.
    """

    member: Member
    x: FloatArray
    pressure: FloatArray
    at_points: bool
    solution: Solution

    @property
    def departure(self) -> float:
        """The largest |p/p_exact − 1|."""
        return float(abs(self.pressure - 1).max())


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """A patch test of the paper, solved by the formulations that its figures show.

    Attributes
    ----------
    scene : str
        Name of the scene on the command line.
    pressures, meshes : str
        Numbers of the paper's figures.
    printed : tuple[float, float]
        Lower and upper end of the pressure axis that the paper prints.
    close_up : tuple[float, float] | None
        The same of its close-up, None where there is none.
    stiffness : float
        Ε̂ over E, per unit of length.
    exact : float
        The exact pressure, force per length.
    """

    scene: str
    title: str
    pressures: str
    meshes: str
    printed: tuple[float, float]
    close_up: tuple[float, float] | None
    stiffness: float
    exact: float
    solved: SolvedScene
    curves: tuple[Curve, ...]


@dataclass(frozen=True, slots=True, eq=False)
class PassTable:
    """Who passes the elastic patch test, by the largest error of a stress over the pressure.

    Attributes
    ----------
    errors : FloatArray, shape (n_members, n_scenes)
        ; NaN where Newton did not end at a solution.
    tolerances : FloatArray, shape (n_scenes,)
        Of roundoff.
    fails : float
        Errors above this are failures; nothing should lie between.
    said : IntArray, shape (n_members, n_scenes)
        1 where the paper says that it passes, 0 where it says that it fails, −1 silent.
    unequal : tuple[float, float]
        Error and tolerance of VTS-PPT on Example 1bis with a foundation UNEQUAL times as stiff as the punch.
    """

    members: tuple[Member, ...]
    scenes: tuple[str, ...]
    errors: FloatArray
    tolerances: FloatArray
    fails: float
    said: IntArray
    unequal: tuple[float, float]

    def of(self, member: Member, scene: str) -> float:
        """The error of one of them on one scene."""
        return float(self.errors[self.members.index(member), self.scenes.index(scene)])

    def word(self, member: int, scene: int) -> str:
        """pass, fail, or what else it is."""
        error = self.errors[member, scene]
        if error <= self.tolerances[scene]:
            return "pass"
        return "fail" if error > self.fails else "between" if error == error else "no solution"


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """How Newton got to a solution: largest entry of the residual (n_iterates,), a force; `rate` of its last steps."""

    member: Member
    residuals: FloatArray
    floor: float
    end: str
    rate: float

    @property
    def n_iterations(self) -> int:
        """Linear systems solved."""
        return len(self.residuals) - 1


@dataclass(frozen=True, slots=True, eq=False)
class Convergence:
    """Residual histories, and the linear rate of the basic version over the penalty.

    Attributes
    ----------
    ratios : FloatArray, shape (n_ratios,)
        E of the master over E of the slave; histories[i] are those of ratios[i].
    stiffness : FloatArray, shape (n_penalties,)
        Ε̂ over E, times a unit of length.
    radius : FloatArray, shape (n_penalties,)
        Spectral radius of I − K_basic⁻¹ K_consistent at the solution.
    rate : FloatArray, shape (n_penalties,)
        Ratio of successive residuals that Newton's method shows.
    """

    scene: str
    ratios: FloatArray
    histories: tuple[tuple[History, ...], ...]
    stiffness: FloatArray
    radius: FloatArray
    rate: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Tangents:
    """What tangents are, each (n_members,), in the solution of one scene.

    Attributes
    ----------
    error : FloatArray
        Largest difference of K d from a complex step along d, over the largest entry of K d, over random d.
    asymmetry : FloatArray
        Largest entry of K − Kᵀ over that of K.
    order : FloatArray
        Of one Newton step towards the solution; infinite where one step is exact, NaN where nothing decides.
    iterations : IntArray
        Linear systems solved from the slave just touching to roundoff.
    """

    scene: str
    members: tuple[Member, ...]
    error: FloatArray
    asymmetry: FloatArray
    order: FloatArray
    iterations: IntArray

    def row(self, formulation: str) -> int:
        """Where in the arrays it stands."""
        return [member.formulation for member in self.members].index(formulation)


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """A number of each member, over something; values (n_members, n_places)."""

    members: tuple[Member, ...]
    at: FloatArray
    values: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Defects:
    """Three defects of the algorithm as it is published.

    Attributes
    ----------
    force, moment : Series
        Over the tilt (rad): |ΣR| over the slave's force, |Σ x×R| over that times the slave's length.
    shift, sliding : Series
        Over the position of the end of an area of competence past a master node (over the slave's length), at a
        tilt of `sliding_tilt`: the force on the master over that on the slave.
    jump : Series
        Over the tilt (rad): largest jump of a nodal force there, over the slave's force.
    jump_known : FloatArray, shape (n_tilts,)
        The same by formula, of the printed algorithm in that configuration.
    free_end : Series
        Over the part of a slave segment that overhangs: largest error of a stress over the pressure.
    """

    force: Series
    moment: Series
    sliding_tilt: float
    sliding: Series
    jump: Series
    jump_known: FloatArray
    free_end: Series


@dataclass(frozen=True, slots=True, eq=False)
class MultiplierRow:
    """A patch test with Lagrange multipliers.

    Attributes
    ----------
    low, high : float
        Of the pressures λ (a nodal method: λ over the length that the node stands for) over the exact one.
    deficiency : int
        Number of vanishing singular values of the last matrix.
    error : float
        Of the stress, over the pressure; NaN without a solution.
    stress, uniform : bool
        Whether stress and multipliers are exact up to roundoff.
    said : int
        What the paper says of the stress: 1 passes, 0 fails, −1 silent.
    """

    member: Member
    scene: str
    end: str
    error: float
    tolerance: float
    low: float
    high: float
    deficiency: int
    said: int = -1

    @property
    def stress(self) -> bool:
        """Whether the stress is exact."""
        return self.error <= self.tolerance

    @property
    def uniform(self) -> bool:
        """Whether the multipliers are."""
        return max(abs(self.low - 1), abs(self.high - 1)) <= self.tolerance


@dataclass(frozen=True, slots=True, eq=False)
class DiskCurve:
    """The pressure (n_points,) of one formulation under the disk, a force per length, at x (n_points,).

    Attributes
    ----------
    iterations : int
        Linear systems solved from a disk that is lowered about as far as it ends; −1 without a solution.
    from_touching : int
        The same from one that has hardly been lowered.
    """

    member: Member
    x: FloatArray
    pressure: FloatArray
    largest: float
    half_width: float
    iterations: int
    from_touching: int


@dataclass(frozen=True, slots=True, eq=False)
class DiskStudy:
    """What lies between the largest pressure and that of Hertz on a layer of springs.

    Attributes
    ----------
    size : FloatArray, shape (n_meshes,)
        Of an element in the middle, a length.
    largest, half_width, iterations : FloatArray or IntArray, shape (n_members, n_meshes)
        .
    slopes : Series
        Over a/R, over that of the paper: largest pressure over that of Hertz on springs, less 1.
    sizes : Series
        Over the size of the foundation, over the one chosen: the same.
    difference_x, difference : FloatArray, shape (n_points,)
        VTS-PPT minus VTS-ME on the second mesh.
    """

    members: tuple[Member, ...]
    size: FloatArray
    largest: FloatArray
    half_width: FloatArray
    iterations: IntArray
    slopes: Series
    sizes: Series
    difference_x: FloatArray
    difference: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Disk:
    """Example 2. `hertz` and `winkler` are (largest pressure, half-width) of the exact answers for half-planes.

    Attributes
    ----------
    difference : FloatArray, shape (n_points,)
        VTS-PPT minus VTS-ME at `difference_x`.
    """

    scene: str
    curves: tuple[DiskCurve, ...]
    difference_x: FloatArray
    difference: FloatArray
    hertz: tuple[float, float]
    winkler: tuple[float, float]
    winkler_x: FloatArray
    winkler_pressure: FloatArray
    study: DiskStudy | None


@dataclass(frozen=True, slots=True)
class Statement:
    """What the paper says, in our words, beside what was found.

    Attributes
    ----------
    figure : str
        Where in the paper.
    says, found : str
        In words.
    verdict : Said
        How the two agree.
    drawing : str
        File name, without its suffix, of the figure here that shows it; empty if none does.
    """

    figure: str
    says: str
    found: str
    verdict: Said
    drawing: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Paper:
    """All of it; `disk` and `disk.study` may be left out, since they take longest."""

    forces: tuple[ForceTable, ...]
    patches: tuple[Patch, ...]
    passes: PassTable
    convergence: Convergence
    tangents: Tangents
    defects: Defects
    multipliers: tuple[MultiplierRow, ...]
    disk: Disk | None
    statements: tuple[Statement, ...]
    provenance: dict[str, str]
