"""The names that a report is made of, in one place: groups, dimensions, codes, units.

Rules for the next editor:

- The prose is in `reports/README.md`, and a test compares it with a file.
- Whatever changes the meaning of a file that exists already raises `SCHEMA`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import IntEnum

from contactverif.contract.counterexample import distinct, typeable
from contactverif.contract.property import Verdict

SCHEMA = "3"
READABLE = ("2", SCHEMA)  # A report of schema 2 has no numbers beside the place of what was found.
CONVENTIONS = "CF-1.11 UGRID-1.0"
TITLE = "contactverif: what a verification of contact formulations found"
UNITS_NOTE = (
    "Lengths are written in m and forces, per unit of thickness, in N; read them as any one consistent system of units."
)
ROOT_NOTE = (
    "promises_kept is true if the formulations do all that they state and every property was judged. The attributes "
    f"n_… count pairs of a formulation and a property. {UNITS_NOTE}"
)

SUMMARY, COUNTEREXAMPLES, TIMING, CASE = "summary", "counterexamples", "timing", "case"
NAMED_CASES = "named_cases"  # The group of the named cases that some formulation fails; only some reports have it.
RESERVED = frozenset({SUMMARY, COUNTEREXAMPLES, TIMING, NAMED_CASES})
# Root attributes in which two equal runs may differ.
OFF_THE_RECORD = frozenset(
    {"created", "command", "platform", "blas", "cpu_features", "unproven_outcomes", "isolation", "opened", "libraries"}
)
PARTS = ("pair", "tangent", "contact_points")

LENGTH, PENALTY, RATIO, SECONDS, UNKNOWN = "m", "N m-2", "1", "s", "unknown"
FORCE, STRESS = "N", "N m-1"  # Forces are per unit of thickness.
_PARAMETERS: Mapping[str, str] = {  # {unit: names of parameters}
    LENGTH: "penetration along approach gap offset shift bodies_nodes bodies_imposed bodies_start",
    RATIO: "direction cosine variant probe_segment probe_c ratio stiffness turn bodies_cells bodies_contact "
    "bodies_fixed bodies_count bodies_is_slave bodies_poisson bodies_axis",
    FORCE: "bodies_load",
    STRESS: "pressure bodies_young",
    "m2 N-1": "compliance",
}
PARAMETER_UNITS: Mapping[str, str] = {name: unit for unit, names in _PARAMETERS.items() for name in names.split()}

PENALTY_MEANING = "distributed penalty: force per length of the interface, per length of penetration"
# The numbers of a `CaseSummary`: {attribute: what it is}, and {attribute: (what it is, unit)}.
CASE_COUNTS: Mapping[str, str] = {
    "n_slave_segments": "number of slave segments",
    "n_master_segments": "number of master segments",
}
CASE_REALS: Mapping[str, tuple[str, str]] = {
    "penalty": (PENALTY_MEANING, PENALTY),
    "largest_coordinate": ("largest coordinate, of state and reference", LENGTH),
    "shortest_segment": ("shortest current segment, both sides", LENGTH),
}
# The words of a `Quantity`, {variable: (attribute, what it is, comment)}.
_SYMBOLS = (
    "u: unit roundoff; X, S: largest coordinate, of case and state; ℓ: shortest segment; L, D: length and "
    "diameter of the interface; N: number of segments; g: penetration"
)
QUANTITY: Mapping[str, tuple[str, str, str]] = {
    "quantity": ("name", "name of the measured number", ""),
    "quantity_units": ("unit", "unit of value and tolerance", ""),
    "tolerance_formula": ("tolerance", "formula of the tolerance", _SYMBOLS),
    "tolerance_reason": ("reason", "reason for that formula", ""),
    "sense": ("sense", "relation of value to tolerance in a pass", ""),
}
# The words of a `Finding`, {attribute: (variable, what it is)}.
FINDING: Mapping[str, tuple[str, str]] = {
    "place": ("place", "place of the worst number, such as a row and a column of the tangent"),
    "unit": ("finding_unit", "unit of found and right"),
    "found_name": ("found_name", "what was found at the place"),
    "right_name": ("right_name", "what is right there"),
    "remark": ("finding_remark", "remark about the place"),
}
VERDICTS: Mapping[str, int] = {str(verdict).replace(" ", "_"): int(verdict) for verdict in Verdict}
NONE = "none"  # The value of an attribute without one: some readers drop an attribute that is empty.
NOT_PLANNED = -1  # The verdict behind the last case of a formulation that had fewer cases.
NO_CASE = -1  # The number of a case where there is none.
NOT_MEASURED = 9.969209968386869e36  # netCDF's own fill value for doubles; a NaN in a report was measured.
MEASURED, IDLE, BREACH = 1, 2, 4  # The bits of `state`.
STATES: Mapping[str, int] = {"measured": MEASURED, "no_contact_force": IDLE, "breaks_the_contract": BREACH}


class Promise(IntEnum):
    """The codes of what a formulation states about a property."""

    NO_PROMISE = 0
    PROMISED = 1
    STATED_TO_FAIL = 2

    @classmethod
    def from_promise(cls, promise: bool | None) -> Promise:
        """Return the code of `Row.promise`."""
        return cls.NO_PROMISE if promise is None else cls.PROMISED if promise else cls.STATED_TO_FAIL

    @property
    def promise(self) -> bool | None:
        """The value of `Row.promise`."""
        return None if self is Promise.NO_PROMISE else self is Promise.PROMISED


PROMISES: Mapping[str, int] = {promise.name.lower(): int(promise) for promise in Promise}
PROVIDED: Mapping[str, int] = {"not_provided": 0, "provided": 1}
SIGNS: Mapping[str, int] = {"as_expected": 0, "opposite": 1}
UNSAID = -1  # The code of a part of which the run does not say whether it is provided.
SIDES: Mapping[str, int] = {"slave": 0, "master": 1}


def group_names(property_ids: Iterable[str]) -> dict[str, str]:
    """Return {property id: group}: `patch.flat.transmission` is the group `/patch/flat/transmission`.

    A name that is a folder of others already, or a group of the report itself, gets `_` behind it.
    """
    ids = list(property_ids)
    paths = [tuple(map(typeable, id_.split("."))) for id_ in ids]
    paths = [(f"{path[0]}_" if path[0] in RESERVED else path[0], *path[1:]) for path in paths]
    folders = {path[:n] for path in paths for n in range(1, len(path))}
    names = [f"/{'/'.join(path)}{'_' if path in folders else ''}" for path in paths]
    return dict(zip(ids, distinct(names), strict=True))


def text(words: str) -> str:
    """Return the words as UTF-8 can hold them, without NUL, which would cut a netCDF string short."""
    return words.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")
