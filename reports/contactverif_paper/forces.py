"""The force tables of the paper in exact rationals: what each formulation transmits of a uniform pressure p = 1.

Formulations compute in floats. On these states (lengths are small integers, the penetration is 1/16, ε̂ |g| = 1) their
forces are rationals with small denominators up to a few roundings, so the rational is recovered and the rest checked.

Source: Zavarise & De Lorenzis (2009), Figs. 8, 16 and 20.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.subject import Subject
from contactverif.oracle import uniform_pressure_weights_exact
from contactverif.scenes.named_states import named_case
from contactverif_paper import cast
from contactverif_paper.paper_data import Forces, ForceTable, Member, Said, Statement

_LARGEST_DENOMINATOR = 60
_CASES: tuple[
    tuple[str, str, str, dict[str, str]], ...
] = (  # name, title, figure, {formulation: what the paper prints for the master}
    ("a1", "Case A1", "Fig. 8", {}),
    ("b", "Case B", "Fig. 16", {"nts-ar": "5/3 10/3 3 2 2", "vts-me": "3/2 3 7/2 3 1"}),
    (
        "c",
        "Case C",
        "Fig. 20",
        {"nts-ar": "5/3 10/3 7/3 8/3 2", "vts-me": "3/2 3 17/6 10/3 4/3", "vts-ppt": "3/2 3 3 3 3/2"},
    ),
)
_SAYS = {
    "a1": "the right forces on the master are 2p, 2p",
    "b": "NTS, given the right forces on the slave, hands wrong ones to the master; VTS-ME hands over the right ones",
    "c": "NTS and VTS-ME hand wrong forces to the master; VTS-PPT hands over the right ones",
}
_EXACT = {"a1": "2 2", "b": "3/2 3 7/2 3 1", "c": "3/2 3 3 3 3/2"}  # printed, for the master


def tables() -> tuple[ForceTable, ...]:
    """One table a case."""
    return tuple(_table(*case) for case in _CASES)


def statement(table: ForceTable) -> Statement:
    """What the paper says of it, beside it."""
    ours = [row for row in table.rows if row.printed]
    wrong = [row.member.legend for row in (table.exact, *ours) if row.printed != row.master]
    found = "the consistent forces are the printed ones"
    if ours:
        found += f", and so are all {sum(len(row.printed) for row in ours)} fractions of the formulations on the master"
    if wrong:
        found = f"other fractions: {', '.join(wrong)}"
    return Statement(table.figure, f"{table.title}: {_SAYS[table.case]}", found, Said.of(not wrong))


def rationals(values: Iterable[float] | FloatArray, scale: float) -> tuple[tuple[Fraction, ...], float]:
    """The rationals that the floats are roundings of, and the largest difference, in units of `scale`.

    Raises
    ------
    ArithmeticError
        If a float is further from every rational with a small denominator than rounding explains: 256 units of
        roundoff of the largest force, since a force is the sum of a few dozen terms.
    """
    floats = [float(value) for value in values]
    found = tuple(Fraction(value).limit_denominator(_LARGEST_DENOMINATOR) for value in floats)
    error = max((abs(float(Fraction(value) - exact)) for value, exact in zip(floats, found, strict=True)), default=0.0)
    if not error <= 256 * UNIT_ROUNDOFF * scale:
        raise ArithmeticError(f"forces {floats} are no rationals with denominators up to {_LARGEST_DENOMINATOR}")
    return found, error


def _table(name: str, title: str, figure: str, printed: dict[str, str]) -> ForceTable:
    case = named_case(name)
    interface, n_slave = case.interface, case.interface.n_slave_nodes
    along = case.parameters["along"]
    weights = uniform_pressure_weights_exact(interface, along)
    from_left = np.argsort(along[:n_slave]), n_slave + np.argsort(along[n_slave:])
    exact_slave, exact_master = (tuple(weights[node] for node in side.tolist()) for side in from_left)
    exact = Forces(Member("exact", ""), exact_slave, exact_master, printed=_fractions(_EXACT[name]))
    rows = []
    for member in cast.FORCES:
        said = _fractions(printed.get(member.formulation, ""))
        rows.append(_forces(case, member, *from_left, said))
    lengths = [tuple(np.diff(np.sort(part)).tolist()) for part in (along[:n_slave], along[n_slave:])]
    return ForceTable(name, title, figure, lengths[0], lengths[1], exact, tuple(rows))


def _forces(case: Case, member: Member, slave: IntArray, master: IntArray, said: tuple[Fraction, ...]) -> Forces:
    subject = cast.subject(member)
    formulation = subject.with_penalty(case.penalty)  # of NTS too: ε |g| = 1 at each node
    pairing = formulation.pair(case.interface, case.z)
    pushed = -formulation.residual(case.interface, pairing, case.z).reshape(-1, 2)  # upwards on the slave
    scale = float(np.abs(pushed).sum())
    sides = [rationals(sign * pushed[side, 1], scale) for side, sign in ((slave, 1), (master, -1))]
    points = _at_points(case, subject) if member in cast.VIRTUAL else np.zeros(0)
    carried, rounding = rationals(points, scale)
    return Forces(
        member,
        slave=sides[0][0],
        master=sides[1][0],
        points=carried,
        rounding=max(sides[0][1], sides[1][1], rounding),
        printed=said,
    )


def _at_points(case: Case, subject: Subject) -> FloatArray:
    """Forces (n_points,) of the virtual slave nodes from left to right."""
    formulation = subject.with_penalty(case.penalty)
    points = formulation.contact_points(case.interface, formulation.pair(case.interface, case.z), case.z)
    forces: FloatArray = (points.pressure * points.weight)[np.argsort(points.position[:, 0])]
    return forces


def _fractions(text: str) -> tuple[Fraction, ...]:
    return tuple(Fraction(word) for word in text.split())
