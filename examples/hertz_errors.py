"""Press a parabola on a flat, and see whose forces on the master are as good as the mesh allows.

The exact pressure is that of Hertz on a layer of springs. The error of a continuous pressure that is linear on each
segment of the master, and comes as near to the exact one as possible, is the measure: formulations that pass the patch
test are off by once or twice that. Those that fail it are off by up to thirty times that where springs are soft.
"""

import matplotlib.pyplot as plt

from contactverif import judge_case, load_formulation, load_properties

(question,) = load_properties(["accuracy.hertz"])
cases = [case for case in question.cases(None) if case.name.startswith("parabola")]  # The parabola is the slave.
ALLOWED = 3  # The property allows an error of three times that of the best pressure in these cases.
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for name, marker in {
    "nts-ar": "v",
    "vts-me": "^",
    "vts-me:n=4": "x",
    "vts-ppt": "o",
    "sts": "s",
    "mortar": "+",
}.items():
    shares = []
    for case in cases:
        numbers = judge_case(question, case, load_formulation(name)).measurement.numbers
        (error,) = (number for number in numbers if number.quantity.name == "error of master forces")
        shares.append(ALLOWED * error.value / error.tolerance)
    axes.semilogy(range(len(cases)), shares, marker, markerfacecolor="none", label=name)
    print(f"{name:11} " + ", ".join(f"{case.name} {share:.2g}" for case, share in zip(cases, shares, strict=True)))
axes.axhline(ALLOWED, color="0.6", linewidth=0.8)
axes.set(xlim=(-0.5, 2.5), ylabel="error of master forces over that of the best pressure", title="Hertz")
axes.set_xticks(range(len(cases)), ["ε̂ = E/a", "ε̂ = E/h", "ε̂ = 100 E/h"])
axes.set_yticks([0.3, 1, 3, 10, 30], ["0.3", "1", "3", "10", "30"])
axes.minorticks_off()
figure.legend(loc="outside right center")
figure.savefig("hertz_errors.svg")
