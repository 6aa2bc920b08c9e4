"""Example 2: the disk on its foundation, its pressures beside Hertz, and what explains the rest of the difference.

Source: Zavarise & De Lorenzis (2009), Section 7.2, Figs. 38 and 39. What is given and what is chosen is said in
`contactverif.scenes.disk`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contactverif.scenes import hertz
from contactverif.scenes.disk import DiskProblem, disk_on_foundation
from contactverif_paper import cast, disk_study
from contactverif_paper.disk_study import Pressed
from contactverif_paper.paper_data import Disk, DiskCurve, DiskStudy, Member, Said, Series, Statement
from contactverif_reports.html.pages import number

REFINED = (1, 2, 3)
TOUCHING = 1e-2  # of the depth that the first guess has otherwise
AXIS = (-1.0e3, 1.5e3)  # of Fig. 39, as printed
SLOPES, SIZES = (1.0, 0.5, 0.25), (0.5, 1.0, 2.0)
_PLACES = 401  # of the exact pressure
_MESHES = (cast.VTS_ME, cast.VTS_PPT, cast.REFERENCE_AREAS)
_EXPLAINED = (cast.VTS_ME, cast.REFERENCE_AREAS)


def disk_steps(*, with_study: bool = True) -> int:
    """How often `disk` tells where it is."""
    return len(cast.DISK) + (len(REFINED) + 2) * with_study


def disk(told: Callable[[str], None], *, with_study: bool = True) -> Disk:
    """All formulations on the base meshes; with the study also finer ones, flatter contacts and other sizes."""
    problem = DiskProblem()
    found = {}
    for member in cast.DISK:
        told(f"Example 2, {member.formulation}")
        found[member] = disk_study.pressed(member.formulation)
    layer = problem.winkler_contact()
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
    touching = disk_study.pressed(member.formulation, lowered=TOUCHING)
    iterations = [end.iterations if end.converged else -1 for end in (one, touching)]
    return DiskCurve(member, one.x, one.pressure, one.peak, one.half_width, *iterations)


def _study(told: Callable[[str], None]) -> DiskStudy:
    members, explained = _MESHES, _EXPLAINED
    names = [member.formulation for member in members]
    solved = []
    for refine in REFINED:
        told(f"Example 2, cells divided by {refine}")
        solved += disk_study.over_meshes(names, [refine])
    meshes = _rows(solved, len(names))
    x, difference = disk_study.difference(meshes[members.index(cast.VTS_PPT)][1], meshes[members.index(cast.VTS_ME)][1])
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
        difference_x=x,
        difference=difference,
    )


def statements(disk: Disk) -> tuple[Statement, ...]:
    """What the paper says, beside it; of the study only where there is one."""
    largest, widths = [curve.largest for curve in disk.curves], [curve.half_width for curve in disk.curves]
    counts, touching = (
        sorted({getattr(curve, name) for curve in disk.curves}) for name in ("iterations", "from_touching")
    )
    said = ", ".join(map(str, touching))
    return (
        Statement(
            "Fig. 38",
            "Example 2: the axis of the close-up ends at 1.61e6, and curves are nearly the same for all",
            f"{number(min(largest), 4)} to {number(max(largest), 4)}; half-width {min(widths):.3f} to "
            f"{max(widths):.3f}. Hertz: {number(disk.hertz[0], 4)} and {disk.hertz[1]:.3f}; Hertz on a layer of springs"
            f" ε̂: {number(disk.winkler[0], 4)} and {disk.winkler[1]:.3f}",
            Said.of(all(abs(value / 1.61e6 - 1) <= 0.03 for value in largest)),
            "fig38",
        ),
        *(_of_study(disk) if disk.study is not None else ()),
        Statement(
            "Section 7.2",
            "Example 2: every algorithm needs the same number of iterations, 4; the first guess is not said",
            f"{', '.join(map(str, counts))} to roundoff, from a disk lowered about as far as it ends; {said} from one "
            "that just touches",
            Said.of(counts == [4]),
        ),
    )


def _of_study(disk: Disk) -> tuple[Statement, Statement]:
    """Differences on finer meshes, and what the rest of the difference to Hertz is made of."""
    assert disk.study is not None
    study = disk.study
    current, reference = study.slopes.values
    moved = float(np.ptp(study.largest, axis=1).max()) / disk.winkler[0]
    base, finer = ([float(values.min()), float(values.max())] for values in (disk.difference, study.difference))
    within = AXIS[0] <= finer[0] and finer[1] <= AXIS[1]
    says = "Example 2: the pressure is not held against an exact one"
    return (
        Statement(
            "Fig. 39",
            "Example 2: VTS-PPT and VTS-ME differ by little: the axis runs from −1e3 to 1.5e3; the mesh is not printed",
            f"{_range(base)} on our base meshes; {_range(finer)} on meshes twice as fine, "
            f"{'inside' if within else 'not inside'} that axis",
            Said.of(within),
            "fig39",
        ),
        Statement(
            "Section 7.2",
            says,
            f"Hertz on springs ε̂ is exceeded by {current[0]:.2%}. That is a pressure per current length on a surface "
            f"that contact compresses: it falls with a/R, to {current[-1]:.2%} at {study.slopes.at[-1]:g} of it, and "
            f"with reference areas {reference[0]:.2%} are left, of which the mesh is the cause. Finer meshes change "
            f"{moved:.2%}, a foundation of half or twice the size {float(np.ptp(study.sizes.values)):.2%}",
            Said.SILENT,
            "fig39-why",
        ),
    )


def _range(ends: Sequence[float]) -> str:
    return " to ".join(number(end, 2) for end in ends)


def _rows(found: Sequence[Pressed], n_members: int) -> list[list[Pressed]]:
    """A row a formulation, from a list in which formulations change fastest."""
    return [list(found[row::n_members]) for row in range(n_members)]


def _size(refine: int) -> float:
    """The shortest segment of the slave, a length: that in the middle."""
    interface = disk_on_foundation(DiskProblem(), refine=refine).interface
    return float(interface.slave.lengths(interface.nodes).min())
