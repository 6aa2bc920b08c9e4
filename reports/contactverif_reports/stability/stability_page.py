"""The page in Markdown that stands beside a kept figure: a sentence for each formulation and the table of ω."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contactverif.contract.result import Run
from contactverif_reports.stability.sweep_points import (
    COLUMNS,
    FAR_AND_CLOSE,
    LINE_FACTOR,
    SWEEPS,
    TOLERANCE,
    SweepPanel,
    SweepPoint,
    short_number,
    sweep_panels,
)

_FAR = ("offset", "offset, gap 1e-6", "offset, gap, ratio")  # The sweeps away from the origin.
_MEANING = f"""\
A state is a flat interface that is turned and moved without rounding. The reference is the forces of the same state,
flat at the origin, turned. κ is the condition number of a force: Σ ‖K‖ |z − z̄| over the largest force. K is the
derivative of the residual and z̄ the centroid of the interface. If each position is rounded relative to the others,
with u = 2⁻⁵³, a force changes by u κ at most. {{below}} of {{count}} formulations keep all errors below that. The line
of the figure is {LINE_FACTOR:g} u κ. The dashed line is {TOLERANCE:g} u κ, from which `stability.sweep` and
`stability.stiffness` fail. The states of ε̂h/E are two blocks, solved; there K is the matrix of bodies and contact."""


def stability_page(run: Run, files: Mapping[str, str]) -> str:
    """Return the page."""
    panels = sweep_panels(run)
    sentences = [f"- `{panel.formulation}` {sentence_of(panel)}" for panel in panels]
    sentences += [f"- `{plugin.formulation}` was not loaded: {plugin.reason}" for plugin in run.not_loaded]
    n_below = sum(panel.worst is not None and panel.worst.roundings <= 1 for panel in panels)  # All errors below u κ.
    meaning = _MEANING.format(below=n_below, count=len(panels))
    parts = ["# Error against condition number", f"`{run.provenance['command']}`", _origin(run), meaning]
    pictures = [files[suffix] for suffix in (".svg", ".png") if suffix in files][:1]
    parts += [f"![Error against condition number, one panel a formulation]({name})" for name in pictures]
    parts += ["## One sentence for each formulation", "\n".join(sentences)]
    parts += ["## ω, the error over u κ", "\n".join(_table(panels))]
    if ".nc" in files:
        parts.append(_how_to_replay(panels, files[".nc"]))
    return "\n\n".join(parts) + "\n"


def _origin(run: Run) -> str:
    version, commit = (run.provenance.get(name, "unknown") for name in ("contactverif_version", "commit"))
    return f"The command above wrote these files with contactverif {version}, commit {commit}."


def _table(panels: Sequence[SweepPanel]) -> list[str]:
    """Return the lines of the table; the last column is the relative error of the forces."""
    headings = ["", *COLUMNS, "error of the forces at offset 1e6, gap 1e-6"]
    lines = [f"| {' | '.join(headings)} |", f"|---|{'--:|' * (len(headings) - 1)}"]
    for panel in panels:
        numbers = [panel.roundings_at(stem) for stem in COLUMNS.values()] + [panel.force_error_at(FAR_AND_CLOSE)]
        lines.append(f"| `{panel.formulation}` | {' | '.join(map(short_number, numbers))} |")
    return lines


def _how_to_replay(panels: Sequence[SweepPanel], report: str) -> str:
    """Return how a point that fails is judged again, with the worst one for an example, if there is one."""
    above = [point for panel in panels for point in panel.above]
    failing = [point for point in above if point.fails]
    if not failing:
        line = "the dashed line" if above else "the line"
        return f"No point is above {line}. `{report}` holds the numbers; `contactverif report {report}` shows them."
    worst = max(failing, key=lambda point: point.roundings)
    command = f"    contactverif replay {report} --case {worst.case_id}"
    return f"Each point above the dashed line can be judged again, for example the worst one:\n\n{command}"


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
    if not any(point.fails for point in panel.above):
        return f"in the sweeps of {', '.join(sweeps)}, and never above {TOLERANCE:g} u κ: it loses a digit there"
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
