"""Fig. 39: the pressure of VTS-PPT minus that of VTS-ME in Example 2, on two meshes.

The paper does not print its mesh. The difference is a discretization error: it is smaller on finer meshes, and which
axis it fits depends on the mesh.

Source: Zavarise & De Lorenzis (2009), Section 7.2, Fig. 39.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from matplotlib.figure import Figure

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray
from contactverif.contract.columns import Group
from contactverif_paper.disk_solutions import difference, solve_disk
from contactverif_paper.figure_style import REFERENCE_LINE, new_panels, use_round_ticks
from contactverif_paper.paper_columns import Column, to_group
from contactverif_paper.paper_formulations import VTS_ME, VTS_PPT
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement
from contactverif_reports.html.pages import number

REFINE = (1, 2)
MESHES = ("our base meshes", "meshes twice as fine")
X_AXIS, AXIS = (0.0, 0.4), (-1.0e3, 1.5e3)  # Ends of the printed axes.


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
    fitting = " or ".join(mesh for mesh, fits in zip(MESHES, inside, strict=True) if fits)
    yield Statement(
        "Fig. 39",
        "Example 2: VTS-PPT and VTS-ME differ by little: the axis runs from −1e3 to 1.5e3; the mesh is not printed",
        "; ".join(f"{row.words} on {mesh}" for row, mesh in zip(differences, MESHES, strict=True)),
        Agreement.decide(any(inside), always=all(inside)),
        "fig39",
        f"on {fitting} only",
    )


@PaperFigure.define(
    "fig39",
    "Example 2: the pressure of VTS-PPT minus that of VTS-ME, (a) on meshes twice as fine as our base meshes, on the "
    "paper’s axes; (b) on our base meshes, which leave these axes at the dotted lines.",
)
def plot(differences: tuple[Difference, ...]) -> Figure:
    """Draw the difference on the finer meshes on the paper's axes, and that on the base meshes on axes that hold it."""
    figure, panels = new_panels(3.3, 2)
    for axes, row, mesh in zip(panels, reversed(differences), reversed(MESHES), strict=True):
        axes.axhline(0.0, **REFERENCE_LINE)
        right = (row.x >= 0) & (row.x <= X_AXIS[1])
        axes.plot(row.x[right], row.values[right], linewidth=1.0, zorder=3, color="black")
        axes.set(xlabel="x along the interface (length)", title=mesh)
        use_round_ticks(axes)
        axes.set_xlim(*X_AXIS)
    printed, whole = panels
    printed.set_ylim(*AXIS)
    for end in AXIS:
        whole.axhline(end, color="0.35", linewidth=0.8, linestyle=":", zorder=1)
        words_ = "printed\naxis ends" if end > 0 else "printed axis ends"
        whole.text(X_AXIS[1], 1.05 * end, words_, ha="right", va="bottom" if end > 0 else "top", color="0.35")
    printed.set_ylabel("VTS-PPT − VTS-ME\n(force / length)")
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
