"""Count what the judge does for each kind of scene, beside the least that would do.

Run with `python evidence/bench/scene_work.py FILE.csv`. Each property is asked on one case, and no body is remembered
from before. Counts do not depend on the machine.

What is least: each elastic body that differs in mesh, material or supports is assembled and factorised once; the
formulation visits the facets that touch at the solution; Newton's method has the free components of their nodes.
"""

import csv
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))

from origin import keep_commit

from contactverif import Case, Property, Subject, judge_case, load_formulation, load_properties
from contactverif.mechanics import bulk
from contactverif.mechanics.scene import Scene, forget_bodies, has_bodies
from contactverif.mechanics.system import System
from contactverif.sampling.draw import draw_block


@dataclass(frozen=True)
class Work:
    """The work for one property on one case. Numbers of facets and unknowns are those of its largest solved scene."""

    property_id: str
    scenes: int = 0
    assembled: int = 0
    factorised: int = 0
    least_bodies: int = 0
    facets: int = 0
    touching_facets: int = 0
    unknowns: int = 0
    least_unknowns: int = 0
    all_unknowns: int = 0


@dataclass
class Counts:
    """The counts of the instruments, and what they saw."""

    assembled: int = 0
    factorised: int = 0
    parts: set[Any] = field(default_factory=set)  # Elastic bodies that differ, as far as matrices are concerned.
    scenes: dict[int, Scene] = field(default_factory=dict)
    forces: dict[int, Any] = field(default_factory=dict)  # The contact forces that each scene was balanced with last.


@contextmanager
def count_all() -> Iterator[Counts]:
    """Count assemblies, factorisations and scenes, and keep contact forces, while the context lasts."""
    counts = Counts()
    assemble, factorise, prepare = bulk.assemble_stiffness, bulk._interior_solver, bulk._factorise
    bodies, balance = Scene.__dict__["condensed_bodies"], System.balance
    condense = bodies.func

    def count_assembly(*arguments: Any) -> Any:
        counts.assembled += 1
        return assemble(*arguments)

    def count_factorisation(*arguments: Any) -> Any:
        counts.factorised += 1
        return factorise(*arguments)

    def count_part(part: Any) -> Any:
        counts.parts.add(part)
        return prepare(part)

    def count_scene(scene: Scene) -> Any:
        counts.scenes[id(scene)] = scene
        return condense(scene)

    def keep_forces(system: System, u: Any, forces: Any) -> Any:
        counts.scenes[id(system.scene)], counts.forces[id(system.scene)] = system.scene, forces
        return balance(system, u, forces)

    with ExitStack() as stack:
        stack.enter_context(patch.object(bulk, "assemble_stiffness", count_assembly))
        stack.enter_context(patch.object(bulk, "_interior_solver", count_factorisation))
        stack.enter_context(patch.object(bulk, "_factorise", count_part))
        stack.enter_context(patch.object(bodies, "func", count_scene))
        stack.enter_context(patch.object(System, "balance", keep_forces))
        yield counts


def forget_everything() -> None:
    """Let go of all that a process remembers of bodies."""
    forget_bodies()
    for name, module in list(sys.modules.items()):
        if name.startswith("contactverif.problems."):
            for remembered in vars(module).values():
                getattr(remembered, "cache_clear", lambda: None)()


def size_of(case: Case) -> tuple[bool, int]:
    """Return a key by which scenes come after interfaces, and large cases after small ones."""
    return has_bodies(case), case.z.size


def measure_work(question: Property, subject: Subject) -> Work:
    """Ask a property on the largest of some cases and return what was done."""
    case = max(draw_block(question.cases(None), seed="0", examples=20, number=0).cases[:20], key=size_of)
    forget_everything()
    with count_all() as counts:
        judge_case(question, case, subject)
    work = {
        "property_id": question.id,
        "scenes": len(counts.scenes),
        "assembled": counts.assembled,
        "factorised": counts.factorised,
        "least_bodies": len(counts.parts),
    }
    if counts.forces:
        largest = max(counts.forces, key=lambda key: counts.scenes[key].n_free)
        work |= sizes_of(counts.scenes[largest], counts.forces[largest])
    return Work(**work)


def sizes_of(scene: Scene, forces: Any) -> dict[str, int]:
    """Return the numbers of facets and unknowns of a solved scene with its contact forces."""
    interface = scene.interface
    pushed = forces[: interface.n_unknowns].reshape(-1, 2).any(axis=1)
    segments = np.vstack([interface.slave.segments, interface.master.segments])
    touching = segments[pushed[segments].any(axis=1)]
    rows = np.repeat(np.isin(np.arange(interface.n_nodes), touching), 2)
    moved = abs(scene.transformation).T @ rows.astype(float)
    return {
        "facets": len(segments),
        "touching_facets": len(touching),
        "unknowns": scene.n_free,
        "least_unknowns": int(np.count_nonzero(moved)),
        "all_unknowns": sum(int((~scene.bodies[index].fixed).sum()) for index in scene.bodies_in_reach),
    }


def main(path: Path) -> None:
    """Write the table of all properties that need a body."""
    subject = load_formulation("vts-ppt")
    assert isinstance(subject, Subject)
    questions = [item for item in load_properties(["*"]) if isinstance(item, Property)]
    rows = [measure_work(question, subject) for question in questions if not question.refusal_of(subject)]
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, [entry.name for entry in fields(Work)])
        table.writeheader()
        table.writerows(asdict(row) for row in rows if row.scenes)
    keep_commit(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
