"""The table of docs/concepts/promises.md: which trait needs a witness of which property, and names that exist."""

import re
from ast import literal_eval
from itertools import repeat

import pytest
from quotes import DOCS

from contactverif import PatchPromises, Promises, Property, Traits, load_properties
from contactverif.problems.catalogue import load_scene_case
from contactverif.problems.named_states import NAMED, named_case

TEXT = (DOCS / "concepts" / "promises.md").read_text(encoding="utf-8")
BAD = {"locks": True, "tangent": "approximate", "continuity": "jumps"}  # All other traits say it by False.
SAYS = [
    (name, BAD.get(name, False))
    for kind in (PatchPromises, Promises)
    for name in kind.__dataclass_fields__
    if name != "patch"
]


def read_rows() -> dict[str, tuple[list[str], list[str]]]:
    """Return {what the trait says: (properties, names of cases)} of the table."""
    table = TEXT.partition("| the trait says | properties that need a witness | names |")[2].partition("\n\n")[0]
    rows = [[re.findall(r"`(.+?)`", cell) for cell in line.split("|")[1:-1]] for line in table.splitlines()[2:]]
    return {trait[0]: (ids, names) for trait, ids, names in rows}


ROWS = read_rows()


def make_properties() -> dict[str, Property]:
    return {question.id: question for question in load_properties() if isinstance(question, Property)}


@pytest.mark.parametrize(("name", "value"), SAYS)
def test_a_trait_needs_the_witnesses_of_its_row(name: str, value: object) -> None:
    stated = Traits().revise(penalty="distributed", **{name: value})  # Steps are promised of a linear law alone.
    needed = [id_ for id_, question in make_properties().items() if question.promise(stated) is False]
    ids, _ = next(row for says, row in ROWS.items() if says == f"{name}={value!r}".replace("'", '"'))
    assert ids == sorted(needed)


def test_the_table_has_no_other_rows() -> None:
    stated = {(name, literal_eval(value)) for name, value in (says.split("=") for says in ROWS)}
    assert stated == set(SAYS)


@pytest.mark.parametrize("says", ROWS)
def test_each_name_is_that_of_a_case(says: str) -> None:
    ids, names = ROWS[says]
    assert len(names) in (1, len(ids))
    for id_, name in zip(ids, names if len(names) > 1 else repeat(names[0]), strict=len(names) > 1):
        question = make_properties()[id_]
        listed = question.cases(None)
        if isinstance(listed, tuple) and any(case.name == name for case in listed):
            continue
        assert (load_scene_case if question.bodies else named_case)(name)


def test_the_list_of_names_is_whole() -> None:
    line = next(line for line in TEXT.splitlines() if line.startswith("- properties on interfaces: "))
    names = set(re.findall(r"`(.+?)`", line)) - {"-swapped"}
    assert names == {name.removesuffix("-swapped") for name in NAMED}
