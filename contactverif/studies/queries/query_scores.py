"""The scores of a program's answers: wrong decisions a million, worst errors in units of roundoff, time a decision.

A decision is wrong if the segment is not one of the exact nearest ones, or the sign of the gap is wrong though the gap
exceeds 4u(L + |P − A|), with the length L and the first node A of the segment. A wrong segment with the right sign that
is farther by no more than that, for both segments together, is the work of roundoff; anything else is a mistake.

The decision is made in rationals. Floats only measure how far an answer is off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.oracle.exact_nearest import nearest_segments
from contactverif.studies.queries.answers import Answer, Answers
from contactverif.studies.queries.query_file import ExactAnswer, ExactSegment, Queries
from contactverif.studies.queries.surfaces import Shape, Vector

SIGN_TOLERANCE = 4  # The tolerance of the gap, in units of u (L + |P − A|); verification of gaps elsewhere uses it too.
_MILLION = 1e6


@dataclass(slots=True)
class Score:
    """The counts and worst errors of the answers to some queries."""

    kind: str
    queries: int = 0
    wrong_segments: int = 0
    wrong_signs: int = 0
    beyond_roundoff: int = 0  # The number of wrong decisions that roundoff does not explain.
    undecided: int = 0  # The number of queries for which the program does not know the segment or the sign.
    # The number of right segments that another rule than the smallest overshoot has chosen in a tie.
    other_rule: int = 0
    worst_xi: float = 0.0  # The largest error of ξ, in units of u (L + |P − A|) / L, over right segments.
    worst_distance: float = 0.0  # The largest error of the distance, in units of u (L + |P − A|), over right segments.
    seconds: float | None = None  # The time of all decisions; None where it is not stated.

    @property
    def wrong(self) -> int:
        """The number of wrong decisions."""
        return self.wrong_segments + self.wrong_signs

    @property
    def wrong_per_million(self) -> float:
        """The number of wrong decisions in a million queries."""
        return _MILLION * self.wrong / self.queries

    @property
    def seconds_each(self) -> float | None:
        """The time of one decision, None if nobody has said it."""
        return None if self.seconds is None else self.seconds / self.queries


@dataclass(frozen=True, slots=True)
class Scores:
    """The scores of a program."""

    total: Score  # The score over all queries.
    kinds: list[Score]  # The score of each kind, in the order of the file.
    first_wrong: list[str] = field(default_factory=list)  # The first wrong decision of each kind, in words.


def score_answers(queries: Queries, exact: Sequence[ExactAnswer], answers: Answers) -> Scores:
    """Compare the answers of a program with the exact ones."""
    total = Score("all kinds", seconds=answers.seconds.get(""))
    kinds: dict[str, Score] = {}
    first_wrong: dict[str, str] = {}
    for number, (query, truth, answer) in enumerate(zip(queries.queries, exact, answers.answers, strict=True)):
        score = kinds.setdefault(query.kind, Score(query.kind, seconds=answers.seconds.get(query.kind)))
        reason = _judge(queries.surfaces[query.surface], query.point, truth, answer, (score, total))
        if reason:
            first_wrong.setdefault(query.kind, f"query {number}, {query.kind}: {reason}")
    if total.seconds is None and all(score.seconds is not None for score in kinds.values()):
        total.seconds = sum(score.seconds or 0.0 for score in kinds.values())
    return Scores(total, list(kinds.values()), list(first_wrong.values()))


def _judge(shape: Shape, point: Vector, truth: ExactAnswer, answer: Answer, scores: Sequence[Score]) -> str:
    """Add one answer to the scores; return in words what is wrong with it, or nothing."""
    for score in scores:
        score.queries += 1
    if answer.segment is None:
        for score in scores:
            score.undecided += 1
        return ""
    place = next((place for place, near in enumerate(truth.segments) if near.segment == answer.segment), None)
    if place is None:
        return _judge_wrong_segment(shape, point, truth, answer, answer.segment, scores)
    near, unit = truth.segments[place], _unit(shape, point, answer.segment)
    wrong_sign = _has_wrong_sign(answer, [near], unit)
    xi_error = 0.0 if answer.xi is None else _difference(answer.xi, near.xi) * _length(shape, answer.segment) / unit
    distance_error = 0.0 if answer.distance is None else _root_difference(answer.distance, truth) / unit
    for score in scores:
        score.undecided += answer.sign is None
        score.wrong_signs += wrong_sign
        score.beyond_roundoff += wrong_sign
        score.other_rule += place >= truth.n_first
        score.worst_xi = max(score.worst_xi, xi_error)
        score.worst_distance = max(score.worst_distance, distance_error)
    return f"sign {answer.sign} of the gap, which is {_signed_root(near.signed_squared_gap):.3g}" if wrong_sign else ""


def _judge_wrong_segment(
    shape: Shape, point: Vector, truth: ExactAnswer, answer: Answer, segment: int, scores: Sequence[Score]
) -> str:
    """Add an answer with a wrong segment to the scores; return in words what is wrong with it.

    If the segment is nearly as near, the sign of the gap must be right all the same, or roundoff is no excuse.
    """
    nearest = truth.segments[0]
    farther = nearest_segments(shape.nodes, shape.segments[segment : segment + 1], point).squared_distance
    excess = float(farther - truth.squared_distance) / (_root(farther) + _root(truth.squared_distance))
    unit = _unit(shape, point, segment) + _unit(shape, point, nearest.segment)
    wrong_sign = _has_wrong_sign(answer, truth.segments, unit)
    for score in scores:
        score.wrong_segments += 1
        score.beyond_roundoff += wrong_sign or excess > SIGN_TOLERANCE * unit
    gap = f", with sign {answer.sign} of the gap {_signed_root(nearest.signed_squared_gap):.3g}" if wrong_sign else ""
    return f"segment {segment}, which is {excess:.3g} farther than segment {nearest.segment}{gap}"


def _has_wrong_sign(answer: Answer, segments: Sequence[ExactSegment], unit: float) -> bool:
    """Return whether a sign is that of no gap at these segments, though each gap exceeds the tolerance."""
    gaps = [_signed_root(near.signed_squared_gap) for near in segments]
    return answer.sign is not None and all(
        answer.sign != _sign(gap) and abs(gap) > SIGN_TOLERANCE * unit for gap in gaps
    )


def _length(shape: Shape, segment: int) -> float:
    (ax, ay), (bx, by) = shape.ends(segment)
    return math.hypot(bx - ax, by - ay)


def _unit(shape: Shape, point: Vector, segment: int) -> float:
    """Return u (L + |P − A|), the length that roundoff of a stable projection is measured in."""
    (ax, ay), _ = shape.ends(segment)
    return UNIT_ROUNDOFF * (_length(shape, segment) + math.hypot(point[0] - ax, point[1] - ay))


def _root(value: Fraction) -> float:
    """Return the square root of a rational number, also of one whose float would underflow."""
    numerator, denominator = value.as_integer_ratio()
    shift = 2 * max(0, (120 + denominator.bit_length() - numerator.bit_length() + 1) // 2)
    return math.ldexp(math.isqrt((numerator << shift) // denominator), -shift // 2)


def _signed_root(value: Fraction) -> float:
    """Return the root of a squared length with its sign."""
    return math.copysign(_root(abs(value)), value)


def _sign(value: float) -> int:
    """Return the sign of a number."""
    return (value > 0) - (value < 0)


def _difference(value: float, exact: Fraction) -> float:
    """Return |value − exact|, infinite for a value that is not finite."""
    return abs(float(Fraction(value) - exact)) if math.isfinite(value) else math.inf


def _root_difference(value: float, truth: ExactAnswer) -> float:
    """Return |value − √exact| without cancellation, infinite for a value that is not finite."""
    if not math.isfinite(value):
        return math.inf
    both = value + _root(truth.squared_distance)
    return abs(float(Fraction(value) ** 2 - truth.squared_distance)) / both if both else 0.0
