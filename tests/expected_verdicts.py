"""The verdict that theory expects for each formulation and property; `properties/README.md` shows it in a table.

`python tests/expected_verdicts.py` writes that table anew, and those of all properties. `test_verdicts.py` compares the
table of verdicts with what the harness finds, and both with the file. Rule for the next editor: change an entry only
with a reason from theory, never because a run differs.
"""

from collections.abc import Mapping
from pathlib import Path

from contactverif.contract.property import Property, Verdict
from contactverif.plugins.registry import load_properties, property_ids

README = Path(__file__).parents[1] / "properties" / "README.md"

FLAT = "patch.flat.transmission"
RESULTANT, RANK, DEAD_ZONE = "patch.flat.resultant", "multipliers.rank", "patch.dead-zone"
COMPLEMENTARITY = "complementarity"
NORMAL, SINGLE = "patch.flat.normal", "patch.flat.single"
NODAL, PUBLISHED = "patch.flat.nodal", "patch.flat.published"
SYMMETRIC, SWAP, CONTINUITY = "symmetric", "swap", "continuity"
CURVED, KINKED, ARC = "patch.curved", "patch.kinked", "accuracy.arc"
HERTZ = "accuracy.hertz"
TILTED, LINEAR = "patch.tilted.resultant", "patch.tilted.nodal"
WEIGHTED, OPEN_END = "patch.tilted.weighted", "unilateral.overhang"
NODAL_PUSH = "nodal-push"
LOCAL, STIFFNESS = "stability.local", "stability.stiffness"
INF_SUP, LOCKING = "stability.inf-sup", "stability.locking"
WAVY, CURVED_WAVE = "accuracy.wavy", "accuracy.wavy-curved"
FORCE, MOMENT, TANGENT = "balance.force", "balance.moment", "tangent.directional"
SOLVED = frozenset({"patch.flat.solve", "patch.variants"})
PATCHES = frozenset({FLAT, DEAD_ZONE, KINKED}) | SOLVED
INEXACT = frozenset({TANGENT, "tangent.sparsity", "tangent.long", "newton.order", "newton.history"})
PRINTED = frozenset({FORCE, MOMENT, DEAD_ZONE})

# The properties that each formulation fails. It passes all others that apply.
FAILS: Mapping[str, frozenset[str]] = {
    "nts": PATCHES | {NORMAL, SINGLE},
    "nts-ar": PATCHES | {SINGLE},
    "nts-ar:area=reference": PATCHES | {SINGLE},
    "vts-g": PATCHES | {SINGLE},
    "vts-g:n=3": PATCHES | {SINGLE},
    "vts-me": PATCHES,
    "vts-me:n=4": PATCHES,
    "vts-ppt": PRINTED,
    "vts-ppt-basic": PRINTED | INEXACT,
    "vts-ppt-balanced": frozenset(),
    "nts-lm": PATCHES | {SINGLE},
    "vts-me-lm": PATCHES | {RANK},
    "vts-ppt-lm": PRINTED | {RANK},
    "two-pass/nts": PATCHES | {NORMAL, SINGLE},
    "two-pass/nts-ar": PATCHES | {NORMAL, SINGLE},
    "two-pass/nts-lm": frozenset({RANK}),
    "sts": frozenset(),
    "mortar": frozenset(),
    "mortar:normals=averaged": frozenset({KINKED}),
    "mortar-dual": frozenset({NODAL_PUSH}) | frozenset(),
    "mortar-lm": frozenset(),
    "mortar-dual-lm": frozenset({NODAL_PUSH}) | frozenset(),
    "mortar-two-half-pass": frozenset({FORCE, MOMENT}),
    "chen-hisada": frozenset({DEAD_ZONE}),
}

