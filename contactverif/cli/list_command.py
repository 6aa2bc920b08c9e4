"""The command `list`: installed formulations with what they state, properties, problems, and engines."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from contactverif.cli.isolation_options import IsolationOptions

if TYPE_CHECKING:
    from contactverif.contract.result import NotLoaded
    from contactverif.contract.subject import Subject
    from contactverif.contract.traits import Traits
    from contactverif.isolation.remote import Wrapper

_YES_OR_NO = (  # (trait, statement where it is true, statement where it is false)
    ("normal", "passes with node on node", "fails with node on node"),
    ("single", "passes with nodes on midpoints", "fails with nodes on midpoints"),
    ("overhang", "passes where the slave overhangs", "fails where the slave overhangs"),
    ("converges", "converges", "does not converge"),
    ("inf_sup", "satisfies inf-sup", "does not satisfy inf-sup"),
    ("locks", "locks", "does not lock"),
    ("integrates_linear_gap", "integrates a linear gap", "does not integrate a linear gap"),
    ("local", "local", "not local"),
    ("unbiased", "unbiased", "biased"),
    ("nodes_push", "nodes push", "nodes may pull"),
    ("independent_multipliers", "independent multipliers", "dependent multipliers"),
    ("conserves_force", "conserves force", "does not conserve force"),
    ("conserves_moment", "conserves moment", "does not conserve moment"),
    ("symmetric", "symmetric", "unsymmetric"),
    ("translation_stable", "stable under translation", "not stable under translation"),
)


def list_installed(
    *,
    traits: Annotated[bool, typer.Option("--traits", help="Show every promise, with its witness.")] = False,
    isolation: IsolationOptions,
) -> None:
    """List the installed formulations with their promises, properties, problems of bench, and engines.

    A promise is what a formulation says of itself; verify checks it. A
    witness is a named case on which a formulation says that it fails.

    \bExit status
      0  listed

    \bExamples
      contactverif list
      contactverif list --traits
    """
    from contactverif.cli.console import plain_table, show
    from contactverif.contract.result import NotLoaded
    from contactverif.contract.subject import Subject
    from contactverif.plugins.registry import describe_engines, load_formulations, load_problems, load_properties

    table = plain_table("formulations", words=("name",))
    table.add_column("in")  # It gives way on a narrow screen, and names do not.
    table.add_column("promises")
    for item in load_formulations(isolation.limits()):
        if isinstance(item, NotLoaded):
            table.add_row(item.formulation, "", _not_loaded(item))
        else:
            dimensions = item.traits.abilities.dimensions if isinstance(item, Subject) else ()
            table.add_row(item.name, _dimensions(dimensions), _promises(item, traits))
    show(table)
    table = plain_table("properties", words=("id",))
    table.add_column("in")
    table.add_column("asks")
    for question in load_properties():
        if isinstance(question, NotLoaded):
            table.add_row(question.formulation, "", _not_loaded(question))
        else:
            table.add_row(
                question.id, _dimensions((2,) if question.cases_in_space is None else (2, 3)), question.summary
            )
    show(table)
    table = plain_table("problems", words=("name",))
    table.add_column("what bench solves")
    for name, problem in load_problems().items():
        table.add_row(name, _not_loaded(problem) if isinstance(problem, NotLoaded) else problem.label)
    show(table)
    table = plain_table("engines", words=("name",))
    table.add_column("what it is")
    for name, words in describe_engines().items():
        table.add_row(name, words)
    show(table)


def _dimensions(dimensions: Iterable[int]) -> str:
    """Return the numbers of coordinates in words, "2-D, 3-D"."""
    return ", ".join(f"{dimension}-D" for dimension in dimensions)


def _not_loaded(item: NotLoaded) -> Text:
    return Text(f"not loaded: {item.reason}", style="red")


def _promises(item: Subject | Wrapper, every_trait: bool) -> str:
    """Return what a formulation states and which parts it leaves out, or what a wrapper does."""
    from contactverif.contract.subject import OPTIONAL_PARTS, Subject

    if not isinstance(item, Subject):
        verbs = {"/NAME": "wraps another", "=PATH": "loads a file", "=KIND": "has kinds"}
        verb = next(words for ending, words in verbs.items() if item.form.endswith(ending))
        return f"{verb}, {item.form}{f': {item.summary}' if item.summary else ''}"
    statements = _statements(item.traits, every_trait) or ["nothing"]
    missing = ", ".join(part for part in OPTIONAL_PARTS if part not in item.provides)
    return "; ".join([*statements, *([f"not provided: {missing}"] if missing else [])])


def _statements(traits: Traits, every_trait: bool) -> list[str]:
    """Return what the traits say, in words; the most important ones alone or all of them."""
    statements: list[str] = [] if traits.rules.enforcement == "penalty" else [f"by {traits.rules.enforcement}"]
    if traits.promises.patch.flat is not None:
        statements.append("passes the flat patch test" if traits.promises.patch.flat else "fails the flat patch test")
    if traits.promises.tangent is not None:
        statements.append(f"{traits.promises.tangent} tangent")
    return statements + _further_statements(traits) if every_trait else statements


def _further_statements(traits: Traits) -> list[str]:
    values = traits.by_name()
    statements = [yes if values[name] else no for name, yes, no in _YES_OR_NO if values[name] is not None]
    for words, value in (
        ("area {}", traits.rules.area),
        ("penalty {}", traits.rules.penalty),
        ("gap by {}", traits.rules.gap),
        ("force along {}", traits.rules.force_along),
        ("{} when sliding", traits.promises.continuity),
        ("forces stated on {}", ", ".join(traits.evidence.published_forces)),
    ):
        statements += [words.format(value)] if value else []
    return statements + [
        f"{property_id} fails on {case}" for property_id, case in sorted(traits.evidence.witnesses.items())
    ]
