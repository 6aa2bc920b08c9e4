"""The built-in formulations with their options, for tests that ask all of them the same question."""

from functools import cache
from typing import Any

import numpy as np
from surfaces import make_bent

from contactverif import Interface, load_formulation

FORMULATIONS = (
    *("nts", "nts-ar", "nts-ar:area=reference", "vts-g:n=3", "vts-g:area=reference"),
    *("vts-me", "vts-me:n=3,area=reference"),
    *("vts-ppt", "vts-ppt:n=3", "vts-ppt:free_end=cover", "vts-ppt:free_end=extend", "vts-ppt-basic"),
    *("vts-ppt-balanced", "vts-ppt-balanced:n=3,area=reference", "vts-ppt-balanced:free_end=truncate"),
    *("nts-lm", "vts-me-lm", "vts-ppt-lm", "vts-ppt-lm:transmission=balanced"),
    *("two-pass/nts", "two-pass/nts-ar:area=reference", "two-pass/nts-lm", "two-pass/mortar"),
    *("sts", "sts:area=reference", "chen-hisada", "chen-hisada:area=reference"),
    *("mortar", "mortar:area=reference", "mortar:normals=averaged"),
    *("mortar-dual", "mortar-dual:normals=averaged,area=reference"),
    *("mortar-dual:gap_shapes=standard", "mortar-dual:gap_shapes=standard,normals=averaged"),
    *("mortar-lm", "mortar-dual-lm:normals=averaged"),
    *("mortar-two-half-pass", "mortar-two-half-pass:area=reference,n=3"),
)


@cache
def load(name: str, penalty: float = 8.0) -> Any:
    """Return the formulation of that name, options included."""
    return load_formulation(name).with_penalty(penalty).plugin


def draw_multipliers(formulation: Any, interface: Interface, seed: int, low: float = -0.1, high: float = 1.0) -> Any:
    """Return random multipliers, most of which press; none of a formulation that has none."""
    n = formulation.n_multipliers(interface) if hasattr(formulation, "n_multipliers") else 0
    return np.random.default_rng(seed).uniform(low, high, n)


def bent_state(formulation: Any, seed: int, low: float = -1.0, high: float = 1.0) -> tuple[Interface, Any]:
    """Return bent surfaces, and z with random multipliers where the formulation has any."""
    interface, z = make_bent(seed)
    return interface, np.append(z, draw_multipliers(formulation, interface, seed, low, high))
