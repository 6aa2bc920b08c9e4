"""Every name that a report is made of, in one place: groups, dimensions, codes, units.

The prose is in `reports/README.md`. What changes the meaning of a file that exists already changes `SCHEMA`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from enum import IntEnum

from contactverif.contract.property import Verdict

SCHEMA = "1"
CONVENTIONS = "CF-1.11 UGRID-1.0"
TITLE = "contactverif: what a verification of contact formulations found"
UNITS_NOTE = (
    "Lengths are written in m and forces, per unit of thickness, in N; read them as any one consistent system of units."
)

SUMMARY, COUNTEREXAMPLES, TIMING, CASE = "summary", "counterexamples", "timing", "case"
RESERVED = frozenset({SUMMARY, COUNTEREXAMPLES, TIMING})
OFF_THE_RECORD = frozenset({"created", "command", "platform"})  # root attributes that two equal runs may differ in
PARTS = ("pair", "tangent", "contact_points")

LENGTH, PENALTY, RATIO, SECONDS, UNKNOWN = "m", "N m-2", "1", "s", "unknown"
FORCE, STRESS = "N", "N m-1"  # forces are per unit of thickness
PARAMETER_UNITS: Mapping[str, str] = {
    "penetration": LENGTH,
    "along": LENGTH,
    "direction": RATIO,
    "cosine": RATIO,
    "variant": RATIO,
    "approach": LENGTH,
    "pressure": STRESS,
    "compliance": "m2 N-1",
    "bodies_nodes": LENGTH,
    "bodies_cells": RATIO,
    "bodies_contact": RATIO,
    "bodies_fixed": RATIO,
    "bodies_imposed": LENGTH,
    "bodies_load": FORCE,
    "bodies_count": RATIO,
    "bodies_is_slave": RATIO,
    "bodies_young": STRESS,
    "bodies_poisson": RATIO,
    "bodies_axis": RATIO,
    "bodies_start": LENGTH,
}

VERDICTS: Mapping[str, int] = {str(verdict).replace(" ", "_"): int(verdict) for verdict in Verdict}
NONE = "none"  # an attribute with nothing to say: an empty one is not kept by every reader
NOT_PLANNED = -1  # verdict beyond the last case of a formulation that had fewer


class Promise(IntEnum):
    """What the traits say about a property."""

    NO_PROMISE = 0
    PROMISED = 1
    SAID_TO_FAIL = 2

    @classmethod
    def of(cls, promise: bool | None) -> Promise:
        """The code of `Row.promise`."""
        return cls.NO_PROMISE if promise is None else cls.PROMISED if promise else cls.SAID_TO_FAIL


PROMISES: Mapping[str, int] = {promise.name.lower(): int(promise) for promise in Promise}
PROVIDED: Mapping[str, int] = {"not_provided": 0, "provided": 1}
SIDES: Mapping[str, int] = {"slave": 0, "master": 1}


def typeable(name: str) -> str:
    """The name with only letters, digits, `.`, `_` and `-`, so that a shell and netCDF take it as it is."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name).lstrip("-.") or "_"


def group_of(property_id: str, family: str) -> str:
    """`/patch/flat_transmission` for the property `patch.flat.transmission` of the family `patch`."""
    folder = typeable(family).replace(".", "_")
    folder += "_" if folder in RESERVED else ""
    return f"/{folder}/{typeable(property_id.removeprefix(f'{family}.')).replace('.', '_')}"


def case_id(formulation: str, property_id: str, *, witness: bool = False) -> str:
    """`vts-me_n_4.patch.flat.transmission`, with `.witness` behind it where only the witness was found."""
    return typeable(f"{formulation}.{property_id}") + (".witness" if witness else "")


def distinct(names: Iterable[str]) -> list[str]:
    """The names in their order; one that was there before gets `-2`, `-3`, … behind it."""
    taken: set[str] = set()
    result = []
    for name in names:
        number, free = 1, name
        while free in taken:
            number += 1
            free = f"{name}-{number}"
        taken.add(free)
        result.append(free)
    return result


def text(words: str) -> str:
    """The words as UTF-8 can hold them, without NUL, which would cut a netCDF string short."""
    return words.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")
