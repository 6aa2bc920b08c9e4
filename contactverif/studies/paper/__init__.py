"""The reference paper, computed again: every table and figure of it as numbers, one file a part."""

from __future__ import annotations

from collections.abc import Callable

from contactverif.provenance import provenance
from contactverif.studies.paper import cast
from contactverif.studies.paper.convergence import convergence
from contactverif.studies.paper.defects import defects
from contactverif.studies.paper.disk import disk, disk_steps
from contactverif.studies.paper.forces import tables
from contactverif.studies.paper.multipliers import multipliers
from contactverif.studies.paper.patch import SHOWN, passes, patches
from contactverif.studies.paper.statements import statements
from contactverif_reports.paper_data import Paper

__all__ = ["compute", "steps"]


def steps(*, with_study: bool = True) -> int:
    """How often `compute` tells where it is."""
    tables = 1 + len(SHOWN) + len(cast.installed(cast.PASSES)) + 1 + 3 + len(cast.installed(cast.MULTIPLIERS))
    return tables + disk_steps(with_study=with_study)


def compute(told: Callable[[str], None] = lambda _: None, *, with_study: bool = True) -> Paper:
    """All of it.

    Parameters
    ----------
    told : is told what comes next, a few words, `steps()` times.
    with_study : of Example 2 on finer meshes, which takes most of the time.
    """
    told("force tables")
    forces = tables()
    solved, passing = patches(told), passes(told)
    told("convergence")
    histories = convergence()
    found, saddles = defects(told), multipliers(told)
    pressed = disk(told, with_study=with_study)
    return Paper(
        forces=forces,
        patches=solved,
        passes=passing,
        convergence=histories,
        defects=found,
        multipliers=saddles,
        disk=pressed,
        statements=statements(forces, solved, passing, histories, found, saddles, pressed),
        missing=cast.missing(),
        provenance=_provenance(),
    )


def _provenance() -> dict[str, str]:
    """Versions and the commit; nothing that a second run would say otherwise."""
    found = provenance(profile="", examples=0, seed=0)
    return {name: value for name, value in found.items() if name.endswith("_version") or name == "commit"}
