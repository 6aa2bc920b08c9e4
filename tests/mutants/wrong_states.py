"""Defects that show in some states only: forces and tangent are 1 % too large there, and right everywhere else.

Force and tangent agree with one another, and the reported pressures stay right. So nobody finds such a defect but who
looks at the right place: the strategies of the properties must reach it.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from mutate import Mutant, wrap

TRANSMISSION, RESULTANT = "patch.flat.transmission", "patch.flat.resultant"
FORCES, PURITY = "projection.forces", "purity"
EXCESS = 1.01
Condition = Callable[[Any, Any], bool]  # (interface, positions (n_nodes, 2)) → is the defect there


def _wrong_in(condition: Condition) -> Callable[..., Any]:
    """Return a formulation whose forces and tangent are too large where the condition holds."""

    def factor(interface: Any, z: Any) -> float:
        return EXCESS if condition(interface, np.real(z[..., : interface.n_unknowns]).reshape(-1, 2)) else 1.0

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        states = z.reshape(-1, z.shape[-1])
        factors = np.array([factor(interface, state) for state in states])
        return right(interface, pairing, z) * factors.reshape(*z.shape[:-1], 1)

    def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return right(interface, pairing, z) * factor(interface, z)

    return lambda *, penalty: wrap(penalty, residual=residual, tangent=tangent)


def _directions(surface: Any, x: Any) -> Any:
    """Return the unit vectors (n_segments, 2) along the segments."""
    along = np.diff(x[surface.segments], axis=1)[:, 0]
    return along / np.linalg.norm(along, axis=1)[:, None]


def _turns(surface: Any, x: Any) -> Any:
    """Return the sine of the turn at each vertex; negative where the body is concave."""
    t = _directions(surface, x)
    here = np.flatnonzero(surface.neighbours[:, 1] >= 0)
    other = surface.neighbours[here, 1]
    return t[here, 0] * t[other, 1] - t[here, 1] * t[other, 0]


def _many_segments(interface: Any, x: Any) -> bool:
    return len(interface.slave) + len(interface.master) > 100


def _large_ratio(interface: Any, x: Any) -> bool:
    lengths = np.append(interface.slave.lengths(x), interface.master.lengths(x))
    return bool(lengths.max() > 1e5 * lengths.min())


def _three_chains(interface: Any, x: Any) -> bool:
    return sum(int((surface.neighbours[:, 0] < 0).sum()) for surface in (interface.slave, interface.master)) > 3


def _fifty_masters(interface: Any, x: Any) -> bool:
    return len(interface.master) >= 50 and len(interface.slave) <= 2


def _one_tilt(interface: Any, x: Any) -> bool:
    t = _directions(interface.slave, x)[0]
    return bool(0.4 < np.arctan2(t[1], t[0]) % (np.pi / 2) < 0.5)


def _steep(interface: Any, x: Any) -> bool:
    return bool((_directions(interface.slave, x) @ _directions(interface.master, x).T > -np.sqrt(0.5)).any())


def _re_entrant(interface: Any, x: Any) -> bool:
    return bool((_turns(interface.master, x) < -0.1).any())


def _seam(interface: Any, x: Any) -> bool:
    return bool((interface.master.neighbours >= 0).all())


def _matching_nodes(interface: Any, x: Any) -> bool:
    """Return whether a slave node is exactly over a master node, seen along the first master segment's normal."""
    t = _directions(interface.master, x)[0]
    along = (x - x[0]) @ t
    slave, master = along[: interface.n_slave_nodes], along[interface.n_slave_nodes :]
    return bool(np.isin(slave, master).any())


def _deep(interface: Any, x: Any) -> bool:
    """Return whether some slave node is deeper below the line of the first master segment than the segment is long."""
    first, second = x[interface.master.segments[0]]
    along = second - first
    d = x[: interface.n_slave_nodes] - first
    return bool((d[:, 0] * along[1] - d[:, 1] * along[0] < -0.5 * (along @ along)).any())


def _overhang(interface: Any, x: Any) -> bool:
    """Return whether the slave reaches past the master along the first master segment."""
    t = _directions(interface.master, x)[0]
    along = (x - x[0]) @ t
    slave, master = along[: interface.n_slave_nodes], along[interface.n_slave_nodes :]
    return bool(slave.max() > master.max() or slave.min() < master.min())


def _by_number(interface: Any, x: Any) -> bool:
    return bool(interface.n_nodes % 7 == 0)


def _by_clock(interface: Any, x: Any) -> bool:
    return bool(time.perf_counter_ns() // 1000 % 2 == 0)


MUTANTS = (
    Mutant("wrong above 100 segments", TRANSMISSION, _wrong_in(_many_segments)),
    Mutant("wrong at ratios of lengths above 1e5", RESULTANT, _wrong_in(_large_ratio)),
    Mutant("wrong with four chains", FORCES, _wrong_in(_three_chains)),
    Mutant("wrong with 50 master segments under two slave segments", TRANSMISSION, _wrong_in(_fifty_masters)),
    Mutant("wrong at tilts of 23° to 29°", FORCES, _wrong_in(_one_tilt)),
    Mutant("wrong beyond 45°", FORCES, _wrong_in(_steep)),
    Mutant("wrong at a re-entrant vertex", FORCES, _wrong_in(_re_entrant)),
    Mutant("wrong on a closed master", FORCES, _wrong_in(_seam)),
    Mutant("wrong with matching nodes", TRANSMISSION, _wrong_in(_matching_nodes)),
    Mutant("wrong deeper than half a segment", FORCES, _wrong_in(_deep)),
    Mutant("wrong past the end of the master", FORCES, _wrong_in(_overhang)),
    Mutant("wrong with seven nodes, or fourteen", TRANSMISSION, _wrong_in(_by_number)),
    Mutant("wrong by the clock", PURITY, _wrong_in(_by_clock)),
)
