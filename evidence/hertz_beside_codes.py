"""Write the error of nodal forces on four Hertz meshes: codes beside the formulation of ours with the same method.

    python evidence/hertz_beside_codes.py kratos=PYTHON ngsolve=PYTHON

`NAME=PYTHON` is the interpreter that has a code; without it the lines of the code stay. CalculiX needs the program
`ccx`. `reports/findings/hertz.csv` has a line for each scene and formulation.
"""

import csv
import shutil
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from origin import judge_of, keep_commit

from contactverif import Subject
from contactverif.isolation.host import end_all
from contactverif.isolation.limits import Limits
from contactverif.mechanics.accuracy import solve_for_accuracy
from contactverif.plugins.registry import the_subject
from contactverif.problems.hertz_boxes import HERTZ_STUDIES, HertzStudy
from contactverif.problems.problem import FORCES

SECONDS = 120.0  # The most for one mesh.
TABLE = Path(__file__).parents[1] / "reports" / "findings" / "hertz.csv"
HEADS = ("scene", "formulation", "16", "20", "26", "33", "judge")
SCENES = ("parabola-layer", "flat-soft")
PAIRS = (
    ("sts", "engine/control"),
    ("sts", "engine/calculix"),
    ("sts", "engine/ngsolve:order=15"),
    ("nts-ar", "engine/calculix:kind=nodes"),
    ("mortar-dual-lm", "engine/kratos:search=radius,normals=updated,augmentation=1e-6"),
    ("vts-g:n=3", "engine/ngsolve"),
)


def load(name: str, interpreters: dict[str, str]) -> Subject | None:
    """Return a formulation or an engine; None if its code is not here."""
    engine = name.removeprefix("engine/").partition(":")[0] if name.startswith("engine/") else ""
    if engine == "calculix" and shutil.which("ccx") is None:
        return None
    if engine in ("kratos", "ngsolve"):
        if engine not in interpreters:
            return None
        name += f"{',' if ':' in name else ':'}python={interpreters[engine]}"
    return the_subject(name, Limits(SECONDS))


def errors(study: HertzStudy, subject: Subject) -> list[float]:
    """Return the error of nodal forces on the first four meshes of a study."""
    instances = [study.pose(mesh, subject.traits) for mesh in study.meshes[:4]]
    solutions = [solve_for_accuracy(each.scene, subject, each.start, each.step) for each in instances]
    return [each.errors(solution)[FORCES[0]] for each, solution in zip(instances, solutions, strict=True)]


def main(arguments: Sequence[str]) -> None:
    """Write the lines of all formulations and of the codes that are here."""
    interpreters = dict(argument.split("=", 1) for argument in arguments)
    subjects = {name: load(name, interpreters) for name in dict.fromkeys(name for pair in PAIRS for name in pair)}
    studies = [HERTZ_STUDIES.read(case) for case in HERTZ_STUDIES.cases() if case.name in SCENES]
    with TABLE.open(encoding="utf-8", newline="") as stream:
        lines = {(row[0], row[1]): row for row in csv.reader(stream)}
    for scene, study in zip(SCENES, studies, strict=True):
        for name, subject in subjects.items():
            if subject is not None:
                numbers = (f"{error:.3e}" for error in errors(study, subject))
                lines[scene, name] = [scene, name, *numbers, judge_of("accuracy.hertz")]
                print(*lines[scene, name], flush=True)
    end_all()
    kept = (lines[key] for key in product(SCENES, subjects) if key in lines)
    with TABLE.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([HEADS, *kept])
    keep_commit(TABLE)


if __name__ == "__main__":
    main(sys.argv[1:])
