"""Draw `docs/pictures/face_patches.svg`: the parts of a slave triangle, and what two master triangles carry of each."""

from fractions import Fraction
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from contactverif import Interface, Pairing, load_formulation
from contactverif.oracle.flat_answers import cut_polygon, turn

FILE = Path(__file__).parents[1] / "docs" / "pictures" / "face_patches.svg"
MASTER = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
SLAVE = np.array([[0.375, 0.125], [1.875, 0.5], [0.25, 1.5]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
MIDDLES = [[0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5]]  # Of the edges, as shares of the corners.
CORNERS = np.array([[[1, 0, 0], MIDDLES[0], MIDDLES[2]], [[0, 1, 0], MIDDLES[1], MIDDLES[0]],
                    [[0, 0, 1], MIDDLES[2], MIDDLES[1]], MIDDLES])  # fmt: skip
COLORS, NAMES = ("#56B4E9", "#E69F00"), ("vts-ppt-3d", "vts-ppt-balanced-3d")
ROWS = ("slave", "master, printed", "master, balanced")


def covered_area(part: np.ndarray, face: int) -> float:
    """Return the area of a part (3, 2) over a master face, seen from above."""
    polygons = [
        [(Fraction(x), Fraction(y)) for x, y in each] for each in (part.tolist(), MASTER[FACES[face], :2].tolist())
    ]
    cell = cut_polygon(*polygons)
    return float(sum(turn(cell[0], *cell[i : i + 2]) for i in range(1, len(cell) - 1))) / 2


def draw() -> None:
    """Draw the parts from above, and the force of each part on the slave and on both master faces."""
    mpl.rcParams.update({"svg.hashsalt": "contactverif", "font.size": 9})
    slave = np.column_stack([SLAVE, SLAVE @ [0.75, 0.375] - 2.0])
    interface = Interface.from_faces(slave, [[0, 2, 1]], MASTER, FACES)  # Its corners seen from below: 0, 2, 1.
    z, parts, order = interface.nodes.reshape(-1), CORNERS @ SLAVE, [0, 2, 1, 3]
    totals = []
    for name in NAMES:
        formulation = load_formulation(name).with_penalty(1.0).plugin
        pairing = formulation.pair(interface, z)
        alone = [Pairing({**pairing, "active": np.arange(4) == part}) for part in order]
        forces = [formulation.residual(interface, each, z).reshape(-1, 3)[:, 2] for each in alone]
        totals.append([(-force[:3].sum(), force[3:].sum()) for force in forces])
    figure = Figure(figsize=(3.7, 5.6), layout="constrained")  # As wide as a phone.
    above, bars = figure.subplots(2, height_ratios=[3, 2.4])
    for face, color in enumerate(COLORS):
        above.fill(*MASTER[FACES[face], :2].T, facecolor=color, alpha=0.3, edgecolor="black", linewidth=1)
    for corners, style in ((SLAVE, "-"), (parts[3], "--")):
        above.fill(*corners.T, facecolor="none", edgecolor="black", linestyle=style, linewidth=1)
    for number, part in enumerate(parts):
        place = part.mean(axis=0)
        above.plot(*place, "ko", markersize=4)
        above.annotate(f" V{number + 1}", place)
        areas = np.array([covered_area(part, face) for face in (0, 1)])
        on_slave, printed, balanced = totals[0][number][0], totals[0][number][1], totals[1][number][1]
        for row, total in enumerate((on_slave, printed, balanced)):
            y, left = number + (row - 1) * 0.27, 0.0
            for share, color in zip(areas / areas.sum(), COLORS, strict=True) if row else [(1.0, "0.6")]:
                bars.barh(y, share * total, 0.22, left, color=color, edgecolor="black", linewidth=0.5)
                left += share * total
            bars.annotate(f" {ROWS[row]}", (total, y), va="center", fontsize=7)
    above.set(aspect="equal", title="one slave triangle on two master triangles")
    above.axis("off")
    bars.set(yticks=range(4), yticklabels=[f"V{i + 1}" for i in range(4)], xlabel="force / ε̂")
    bars.set_xlim(0, 1.35 * bars.get_xlim()[1])
    bars.invert_yaxis()
    bars.spines[["top", "right"]].set_visible(False)
    figure.savefig(FILE, metadata={"Date": None})


if __name__ == "__main__":
    draw()
