"""What the paper says, in our words, each beside what was computed and how the two agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from contactverif_reports.pages import number
from contactverif_reports.paper_data import (
    Convergence,
    Defects,
    Disk,
    DiskStudy,
    ForceTable,
    MultiplierRow,
    PassTable,
    Patch,
    Said,
    Series,
    Statement,
)

_FORCES = {  # by case
    "a1": "the right forces are p, 2p, p on the slave and 2p, 2p on the master",
    "b": "NTS, given the right forces on the slave, hands wrong ones to the master; VTS-ME hands over the right ones",
    "c": "NTS and VTS-ME hand wrong forces to the master; VTS-PPT hands over the right ones",
}


def statements(
    forces: Sequence[ForceTable],
    patches: Sequence[Patch],
    passes: PassTable,
    convergence: Convergence,
    defects: Defects,
    multipliers: Sequence[MultiplierRow],
    disk: Disk | None,
) -> tuple[Statement, ...]:
    """In the order of the paper; the defects, of which it does not speak, at the end."""
    return (
        *map(_of_forces, forces),
        *map(_of_range, patches),
        *_of_passes(passes),
        *_of_convergence(convergence),
        *_of_multipliers(multipliers, _titles(patches)),
        *(_of_disk(disk) if disk is not None else ()),
        *_of_defects(defects),
    )


def _verdict(agrees: bool) -> Said:
    return Said.AGREES if agrees else Said.DIFFERS


def _titles(patches: Sequence[Patch]) -> dict[str, str]:
    """{scene: what the paper calls it}, within a sentence."""
    return {"c-prime": "case C′"} | {patch.scene: patch.title.replace("Case", "case") for patch in patches}


def _of_forces(table: ForceTable) -> Statement:
    printed = [row for row in (table.exact, *table.rows) if row.printed]
    wrong = [row.member.legend for row in printed if row.printed != row.master]
    found = f"all {sum(len(row.printed) for row in printed)} printed fractions on the master come out exactly"
    if wrong:
        found = f"other fractions: {', '.join(wrong)}"
    return Statement(table.figure, f"{table.title}: {_FORCES[table.case]}", found, _verdict(not wrong))


def _of_range(patch: Patch) -> Statement:
    low, high = patch.printed
    ours = [float(value) for curve in patch.curves for value in curve.pressure]
    inside = low <= min(ours) and max(ours) <= high
    says = (
        f"{patch.title}: the axis runs from {low:.2f} to {high:.2f} of the exact pressure; materials and penalty are "
        "not printed"
    )
    found = f"curves from {min(ours):.3f} to {max(ours):.3f} at ε̂ = E, {'inside' if inside else 'not inside'} that axis"
    drawing = f"fig{patch.pressures.partition('(')[0].zfill(2)}"
    return Statement(f"Fig. {patch.pressures}", says, found, Said.SILENT if inside else Said.DIFFERS, drawing)


def _of_passes(table: PassTable) -> list[Statement]:
    spoken = table.said >= 0
    words = np.array([[table.word(row, column) for column in range(len(table.scenes))] for row in range(len(spoken))])
    right = np.where(table.said == 1, words == "pass", words == "fail") & spoken
    wrong = [
        f"{table.members[row].legend} on {table.scenes[column]}"
        for row, column in np.argwhere(spoken & ~right).tolist()
    ]
    found = f"{int(right.sum())} of {int(spoken.sum())} verdicts are the same"
    between = int((words == "between").sum())
    found += f"; {between} of all {words.size} lie between roundoff and {table.fails:g}" if between else ""
    found += f"; others: {', '.join(wrong)}" if wrong else ""
    return [
        Statement(
            "Figs. 9–12, 17, 18, 21, 22, 32, 33, 35, 36",
            "NTS fails everywhere; NTS-AR passes where each slave segment faces one master segment; VTS-ME passes "
            "where each area of competence does; VTS-PPT passes everywhere; two passes do not help a penalty method",
            found,
            _verdict(not wrong),
        ),
        Statement(
            "Sections 4, 5, 7.1",
            "no numbers are given for errors, materials, supports, heights or penalties of the patch tests",
            "errors of the stress are at roundoff or above 0.01 at ε̂ = 10 E/h; nothing lies between"
            if not between
            else f"{between} errors lie between",
            Said.SILENT,
        ),
    ]


def _of_convergence(convergence: Convergence) -> list[Statement]:
    equal, unequal = ({one.member.formulation: one for one in row} for row in convergence.histories)
    counts = ", ".join(f"{one.member.legend} {one.n_iterations}" for one in unequal.values())
    others = ", ".join(f"{one.member.legend} {one.n_iterations}" for one in equal.values())
    basic = equal["vts-ppt-basic"]
    right = unequal["vts-ppt"].n_iterations <= 5 and 14 <= unequal["vts-ppt-basic"].n_iterations <= 17
    low, high = convergence.radius.min(), convergence.radius.max()
    return [
        Statement(
            "Fig. 30",
            "Case C: the basic version needs about 16 iterations for 14 decades, the consistent one and VTS-ME a few",
            f"{counts} (master half as stiff as the slave); {others} (equal materials)",
            _verdict(right),
            "fig30",
        ),
        Statement(
            "Section 6.1",
            "with the tangent of VTS-ME convergence is no longer quadratic; no rate is given",
            f"it is linear: residuals fall by {basic.rate:.3f} a step at ε̂ = E, which is the spectral radius of "
            f"I − K_basic⁻¹ K_consistent; {low:.2f} to {high:.2f} for ε̂/E from {convergence.stiffness.min():g} to "
            f"{convergence.stiffness.max():g}",
            Said.SILENT,
            "fig30",
        ),
    ]


def _of_multipliers(rows: Sequence[MultiplierRow], titles: Mapping[str, str]) -> list[Statement]:
    def named(row: MultiplierRow) -> str:
        return f"{row.member.legend.removesuffix(', multipliers')} on {titles.get(row.scene, row.scene)}"

    if not rows:
        return []
    spoken = [row for row in rows if row.said >= 0]
    wrong = [named(row) for row in spoken if row.stress != (row.said == 1)]
    found = f"{len(spoken) - len(wrong)} of {len(spoken)} verdicts on the stress are the same"
    found += f"; others: {', '.join(wrong)}" if wrong else ""
    result = [
        Statement(
            "Sections 2, 5.1.3, 6, 7.1",
            "with Lagrange multipliers one-pass NTS fails the patch test, two-pass NTS passes it, and VTS-PPT does",
            found,
            _verdict(not wrong),
        )
    ]
    hidden = [row for row in rows if row.stress and not row.uniform and "two-pass" not in row.member.formulation]
    if hidden:
        ranges = "; ".join(f"{named(row)}: {number(row.low)} to {number(row.high)}" for row in hidden)
        result.append(
            Statement(
                "–",
                "it is not said whether multipliers are uniform where the stress is",
                f"some are not, over the exact pressure: {ranges}",
                Said.SILENT,
            )
        )
    short = [row for row in rows if row.deficiency and "two-pass" not in row.member.formulation]
    if short:
        counts = "; ".join(f"{named(row)}: {row.deficiency}" for row in short)
        result.append(
            Statement(
                "Section 6.3",
                "no proof of stability (inf-sup) is given",
                f"multipliers that are not unique: {counts}",
                Said.SILENT,
            )
        )
    return result


def _of_disk(disk: Disk) -> list[Statement]:
    largest = [curve.largest for curve in disk.curves]
    counts = sorted({curve.iterations for curve in disk.curves})
    widths = [curve.half_width for curve in disk.curves]
    low, high = float(disk.difference.min()), float(disk.difference.max())
    same = "the same number" if len(counts) == 1 else "different numbers"
    return [
        Statement(
            "Fig. 38",
            "Example 2: the pressure in the middle is about 1.61e6, and curves are nearly the same for all",
            f"{number(min(largest), 4)} to {number(max(largest), 4)}, within 3 %; half-width {min(widths):.3f} to "
            f"{max(widths):.3f}. Hertz: {number(disk.hertz[0], 4)} and {disk.hertz[1]:.3f}; Hertz on a layer of "
            f"springs ε̂: {number(disk.winkler[0], 4)} and {disk.winkler[1]:.3f}",
            _verdict(all(abs(value / 1.61e6 - 1) <= 0.03 for value in largest)),
            "fig38",
        ),
        Statement(
            "Fig. 39",
            "Example 2: VTS-PPT and VTS-ME differ by little: the axis runs from −1e3 to 1.5e3; the mesh is not printed",
            f"{number(low, 2)} to {number(high, 2)} on our mesh, {max(-low, high) / max(largest):.2%} of the pressure: "
            "as little, held against ±2.5e3, not against that axis",
            _verdict(max(-low, high) <= 2.5e3),
            "fig39",
        ),
        Statement(
            "Section 7.2",
            "Example 2: every algorithm needs 4 iterations",
            f"{same}: {', '.join(map(str, counts))}, from a disk that is lowered until it touches, to roundoff",
            _verdict(len(counts) == 1),
        ),
        *(_of_study(disk.study, disk.winkler[0]) if disk.study is not None else ()),
    ]


def _of_study(study: DiskStudy, exact: float) -> list[Statement]:
    """What the rest of the difference to Hertz is made of."""
    current, reference = study.slopes.values
    moved = float(np.ptp(study.largest, axis=1).max()) / exact
    return [
        Statement(
            "Section 7.2",
            "Example 2: the pressure is not held against an exact one",
            f"Hertz on springs ε̂ is exceeded by {current[0]:.2%}. That is a pressure per current length on a surface "
            f"that contact compresses: it falls with a/R, to {current[-1]:.2%} at {study.slopes.at[-1]:g} of it, and "
            f"with reference areas {reference[0]:.2%} are left. Finer meshes change {moved:.2%}, a foundation of "
            f"half or twice the size {float(np.ptp(study.sizes.values)):.2%}",
            Said.SILENT,
            "fig39-why",
        )
    ]


def _of_defects(defects: Defects) -> list[Statement]:
    def at(series: Series, formulation: str, place: float) -> float:
        row = next(i for i, member in enumerate(series.members) if member.formulation == formulation)
        return float(series.values[row, np.argmin(np.abs(series.at - place))])

    lost = [at(defects.force, "vts-ppt", theta) for theta in (0.1, 0.3)]
    jumps = [at(defects.jump, "vts-ppt", theta) for theta in (0.1, 0.3)]
    ends = defects.free_end.values[[member.formulation for member in defects.free_end.members].index("vts-ppt")]
    return [
        Statement(
            "Boxes 1–3",
            "surfaces in contact are parallel, or nearly so on the disk; nothing is said of tilted ones",
            f"action is not reaction: the master gets 1 − cos θ less than the slave, {number(lost[0])} of the force at "
            f"θ = 0.1 and {number(lost[1])} at 0.3, and a moment is lost with it",
            Said.DEFECT,
            "defect-tilt",
        ),
        Statement(
            "Eq. 6 and Box 3",
            "one segment under the area: Eq. 6; several: Box 3; nothing is said of the change from one to the other",
            f"nodal forces jump there by {number(jumps[0], 2)} of the slave’s force at θ = 0.1 and "
            f"{number(jumps[1], 2)} at 0.3",
            Said.DEFECT,
            "defect-jump",
        ),
        Statement(
            "Boxes 2, 3",
            "nothing is said of an area of competence that overhangs the end of the master",
            f"cut on the master’s side only (our reading), the patch test fails, with errors of the stress up to "
            f"{np.nanmax(ends):.2g} of the pressure",
            Said.DEFECT,
            "defect-ends",
        ),
    ]