# What many fail, by property.
HALF_PASSES = "mortar-two-half-pass"
AREAS_THAT_STRETCH = ("nts-ar", "vts-g", "vts-g:n=3", "vts-me", "vts-me:n=4", "vts-me-lm", "two-pass/nts-ar")
VTS_PPT = ("vts-ppt", "vts-ppt-basic", "vts-ppt-balanced", "vts-ppt-lm")
MORTARS = ("mortar", "mortar:normals=averaged", "mortar-dual", "mortar-lm", "mortar-dual-lm")
NOT_CONVERGENT = (
    "nts", "nts-ar", "nts-ar:area=reference", "nts-lm", "vts-g", "vts-g:n=3", "vts-me", "vts-me:n=4",
    "two-pass/nts", "two-pass/nts-ar",
)  # fmt: skip
FAILED_BY: Mapping[str, frozenset[str]] = {
    WAVY: frozenset(NOT_CONVERGENT),
    CURVED_WAVE: frozenset({*NOT_CONVERGENT, *VTS_PPT[:3], "sts", "mortar-two-half-pass"}),
    LINEAR: frozenset(
        {"nts-ar", "nts-ar:area=reference", "vts-me", "vts-me:n=4", *VTS_PPT[:3], "mortar", "mortar-dual"}
    ),
    OPEN_END: frozenset({"mortar-dual", "mortar-dual-lm"}),  # Dual shapes extrapolate the gap.
    SYMMETRIC: frozenset({*AREAS_THAT_STRETCH, *VTS_PPT, *MORTARS, HALF_PASSES, "sts", "chen-hisada"}),
    INF_SUP: frozenset({"vts-me-lm", "vts-ppt-lm", "two-pass/nts-lm"}),
    LOCKING: frozenset(
        {
            *("vts-g", "vts-g:n=3", "vts-me", "vts-me:n=4", *VTS_PPT[:3], "sts"),
            *("two-pass/nts", "two-pass/nts-ar", "mortar-two-half-pass"),
        }
    ),
    CONTINUITY: frozenset({"nts", "nts-ar:area=reference", *AREAS_THAT_STRETCH, *VTS_PPT, "two-pass/nts"}),
    # Where surfaces are not parallel, both half passes push with different forces: the more, the stiffer they are.
    HERTZ: frozenset({*(name for name, fails in FAILS.items() if FLAT in fails), "mortar-two-half-pass"}),
    SWAP: frozenset(name for name in FAILS if not name.startswith("two-pass/") and name != HALF_PASSES),
}

# Properties that follow from one with random cases: whoever fails that one fails these. Hard cases need no statement.
FOLLOWS = {
    **{f"{name}.solve": name for name in (NORMAL, SINGLE)},
    **dict.fromkeys(("hard.c", "hard.contrast", "hard.short-segment", "hard.stiff"), FLAT),
    "hard.dead-zone": DEAD_ZONE,
}

# Formulations that a property cannot judge: nodal springs have no area, and springs that act twice have no total.
WITHOUT_AREA = ("nts", "nts-lm", "two-pass/nts", "two-pass/nts-ar", "two-pass/nts-lm")
WITH_MULTIPLIERS = ("nts-lm", "vts-me-lm", "vts-ppt-lm", "two-pass/nts-lm", "mortar-lm", "mortar-dual-lm")
# With redundant multipliers Newton has no limit. `vts-ppt-lm:n=1` has one, and fails `accuracy.wavy` on a finer slave:
# its inf-sup constant falls as h, so pressures need not converge. `tests/properties/test_accuracy_wavy.py` asks it.
NOT_UNIQUE = ("vts-me-lm", "vts-ppt-lm", "two-pass/nts-lm")
# These state neither an area nor pressures that pass the patch test, and a compiled kernel takes no long double. So no
# exact force of theirs is known.
WITHOUT_EXACT_FORCES = ("nts", "nts-lm", "vts-me-lm", "two-pass/nts", "two-pass/nts-ar", "two-pass/nts-lm")
# Averaged normals are no stated direction, and two passes push along the normals of both sides.
WITHOUT_DIRECTION = ("two-pass/nts", "two-pass/nts-ar", "two-pass/nts-lm", "mortar:normals=averaged")
NEEDS_MULTIPLIERS = frozenset({RANK, COMPLEMENTARITY, INF_SUP})
NEEDS_SOLUTION = frozenset(
    {
        "newton.order",
        "newton.history",
        "newton.units",
        "newton.attainable",
        "hard.zero-load",
        LOCKING,
        COMPLEMENTARITY,
        HERTZ,
        WAVY,
        CURVED_WAVE,
    }
)
# Nodal springs have no area. Some state no rule of projection, and decisions of multipliers and of nodes are others.
WITHOUT_RULE = ("mortar:normals=averaged", "mortar-two-half-pass")
WITHOUT_PROJECTION: Mapping[str, tuple[str, ...]] = {
    "projection.segment": WITHOUT_RULE,
    "projection.place": WITHOUT_RULE,
    "projection.activity": (*WITHOUT_RULE, "chen-hisada", *WITH_MULTIPLIERS),
    "projection.area": ("nts", "nts-lm", "two-pass/nts", "two-pass/nts-lm"),
}

NODAL_SPRINGS = ("nts", "two-pass/nts")
# Gauss points and four points a segment have no tables in the paper, and the others have no wrong forces to state.
WITHOUT_TABLE = (
    *("vts-g", "vts-g:n=3", "vts-me:n=4", "sts", "mortar", "mortar:normals=averaged", "mortar-dual"),
    *("mortar-lm", "mortar-dual-lm", "mortar-two-half-pass", "chen-hisada"),
)

# What nobody states: two half passes converge where surfaces are parallel or springs are soft, and not elsewhere.
# Nor on a kink with stiff springs. VTS-PPT continues a segment where a walk stops before one that is seen edge-on, and
# may pull; random cases have no such step.
UNSTATED = frozenset(
    {*((HALF_PASSES, name) for name in (HERTZ, WAVY, KINKED)), *((name, NODAL_PUSH) for name in VTS_PPT)}
)

