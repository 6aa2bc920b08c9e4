"""Make mutants: right formulations in which one line, some verbs, a report or a promise is changed.

A mutant names the property that is meant to catch it, and registers itself in `PLANE`, `SPACE` or `SURVIVORS`. Verbs of
formulations have no annotations in this package: their arguments are those of the contract.
"""

import importlib
import inspect
import itertools
import re
import sys
import types
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from subjects import Changed, change_verbs, with_promises

import contactverif_nts
from contactverif import Pairing

Make = Callable[..., Any]
BALANCED = contactverif_nts.vts_ppt_balanced
PACKAGE = "contactverif_nts"
# The modules of the copy, in the order in which they import each other.
MODULES = ("nts_force", "vts_ppt_force", "vts_ppt_tangent", "point_contact", "patch_test_passing")

_numbers = itertools.count()


@dataclass(frozen=True)
class Mutant:
    """A wrong formulation, and the property that is meant to catch it."""

    name: str
    caught_by: str
    make: Make


PLANE: list[Mutant] = []
SPACE: list[Mutant] = []
SURVIVORS: list[Mutant] = []  # No property catches these yet. Each names the property that is missing.


def add(name: str, caught_by: str, make: Make, into: list[Mutant] = PLANE) -> None:
    """Register the mutant of a factory."""
    into.append(Mutant(name, caught_by, make))


def wrap(penalty: float, base: Make = BALANCED, **changes: Make) -> Changed:
    """Return a formulation with verbs that are changed as by `change_verbs`."""
    return change_verbs(base(penalty=penalty), **changes)


def answers(verbs: str, change: Make, base: Make = BALANCED, memory: Make | None = None) -> Make:
    """Return the factory of a formulation whose verbs are answered by `change(right, *arguments)`.

    `right` is the verb of the right formulation, which is `right.__self__`. With a memory, each instance has its own
    `memory()`, which is the first argument.
    """

    def make(*, penalty: float) -> Changed:
        act = change if memory is None else partial(change, memory())
        return wrap(penalty, base, **dict.fromkeys(verbs.split(), act))

    return make


def mutant(
    name: str,
    caught_by: str,
    verbs: str,
    base: Make = BALANCED,
    *,
    memory: Make | None = None,
    into: list[Mutant] = PLANE,
) -> Callable[[Make], Make]:
    """Decorate the `change` of `answers`, and register its mutant."""

    def decorate(change: Make) -> Make:
        add(name, caught_by, answers(verbs, change, base, memory), into)
        return change

    return decorate


def says(base: Make, **promises: Any) -> Make:
    """Return the factory of a right formulation that promises more than it keeps."""
    return with_promises(base, **promises)._make


def reports(base: Make, change: Make) -> Make:
    """Return the factory of a formulation that computes the right thing and reports other arrays.

    They are those of `change(points, interface, x)`; positions x (n_nodes, dim).
    """

    def contact_points(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        x = z[: interface.n_unknowns].reshape(interface.nodes.shape)
        points = right(interface, pairing, z)
        return replace(points, **change(points, interface, x))

    return answers("contact_points", contact_points, base)


def decides(base: Make, change: Make, **changes: Make) -> Make:
    """Return the factory of a formulation whose active points are those of `change(pairing, interface)`."""

    def pair(right: Any, interface: Any, z: Any) -> Any:
        pairing = right(interface, z)
        return Pairing({**pairing, "active": change(pairing, interface)})

    return lambda *, penalty: wrap(penalty, base, pair=pair, **changes)


def whole_segments(pairing: Any, interface: Any) -> Any:
    """Return that all points of a slave segment are active as soon as one of them is."""
    closed = np.zeros(len(interface.slave), dtype=bool)
    closed[pairing["segment"][pairing["active"]]] = True
    return closed[pairing["segment"]] & (pairing["master"] >= 0)


@cache
def _sources() -> dict[str, str]:
    return {name: inspect.getsource(importlib.import_module(f"{PACKAGE}.{name}")) for name in MODULES}


def _load_copy(sources: dict[str, str], in_one_call: bool) -> dict[str, Any]:
    """Load modules of changed sources, uncompiled, under names of their own; return all that they define."""
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


def changed_line(module: str, old: str, new: str, factory: str, nth: int, in_one_call: bool, **options: Any) -> Make:
    """Return the factory of a copy of the included formulation in which the nth `old` of a module reads `new`.

    The copy computes residual and tangent in two calls unless `in_one_call`. It is loaded at its first use. The line
    must stand in the source: a mutant that changes nothing proves nothing.
    """
    parts = _sources()[module].split(old)
    if len(parts) < nth + 2:
        raise AssertionError(f"{module} has no line {old!r} number {nth} any more: bring the mutant up to date")
    changed = old.join(parts[: nth + 1]) + new + old.join(parts[nth + 1 :])
    load = cache(lambda: _load_copy(_sources() | {module: changed}, in_one_call))
    return lambda *, penalty: load()[factory](penalty=penalty, **options)


def line(
    name: str,
    caught_by: str,
    module: str,
    old: str,
    new: str,
    *,
    factory: str = "vts_ppt_balanced",
    nth: int = 0,
    in_one_call: bool = False,
    into: list[Mutant] = PLANE,
    **options: Any,
) -> None:
    """Register the mutant of a changed line."""
    add(name, caught_by, changed_line(module, old, new, factory, nth, in_one_call, **options), into)
