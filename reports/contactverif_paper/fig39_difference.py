"""Fig. 39: the pressure of VTS-PPT minus that of VTS-ME in Example 2, on two meshes.

The paper does not print its mesh. The difference is a discretization error: it is smaller on finer meshes, and which
axis it fits depends on the mesh.

Source: Zavarise & De Lorenzis (2009), Section 7.2, Fig. 39.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from contactverif.contract.arrays import FloatArray
from contactverif_paper.disk_solutions import difference, solve_disk
from contactverif_paper.figure_style import REFERENCE_LINE, new_panels, use_round_ticks
from contactverif_paper.paper_columns import Column, to_group
from contactverif_paper.paper_formulations import VTS_ME, VTS_PPT
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement
from contactverif_reports.html.pages import number
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.groups import Group

REFINE = (1, 2)
MESHES = ("our base meshes", "meshes twice as fine")
X_AXIS, AXIS = (0.0, 0.4), (-1.0e3, 1.5e3)  # Ends of the printed axes.
_STYLES: tuple[dict[str, Any], ...] = ({"color": "0.45", "linestyle": "--"}, {"color": "black", "linestyle": "-"})


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """The difference of the pressures on one mesh."""

    x: Annotated[FloatArray, Column("place", schema.LENGTH, "x along the interface", name="difference_x")]
    values: Annotated[
        FloatArray, Column("place", schema.STRESS, "VTS-PPT minus VTS-ME in contact pressure", name="difference")
    ]

    @property
    def inside(self) -> bool:
        """True if the printed axis holds it."""
        return AXIS[0] <= float(self.values.min()) and float(self.values.max()) <= AXIS[1]

    @property
    def words(self) -> str:
        """The range of the differences, in words."""
        return f"{number(float(self.values.min()), 2)} to {number(float(self.values.max()), 2)}"


def compute(report_progress: Progress) -> tuple[Difference, ...]:
    """Compute the difference on each mesh."""
    differences = []
    for refine, mesh in zip(REFINE, MESHES, strict=True):
        report_progress(f"Fig. 39, {mesh}")
        pair = (solve_disk(row, refine=refine) for row in (VTS_PPT, VTS_ME))
        differences.append(Difference(*difference(*pair)))
    return tuple(differences)


def statements(differences: tuple[Difference, ...]) -> Iterator[Statement]:
    """Say on which meshes the difference fits the printed axis."""
    inside = [row.inside for row in differences]
    agreement = Agreement.decide(any(inside), always=all(inside))
    fitting = " or ".join(mesh for mesh, fits in zip(MESHES, inside, strict=True) if fits)
    yield Statement(
        "Fig. 39",
        "Example 2: VTS-PPT and VTS-ME differ by little: the axis runs from −1e3 to 1.5e3; the mesh is not printed",
        "; ".join(f"{row.words} on {mesh}" for row, mesh in zip(differences, MESHES, strict=True)),
        agreement,
        "fig39",
        f"on {fitting} only" if agreement is Agreement.CONDITIONAL else "",
    )


@PaperFigure.define(
    "fig39",
    "Example 2: the pressure of VTS-PPT minus that of VTS-ME, (a) on the paper’s axes, which the curve of the "
    "base meshes leaves, (b) on axes that hold both.",
)
def plot(differences: tuple[Difference, ...]) -> Figure:
    """Draw both differences on the paper's axes, and on axes that hold both."""
    figure, (printed, whole) = new_panels(3.6, 2)
    for axes in (printed, whole):
        axes.axhline(0.0, **REFERENCE_LINE)
        for row, style in zip(differences, _STYLES, strict=True):
            right = row.x >= 0
            axes.plot(row.x[right], row.values[right], linewidth=1.0, zorder=3, **style)
        axes.set_xlabel("x along the interface (length)")
        use_round_ticks(axes)
    printed.set_xlim(*X_AXIS)
    printed.set_ylim(*AXIS)
    whole.set_xlim(0.0, None)
    printed.set_ylabel("VTS-PPT − VTS-ME\n(force / length)")
    handles = [Line2D([], [], label=mesh, **style) for mesh, style in zip(MESHES, _STYLES, strict=True)]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def datasets(differences: tuple[Difference, ...]) -> dict[str, Group]:
    """Return the differences, a group for each mesh."""
    groups = zip(("base", "fine"), MESHES, differences, strict=True)
    return {group: to_group(row, figure="Fig. 39", comment=mesh) for group, mesh, row in groups}


ITEM = Item(
    name="fig39_difference",
    title="Fig. 39: VTS-PPT beside VTS-ME on the disk",
    compute=compute,
    statements=statements,
    datasets=datasets,
    figures=(plot,),
    n_steps=len(REFINE),
    slow=True,
)
