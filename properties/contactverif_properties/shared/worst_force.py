"""The nodal force that is furthest from the exact one, for a person who looks for the mistake."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import PLANE, Interface
from contactverif.contract.measurement import Finding

COMPONENTS = {2: "x and y", 3: "x, y and z"}  # The components of a vector in words, by their number.
_ASIDE = 2.0**-20  # The part of a force that may point aside by roundoff if both lie on one line.


def worst_force(
    interface: Interface, forces: FloatArray, exact: FloatArray, names: tuple[str, str] = ("force", "exact")
) -> Finding:
    """Return the force at the node where it errs most, beside the exact one, in the words of `names`.

    The forces (n, dim) push all nodes, or those of the slave alone. If both lie on one line, the finding has two
    numbers, counted along the exact force, with their ratio; else the components of both.
    """
    node = int(np.linalg.norm(forces - exact, axis=1).argmax())
    return _beside(describe_node(interface, node), forces[node], exact[node], names)


def total_force(total: FloatArray, exact: FloatArray) -> Finding:
    """Return the total force (dim,) on the slave beside the exact one, as `worst_force` does for a node."""
    return _beside("all slave nodes together", total, exact, ("force", "exact"))


def _beside(place: str, force: FloatArray, right: FloatArray, names: tuple[str, str]) -> Finding:
    """Return a force beside the one that is right: one number of each if they lie on one line."""
    line = right if right.any() else force
    direction = line / np.linalg.norm(line)
    aside = distance_from_line(force, direction)
    if not aside <= _ASIDE * float(np.abs(np.stack([force, right])).max()):
        return Finding(f"{place}, {COMPONENTS[len(force)]}", tuple(force), tuple(right), "N", *names)
    along, size = float(force @ direction), float(right @ direction)
    return Finding(place, (along,), (size,), "N", *names, _tell_ratio(along, size) if size else "")


def _tell_ratio(force: float, right: float) -> str:
    """Return a force over the right one in words, and by how much it differs from 1 if four digits do not say that."""
    ratio, difference = f"ratio {force / right:.4g}", (force - right) / right
    if ratio != "ratio 1" or difference == 0:
        return ratio
    return f"{ratio} {'+' if difference > 0 else '−'} {abs(difference):.2g}"


def distance_from_line(force: FloatArray, direction: FloatArray) -> float:
    """Return the part of a force (dim,) across a unit vector (dim,)."""
    if len(force) == PLANE:
        return abs(float(force[0] * direction[1] - force[1] * direction[0]))
    return float(np.linalg.norm(np.cross(force, direction)))


def describe_node(interface: Interface, node: int) -> str:
    """Return a node in words: its side, its number, and whether the side ends there."""
    on_slave = node < interface.n_slave_nodes
    surface = interface.slave if on_slave else interface.master
    at_border = surface.neighbours < 0
    if interface.dim != PLANE:  # A border edge runs from its corner to the next one.
        at_border = at_border | np.roll(at_border, 1, axis=1)
    border = "(free end)" if interface.dim == PLANE else "(border)"
    return f"{'slave' if on_slave else 'master'} node {node}{f' {border}' if node in surface.faces[at_border] else ''}"
