"""Print the error of nodal forces on four Hertz meshes: codes beside the formulation of ours with the same method.

    python evidence/hertz_beside_codes.py kratos=PYTHON ngsolve=PYTHON

`NAME=PYTHON` is the interpreter that has a code; without it the code is left out. CalculiX needs the program `ccx`.
"""

import shutil
import sys
from collections.abc import Sequence

from contactverif import Subject
from contactverif.isolation.host import end_all
from contactverif.isolation.limits import Limits
from contactverif.mechanics.accuracy import solve_for_accuracy
from contactverif.plugins.registry import the_subject
from contactverif.problems.hertz_boxes import HERTZ_STUDIES, HertzStudy
from contactverif.problems.problem import FORCES

SECONDS = 120.0  # The most for one mesh.
SCENES = ("parabola-layer", "flat-soft")
PAIRS = (
    ("sts", "engine/control"),
    ("sts", "engine/calculix"),
    ("nts-ar", "engine/calculix:kind=nodes"),
    ("mortar-dual-lm", "engine/kratos:search=radius,normals=updated,augmentation=1e-6"),
    ("vts-g:n=3", "engine/ngsolve"),
    ("sts", "engine/ngsolve:order=15"),
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
    """Print a table of each scene."""
    interpreters = dict(argument.split("=", 1) for argument in arguments)
    subjects = {name: load(name, interpreters) for name in dict.fromkeys(name for pair in PAIRS for name in pair)}
    studies = [HERTZ_STUDIES.read(case) for case in HERTZ_STUDIES.cases() if case.name in SCENES]
    for scene, study in zip(SCENES, studies, strict=True):
        print(f"\n{scene}, segments {', '.join(map(str, study.meshes[:4]))}")
        for name, subject in subjects.items():
            if subject is not None:
                print(f"  {name:70s}", *(f"{error:.3e}" for error in errors(study, subject)), flush=True)
    end_all()


if __name__ == "__main__":
    main(sys.argv[1:])
