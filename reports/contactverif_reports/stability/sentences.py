"""One sentence for each formulation: how its errors stand to the condition number."""

from __future__ import annotations

from contactverif_reports.stability.sweep_points import LINE_FACTOR, SWEEPS, SweepPanel, SweepPoint, short_number

_FAR = ("offset", "offset, gap 1e-6", "offset, gap, ratio")  # The sweeps away from the origin.


def sentence_of(panel: SweepPanel) -> str:
    """Return a sentence without the formulation's name, such as "rounds as little as …"."""
    worst, n = panel.worst, len(panel.points)
    if worst is None:
        return f"was not measured{_list_rest(panel)}."
    rest = _list_rest(panel)
    if not panel.above:
        return f"stays below the line in all {n} states; the largest error is {_times(worst)}{rest}."
    share = f"is above the line in {len(panel.above)} of {n} states"
    return f"{share}, {_describe_sweeps(panel)}; the largest error is {_times(worst)}{rest}."


def _times(point: SweepPoint) -> str:
    """Return an error in units of u κ, with its state."""
    return f"{short_number(point.roundings)} u κ, in `{point.name}`" if point.roundings else "0"


def _describe_sweeps(panel: SweepPanel) -> str:
    """Return the sweeps in which points are above the line, and what that means."""
    sweeps = [sweep for sweep in SWEEPS if any(point.sweep == sweep for point in panel.above)]
    if all(sweep in _FAR for sweep in sweeps):
        return "all of them far from the origin: it rounds positions there before it subtracts them"
    if panel.roundings_at("gap-1e-1") > LINE_FACTOR:
        return "at an ordinary gap near the origin too: its forces do not turn with the state, or have few digits"
    return f"in the sweeps of {', '.join(sweeps)}"


def _list_rest(panel: SweepPanel) -> str:
    """Return what gave no point, in words behind a semicolon."""
    parts = []
    if panel.n_undecided:
        parts.append(f"{panel.n_undecided} undecided")
    if panel.n_crashed:
        parts.append(f"{panel.n_crashed} without an answer")
    parts += panel.remarks
    return "".join(f"; {part}" for part in parts)
