"""Draw `reports/stability/stability.svg` from the file beside it: no formulation loses more digits than κ explains."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

FOLDER = Path(__file__).parents[1] / "reports" / "stability"
U = 2.0**-53


def draw() -> None:
    """Draw the errors of all formulations against the condition numbers, and name those beyond one rounding."""
    mpl.rcParams.update({"svg.hashsalt": "contactverif", "font.size": 9})
    report = xr.open_datatree(FOLDER / "stability.nc")
    parts = [report[f"stability/{name}"].detail_value for name in ("sweep", "stiffness")]
    details = xr.concat(parts, "case")  # Missing cases are NaN.
    condition, error = (details.sel(detail=name) for name in ("condition number", "relative error"))
    figure = Figure(figsize=(3.7, 4.4), layout="constrained")  # As wide as a phone.
    axes = figure.subplots()
    beyond = (error > U * condition).any("case")
    at_most = {"ls": "none", "marker": ".", "ms": 4, "color": "0.6", "label": f"{int((~beyond).sum())} formulations"}
    axes.plot(condition[~beyond].values.ravel(), error[~beyond].values.ravel(), **at_most)
    for name, color, marker in zip(condition.formulation[beyond].values, ("#D55E00", "#0072B2"), "^s", strict=True):
        look = {"ls": "none", "marker": marker, "ms": 4, "mfc": "none", "color": color, "label": name}
        axes.plot(condition.sel(formulation=name), error.sel(formulation=name), **look)
    ends = np.array([1.0, float(condition.max())])
    axes.plot(ends, 4 * U * ends, color="black", linewidth=1.0, label="4 u κ")
    axes.plot(ends, 16 * U * ends, color="black", linewidth=1.0, linestyle="--", label="16 u κ: a property fails")
    axes.set(xscale="log", yscale="log", xlabel="condition number κ", ylabel="relative error of the worst force")
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    figure.savefig(FOLDER / "stability.svg", metadata={"Date": None})


if __name__ == "__main__":
    draw()
