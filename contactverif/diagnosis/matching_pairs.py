"""Tell in what pattern forces are wrong on flat pairs of matching meshes, in the plane and in space.

On these nearly every method gives the same forces: nodal springs by their own law, others by the areas at the nodes. A
pattern is a sum of known forces with unknown factors, the same on all pairs: of 1, 2 and 4 cells, with other lengths,
depths and numbers. It is named only where the sum is the force on each node of each pair.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE, QUADRILATERAL, SEGMENT, SPACE, Interface, Surface
from contactverif.contract.subject import Subject
from contactverif.diagnosis.flat_state import DEPTH, PENALTY, SAME, grid, residual_of, same
from contactverif.oracle.flat_answers import uniform_surface_weights

_MEANINGS = {  # {factor: what it may mean}
    2.0: "two passes that each have the whole penalty, or a factor 2",
    0.5: "a factor ½, such as a mean of two sides that is taken once too often",
    -1.0: "the sign",
}
# The places of nodes along the axes, so that no two cells are alike; and others.
_STEPS = np.array([0.0, 1.0, 2.25, 3.125, 4.75]), np.array([0.0, 1.375, 2.0, 3.875, 5.0])
_SIZES = {PLANE: ((1, 0), (2, 0), (4, 0)), SPACE: ((1, 1), (2, 1), (2, 2))}  # The cells along the axes.
_SKEW = np.array([0.25, -0.375])  # The way of a node in the middle of four quadrilaterals.
_SAME_SKEWED = 1e-2  # Shape functions are no polynomials of the place there.
_Surface = tuple[FloatArray, IntArray]  # Points (n, dim), and faces as the master has them.


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """A state of two flat surfaces with the same nodes, uniformly apart along the last axis."""

    case: Case
    depth: float  # It is negative where the surfaces are apart.
    areas: FloatArray  # (n_slave_faces, n_nodes) The area of each slave face that belongs to a node, of either side.

    @property
    def is_slave(self) -> FloatArray:
        """The numbers (n_nodes,) 1 for nodes of the slave, and 0 for others."""
        return (np.arange(self.areas.shape[1]) < self.case.interface.n_slave_nodes).astype(np.float64)

    @property
    def is_border(self) -> FloatArray:
        """The numbers (n_nodes,) 1 for nodes at the border of their surface, and 0 for others."""
        is_border = np.zeros(self.areas.shape[1])
        for side in (self.case.interface.slave, self.case.interface.master):
            free, faces = side.neighbours < 0, side.faces
            is_border[faces[free]] = 1.0
            if faces.shape[1] > SEGMENT:
                is_border[np.roll(faces, -1, axis=1)[free]] = 1.0
        return is_border


def diagnose_matching(subject: Subject) -> str:
    """Return in what pattern forces on matching pairs are wrong; empty if they are right, or no rule knows them."""
    abilities = subject.traits.abilities
    kinds = (SEGMENT,) if abilities.in_plane else sorted(abilities.faces)
    if subject.traits.rules.enforcement == "barrier":
        return ""
    return next(filter(None, (text for corners in kinds for text in _patterns(subject, corners))), "")


def _patterns(subject: Subject, corners: int) -> Iterator[str]:
    sizes = _SIZES[PLANE if corners == SEGMENT else SPACE]
    surfaces = [grid(corners, _STEPS[k][: nx + 1], _STEPS[1 - k][: ny + 1]) for k in (0, 1) for nx, ny in sizes]
    numbered = [(surface, shift) for number, surface in enumerate(surfaces, 1) for shift in (0, number)]
    pairs = [_pair(surface, DEPTH * (1 + shift % 2), shift) for surface, shift in numbered]
    forces, rules = [_pushes(subject, pair) for pair in pairs], subject.traits.rules
    presses = any(map(np.any, forces))
    if rules.enforcement == "penalty" and rules.penalty and _pushes(subject, _pair(surfaces[-1], -DEPTH, 0)).any():
        forces_apart = "there are forces" if presses else "there is no force at all where they penetrate, and there is"
        yield f"{forces_apart} where the surfaces are apart: look at the sign of the gap, and at its test"
    exact = [pair.areas.sum(axis=0) for pair in pairs]
    if rules.penalty == "nodal":
        of_nodes = [subject.penalty(pair.case) / PENALTY if rules.enforcement == "penalty" else 1.0 for pair in pairs]
        exact = [np.full(len(right), size) for right, size in zip(exact, of_nodes, strict=True)]
    if not presses:
        yield "there is no force at all where matching meshes penetrate"
    if not presses or all(map(same, forces, exact)):
        return
    factors = _fit(forces, [[right] for right in exact])
    if factors is not None and subject.traits.promises.unbiased and abs(factors[0] - 2.0) <= SAME:
        return  # Two passes are right with twice the force.
    if factors is not None:
        near = [f": {words}" for known, words in _MEANINGS.items() if abs(factors[0] - known) <= SAME]
        yield f"every node has {factors[0]:.4g} times the exact force{''.join(near)}"
    of_slave = [right * pair.is_slave for pair, right in zip(pairs, exact, strict=True)]
    of_master = [right - part for right, part in zip(exact, of_slave, strict=True)]
    factors = _fit(forces, list(zip(of_slave, of_master, strict=True)))
    if factors is not None:
        sizes_of_sides = f"slave nodes have {factors[0]:.4g} times the exact force, master nodes {factors[1]:.4g} times"
        yield f"{sizes_of_sides}: look at the reaction"
    ends = [pair.is_border for pair in pairs]
    columns = zip(exact, of_slave, of_master, ends, strict=True)
    factors = _fit(forces, [[right * (1 - end), a * end, b * end] for right, a, b, end in columns])
    if factors is not None and abs(factors[0] - 1.0) <= SAME:
        words = f"{factors[1]:.4g} times the exact force on the slave, {factors[2]:.4g} times on the master"
        yield f"only {'free ends' if corners == SEGMENT else 'nodes at the border'} are wrong: {words}"
    if rules.penalty != "nodal":
        yield from _patterns_of_faces(pairs, forces, corners)


def diagnose_skewed(subject: Subject) -> str:
    """Return whether forces on a matching pair are wrong only where quadrilaterals are no parallelograms."""
    promises = subject.traits.promises.patch
    if QUADRILATERAL not in subject.traits.abilities.faces or not (promises.flat or promises.normal):
        return ""
    points, faces = grid(QUADRILATERAL, *(steps[:3] for steps in _STEPS))
    middle = len(points) // 2
    points[middle, :2] += _SKEW
    pair = _pair((points, faces), DEPTH, 0)
    nodes, domain = pair.case.interface.nodes[:, :2], points[[0, 2, -1, -3], :2]
    exact, pushes = uniform_surface_weights(pair.case.interface, nodes, domain), _pushes(subject, pair)
    if np.abs(pushes - exact).max() <= _SAME_SKEWED * exact.max():
        return ""
    return "forces are right on parallelograms, and wrong on other quadrilaterals: look at the Jacobian of each point"


def _patterns_of_faces(pairs: Sequence[_Pair], forces: Sequence[FloatArray], corners: int) -> Iterator[str]:
    word, size = ("segment", "length") if corners == SEGMENT else ("face", "area")
    sizes = [pair.areas.sum(axis=1) / 2 for pair in pairs]
    weights = {
        f"the {size} of a slave {word} is missing": [1 / each for each in sizes],
        f"each slave {word} counts with the mean {size}, whatever its own": [each.mean() / each for each in sizes],
    }
    for words, of_pairs in weights.items():
        factors = _fit(forces, [[each @ pair.areas] for pair, each in zip(pairs, of_pairs, strict=True)])
        if factors is not None:
            yield words + ("" if abs(factors[0] - 1.0) <= SAME else f", and there is a factor {factors[0]:.4g}")
    for side, (rank, number) in product(("slave", "master"), (("last", -1), ("first", 0))):
        columns = []
        for pair in pairs:
            nodes = getattr(pair.case.interface, side).faces[number]
            (part,) = pair.areas[(pair.areas[:, nodes] > 0).all(axis=1)]
            columns.append([pair.areas.sum(axis=0) - part, part])
        factors = _fit(forces, columns)
        if factors is not None and abs(factors[0] - 1.0) <= SAME:
            change = f"has {factors[1]:.4g} times the exact force" if factors[1] else "is left out"
            yield f"the {rank} {side} {word} {change}, and all others are right: look at the loop"


def _fit(values: Sequence[FloatArray], columns: Sequence[Sequence[FloatArray]]) -> FloatArray | None:
    """Return the factors with which columns, a list for each pair, add up to all values; None if they do not."""
    matrix, stacked = np.vstack([np.column_stack(each) for each in columns]), np.concatenate(values)
    factors = np.asarray(np.linalg.lstsq(matrix, stacked, rcond=None)[0], dtype=np.float64)
    fits = np.abs(matrix @ factors - stacked).max() <= SAME * np.abs(stacked).max()
    return np.where(np.abs(factors) < SAME, 0.0, factors) if fits else None


def _number(points: FloatArray, faces: IntArray, shift: int) -> _Surface:
    """Return a surface with other numbers of nodes and faces, and other first corners of these."""
    order = np.roll(np.arange(len(points))[:: -1 if shift else 1], shift)
    faces = np.roll(np.argsort(order)[faces], (shift, shift * (faces.shape[1] > SEGMENT)), axis=(0, 1))
    return points[order], faces


def _pair(surface: _Surface, depth: float, shift: int) -> _Pair:
    points, faces = surface
    # The slave runs the other way: in the plane its nodes are numbered along it, too.
    above = (points[::-1], faces) if faces.shape[1] == SEGMENT else (points, faces[:, ::-1])
    (upper, slave), (lower, master) = _number(*above, shift), _number(points, faces, shift + (shift > 0))
    n, nodes = len(points), np.vstack([upper, lower])
    interface = Interface(nodes, Surface(slave), Surface(master + n))
    opposite = n + (upper[:, None] == lower).all(axis=-1).argmax(axis=1)
    areas = np.zeros((len(slave), 2 * n))
    for of_face, face, size in zip(areas, slave, interface.slave.measures(nodes), strict=True):
        of_face[face] = of_face[opposite[face]] = size / len(face)
    z = nodes.copy()
    z[:n, -1] -= depth
    return _Pair(Case(interface, z.reshape(-1), PENALTY, name="matching"), depth, areas)


def _pushes(subject: Subject, pair: _Pair) -> FloatArray:
    """Return the forces (n_nodes,) that push the surfaces apart, over the pressure; multipliers have the pressure."""
    pressure = PENALTY * max(pair.depth, 0.0)
    residual = residual_of(subject, pair.case.interface, pair.case.z, pressure)[: pair.case.z.size]
    normal: FloatArray = residual.reshape(pair.case.positions.shape)[:, -1] * (1 - 2 * pair.is_slave)
    return normal / (PENALTY * abs(pair.depth))
