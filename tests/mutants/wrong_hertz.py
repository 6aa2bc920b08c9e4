"""Mutants that are right wherever all of the slave is in contact: what is wrong is wrong where a contact has an edge.

Flat patch tests, full contact and open gaps do not see them. Their tangents are exact, forces balance, and nothing is
reported: what is wrong shows in the forces alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mutate import Mutant

import contactverif_nts

HERTZ = "accuracy.hertz"


@dataclass
class SharedForces:
    """The balanced VTS-PPT with all forces multiplied by a share, which should be 1. It promises to converge."""

    penalty: float
    share: Callable[[Any], float]  # From which points (n_points,) are active.

    def __post_init__(self) -> None:
        self._inner = contactverif_nts.vts_ppt_balanced(penalty=self.penalty)
        self.traits = self._inner.traits.revise(converges=True)

    def pair(self, interface: Any, z: Any) -> Any:
        return self._inner.pair(interface, z)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.share(pairing["active"]) * self._inner.residual(interface, pairing, z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.share(pairing["active"]) * self._inner.tangent(interface, pairing, z)


def _multiply_forces(share: Callable[[Any], float]) -> Callable[..., Any]:
    return lambda *, penalty: SharedForces(penalty, share)


def _less_beside_an_edge(active: Any) -> float:
    """Return 0.95 if the contact has an edge on the slave, else 1."""
    return 1.0 if active.all() or not active.any() else 0.95


MUTANTS = (Mutant("springs softer by 5 % once the contact has an edge", HERTZ, _multiply_forces(_less_beside_an_edge)),)
