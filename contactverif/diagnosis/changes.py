"""Tell which change of a state forces do not follow, in the plane and in space.

The forces of a right formulation turn, move and grow with the state, and do not know numbers, or what lies far away.
Each of three states, from a flat one to one with ends and openings, is asked again after each change.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.interface import PLANE, QUADRILATERAL, SEGMENT, Interface, Surface
from contactverif.contract.subject import Subject
from contactverif.diagnosis.flat_state import DEPTH, PENALTY, SAME, grid, residual_of, same, spell

_SLOPE, _TILTED_DEPTH = 2.0**-3, 2.0**-3
_APART, _BEHIND = 1.0, 3.0  # How far a pair opens, and another surface lies behind the master.
_ASIDE, _FAR, _FARTHEST = 64.0, 10, 24  # The last two are powers of 2.
_MANY = {PLANE: 40, PLANE + 1: 12}  # Copies of a pair, by the number of coordinates.
_SCALES = range(4, 41, 4)  # The mesh is as many times smaller, and then larger, as 2 to these powers.
# A power of two changes no rounding, and an absolute length in the code soon changes forces by far more than this.
_SAME_SCALED = 2.0**-20
_BEYOND, _HALVINGS = 1.0625, 30
_BY_CORNERS = "if its faces begin at another corner", "in a mirror"
_FEW = 3  # So many nodes are told by number.


class _Side(NamedTuple):
    reference: FloatArray  # (n, dim)
    current: FloatArray  # (n, dim)
    faces: IntArray  # (n_faces, n_corners)


_Pair = Sequence[_Side]  # Slave and master


class _Change(NamedTuple):
    words: str
    pair: _Pair
    rows: Sequence[IntArray]  # The nodes of either side, in the order that they had before.
    turn: FloatArray  # (dim, dim) By which all positions are multiplied.


def diagnose_changes(subject: Subject) -> str:
    """Return which change of a state the forces do not follow; empty if they follow all."""
    rules, abilities = subject.traits.rules, subject.traits.abilities
    if rules.enforcement == "barrier" and rules.activation is None:
        return ""
    kinds = [SEGMENT] if abilities.in_plane else sorted(abilities.faces)
    return next((text for corners in kinds for text in _differences(subject, corners)), "")


def find_kept_mesh(subject: Subject) -> str:
    """Return whether a mesh gets what is kept of another one with as many nodes; empty if it does not."""
    if subject.traits.rules.enforcement != "penalty":
        return ""
    corners, answers = SEGMENT if subject.traits.abilities.in_plane else max(subject.traits.abilities.faces), []
    for n_copies, factor in ((5, 1.0), (5, 2.0), (7, 2.0)):
        pair = [_scale(_copy(side, range(n_copies)), factor) for side in _states(corners, 1.0)["flat state"]]
        answers.append(_forces(subject, pair)[0][:3] / factor ** pair[0].reference.shape[1])
    first, second, of_more = answers
    if same(of_more, first) and not same(second, first):
        return "something is kept by numbers of nodes or segments: a mesh gets it of another one with as many"
    return ""


def _differences(subject: Subject, corners: int) -> Iterator[str]:
    rules = subject.traits.rules
    if rules.enforcement == "barrier":
        yield from _diagnose_barrier(subject, _states(corners, 1.0)["flat state"])
    for state, pair in _states(corners, min(1.0, subject.traits.abilities.reach or 1.0)).items():
        if rules.enforcement == "barrier":  # No barrier may be crossed.
            pair = _part(subject, pair, 0.5)
        # The sum over a cell may depend on the corner at which its triangles meet, where it is not exact.
        forces, unsure = _forces(subject, pair), corners == QUADRILATERAL and np.ptp(pair[0].current[:, -1]) > 0
        for words, changed, rows, turn in _changes(subject, pair):
            others = [part[numbers] @ turn.T for part, numbers in zip(_forces(subject, changed), rows, strict=True)]
            if not same(np.vstack(others), np.vstack(forces)) and not (unsure and words in _BY_CORNERS):
                yield f"{words}, the forces of a {state} are others{_name_nodes(others, forces)}"
        if rules.enforcement == "penalty" and rules.penalty is not None and not rules.own_law:
            yield from _diagnose_scale(subject, pair)
        if subject.traits.promises.conserves_force:
            yield from _imbalances(subject, state, pair, forces)


def _states(corners: int, reach: float) -> dict[str, _Pair]:
    """Return pairs by what they are: flat; tilted; and one with ends, openings and bends. They are as deep as asked."""
    if corners == SEGMENT:
        upper = grid(corners, np.array([0.0, 1.0, 2.25, 3.125]))
        inside, short = (grid(corners, np.array([first, 1.5, 2.625, 3.625])) for first in (-0.5, 0.4375))
    else:
        upper = grid(corners, np.array([0.0, 1.0, 2.25]), np.array([0.0, 1.25, 2.0]))
        edges = np.array([-0.75, 0.3125, 1.5, 3.5]), np.array([-0.375, 0.875, 2.25])
        inside = grid(corners, *edges, shear=-0.125)
        short = grid(corners, edges[0] + 1.25, edges[1], shear=-0.125)
    states: dict[str, _Pair] = {}
    for words, lower, slope, depth, bend in (
        ("flat state", inside, 0.0, DEPTH, 0.0),
        ("tilted slave", inside, _SLOPE, _TILTED_DEPTH, 0.0),
        ("slave that is bent, partly open, and past an end of the master", short, _SLOPE, 0.1, 2.0**-5),
    ):
        slave, master = upper[0].copy(), lower[0].copy()
        for current in (slave, master):
            current[:, -1] += reach * bend * np.cos(7.0 * np.arange(len(current)))
        slave[:, -1] += reach * (slope * (slave[:, 0] - 1.0) - depth)
        states[words] = [_Side(upper[0], slave, upper[1][:, ::-1]), _Side(lower[0], master, lower[1])]
    return states


def _part(subject: Subject, pair: _Pair, share: float) -> _Pair:
    """Return a pair whose sides lie at least a share of the distance apart at which a barrier begins."""
    slave, master = pair
    distance = share * float(subject.traits.rules.activation or 0.0)
    if subject.traits.rules.activation_unit == "segment":
        edges = (np.diff(side.reference[side.faces[:, :2]], axis=1) for side in pair)
        distance *= min(np.linalg.norm(edge, axis=2).min() for edge in edges)
    lift = master.current[:, -1].max() - slave.current[:, -1].min() + distance
    return [slave._replace(current=slave.current + lift * np.eye(slave.current.shape[1])[-1]), master]


def _diagnose_barrier(subject: Subject, pair: _Pair) -> Iterator[str]:
    def size(share: float) -> float:
        return float(np.abs(_forces(subject, _part(subject, pair, share))[0]).max())

    if size(_BEYOND):
        yield f"there are forces at {_BEYOND:g} times the distance `activation`"
    for power in range(1, _HALVINGS):
        if size(2.0**-power) <= size(2.0 ** (1 - power)):
            yield f"the forces do not grow where a gap of 2^-{power - 1} of the distance `activation` is halved"


def _forces(subject: Subject, pair: _Pair) -> list[FloatArray]:
    """Return the forces (n, dim) of either side; all multipliers have the pressure of the flat state."""
    slave, master = pair
    n = len(slave.reference)
    nodes, z = (np.vstack([getattr(side, name) for side in pair]) for name in ("reference", "current"))
    interface = Interface(nodes, Surface(slave.faces), Surface(master.faces + n))
    residual = residual_of(subject, interface, z.reshape(-1), PENALTY * DEPTH)
    return np.split(-residual[: z.size].reshape(z.shape), [n])


def _changes(subject: Subject, pair: _Pair) -> Iterator[_Change]:
    rules, stable = subject.traits.rules, subject.traits.promises.translation_stable
    slave, master = pair
    is_flat, dim = np.ptp(slave.current[:, -1]) == 0, slave.reference.shape[1]
    (along, up), rest = np.eye(dim)[[0, -1]], np.eye(dim)
    rows = [np.arange(len(side.reference)) for side in pair]
    orders = [np.roll(numbers[::-1], 1) for numbers in rows]
    renumbered = [
        _Side(side.reference[order], side.current[order], np.argsort(order)[side.faces])
        for side, order in zip(pair, orders, strict=True)
    ]
    yield _Change("if its nodes have other numbers", renumbered, [np.argsort(order) for order in orders], rest)
    word = "segments" if slave.faces.shape[1] == SEGMENT else "faces"
    others = {
        f"if its {word} stand in another order": [side._replace(faces=side.faces[::-1]) for side in pair],
        _BY_CORNERS[0]: [side._replace(faces=np.roll(side.faces, dim - PLANE, axis=1)) for side in pair],
    }
    far = 2.0 ** (_FARTHEST if stable and is_flat else _FAR)  # It rounds nothing where the state is flat.
    others[f"if all is moved by {far:g}"] = [_shift(side, far) for side in pair]
    if rules.area == "current" and rules.penalty == "distributed" and not rules.own_law:
        of_now = [side._replace(reference=side.current) for side in pair]
        others["if the reference is as the state is, though areas are current ones"] = of_now
    for words, numbers in (("one more pair", range(2)), (f"{_MANY[dim]} more pairs", range(_MANY[dim] + 1))):
        others[f"beside {words} of the same kind"] = [_copy(side, numbers) for side in pair]
    apart = [_shift(side, _ASIDE * along) for side in pair]
    apart[0] = apart[0]._replace(current=apart[0].current + _APART * up)
    others["beside a pair that is apart"] = [_join(list(sides)) for sides in zip(pair, apart, strict=True)]
    # On tilted states a surface that is cut where this one has nodes may have other sums.
    if is_flat and rules.enforcement != "barrier" and subject.traits.abilities.reach is None:
        both = _join([master, _shift(master, -_BEHIND * up)])
        others[f"if another surface lies {_BEHIND:g} behind the master"] = [slave, both]
    yield from (_Change(words, changed, rows, rest) for words, changed in others.items())
    before = [_copy(side, (-1, 0)) for side in pair]
    yield _Change("behind another pair in its numbers", before, [numbers + len(numbers) for numbers in rows], rest)
    little = rest.copy()
    little[np.ix_([0, -1], [0, -1])] = [[0.8, 0.6], [-0.6, 0.8]]
    half, mirror = np.diag([-1.0, *[1.0] * (dim - PLANE), -1.0]), np.diag([-1.0, *[1.0] * (dim - 1)])
    turns = {"if all is turned by 180°": half, "if all is turned by 37°": little, _BY_CORNERS[1]: mirror}
    for words, turn in turns.items():
        flip = int(np.rint(np.linalg.det(turn)))
        turned = [_Side(x @ turn, z @ turn, faces[:, ::flip]) for x, z, faces in pair]
        yield _Change(words, turned, rows, turn)


def _shift(side: _Side, way: FloatArray | float) -> _Side:
    return side._replace(reference=side.reference + way, current=side.current + way)


def _copy(side: _Side, places: Iterable[int]) -> _Side:
    return _join([_shift(side, _ASIDE * place * np.eye(side.reference.shape[1])[0]) for place in places])


def _scale(side: _Side, factor: float) -> _Side:
    return side._replace(reference=side.reference * factor, current=side.current * factor)


def _join(sides: list[_Side]) -> _Side:
    first = np.cumsum([0] + [len(side.reference) for side in sides])
    faces = np.vstack([side.faces + start for side, start in zip(sides, first, strict=False)])
    return _Side(np.vstack([side.reference for side in sides]), np.vstack([side.current for side in sides]), faces)


def _name_nodes(others: list[FloatArray], forces: list[FloatArray]) -> str:
    """Return the nodes whose forces differ, if they are few, and the factor, if there is one."""
    size = SAME * max(np.abs(part).max() for part in forces)
    wrong = [np.flatnonzero(np.abs(a - b).max(axis=1) > size) for a, b in zip(others, forces, strict=True)]
    a, b = (np.vstack([part[w] for part, w in zip(side, wrong, strict=True)]) for side in (others, forces))
    factor = float((a * b).sum() / (b * b).sum()) if b.any() else np.nan
    text = f", {factor:.4g} times those before" if np.abs(a - factor * b).max() <= size else ""
    sides = {side: numbers for side, numbers in zip(("slave", "master"), wrong, strict=True) if len(numbers)}
    if max(map(len, wrong)) <= _FEW:
        return f"{text}, at {' and '.join(spell(f'{side} node', numbers) for side, numbers in sides.items())}"
    return text if len(sides) > 1 else f"{text}, on the {next(iter(sides))} alone"


def _diagnose_scale(subject: Subject, pair: _Pair) -> Iterator[str]:
    dim = pair[0].reference.shape[1]  # A force is ε̂ |g| times a length or an area.

    def scale(factor: float) -> FloatArray:
        forces: FloatArray = np.vstack(_forces(subject, [_scale(side, factor) for side in pair])) / factor**dim
        return forces

    reference, first = scale(1.0), scale(2.0**4)
    ratio = float((first * reference).sum() / (reference**2).sum())
    if abs(ratio - 1.0) > SAME and same(first, ratio * reference):
        power = np.log2(abs(ratio)) / 4
        if same(scale(2.0**8), 2.0 ** (8 * power) * reference):
            words = f"the forces grow like the size of the mesh to the power {dim + power:.3g}, and should like {dim}"
            yield f"{words}: is a length missing, or counted twice?"
    for (sign, word), exponent in product(((-1, "smaller"), (1, "larger")), _SCALES):
        factor = 2.0 ** (sign * exponent)
        if np.abs(scale(factor) - reference).max() > _SAME_SCALED * np.abs(reference).max():
            sizes = f"gaps of {factor * DEPTH:.1e} on segments of about {factor:.1e}"
            yield f"forces do not scale with a mesh 2^{exponent} times {word} ({sizes}): look for an absolute length"


def _imbalances(subject: Subject, state: str, pair: _Pair, forces: list[FloatArray]) -> Iterator[str]:
    on_slave, on_master = (part.sum(axis=0) for part in forces)
    if not same(-on_master, on_slave):
        names = [_name_direction(force) for force in (on_slave, -on_master)]
        words = f"they are along {names[0]} normal on the slave, along {names[1]} normal on the master"
        ratio = float(np.linalg.norm(on_master) / np.linalg.norm(on_slave))
        if abs(ratio - 1.0) > SAME:
            words = f"the master gets {ratio:.4g} times the slave's"
        yield f"the forces on the sides of a {state} do not balance: {words}"
    if not subject.traits.promises.conserves_moment:
        return
    moments = [_moment(side.current, part) for side, part in zip(pair, forces, strict=True)]
    if np.abs(moments[0] + moments[1]).max() > SAME * np.abs(np.concatenate(moments)).max():
        yield (
            f"the forces on the sides of a {state} balance, and their moments do not: look at the projection, and at "
            "shapes or weights that are not the same on both sides"
        )


def _name_direction(force: FloatArray) -> str:
    along, up = np.eye(len(force))[[0, -1]]
    normals = {"the slave's": up - _SLOPE * along, "the master's": up}
    size = np.linalg.norm(force)
    return next((name for name, n in normals.items() if same(force, n * size / np.linalg.norm(n))), "another")


def _moment(positions: FloatArray, forces: FloatArray) -> FloatArray:
    if positions.shape[1] == PLANE:
        return np.array([positions[:, 0] @ forces[:, 1] - positions[:, 1] @ forces[:, 0]])
    moment: FloatArray = np.cross(positions, forces).sum(axis=0)
    return moment
