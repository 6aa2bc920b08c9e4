"""The tables of the command `list`: installed formulations with what they state, and installed properties."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from contactverif.cli.console import plain_table
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import OPTIONAL_PARTS, Subject
from contactverif.contract.traits import Traits
from contactverif.isolation.loading import Wrapper

_YES_OR_NO = (  # (trait, statement where it is true, statement where it is false)
    ("passes_normal_patch", "passes with node on node", "fails with node on node"),
    ("passes_single_patch", "passes with nodes on midpoints", "fails with nodes on midpoints"),
    ("covers_overhang", "passes where the slave overhangs", "fails where the slave overhangs"),
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


def formulations_table(formulations: Sequence[Subject | Wrapper | NotLoaded], *, every_trait: bool) -> Table:
    """Return a table of the installed formulations: what each states, or why it does not load."""
    table = plain_table("formulations")
    table.add_column("name", no_wrap=True)
    table.add_column("promises")
    for item in formulations:
        if isinstance(item, NotLoaded):
            table.add_row(item.formulation, Text(f"not loaded: {item.reason}", style="red"))
            continue
        if isinstance(item, Wrapper):
            about = f": {item.summary}" if item.summary else ""
            table.add_row(item.name, f"wraps another, {item.name}/NAME{about}")
            continue
        statements = _statements(item.traits, every_trait) or ["nothing"]
        missing = ", ".join(part for part in OPTIONAL_PARTS if part not in item.provides)
        statements += [f"not provided: {missing}"] if missing else []
        table.add_row(item.name, "; ".join(statements))
    return table


def properties_table(properties: Sequence[Property | NotLoaded]) -> Table:
    """Return a table of the installed properties, with a summary of each."""
    table = plain_table("properties")
    table.add_column("id", no_wrap=True)
    table.add_column("asks")
    for item in properties:
        if isinstance(item, NotLoaded):
            table.add_row(item.formulation, Text(f"not loaded: {item.reason}", style="red"))
        else:
            table.add_row(item.id, item.summary)
    return table


def _statements(traits: Traits, every_trait: bool) -> list[str]:
    """Return what the traits say, in words; the most important ones alone or all of them."""
    statements: list[str] = [] if traits.enforcement == "penalty" else [f"by {traits.enforcement}"]
    if traits.passes_flat_patch is not None:
        statements.append("passes the flat patch test" if traits.passes_flat_patch else "fails the flat patch test")
    if traits.tangent is not None:
        statements.append(f"{traits.tangent} tangent")
    return statements + _further_statements(traits) if every_trait else statements


def _further_statements(traits: Traits) -> list[str]:
    statements = [
        yes if getattr(traits, name) else no for name, yes, no in _YES_OR_NO if getattr(traits, name) is not None
    ]
    statements += [f"{word} {value}" for word, value in (("area", traits.area), ("penalty", traits.penalty)) if value]
    statements += [f"gap by {traits.gap}"] if traits.gap else []
    statements += [f"force along {traits.force_along}"] if traits.force_along else []
    statements += [f"{traits.continuity} when sliding"] if traits.continuity else []
    statements += [f"forces stated on {', '.join(traits.published_forces)}"] if traits.published_forces else []
    return statements + [f"{property_id} fails on {case}" for property_id, case in sorted(traits.witnesses.items())]
