"""The reference paper, computed again: every table and figure of it as numbers, one file a part.

Each part also says what the paper says of it, in our words, beside what was found.
"""

from __future__ import annotations

from collections.abc import Callable

from contactverif.run.provenance import collect_provenance
from contactverif_paper import cast, convergence, defects, forces
from contactverif_paper import paper_disk as disk
from contactverif_paper import paper_multipliers as multipliers
from contactverif_paper import paper_patch as patch
from contactverif_paper import paper_tangents as tangents
from contactverif_paper.paper_data import Paper, Patch

__all__ = ["compute", "steps"]


def steps(*, with_study: bool = True) -> int:
    """How often `compute` tells where it is."""
    parts = 3 + len(patch.SHOWN) + len(cast.PASSES) + 3 + len(cast.MULTIPLIERS)
    return parts + disk.disk_steps(with_study=with_study)


def compute(told: Callable[[str], None] = lambda _: None, *, with_study: bool = True) -> Paper:
    """All of it.

    Parameters
    ----------
    told : Callable[[str], None]
        Is told what comes next, a few words, `steps()` times.
    with_study : bool
        Of Example 2 on finer meshes, which takes most of the time.
    """
    told("force tables")
    tables = forces.tables()
    patches, passes = patch.patches(told), patch.passes(told)
    told("convergence")
    histories = convergence.convergence()
    told("tangents")
    derivatives = tangents.tangents()
    wrong, saddles = defects.defects(told), multipliers.multipliers(told)
    pressed = disk.disk(told, with_study=with_study)
    return Paper(
        forces=tables,
        patches=patches,
        passes=passes,
        convergence=histories,
        tangents=derivatives,
        defects=wrong,
        multipliers=saddles,
        disk=pressed,
        statements=(
            *map(forces.statement, tables),
            *patch.statements(patches, passes),
            *convergence.statements(histories),
            *tangents.statements(derivatives),
            *multipliers.statements(saddles, _titles(patches)),
            *disk.statements(pressed),
            *defects.statements(wrong),
        ),
        provenance=_provenance(),
    )


def _titles(patches: tuple[Patch, ...]) -> dict[str, str]:
    """{scene: what the paper calls it}, within a sentence."""
    return {"c-prime": "case C′"} | {one.scene: one.title.replace("Case", "case") for one in patches}


def _provenance() -> dict[str, str]:
    """Versions and the commit; nothing that a second run would say otherwise."""
    found = collect_provenance(profile="", examples=0, seed=0)
    return {name: value for name, value in found.items() if name.endswith("_version") or name == "commit"}
