"""The geometry and the numbers that a drawing needs: direction, flatness and gaps of an interface.

Rule: a drawing may be rough where a judge may not; nothing here is used for a verdict.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Self

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray, IntArray
from contactverif.contract.body import SIDES
from contactverif.contract.case import Case
from contactverif_reports.tables import decimal

NEARLY_FLAT = 0.05  # A surface is drawn as a straight line if its rise is at most this share of its length.


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The nodes of a case along the mean direction of its slave surface."""

    direction: FloatArray  # (2,) Unit vector along which the slave runs, with its body on the left.
    along: FloatArray  # (n_nodes,) Coordinates of the nodes along `direction` and to its left, a length each.
    above: FloatArray
    rise: float  # Largest difference of `above` within a surface, a length.
    roundoff: float  # A length; a smaller one is rounding of the coordinates.
    straight: bool  # Whether each slave segment runs along `direction` and each master segment against it.

    @classmethod
    def from_case(cls, case: Case) -> Self:
        """Measure a case. Coordinates begin at the node furthest back along the direction."""
        positions, interface = case.positions, case.interface
        chords = np.diff(positions[interface.slave.segments], axis=1)[:, 0]
        if not np.linalg.norm(chords.sum(axis=0)) > 1e-6 * np.linalg.norm(chords, axis=1).sum():
            chords = np.array([[1.0, 0.0]])  # A ring has no mean direction.
        direction = chords.sum(axis=0) / np.linalg.norm(chords.sum(axis=0))
        left = np.array([-direction[1], direction[0]])
        offsets = positions - positions[np.argmin(positions @ direction)]
        along, above = offsets @ direction, offsets @ left
        n_slave = interface.n_slave_nodes
        roundoff = 64 * UNIT_ROUNDOFF * case.largest_coordinate
        forwards = np.diff(along[interface.slave.segments], axis=1)
        backwards = np.diff(along[interface.master.segments], axis=1)
        rise = float(max(np.ptp(above[:n_slave]), np.ptp(above[n_slave:])))
        straight = bool((forwards > 0).all() and (backwards < 0).all())
        return cls(direction, along, above, rise, roundoff, straight)

    @property
    def flat(self) -> bool:
        """Return whether both surfaces are straight lines, parallel to each other."""
        return self.straight and self.rise <= self.roundoff

    @property
    def nearly_flat(self) -> bool:
        """Return whether both surfaces may be drawn as straight lines."""
        return self.straight and self.rise <= NEARLY_FLAT * float(np.ptp(self.along))

    @property
    def turn(self) -> FloatArray:
        """Return the matrix (2, 2) that takes positions (n, 2) to coordinates along `direction` and to its left."""
        return np.array([self.direction, [-self.direction[1], self.direction[0]]]).T

    @property
    def rotation(self) -> str:
        """Return the angle of a straight interface to the x axis in words; empty for none."""
        angle = float(np.degrees(np.arctan2(self.direction[1], self.direction[0])))
        slack = float(np.degrees(self.roundoff / np.ptp(self.along)))  # Rounded ends of a line turn it by so much.
        return f"rotated by {format_number(angle, slack)}°" if self.nearly_flat and abs(angle) > slack else ""


