"""Forces that a formulation states of itself: fractions as text, on the nodes of a named flat case.

The numbers stay rational, so that a table of a publication is copied as it is printed, `5/3` and not `1.667`.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache

from contactverif.contract.errors import ContractError

Fractions = tuple[Fraction, ...]


def parse_forces(text: str) -> tuple[Fractions, Fractions]:
    """Return the forces on the slave nodes and on the master nodes, from left to right, over penalty × penetration.

    Examples
    --------
    >>> slave, master = parse_forces("1 2 1; 2 2")
    >>> sum(slave) == sum(master)
    True
    """
    try:
        slave, master = (tuple(map(Fraction, row.split())) for row in text.split(";"))
    except (AttributeError, ValueError, ZeroDivisionError):
        slave = master = ()
    if not slave or not master:
        needed = 'fractions on the slave nodes; fractions on the master nodes, such as "1 2 1; 2 2"'
        raise ContractError(f"Traits.evidence.published_forces: found {text!r}; needed {needed}")
    return slave, master


def format_forces(slave: Fractions, master: Fractions) -> str:
    """Return the text from which `parse_forces` reads these forces."""
    return "; ".join(" ".join(map(str, row)) for row in (slave, master))


_parse_once = lru_cache(maxsize=64)(parse_forces)  # Traits are made anew for each penalty.


def check_published_forces(forces: object) -> None:
    """Raise a `ContractError` unless this maps names of cases to forces."""
    if not isinstance(forces, Mapping):
        raise ContractError(
            f"Traits.evidence.published_forces: found a {type(forces).__name__}; needed {{name of a flat case: forces}}"
        )
    for text in forces.values():
        (_parse_once if isinstance(text, str) else parse_forces)(text)
