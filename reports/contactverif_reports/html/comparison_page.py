"""The pages of a comparison: formulations against a reference, and an old report against a new one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isnan
from typing import Any

from markupsafe import Markup

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif_reports.compare.cells import Cell
from contactverif_reports.compare.comparison import PARTS, Comparison, Cost, Differing
from contactverif_reports.compare.regression import Change, Changes
from contactverif_reports.draw.solved_scene import SolvedScene
from contactverif_reports.html.margin_strips import Axis, strip, ticks
from contactverif_reports.html.pages import render, svg_inline
from contactverif_reports.netcdf.read import StoredCase

_ABOUT = ("command", "created", "commit", "profile", "examples", "seed", "contactverif_version", "platform")
_INCHES = 5.6  # wide; two stand side by side on a wide page
_LEGEND = 7  # points: its four entries, with forces, are else wider than the figure


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """What a picture of a differing case needs; whoever gives none of it is drawn without.

    Attributes
    ----------
    candidate, reference : FloatArray | None
        Nodal forces (n_nodes, 2) that they find.
    exact : FloatArray | None
        The exact ones.
    solved : SolvedScene | None
        A case with bodies, solved by both; it is drawn instead of the forces at its first guess.
    """

    candidate: FloatArray | None = None
    reference: FloatArray | None = None
    exact: FloatArray | None = None
    solved: SolvedScene | None = None


def comparison_page(
    found: Comparison, differing: Sequence[Differing], drawings: Sequence[Drawing], costs: Sequence[Cost]
) -> str:
    """The page of formulations against a reference; `drawings` belong to `differing`, one each."""
    axis = Axis.of(cell.margins for cell in found.cells.values())
    asked = [id_ for id_ in found.properties if any((name, id_) in found.cells for name in found.formulations)]
    return render(
        "compare.html.j2",
        found=found,
        candidates=found.formulations[1:],
        wrong=[*found.unexpected],
        differ=[id_ for id_ in asked if _verdicts_differ(found, id_)],
        verdicts=[(id_, [_verdict(found, name, id_) for name in found.formulations]) for id_ in asked],
        errors=[
            (id_, [(cell, found.paired.get((cell.formulation, id_)), strip(cell.margins, axis)) for cell in cells])
            for id_ in asked
            if (cells := _told(found, id_))
        ],
        ticks=ticks(axis),
        parts_of_time=PARTS,
        inf=inf,
        costs=_costs(costs, found.reference),
        meshes=[_mesh(one, drawing, found.reference) for one, drawing in zip(differing, drawings, strict=True)],
        about=_about(found.provenance),
    )


def changes_page(changes: Changes, meshes: Mapping[str, StoredCase]) -> str:
    """The page of an old report and a new one; `meshes` are counterexamples of the new one, by id."""
    axis = Axis.of(cell.margins for change in changes.changes for cell in (change.old, change.new))
    return render(
        "changes.html.j2",
        changes=changes,
        rows=_by_formulation(changes, axis),
        ticks=ticks(axis),
        meshes=[(id_, stored, _drawn(stored.case, None, None, id_)) for id_, stored in meshes.items()],
        n_others=sum(change.paired is None for change in changes.changes),
        old_about=_about(changes.old.provenance),
        new_about=_about(changes.new.provenance),
    )


def _by_formulation(changes: Changes, axis: Axis) -> list[tuple[str, list[tuple[Change, Markup, Markup]]]]:
    """Rows with the strips of the old and the new margins."""
    rows: dict[str, list[tuple[Change, Markup, Markup]]] = {}
    for change in changes.changes:
        line = (change, strip(change.old.margins, axis), strip(change.new.margins, axis))
        rows.setdefault(change.new.formulation, []).append(line)
    return list(rows.items())


def _verdict(found: Comparison, name: str, id_: str) -> dict[str, Any] | None:
    cell, reference = found.cells.get((name, id_)), found.cells.get((found.reference, id_))
    if cell is None:
        return None
    return {
        "word": str(cell.verdict),
        "unexpected": cell.unexpected,
        "differs": reference is not None and cell.verdict is not reference.verdict,
    }


def _verdicts_differ(found: Comparison, id_: str) -> bool:
    cells = [found.cells.get((name, id_)) for name in found.formulations]
    return len({cell.verdict for cell in cells if cell is not None}) > 1


def _told(found: Comparison, id_: str) -> list[Cell]:
    cells = [found.cells[name, id_] for name in found.formulations if (name, id_) in found.cells]
    return [cell for cell in cells if not isnan(cell.worst)]


def _costs(costs: Sequence[Cost], reference: str) -> list[tuple[int, list[dict[str, Any]]]]:
    """By number of slave segments: microseconds of each formulation, in words, and its ratio to the reference's."""
    of = {cost.n_segments: cost.total for cost in costs if cost.formulation == reference}
    lines: dict[int, list[dict[str, Any]]] = {cost.n_segments: [] for cost in costs}
    for cost in costs:
        seconds = [*(cost.seconds[part] for part in PARTS), cost.total]
        lines[cost.n_segments].append(
            {
                "formulation": cost.formulation,
                "failed": cost.failed,
                "times": [*map(_micro, seconds), _micro(cost.total / cost.n_segments, digits=2)],
                "ratio": "–" if isnan(cost.total / of[cost.n_segments]) else f"{cost.total / of[cost.n_segments]:.2f}",
            }
        )
    return list(lines.items())


def _micro(seconds: float, digits: int = 1) -> str:
    return "–" if isnan(seconds) else f"{1e6 * seconds:.{digits}f}"


def _mesh(one: Differing, drawing: Drawing, reference: str) -> dict[str, Any]:
    """Two figures with a caption each, or one with both."""
    sides = [
        (one.formulation, one.outcome, one.margin),
        (reference, one.reference_outcome, one.reference_margin),
    ]
    if drawing.solved is not None and drawing.solved.solutions:
        from contactverif_reports.draw.scene_figures import make_scene_figure

        figures = [(svg_inline(make_scene_figure(drawing.solved), f"{one.question.id}, solved"), sides)]
    else:
        figures = [
            (_drawn(one.case, found, drawing.exact, f"{one.question.id}: {side[0]}"), [side])
            for side, found in zip(sides, (drawing.candidate, drawing.reference), strict=True)
        ]
    return {"one": one, "figures": figures}


def _drawn(case: Case, forces: FloatArray | None, exact: FloatArray | None, label: str) -> Markup:
    import matplotlib  # it takes its time

    from contactverif_reports.draw.case_figure import make_case_figure
    from contactverif_reports.draw.scene_outline import has_outline, make_outline_figure

    if has_outline(case):
        return svg_inline(make_outline_figure(case, _INCHES), label)
    with matplotlib.rc_context({"legend.fontsize": _LEGEND}):
        beside = exact if forces is not None else None  # of multipliers nobody knows what it should be
        figure = make_case_figure(case, title="", forces=forces, exact=beside, width=_INCHES)
    return svg_inline(figure, label)


def _about(provenance: Mapping[str, str]) -> dict[str, str]:
    return {name.replace("_", " "): provenance[name] for name in _ABOUT if provenance.get(name)}