MARKS = {Verdict.PASS: "✓", Verdict.FAIL: "✗", Verdict.NOT_APPLICABLE: "·"}


# The formulations that a property cannot judge. Where a reason is not plain from the name, it stands beside it.
WITHOUT_INTEGRAL = (*WITHOUT_DIRECTION, "nts", HALF_PASSES, *WITH_MULTIPLIERS)  # No integral of a linear gap is stated.
# Nodal multipliers have no area, but the pressure of shrunk rings without springs needs none.
WITHOUT_RINGS = tuple(name for name in (*WITHOUT_AREA, *NOT_UNIQUE) if name != "nts-lm")
CANNOT_JUDGE: Mapping[str, frozenset[str]] = {
    **{property_id: frozenset(NOT_UNIQUE) for property_id in NEEDS_SOLUTION},
    **{property_id: FAILS.keys() - WITH_MULTIPLIERS for property_id in NEEDS_MULTIPLIERS},
    **{property_id: frozenset(names) for property_id, names in WITHOUT_PROJECTION.items()},
    COMPLEMENTARITY: FAILS.keys() - WITH_MULTIPLIERS | frozenset(NOT_UNIQUE),
    # These have no springs, or no exact tangent to solve with.
    STIFFNESS: frozenset({*WITH_MULTIPLIERS, *(name for name, fails in FAILS.items() if TANGENT in fails)}),
    TILTED: frozenset(WITHOUT_DIRECTION),
    LINEAR: frozenset(WITHOUT_INTEGRAL),
    WEIGHTED: FAILS.keys() - set(MORTARS) | {"mortar:normals=averaged"},
    NODAL: FAILS.keys() - NODAL_SPRINGS,
    "intersection-free": FAILS.keys(),  # None of them is a barrier.
    PUBLISHED: frozenset(WITHOUT_TABLE),
    # Multipliers solve nothing on the way, and averaged normals and half passes state nothing.
    CONTINUITY: frozenset({*WITH_MULTIPLIERS, *WITHOUT_RULE}),
    LOCAL: frozenset(WITHOUT_EXACT_FORCES),
    CURVED: frozenset(WITHOUT_RINGS),
    RESULTANT: frozenset(WITHOUT_AREA),
    "total-stiffness": frozenset(WITH_MULTIPLIERS),
    ARC: frozenset(WITHOUT_AREA),
}


def applies(name: str, property_id: str) -> bool:
    """Return whether the property makes sense for the formulation."""
    return name not in CANNOT_JUDGE.get(property_id, ())


def expected_verdict(name: str, property_id: str) -> Verdict:
    """Return the verdict that theory expects."""
    if not applies(name, property_id):
        return Verdict.NOT_APPLICABLE
    fails = FOLLOWS.get(property_id, property_id) in FAILS[name] or name in FAILED_BY.get(property_id, ())
    return Verdict.FAIL if fails else Verdict.PASS


def matrix() -> str:
    """Return two tables in Markdown: a row for each formulation, a column for each property that one of them fails."""
    failed = [name for name in property_ids() if any(expected_verdict(each, name) is Verdict.FAIL for each in FAILS)]
    ids = [name for name in failed if name not in FOLLOWS]
    patch = [name for name in ids if name.startswith("patch.")]
    return "\n\n".join(_table(names) for names in (patch, [name for name in ids if name not in patch]))


def _table(ids: list[str]) -> str:
    heads = [property_id.replace(".", ".<br>") for property_id in ids]
    lines = [f"| | {' | '.join(heads)} |", f"|---|{':-:|' * len(ids)}"]
    for name in FAILS:
        marks = [MARKS[expected_verdict(name, property_id)] for property_id in ids]
        lines.append(f"| `{name}` | {' | '.join(marks)} |")
    return "\n".join(lines)


def properties() -> str:
    """Return a table in Markdown for each family: the summary of each property, and the first of its tolerances."""
    families: dict[str, list[str]] = {}
    for prop in load_properties():
        assert isinstance(prop, Property)
        cells = (f"`{prop.id}`", prop.summary, prop.quantities[0].tolerance)
        families.setdefault(prop.family, []).append(
            f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
        )
    head = "| property | what holds | tolerance |\n|---|---|---|"
    return "\n\n".join("\n".join([f"### {name.capitalize()}\n\n{head}", *rows]) for name, rows in families.items())


TABLES = {"properties": properties, "verdicts": matrix}


def in_readme(name: str) -> str:
    """Return the tables of a name that the file holds."""
    return README.read_text().partition(f"<!-- {name}: begin -->")[2].partition(f"<!-- {name}: end -->")[0].strip()


def write_tables() -> None:
    """Write all tables into the file."""
    for name, make in TABLES.items():
        before, begin, rest = README.read_text().partition(f"<!-- {name}: begin -->")
        _, end, after = rest.partition(f"<!-- {name}: end -->")
        README.write_text(f"{before}{begin}\n{make()}\n{end}{after}")


if __name__ == "__main__":
    write_tables()