@dataclass(frozen=True, slots=True, eq=False)
class Gaps:
    """The gaps of the slave nodes to their nearest master segments."""

    gap: FloatArray  # (n_slave_nodes,) The gap, a length, negative in penetration.
    normal: FloatArray  # (n_slave_nodes, 2) The normal of that segment, out of the master.
    facing: BoolArray  # (n_slave_nodes,) Whether the node faces the master; False beyond an end of the master surface.

    @classmethod
    def from_case(cls, case: Case) -> Self:
        """Compare each slave node with every master segment."""
        positions, master = case.positions, case.interface.master
        first, chords = positions[master.segments[:, 0]], np.diff(positions[master.segments], axis=1)[:, 0]
        lengths = np.maximum(np.linalg.norm(chords, axis=1), np.finfo(float).tiny)
        tangents = chords / lengths[:, None]
        normals = np.column_stack([tangents[:, 1], -tangents[:, 0]])
        gaps, nearest_normals, facing = [], [], []
        for node in positions[: case.interface.n_slave_nodes]:
            feet = ((node - first) * tangents).sum(axis=1) / lengths
            outside = np.maximum(np.maximum(-feet, feet - 1), 0) * lengths
            distances = np.hypot(((node - first) * normals).sum(axis=1), outside)
            nearest = int(np.argmin(distances))
            gaps.append(float((node - first[nearest]) @ normals[nearest]))
            nearest_normals.append(normals[nearest])
            at_an_end = master.neighbours[nearest, 0 if feet[nearest] < 0 else 1] < 0
            facing.append(not (at_an_end and outside[nearest] > 1e-9 * lengths[nearest]))
        return cls(np.array(gaps), np.array(nearest_normals), np.array(facing))

    def uniform(self, roundoff: float) -> bool:
        """Return whether all nodes that face the master have the same gap, up to a length `roundoff`."""
        gap = self.gap[self.facing]
        return bool(len(gap) and np.ptp(gap) <= max(roundoff, 1e-9 * np.abs(gap).max()))


def outer_faces(cells: IntArray, contact: IntArray) -> list[IntArray]:
    """Return the faces (n, 3 or 4) around bodies in space, seen from outside; of a rigid body those that touch.

    A shorter row of cells (n, 8) or of contact (n, 4) ends with −1.
    """
    parts = []
    for corners, sides in SIDES.items():
        solid = cells[(cells >= 0).sum(axis=1) == corners]
        faces = np.concatenate([solid[:, side] for side in sides])
        _, number, count = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
        parts.append(faces[count[number.reshape(-1)] == 1])
    rigid = contact[~np.isin(contact[:, 0], cells)]
    is_triangle = rigid[:, -1] < 0
    return [part for part in (*parts, rigid[is_triangle, :3], rigid[~is_triangle]) if len(part)]


def segment_lengths(case: Case) -> list[FloatArray]:
    """Return the current lengths of the segments, of the slave and of the master."""
    return [surface.lengths(case.positions) for surface in (case.interface.slave, case.interface.master)]


_LARGEST_DENOMINATOR = 64


def format_number(value: float, slack: float = 0.0, digits: int = 4) -> str:
    """Return the shortest text for a number: an integer, a decimal, a fraction or an integer times 2^k."""
    if not math.isfinite(value):
        return "–"
    slack = min(slack, 1e-6 * abs(value))
    texts = [text for text, number in _candidates(value, digits) if abs(number - value) <= slack]
    return min(texts, key=len, default=decimal(value, digits))


def one_digit(value: float) -> float:
    """Round to one significant digit."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{round(value / power) * power:.3g}")


def unit_of(lengths: FloatArray) -> tuple[float, str]:
    """Return a power of two as unit of the lengths, and its name; 1 and no name if they are of everyday size."""
    shortest, longest = float(np.min(lengths)), float(np.max(lengths))
    if longest >= 1e-3 and shortest < 1e5:
        return 1.0, ""
    exponent = math.floor(math.log2(shortest))
    return math.ldexp(1.0, exponent), f"2^{exponent}"


def _candidates(value: float, digits: int) -> list[tuple[str, float]]:
    candidates = []
    if abs(value) < 1e6:
        fraction = Fraction(value).limit_denominator(_LARGEST_DENOMINATOR)
        candidates += [(f"{round(value)}", float(round(value))), (str(fraction), float(fraction))]
    candidates += [(text, float(text)) for text in (decimal(value, count) for count in range(1, digits + 1))]
    if value:
        significand, exponent = math.frexp(value)
        odd, power = round(significand * 1024), exponent - 10
        while odd and odd % 2 == 0:
            odd, power = odd // 2, power + 1
        if abs(power) > 3:
            times = {1: "", -1: "-"}.get(odd, f"{odd}·")
            with np.errstate(over="ignore"):
                candidates += [(f"{times}2^{power}", float(np.ldexp(float(odd), power)))]
    return candidates
