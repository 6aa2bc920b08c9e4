"""The mark on a decorated test, and the arguments of the decorator that it carries to pytest.

The decorator sets the mark and the pytest plugin reads it; neither imports the other. Rule: nothing that takes long is
imported here, because every run of pytest loads this file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

MARK = "contactverif_properties"


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """The arguments of `parametrize_with_properties`, until pytest collects the test."""

    formulations: tuple[str | Callable[..., Any], ...]  # Names as on the command line, or factories.
    properties: tuple[str, ...]  # Patterns of property ids.
    examples: int | None  # The size of the run; None where the test file leaves it open.
    seed: int | None
    profile: str | None
    known: Mapping[str, str]  # {property id: why its failure is known}.
