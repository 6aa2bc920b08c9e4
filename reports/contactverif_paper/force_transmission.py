"""The force tables of the paper in exact rationals: what each formulation makes of a uniform pressure p = 1.

Formulations compute in floats. On these states (lengths are small integers, the penetration is 1/16, ε̂ |g| = 1) their
forces are rationals with small denominators up to a few roundings. So the rational is recovered and the rest checked.

Source: Zavarise & De Lorenzis (2009), Figs. 8, 16 and 20.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Self

import numpy as np

from contactverif.contract import schema
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.schema import Group
from contactverif.oracle.flat_answers import uniform_pressure_weights_exact
from contactverif.problems.named_states import named_case
from contactverif_paper import paper_formulations as paper
from contactverif_paper.paper_formulations import PaperFormulation, name_columns, subject_of
from contactverif_paper.paper_item import Agreement, Cell, Column, PageTable, Statement, variables_of

FORMULATIONS = (paper.NTS, paper.NTS_AR, paper.VTS_ME, paper.VTS_PPT, paper.BALANCED, paper.STS, paper.MORTAR)
_LARGEST_DENOMINATOR = 60
_ROUNDINGS = 256  # A force is the sum of a few dozen terms.
Fractions = tuple[Fraction, ...]


def _fraction_columns(name: str, dim: str, meaning: str) -> tuple[Column, ...]:
    return tuple(
        Column(
            dim, unit, f"force {meaning}: {part}", "0 over 0: nothing there", part=part, name=f"{name}_{part}", pad=0
        )
        for part, unit in (("numerator", schema.LENGTH), ("denominator", "1"))
    )


@dataclass(frozen=True, slots=True)
class PrintedForces:
    """The forces on the master that a figure of the paper prints, from left to right: "3/2 3 7/2 3 1"."""

    figure: str
    claim: str
    exact: str
    transmitted: Mapping[PaperFormulation, str]  # By each formulation that the paper shows.


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """The nodal forces of a uniform pressure p = 1, in rationals, from left to right; forces per thickness over p."""

    formulation: Annotated[PaperFormulation, name_columns("")]
    slave: Annotated[Fractions, _fraction_columns("slave", "slave_node", "transferred by the slave's nodes")]
    master: Annotated[Fractions, _fraction_columns("master", "master_node", "transferred by the master's nodes")]
    # Empty if the formulation has no virtual slave nodes.
    points: Annotated[Fractions, _fraction_columns("points", "point", "on the virtual slave nodes")] = ()
    rounding: Annotated[float, Column("", schema.LENGTH, "largest difference of a force from its rational")] = 0.0
    # Empty where the paper is silent.
    printed: Annotated[
        Fractions, _fraction_columns("printed", "master_node", "on the master's nodes as the paper prints it")
    ] = ()


@dataclass(frozen=True, slots=True, eq=False)
class ForceTable:
    """The forces of one case: lengths of its segments, the consistent forces, and what each formulation transmits."""

    case: str
    title: str
    source: PrintedForces
    slave_length: Annotated[tuple[float, ...], Column("slave_segment", schema.LENGTH, "length of the slave's segments")]
    master_length: Annotated[
        tuple[float, ...], Column("master_segment", schema.LENGTH, "length of the master's segments")
    ]
    exact: Forces
    rows: tuple[Forces, ...]

    @classmethod
    def compute(cls, name: str, title: str, source: PrintedForces) -> Self:
        """Compute the table of one case."""
        case = named_case(name)
        n_slave, along = case.interface.n_slave_nodes, case.parameters["along"]
        weights = uniform_pressure_weights_exact(case.interface, along)
        from_left = np.argsort(along[:n_slave]), n_slave + np.argsort(along[n_slave:])
        on_slave, on_master = (tuple(weights[node] for node in side.tolist()) for side in from_left)
        exact = Forces(PaperFormulation("exact", ""), on_slave, on_master, printed=_fractions(source.exact))
        rows = tuple(
            _forces(case, row, *from_left, _fractions(source.transmitted.get(row, ""))) for row in FORMULATIONS
        )
        slave, master = (tuple(np.diff(np.sort(part)).tolist()) for part in (along[:n_slave], along[n_slave:]))
        return cls(name, title, source, slave, master, exact, rows)

    @property
    def all_rows(self) -> tuple[Forces, ...]:
        """The exact forces, and the rows behind them."""
        return (self.exact, *self.rows)

    def statement(self) -> Statement:
        """Compare all printed fractions with the computed ones."""
        wrong = [row.formulation.legend for row in self.all_rows if row.printed and row.printed != row.master]
        result = "the consistent forces are the printed ones"
        if n_fractions := sum(len(row.printed) for row in self.rows):
            result += f", and so are all {n_fractions} fractions of the formulations on the master"
        if wrong:
            result = f"other fractions: {', '.join(wrong)}"
        claim = f"{self.title}: {self.source.claim}"
        return Statement(self.source.figure, claim, result, Agreement.decide(not wrong))

    def page_table(self) -> PageTable:
        """Return the table of the page; consistent forces are bold."""
        slave, master = (", ".join(f"{each:g}" for each in side) for side in (self.slave_length, self.master_length))
        rounding = max(row.rounding for row in self.all_rows)
        rows = []
        for row in self.all_rows:
            on_slave, on_master = _cell(row.slave, self.exact.slave), _cell(row.master, self.exact.master)
            rows.append((row.formulation.legend, (on_slave, _cell(row.points, ()), on_master, _printed_cell(row))))
        return PageTable.of_cells(
            f"{self.title}: nodal forces over p from left to right; slave segments {slave}; master segments {master}. "
            f"Bold: the consistent forces. Largest rounding: {rounding:.1e}",
            ("Formulation", "Slave nodes", "Virtual slave nodes", "Master nodes", "Printed for the master"),
            rows,
        )

    def group(self) -> Group:
        """Return the fractions as numerators and denominators (formulation, node)."""
        comment = "forces of a uniform pressure p = 1, over p, in rationals; the first row is exact; from left to right"
        variables = variables_of(self.all_rows, "formulation") | variables_of(self)
        return Group(variables, {"figure": self.source.figure, "comment": comment})


def rationals(values: Iterable[float] | FloatArray, scale: float) -> tuple[Fractions, float]:
    """Return the rationals that the floats are roundings of, and the largest difference."""
    floats = [float(value) for value in values]
    nearest = tuple(Fraction(value).limit_denominator(_LARGEST_DENOMINATOR) for value in floats)
    error = max((abs(float(Fraction(a) - exact)) for a, exact in zip(floats, nearest, strict=True)), default=0.0)
    if not error <= _ROUNDINGS * UNIT_ROUNDOFF * scale:
        raise ArithmeticError(f"forces {floats} are no rationals with denominators up to {_LARGEST_DENOMINATOR}")
    return nearest, error


def _forces(case: Case, formulation: PaperFormulation, slave: IntArray, master: IntArray, printed: Fractions) -> Forces:
    plugin = subject_of(formulation).with_penalty(case.penalty)  # NTS gets it too: ε |g| = 1 at each node.
    pairing = plugin.pair(case.interface, case.z)
    forces = -plugin.residual(case.interface, pairing, case.z).reshape(-1, 2)  # They push the slave upwards.
    at_points = np.zeros(0)
    if formulation in paper.VIRTUAL:
        points = plugin.contact_points(case.interface, pairing, case.z)
        at_points = (points.pressure * points.weight)[np.argsort(points.position[:, 0])]
    scale, sides = float(np.abs(forces).sum()), (forces[slave, 1], -forces[master, 1], at_points)
    (on_slave, on_master, on_points), roundings = zip(*(rationals(side, scale) for side in sides), strict=True)
    return Forces(formulation, on_slave, on_master, on_points, max(roundings), printed)


def _fractions(text: str) -> Fractions:
    return tuple(map(Fraction, text.split()))


def _cell(values: Sequence[Fraction], exact: Sequence[Fraction]) -> Cell:
    return Cell(tuple(map(str, values)) or ("–",), tone="row strong" if values and values == exact else "row")


def _printed_cell(row: Forces) -> Cell:
    if not row.printed:
        return Cell(("–",), tone="row")
    same = row.printed == row.master
    return Cell((*map(str, row.printed), "✓ same" if same else "✗ differs"), tone=f"row {'good' if same else 'bad'}")
