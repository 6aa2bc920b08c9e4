"""Compute residuals in long double, in a process of its own in which nothing is compiled: `compute_uncompiled.py FILE`.

The file is a numpy archive. For each formulation and state of `far_states` it holds the residual, and for each of
`bent_states` the difference quotient of the residual in one direction, with a step of 2⁻⁴⁰.
"""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
from every_formulation import FORMULATIONS, draw_multipliers
from surfaces import make_bent, make_far

from contactverif import Interface, load_formulation

PENALTY = 3.75
STEP = 2.0**-40
RATIOS = (2.0, 100.0)


def far_states(formulation: Any) -> Iterator[tuple[str, Interface, Any]]:
    """Yield the name of a state far from the origin, its interface and z."""
    for ratio in RATIOS:
        for seed in range(6):
            interface, x = make_far(seed, ratio)
            multipliers = draw_multipliers(formulation, interface, seed)
            yield f"{ratio:g} {seed}", interface, np.append(x, multipliers)


def bent_states(formulation: Any) -> Iterator[tuple[str, Interface, Any, Any]]:
    """Yield the name of a state on bent surfaces, its interface, z, and a direction."""
    for seed in range(4):
        interface, z = make_bent(seed)
        z = np.append(z, draw_multipliers(formulation, interface, seed))
        yield f"bent {seed}", interface, z, np.random.default_rng(seed).normal(size=z.size)


def main(file: str) -> None:
    """Write the archive."""
    answers: dict[str, Any] = {}
    for name in FORMULATIONS:
        subject = load_formulation(name)
        assert subject.traits.abilities.takes_longdouble
        formulation = subject.with_penalty(PENALTY)
        for state, interface, z in far_states(formulation):
            pairing = formulation.pair(interface, z)
            answers[f"{name} {state}"] = formulation.residual(interface, pairing, z.astype(np.longdouble))
        for state, interface, z, direction in bent_states(formulation):
            pairing, long_z = formulation.pair(interface, z), z.astype(np.longdouble)
            first, second = (formulation.residual(interface, pairing, long_z + h * direction) for h in (0.0, STEP))
            answers[f"{name} {state}"] = (second - first) / STEP
    np.savez(file, **answers)


if __name__ == "__main__":
    main(sys.argv[1])
