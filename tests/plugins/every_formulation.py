"""The built-in formulations with their options, for tests that ask all of them the same question."""

from typing import Any

import numpy as np

from contactverif import Interface

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
    *("mortar-lm", "mortar-dual-lm:normals=averaged"),
    *("mortar-two-half-pass", "mortar-two-half-pass:area=reference,n=3"),
)


def draw_multipliers(formulation: Any, interface: Interface, seed: int) -> Any:
    """Return random multipliers, most of which press."""
    n_multipliers = formulation.n_multipliers(interface)
    return np.random.default_rng(seed).uniform(-0.1, 1, n_multipliers)
