"""See whether the pressures of a formulation with multipliers are held by the bodies, on finer and finer meshes.

β says how much a pressure of unit size moves two blocks that touch, if it is the pressure that moves them least. Mortar
and NTS keep it. VTS-PPT with two virtual slave nodes a segment loses half of it with each refinement, or has pressures
that move nothing at all. Two passes always have some of those.
"""

import matplotlib.pyplot as plt

from contactverif import judge_case, load_formulation, load_properties

(question,) = load_properties(["stability.inf-sup"])
cases = question.cases(None)
figure, panels = plt.subplots(1, len(cases), figsize=(10, 4), sharey=True, layout="constrained")
MARKERS = {  # Hollow and of several sizes, since NTS and dual mortar have the same β.
    "nts-lm": ("o", 10),
    "mortar-lm": ("s", 6),
    "mortar-dual-lm": ("+", 8),
    "vts-ppt-lm": ("^", 6),
    "vts-ppt-lm:n=1": ("v", 6),
    "two-pass/nts-lm": ("x", 6),
}
for name, (marker, size) in MARKERS.items():
    print(f"{name:16}", end="")
    for case, axes in zip(cases, panels, strict=True):
        series = judge_case(question, case, load_formulation(name)).measurement.series
        share = series["zero eigenvalues"][-1] / series["multipliers"][-1]
        last = series["inf-sup constant"][-2:]
        print(f"{case.name}: {last[1] / last[0]:.2f} of β left, {share:.0%} move nothing", end="   ")
        style = {"linestyle": "-" if share == 0 else "--", "marker": marker, "markersize": size}
        axes.loglog(series["slave segment"], series["inf-sup constant"], **style, fillstyle="none", label=name)
        axes.set_xscale("log", base=2)
        axes.set(title=case.name, xlabel="slave segment h")
    print()
panels[0].set_ylabel("inf-sup constant β")
figure.suptitle("Dashed: some pressures move nothing. They are left out.", fontsize="medium")
figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
figure.savefig("inf_sup.svg")
