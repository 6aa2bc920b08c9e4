"""Read a report with xarray, without our code, and plot the error against the mesh.

Make the report first: `contactverif verify vts-me vts-ppt -p patch.flat.transmission --out report.nc`.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

report = xr.open_datatree(sys.argv[1] if len(sys.argv) > 1 else "report.nc")
patch = report["patch/flat/transmission"].to_dataset()
error = (patch.value / patch.tolerance).isel(quantity=0)  # above 1 it fails
segments = patch.n_slave_segments + patch.n_master_segments

figure, axes = plt.subplots(figsize=(7, 4))
for formulation in error.formulation.values:
    choice = {"formulation": formulation}
    print(f"{formulation}: largest error {float(error.sel(choice).max()):.0e} tolerances")
    # An error of 0 has no logarithm, so the drawing has a floor.
    axes.scatter(segments.sel(choice), np.maximum(error.sel(choice), 1e-6), label=str(formulation), s=12)
axes.axhline(1, color="black", linewidth=0.8)
axes.set(xlabel="number of segments, both sides", ylabel="error over its tolerance", yscale="log")
axes.legend()
figure.savefig("error_against_mesh.svg")
