"""Refine two wavy bodies in full contact, and see whose forces and pressures converge to the exact ones.

On a flat interface, formulations that pass the patch test converge. On a curved one the facets of both meshes cross.
With stiff springs, those that press many points of each facet then get wrong pressures. Mortar keeps its rate.
"""

import matplotlib.pyplot as plt
import numpy as np

from contactverif import judge_case, load_formulation, load_properties

STYLES = {"nts-ar": "C0v-", "vts-me": "C1^-", "vts-ppt": "C3o-", "sts": "C4s-", "mortar": "C5+-"}
STUDIES = (
    ("accuracy.wavy", "upper slave, 10 E/h", "flat interface, 10 E/h"),
    ("accuracy.wavy-curved", "upper slave, 10 E/h", "curved interface, 10 E/h"),
    ("accuracy.wavy-curved", "upper slave, 100 E/h", "curved interface, 100 E/h"),
)
sizes = 1 / (6 * np.array([1, 2, 4, 8]))  # Slave segments h over the wavelength; the master has 4 for each 3 of them.

figure, panels = plt.subplots(2, 3, figsize=(10, 6), sharex=True, sharey="row", layout="constrained")
for (pressures, forces), (identifier, study, title) in zip(panels.T, STUDIES, strict=True):
    (question,) = load_properties([identifier])
    (case,) = (case for case in question.cases(None) if case.name == study)
    for name, style in STYLES.items():
        series = judge_case(question, case, load_formulation(name)).measurement.series
        errors = series["pressure error"]
        pressures.loglog(sizes, errors, style, markerfacecolor="none", label=name)
        worse = np.maximum(series["slave force error"], series["master force error"])
        forces.loglog(sizes, worse, style, markerfacecolor="none")
        rate = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
        print(f"{title:25} {name:7} pressures: rate {rate:5.2f}, last error {errors[-1]:.1e}")
    for axes, first in ((pressures, 0.02), (forces, 0.004)):
        axes.loglog(sizes, first * (sizes / sizes[0]) ** 2, "k:", label="slope 2" if axes is pressures else None)
    pressures.set_title(title)
    forces.set_xlabel("slave segment h over the wavelength")
    forces.set_xticks(sizes, [f"1/{1 / size:.0f}" for size in sizes])
    forces.minorticks_off()
panels[0, 0].set_ylabel("error of reported pressures")
panels[1, 0].set_ylabel("error of nodal forces")
figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
figure.savefig("wavy_rates.svg")
