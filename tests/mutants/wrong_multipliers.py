"""Mutants with multipliers: rows of another size, decisions beside their threshold, and rows that are 0 = 0.

All have the right solution wherever all of the slave sees the master.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from mutate import Mutant, wrap

import contactverif_mortar
import contactverif_nts
from contactverif import Pairing
from contactverif.contract.arrays import dense

UNILATERAL, RANK = "unilateral", "multipliers.rank"
SMALL_TENSION = 1e-3  # The share of the largest multiplier that a tension must reach before it is released.


def _change_rows(make: Callable[..., Any], factors: Callable[[float, Any], Any]) -> Callable[..., Any]:
    """Multiply the constraint rows by factors of the penalty and the pairing, in the residual and in the tangent."""

    def mutant(*, penalty: float) -> Any:
        def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
            answer, n = np.array(right(interface, pairing, z)), interface.n_unknowns
            answer[..., n:] *= factors(penalty, pairing)
            return answer

        def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
            matrix, n = np.array(dense(right(interface, pairing, z))), interface.n_unknowns
            matrix[n:] *= np.broadcast_to(factors(penalty, pairing), len(z) - n)[:, None]
            return matrix

        return wrap(penalty, make, residual=residual, tangent=tangent)

    return mutant


def _releases_late(*, penalty: float) -> Any:
    """Release a node only where its tension λ − c g < 0 is larger than a share of the largest multiplier."""

    def pair(right: Any, interface: Any, z: Any) -> Any:
        later, n = np.array(z), interface.n_unknowns
        later[n:] += SMALL_TENSION * np.abs(z[n:]).max()
        return right(interface, later)

    return wrap(penalty, contactverif_nts.nts_lm, pair=pair)


def _decides_by_gap(*, penalty: float) -> Any:
    """Decide by the gap alone where there is a penetration, whatever the multiplier is."""

    def pair(right: Any, interface: Any, z: Any) -> Any:
        unloaded, n = np.array(z), interface.n_unknowns
        unloaded[n:] = 0.0
        either = right(interface, z)["active"] | right(interface, unloaded)["active"]
        return Pairing({**right(interface, z), "active": either})

    return wrap(penalty, contactverif_mortar.mortar_lm, pair=pair)


def _leaves_rows_empty(make: Callable[..., Any]) -> Callable[..., Any]:
    """Leave the row of a slave node that sees nothing empty: 0 = 0."""

    def pair(right: Any, interface: Any, z: Any) -> Any:
        pressed, n = np.array(z), interface.n_unknowns
        pressed[n:] = 1e300
        return Pairing({**right(interface, z), "sees": right(interface, pressed)["active"]})

    def mutant(*, penalty: float) -> Any:
        changed = _change_rows(make, lambda _, pairing: np.where(pairing["sees"], 1.0, 0.0))(penalty=penalty)
        inner = make(penalty=penalty)
        changed.pair = lambda interface, z: pair(inner.pair, interface, z)
        return changed

    return mutant


MUTANTS = (
    Mutant("constraint rows times the penalty", UNILATERAL,
           _change_rows(contactverif_nts.nts_lm, lambda penalty, _: penalty)),
    Mutant("constraint rows of pressures times the penalty", UNILATERAL,
           _change_rows(contactverif_mortar.mortar_lm, lambda penalty, _: penalty)),
    Mutant("constraint rows twice as large", UNILATERAL,
           _change_rows(contactverif_mortar.mortar_dual_lm, lambda *_: 2.0)),
    Mutant("rows of inactive constraints times the penalty", UNILATERAL,
           _change_rows(contactverif_nts.vts_me_lm,
                        lambda penalty, pairing: np.where(pairing["active"], 1.0, penalty))),
    Mutant("small tension is not released", UNILATERAL, _releases_late),
    Mutant("tension is not released where surfaces penetrate", UNILATERAL, _decides_by_gap),
    Mutant("row of a node that sees nothing is 0 = 0", RANK, _leaves_rows_empty(contactverif_nts.nts_lm)),
    Mutant("row of a mortar node that sees nothing is 0 = 0", RANK, _leaves_rows_empty(contactverif_mortar.mortar_lm)),
)  # fmt: skip
