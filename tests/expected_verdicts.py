"""The verdict that theory expects for each formulation and property; the table in `properties/README.md` shows it.

`python tests/expected_verdicts.py` writes the table anew. `test_verdicts.py` compares it with what the harness finds,
and with the file. Rule for the next editor: change an entry only with a reason from theory, never because a run
differs.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from contactverif.contract.property import Verdict
from contactverif.run.registry import property_ids

README = Path(__file__).parents[1] / "properties" / "README.md"
BEGIN, END = "<!-- verdicts: begin -->", "<!-- verdicts: end -->"

FLAT = "patch.flat.transmission"
RESULTANT, RANK, DEAD_ZONE = "patch.flat.resultant", "multipliers.rank", "patch.dead-zone"
COMPLEMENTARITY = "complementarity"
LOCAL, STIFFNESS = "stability.local", "stability.stiffness"
FORCE, MOMENT, TANGENT = "balance.force", "balance.moment", "tangent.directional"
SOLVED = frozenset({"patch.flat.solve", "patch.variants"})
PATCHES = frozenset({FLAT, DEAD_ZONE}) | SOLVED
INEXACT = frozenset({TANGENT, "newton.order", "newton.history"})
PRINTED = frozenset({FORCE, MOMENT, DEAD_ZONE})

# The properties that each formulation fails. It passes all others that apply.
FAILS: Mapping[str, frozenset[str]] = {
    "nts": PATCHES,
    "nts-ar": PATCHES,
    "nts-ar:area=reference": PATCHES,
    "vts-g": PATCHES,
    "vts-g:n=3": PATCHES,
    "vts-me": PATCHES,
    "vts-me:n=4": PATCHES,
    "vts-ppt": PRINTED,
    "vts-ppt-basic": PRINTED | INEXACT,
    "vts-ppt-balanced": frozenset(),
    "nts-lm": PATCHES,
    "vts-me-lm": PATCHES | {RANK},
    "vts-ppt-lm": PRINTED | {RANK},
    "two-pass/nts": PATCHES,
    "two-pass/nts-ar": PATCHES,
    "two-pass/nts-lm": frozenset({RANK}),
    "sts": frozenset(),
    "mortar": frozenset(),
    "mortar:normals=averaged": frozenset(),
    "mortar-dual": frozenset(),
    "mortar-lm": frozenset(),
    "mortar-dual-lm": frozenset(),
    "chen-hisada": frozenset({DEAD_ZONE}),
}

# Hard cases that follow from a property with random cases: whoever fails that one fails these, and states nothing.
FOLLOWS = {
    **dict.fromkeys(("hard.c", "hard.contrast", "hard.short-segment", "hard.stiff"), FLAT),
    "hard.dead-zone": DEAD_ZONE,
}

# Formulations that a property cannot judge: nodal springs have no area, and springs that act twice have no total.
WITHOUT_AREA = ("nts", "nts-lm", "two-pass/nts", "two-pass/nts-ar", "two-pass/nts-lm")
WITH_MULTIPLIERS = ("nts-lm", "vts-me-lm", "vts-ppt-lm", "two-pass/nts-lm", "mortar-lm", "mortar-dual-lm")
NOT_UNIQUE = ("vts-me-lm", "vts-ppt-lm", "two-pass/nts-lm")  # With redundant multipliers Newton has no limit.
# These state neither an area nor pressures that pass the patch test, and a compiled kernel takes no long double. So no
# exact force of theirs is known.
WITHOUT_EXACT_FORCES = ("nts", "nts-lm", "vts-me-lm", "two-pass/nts", "two-pass/nts-ar", "two-pass/nts-lm")
NEEDS_MULTIPLIERS = frozenset({RANK, COMPLEMENTARITY})
NEEDS_SOLUTION = frozenset(
    {"newton.order", "newton.history", "newton.units", "newton.attainable", "hard.zero-load", COMPLEMENTARITY}
)
# Nodal springs have no area. Averaged normals are no stated rule, and decisions of multipliers and of nodes are others.
WITHOUT_RULE = "mortar:normals=averaged"
WITHOUT_PROJECTION: Mapping[str, tuple[str, ...]] = {
    "projection.segment": (WITHOUT_RULE,),
    "projection.place": (WITHOUT_RULE,),
    "projection.activity": (WITHOUT_RULE, "chen-hisada", *WITH_MULTIPLIERS),
    "projection.area": ("nts", "nts-lm", "two-pass/nts", "two-pass/nts-lm"),
}

MARKS = {Verdict.PASS: "✓", Verdict.FAIL: "✗", Verdict.NOT_APPLICABLE: "·"}


def applies(name: str, property_id: str) -> bool:
    """Return whether the property makes sense for the formulation."""
    if property_id in NEEDS_MULTIPLIERS and name not in WITH_MULTIPLIERS:
        return False
    if property_id in NEEDS_SOLUTION and name in NOT_UNIQUE:
        return False
    if property_id == STIFFNESS and (name in WITH_MULTIPLIERS or TANGENT in FAILS[name]):
        return False  # It has no springs, or no exact tangent to solve with.
    if name in WITHOUT_PROJECTION.get(property_id, ()):
        return False
    if property_id == LOCAL and name in WITHOUT_EXACT_FORCES:
        return False
    return not (property_id == RESULTANT and name in WITHOUT_AREA)


def expected_verdict(name: str, property_id: str) -> Verdict:
    """Return the verdict that theory expects."""
    if not applies(name, property_id):
        return Verdict.NOT_APPLICABLE
    fails = FOLLOWS.get(property_id, property_id) in FAILS[name]
    return Verdict.FAIL if fails else Verdict.PASS


def matrix() -> str:
    """Return three tables in Markdown, each with a row for each formulation and a column for each of its properties."""
    return "\n\n".join(_table([name for name in property_ids() if _number_of_table(name) == n]) for n in range(3))


def _number_of_table(property_id: str) -> int:
    """Return the table of a property: hard cases are the last one, and one table of all would be too wide to read."""
    family = property_id.partition(".")[0]
    return 2 if family == "hard" else int(family in ("newton", "projection", "stability", "tangent"))


def _table(ids: list[str]) -> str:
    """Return the table in Markdown of some properties."""
    heads = [property_id.replace(".", ".<br>") for property_id in ids]
    lines = [f"| | {' | '.join(heads)} |", f"|---|{':-:|' * len(ids)}"]
    for name in FAILS:
        marks = [MARKS[expected_verdict(name, property_id)] for property_id in ids]
        lines.append(f"| `{name}` | {' | '.join(marks)} |")
    return "\n".join(lines)


def table_in_readme() -> str:
    """Return the table that the file holds."""
    return README.read_text().partition(BEGIN)[2].partition(END)[0].strip()


def write_table() -> None:
    """Write the table into the file."""
    before, _, rest = README.read_text().partition(BEGIN)
    README.write_text(f"{before}{BEGIN}\n{matrix()}\n{END}{rest.partition(END)[2]}")


if __name__ == "__main__":
    write_table()
