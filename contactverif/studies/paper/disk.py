"""Example 2: the disk on its foundation, its pressures beside Hertz, and what explains the rest of the difference.

Source: Zavarise & De Lorenzis (2009), Section 7.2, Figs. 38 and 39. What is given and what is chosen is said in
`contactverif.disk`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contactverif import hertz
from contactverif.disk import Problem, disk_on_foundation
from contactverif.studies import disk_study
from contactverif.studies.disk_study import Pressed
from contactverif.studies.paper import cast
from contactverif_reports.paper_data import Disk, DiskCurve, DiskStudy, Member, Series

REFINED = (1, 2)
SLOPES, SIZES = (1.0, 0.5, 0.25), (0.5, 1.0, 2.0)
_PLACES = 401  # of the exact pressure
_MESHES = (cast.VTS_ME, cast.VTS_PPT, cast.REFERENCE_AREAS)
_EXPLAINED = (cast.VTS_ME, cast.REFERENCE_AREAS)


def disk_steps(*, with_study: bool = True) -> int:
    """How often `disk` tells where it is."""
    return len(cast.installed(cast.DISK)) + 3 * with_study


def disk(told: Callable[[str], None], *, with_study: bool = True) -> Disk:
    """All formulations on the base meshes; with the study also finer ones, flatter contacts and other sizes."""
    problem = Problem()
    found = {}
    for member in cast.installed(cast.DISK):
        told(f"Example 2, {member.formulation}")
        found[member] = disk_study.pressed(member.formulation)
    layer = problem.on_layer()
    places = np.linspace(0.0, layer.half_width, _PLACES)
    x, difference = disk_study.difference(found[cast.VTS_PPT], found[cast.VTS_ME])
    return Disk(
        scene="example-2",
        curves=tuple(_curve(member, one) for member, one in found.items()),
        difference_x=x,
        difference=difference,
        hertz=(hertz.peak(problem.force, problem.radius, problem.stiffness), problem.half_width),
        winkler=(layer.peak, layer.half_width),
        winkler_x=places,
        winkler_pressure=layer.pressure(places),
        study=_study(told) if with_study else None,
    )


def _curve(member: Member, one: Pressed) -> DiskCurve:
    iterations = one.iterations if one.converged else -1
    return DiskCurve(member, one.x, one.pressure, one.peak, one.half_width, iterations)


def _study(told: Callable[[str], None]) -> DiskStudy:
    members, explained = cast.installed(_MESHES), cast.installed(_EXPLAINED)
    told("Example 2, finer meshes")
    names = [member.formulation for member in members]
    meshes = _rows(disk_study.over_meshes(names, REFINED), len(names))
    told("Example 2, flatter contacts")
    flatter = _rows(disk_study.over_slopes([member.formulation for member in explained], SLOPES, 1), len(explained))
    told("Example 2, other sizes")
    sizes = disk_study.over_sizes(cast.VTS_ME.formulation, SIZES)
    return DiskStudy(
        members=members,
        size=np.array([_size(refine) for refine in REFINED]),
        largest=np.array([[one.peak for one in row] for row in meshes]),
        half_width=np.array([[one.half_width for one in row] for row in meshes]),
        iterations=np.array([[one.iterations for one in row] for row in meshes]),
        slopes=Series(explained, np.array(SLOPES), np.array([[one.over_layer for one in row] for row in flatter])),
        sizes=Series((cast.VTS_ME,), np.array(SIZES), np.array([[one.over_layer for one in sizes]])),
    )


def _rows(found: Sequence[Pressed], n_members: int) -> list[list[Pressed]]:
    """A row a formulation, from a list in which formulations change fastest."""
    return [list(found[row::n_members]) for row in range(n_members)]


def _size(refine: int) -> float:
    """The shortest segment of the slave, a length: that in the middle."""
    interface = disk_on_foundation(Problem(), refine=refine).interface
    return float(interface.slave.lengths(interface.nodes).min())
