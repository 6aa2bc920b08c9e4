"""Make formulations that are wrong on purpose: change one line of the shipped plugin's source, and run it uncompiled.

The line must stand in the source; otherwise the mutant raises, because a mutant that changes nothing proves nothing.
"""

import importlib
import inspect
import itertools
import re
import sys
import types
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from subjects import Changed, change_verbs, with_promises

import contactverif_nts
from contactverif import Pairing

PACKAGE = "contactverif_nts"
# The modules of the copy, in the order in which they import each other.
MODULES = ("nts_force", "walk", "vts_ppt_force", "vts_ppt_tangent", "point_contact", "patch_test_passing")

_numbers = itertools.count()


@dataclass(frozen=True)
class Mutant:
    """A wrong formulation, and the property that is meant to catch it."""

    name: str
    caught_by: str
    make: Callable[..., Any]


@cache
def _sources() -> dict[str, str]:
    return {name: inspect.getsource(importlib.import_module(f"{PACKAGE}.{name}")) for name in MODULES}


def _load_copy(sources: dict[str, str], in_one_call: bool) -> dict[str, Any]:
    """Load modules of changed sources under names of their own; return all that they define."""
    copy = f"{PACKAGE}_mutant_{next(_numbers)}"
    package = types.ModuleType(copy)
    package.__path__ = []
    sys.modules[copy] = package
    names: dict[str, Any] = {}
    for name, source in sources.items():
        source = re.sub(r"\n@compile_\w+\n", "\n", source.replace(PACKAGE, copy))
        part = types.ModuleType(f"{copy}.{name}")
        sys.modules[f"{copy}.{name}"] = part
        setattr(package, name, part)
        exec(compile(source, f"<{copy}.{name}>", "exec"), vars(part))
        names |= vars(part)
    # A mutant has one wrong line, in one of two kernels. Newton's method shall see it, whichever it is.
    if not in_one_call:
        del names["PatchTestPassing"].residual_and_tangent
    return names


def changed_line(
    module: str, old: str, new: str, *, factory: str, nth: int = 0, in_one_call: bool = False, **options: Any
) -> Callable[..., Any]:
    """Return the factory of a copy of the plugin in which the nth occurrence of `old` in a module reads `new`.

    The copy computes residual and tangent in two calls unless `in_one_call`. It is loaded at its first use.
    """
    parts = _sources()[module].split(old)
    if len(parts) < nth + 2:
        raise AssertionError(f"{module} has no line {old!r} number {nth} any more: bring the mutant up to date")
    changed = old.join(parts[: nth + 1]) + new + old.join(parts[nth + 1 :])
    load = cache(lambda: _load_copy(_sources() | {module: changed}, in_one_call))
    return lambda *, penalty: load()[factory](penalty=penalty, **options)


def wrap(
    penalty: float, make: Callable[..., Any] = contactverif_nts.vts_ppt_balanced, **changes: Callable[..., Any]
) -> Changed:
    """Return a formulation (by default the balanced VTS-PPT) with verbs that are changed as by `change_verbs`."""
    return change_verbs(make(penalty=penalty), **changes)


def decides(make: Callable[..., Any], change: Callable[..., Any], **changes: Callable[..., Any]) -> Callable[..., Any]:
    """Return the factory of a formulation whose active points are those of `change(pairing, interface)`."""

    def pair(right: Any, interface: Any, z: Any) -> Any:
        pairing = right(interface, z)
        return Pairing({**pairing, "active": change(pairing, interface)})

    return lambda *, penalty: wrap(penalty, make, pair=pair, **changes)


def whole_segments(pairing: Any, interface: Any) -> Any:
    """Return that all points of a slave segment are active as soon as one of them is."""
    closed = np.zeros(len(interface.slave), dtype=bool)
    closed[pairing["segment"][pairing["active"]]] = True
    return closed[pairing["segment"]] & (pairing["master"] >= 0)


def says(make: Callable[..., Any], **promises: Any) -> Callable[..., Any]:
    """Return the factory of a right formulation that promises more than it keeps."""
    return with_promises(make, **promises)._make


def reports(make: Callable[..., Any], change: Callable[..., dict[str, Any]]) -> Callable[..., Any]:
    """Return the factory of a formulation that computes the right thing and reports other arrays.

    They are those of `change(points, interface, x)`; positions x (n_nodes, dim).
    """

    def contact_points(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        points = right(interface, pairing, z)
        return replace(points, **change(points, interface, z[: interface.n_unknowns].reshape(interface.nodes.shape)))

    return lambda *, penalty: wrap(penalty, make, contact_points=contact_points)


def replaces(verb: str, make: Callable[..., Any] = contactverif_nts.vts_ppt_balanced) -> Callable[..., Any]:
    """Decorate `change(right, *arguments)`, which answers one verb; return the factory of the wrong formulation."""
    return lambda change: lambda *, penalty: wrap(penalty, make, **{verb: change})
