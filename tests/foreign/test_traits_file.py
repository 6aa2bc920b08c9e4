"""Traits in TOML: where they stand, and what is said of wrong ones."""

from pathlib import Path

import pytest

from contactverif import MisuseError, Traits
from contactverif_foreign.shared_library import parse_traits_text, traits_beside


def test_groups_and_a_flat_list_say_the_same() -> None:
    grouped = "[promises]\nsymmetric = true\n[promises.patch]\nflat = false\n[rules]\npenalty = 'nodal'\n"
    flat = "symmetric = true\nflat = false\npenalty = 'nodal'\n"
    evidence = "[evidence]\nsource = 'here'\n[evidence.witnesses]\npatch = 'a1'\n"
    assert parse_traits_text(grouped, "text") == parse_traits_text(flat, "text")
    assert parse_traits_text(grouped, "text") == Traits().revise(symmetric=True, flat=False, penalty="nodal")
    assert parse_traits_text(evidence, "text").witness("patch.flat.solve") == "a1"


def test_a_chosen_file_comes_before_one_beside_the_library_and_that_before_the_project(tmp_path: Path) -> None:
    library = tmp_path / "build" / "mine.so"
    library.parent.mkdir()
    assert traits_beside(library) == Traits()
    (tmp_path / "pyproject.toml").write_text("[tool.contactverif.traits.mine]\narea = 'current'\n")
    assert traits_beside(library).rules.area == "current"
    library.with_suffix(".toml").write_text("area = 'reference'\n")
    assert traits_beside(library).rules.area == "reference"
    explicit = tmp_path / "chosen.toml"
    explicit.write_text("penalty = 'nodal'\n")
    assert traits_beside(library, str(explicit)).rules.penalty == "nodal"
    assert traits_beside(library, str(explicit)).rules.area is None


def test_a_project_without_such_a_table_promises_nothing(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text("[tool.contactverif]\nprofile = 'ci'\n")
    assert traits_beside(tmp_path / "mine.so") == Traits()


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("symmetric-tangent = true", ["'symmetric-tangent'", "nearest: symmetric"]),
        ("symmetric = 'yes'", ["symmetric", "'yes'", "True, False, None"]),
        ("batched = true", ["'batched'"]),
        ("witnesses = 'a1'", ["witnesses", "a str"]),
        ("promises = 3", ["'promises'"]),
        ("symmetric", ["needed TOML"]),
    ],
)
def test_a_wrong_trait_is_one_line_with_its_place(text: str, parts: list[str]) -> None:
    with pytest.raises(MisuseError) as error:
        parse_traits_text(text, "mine.toml")
    assert str(error.value).startswith("mine.toml: found ")
    assert "\n" not in str(error.value)
    for part in parts:
        assert part in str(error.value)
