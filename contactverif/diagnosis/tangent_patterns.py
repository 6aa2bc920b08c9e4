"""Tell which part of a tangent is wrong, on the flat interface and on a frozen pairing.

The parts of a tangent differ in how they grow with the penetration g, and in the places where they stand, in each
segment's own normal n and tangent t: the material part is as large for every g and stands in n–n; the parts of δξ, δn
and of the length of a segment grow like g and stand in n–t or t–n.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, dense
from contactverif.contract.interface import PLANE, SEGMENT
from contactverif.contract.subject import Subject
from contactverif.diagnosis.flat_state import MASTER, PENALTY, SLAVE, FlatState, flat_state, flat_state_of, spell

DEPTHS = tuple(2.0**-power for power in (5, 6, 7, 8))
# Central differences of a step of 2^-20 of forces that are smooth over 1 err by less, over the largest entry.
SAME = 1e-6
STEP = 2.0**-20
_BEND = 2.0**-11  # The step of second differences, a fraction of the smallest depth.
_DIFFERENCES = 0.05  # The share of the errors of one-sided differences that a second derivative may leave.
_SHORT_MASTER = MASTER[1:-1]  # The slave reaches past both of its ends.
_PARTLY_APART = -0.625  # The slope of a penetration that ends at 1.6, inside a segment of either side.
_BARRIER = 0.75  # The largest gap over the activation distance, and the length of the shortest segment
_POWER = 0.25  # A part grows like g^k if the measured power is as near to k.


@dataclass(frozen=True, slots=True, eq=False)
class Tangents:
    """A tangent beside the derivative, for each depth; rows and columns (n_nodes, dim) are t, then n."""

    tangents: FloatArray  # (n_depths, n, n)
    derivatives: FloatArray  # (n_depths, n, n)
    curvatures: FloatArray  # (n_depths, n, n): the second derivative of each row by the unknown of the column.
    n_slave: int  # The number of slave nodes, which come first.
    dim: int

    @property
    def errors(self) -> FloatArray:
        """The error of each entry."""
        return self.tangents - self.derivatives

    @property
    def scale(self) -> float:
        """The largest entry of the derivative."""
        return float(np.abs(self.derivatives).max())


def diagnose_tangent(subject: Subject) -> str:
    """Return which part of the tangent is wrong; empty where it is right, or no rule knows the mistake."""
    rules, abilities = subject.traits.rules, subject.traits.abilities
    if subject.traits.promises.tangent == "approximate" or "tangent" not in subject.provides:
        return ""
    is_penalty, depths = rules.enforcement == "penalty" and not rules.own_law, DEPTHS
    if rules.enforcement == "barrier":
        depths = tuple(-16 * _BARRIER * (rules.activation or 0.0) * depth for depth in DEPTHS)
    kinds = [SEGMENT] if abilities.in_plane else sorted(abilities.faces)
    for corners in kinds:
        pair = _measure(subject, [flat_state_of(corners, depth) for depth in depths])
        if pair.scale > 0 and not _is_small(pair.errors, pair.scale):
            return next(filter(None, _patterns(pair, is_penalty=is_penalty)), "")
    if not (is_penalty and abilities.in_plane):
        return ""
    pair = _measure(subject, [flat_state(depth=DEPTHS[0], places=(SLAVE, _SHORT_MASTER))])
    if nodes := _wrong_nodes(pair, axis=0):
        return (
            f"the tangent is wrong only where the slave reaches past an end of the master, in columns of {nodes}: look "
            "at the derivative of the limits between which the force is integrated"
        )
    pair = _measure(subject, [flat_state(slope=_PARTLY_APART, depth=DEPTHS[0])])
    if nodes := _wrong_nodes(pair, axis=1):
        words = f"in rows of {nodes}"
        return f"the tangent is wrong only where a part of the slave is apart from the master, and open: {words}"
    return ""


def _measure(subject: Subject, states: Sequence[FlatState]) -> Tangents:
    tangents, derivatives, curvatures = [], [], []
    step = STEP * min(1.0, abs(states[-1].depth) / DEPTHS[-1])
    for state in states:
        case, formulation = state.case, subject.for_interface(state.case.interface, PENALTY)
        interface, n = case.interface, case.z.size
        z = np.append(case.z, np.full(formulation.n_multipliers(interface), PENALTY * DEPTHS[0]))
        pairing, ways = formulation.pair(interface, z), np.eye(n, z.size)
        at = [
            formulation.residual(interface, pairing, np.concatenate([z + way * ways, z - way * ways]))[:, :n]
            for way in (step, _BEND)
        ]
        derivatives.append((at[0][:n] - at[0][n:]).T / (2 * step))
        middle = formulation.residual(interface, pairing, z)[:n]
        curvatures.append((at[1][:n] + at[1][n:] - 2 * middle).T / _BEND**2)
        tangents.append(dense(formulation.tangent(interface, pairing, z))[:n, :n])
    first = states[0]
    return Tangents(
        np.stack(tangents), np.stack(derivatives), np.stack(curvatures), first.n_slave_nodes, first.case.interface.dim
    )


def _patterns(pair: Tangents, *, is_penalty: bool) -> Iterator[str]:
    yield _as_a_whole(pair)
    yield _one_line(pair)
    if pair.dim == PLANE:
        yield _one_entry(pair)
    of_slave = np.arange(pair.tangents.shape[1]) < pair.dim * pair.n_slave
    for side, columns in (("slave", of_slave), ("master", ~of_slave)):
        if not pair.tangents[:, :, columns].any() and _is_small(pair.errors[:, :, ~columns], pair.scale):
            yield f"the columns of all {side} nodes are missing: the tangent takes the {side} for rigid"
    # One-sided differences err by half a step times the second derivative, and what follows it is smaller by the step
    # over the size of a segment.
    step = 2 * float((pair.errors * pair.curvatures).sum() / (pair.curvatures**2).sum())
    rest = np.abs(pair.errors - step / 2 * pair.curvatures).max()
    if rest <= _DIFFERENCES * np.abs(pair.errors).max():  # It is NaN where forces are linear.
        yield f"the tangent is of one-sided differences with a step of about {abs(step):.1g}, on segments of length 1"
    yield _one_part(pair, is_penalty=is_penalty)


def _as_a_whole(pair: Tangents) -> str:
    tangents, derivatives = pair.tangents, pair.derivatives
    if not tangents.any():
        return "the tangent is zero"
    if _is_small(tangents - derivatives.transpose(0, 2, 1), pair.scale):
        return "the tangent is the transposed derivative"
    factor = float((tangents * derivatives).sum() / (derivatives**2).sum())
    if _is_small(tangents - factor * derivatives, pair.scale):
        return f"the tangent has {'the opposite sign' if abs(factor + 1) < SAME else f'a factor {factor:.4g}'}"
    order = np.arange(tangents.shape[1]).reshape(-1, pair.dim).T.reshape(-1)  # All x, then all y.
    if any(_is_small(tangents - derivatives[:, each][:, :, each], pair.scale) for each in (order, np.argsort(order))):
        return "the tangent numbers the unknowns in another order than the forces: all x before all y"
    if _is_small(tangents - (derivatives + derivatives.transpose(0, 2, 1)) / 2, pair.scale):
        return "the tangent is the symmetric part of the derivative"
    for word, half in (("upper", np.triu(derivatives)), ("lower", np.tril(derivatives))):
        mirror = half.transpose(0, 2, 1) * (1 - np.eye(half.shape[1]))
        if _is_small(tangents - half - mirror, pair.scale):
            return f"the tangent is the {word} triangle of the derivative, mirrored: it is not symmetric"
    return ""


def _one_line(pair: Tangents) -> str:
    large: BoolArray = np.max(np.abs(pair.errors), axis=0) > SAME * pair.scale
    if large.sum() == 1:
        row, column = (int(place) for place in np.argwhere(large)[0])
        return f"row {row} ({_unknown(row, pair)}), column {column} ({_unknown(column, pair)}) alone is wrong"
    for name, lines, axis in (("column", np.any(large, axis=0), 2), ("row", np.any(large, axis=1), 1)):
        (places,) = np.nonzero(lines)
        if len(places) == 1:
            place = int(places[0])
            missing = not np.take(pair.tangents, place, axis=axis).any()
            rank = {0: "the first, ", len(lines) - 1: "the last, "}.get(place, "")
            change = "missing" if missing else "wrong"
            return f"{name} {place} ({rank}{_unknown(place, pair)}) is {change}, all others are right"
    return ""


def _one_entry(pair: Tangents) -> str:
    wrong, n = np.max(np.abs(pair.errors), axis=0) > SAME * pair.scale, len(SLAVE)
    nodes = np.add.outer(n - 1 + np.searchsorted(-MASTER, -SLAVE), [0, 1])
    unknowns = (2 * np.column_stack([np.arange(n), nodes])[:, :, None] + [0, 1]).reshape(n, -1)
    names = [f"{axis} of the {node}" for node in ("slave node", "first master node", "second one") for axis in "xy"]
    for row, column in product(range(len(names)), repeat=2):
        entries = np.zeros_like(wrong)
        entries[unknowns[:, row], unknowns[:, column]] = True
        if np.array_equal(entries, wrong):
            change = _change(pair.tangents[:, wrong], pair.derivatives[:, wrong], pair.scale)
            place = f"row {names[row]}, column {names[column]}: AMATRX({row + 1}, {column + 1}) of a UEL"
            return f"one entry of each slave node and its segment {change}, in {place}"
    return ""


def _unknown(number: int, pair: Tangents) -> str:
    node, axis = divmod(number, pair.dim)
    return f"{'xyz'[axis]} of {'slave' if node < pair.n_slave else 'master'} node {node}"


def _wrong_nodes(pair: Tangents, axis: int) -> str:
    """Return the nodes of the rows (axis 1) or columns (axis 0) that are wrong at the first depth, in words."""
    unknowns = np.flatnonzero(np.abs(pair.errors[0]).max(axis=axis) > SAME * pair.scale)
    nodes = np.unique(unknowns // pair.dim)
    sides = {"slave": nodes[nodes < pair.n_slave], "master": nodes[nodes >= pair.n_slave]}
    return " and ".join(spell(f"{side} node", part) for side, part in sides.items() if len(part))


def _one_part(pair: Tangents, *, is_penalty: bool) -> str:
    normal = np.arange(pair.errors.shape[1]) % pair.dim == pair.dim - 1
    numbers = {"t": np.flatnonzero(~normal), "n": np.flatnonzero(normal)}
    blocks = {
        rows + columns: np.ix_(np.arange(len(DEPTHS)), numbers[rows], numbers[columns])
        for rows, columns in product("tn", repeat=2)
    }
    powers = {}
    for name, block in blocks.items():
        if not _is_small(errors := pair.errors[block], pair.scale):
            sizes = np.abs(errors).max(axis=(1, 2))
            powers[name] = float(np.log2(sizes[0] / sizes[-1]) / (len(DEPTHS) - 1)) if sizes[-1] > 0 else np.inf
    # A part that grows faster follows from the one below it, as a segment turns when its place along another changes.
    powers = {n: power for n, power in powers.items() if not is_penalty or power < min(powers.values()) + 1 - _POWER}
    if len(powers) != 1 or not is_penalty:
        names = " and ".join(f"{name[0]}–{name[1]}" for name in powers)
        return f"entries in {names} are wrong (n along the normal, t along the surface)" if powers else ""
    ((name, power),) = powers.items()
    errors, n = pair.errors[blocks[name]], pair.n_slave
    nearest = int(np.clip(np.rint(power), 0, len(DEPTHS)))  # It is infinite where only deep penetrations are wrong.
    for side, others in (("slave", errors[:, n:]), ("master", errors[:, :n])) if name == "nn" else ():
        if _is_small(others, pair.scale):
            return f"entries in n–n are wrong, in rows of the {side} alone"
    part = _part_of(name, nearest, errors, pair) if abs(power - nearest) < _POWER else ""
    if not part:
        return f"entries in {name[0]}–{name[1]} are wrong, and grow like the penetration to the power {power:.2g}"
    sides = (errors[:, :, :n], errors[:, :, n:])
    if name == "nn" and all(_is_small(side.sum(axis=2), pair.scale) for side in sides):
        return f"{part}, stands at other nodes, as if it were lumped: it is right for a motion of a whole side alone"
    return f"{part}, {_change(pair.tangents[blocks[name]], pair.derivatives[blocks[name]], pair.scale)}"


def _part_of(name: str, power: int, errors: FloatArray, pair: Tangents) -> str:
    rows, columns = (pair.n_slave * (1 if axis == "n" else pair.dim - 1) for axis in name)  # Of the slave in a block
    on_slave = {"rows": errors[:, :rows], "columns": errors[:, :, :columns]}
    on_master = errors[:, :, columns:]
    match name, power:
        case "nn", 0:
            return "the material part, in n–n"
        case "nt", 1 if _is_small(on_slave["rows"], pair.scale):
            return "the part of δξ, in n–t on the master's rows"
        case "nt", 1 if _is_small(on_master, pair.scale):
            sizes = "length of the slave's segments" if pair.dim == PLANE else "area of the slave's faces"
            return f"the part of the {sizes}, in n–t on the slave's columns"
        case "nt", 1:
            return "the part of the places of points (δξ) or of the lengths between them, in n–t on rows of both sides"
        case "tn", 1:
            owner = "master" if _is_small(on_slave["columns"], pair.scale) else "slave"
            both = owner == "slave" and not _is_small(on_master, pair.scale)
            return f"the part of δn, in t–n on the columns of {'both sides' if both else f'the {owner}'}"
    return ""


def _change(tangents: FloatArray, derivatives: FloatArray, scale: float) -> str:
    if not derivatives.any():
        return "is there, and should not be"
    wrong = np.abs(tangents - derivatives) > SAME * scale
    tangents, derivatives = tangents[wrong], derivatives[wrong]
    factor = float((tangents * derivatives).sum() / (derivatives**2).sum())
    if not _is_small(tangents - factor * derivatives, scale):
        return "is wrong"
    if abs(factor) < 1e-3:
        return "is missing"
    return "has the opposite sign" if abs(factor + 1) < 1e-3 else f"has a factor {factor:.7g}"


def _is_small(errors: FloatArray, scale: float) -> bool:
    return bool((np.abs(errors) <= SAME * scale).all())
