"""The work of `list`: installed formulations with what they state, properties, problems, and engines."""

from __future__ import annotations

from rich.text import Text

from contactverif.cli.console import show
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import OPTIONAL_PARTS, Subject
from contactverif.contract.traits import Traits
from contactverif.isolation.remote import Wrapper
from contactverif.plugins.registry import describe_engines, load_formulations, load_problems, load_properties
from contactverif.run.run_options import RunOptions
from contactverif_reports.tables import Column, Table

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


def list_installed(options: RunOptions, traits: bool) -> None:
    """Show four tables; of the traits the most important ones or all."""
    table = _table("formulations", "name", "in", "promises")
    for item in load_formulations(options.limits()):
        if isinstance(item, NotLoaded):
            table.add(item.formulation, "", _not_loaded(item))
        else:
            dimensions = item.traits.abilities.dimensions if isinstance(item, Subject) else ()
            table.add(item.name, ", ".join(f"{each}-D" for each in dimensions), _promises(item, every_trait=traits))
    show(table.terminal())
    table = _table("properties", "id", "in", "asks")
    for question in load_properties():
        if isinstance(question, NotLoaded):
            table.add(question.formulation, "", _not_loaded(question))
        else:
            table.add(question.id, "2-D" if question.cases_in_space is None else "2-D, 3-D", question.summary)
    show(table.terminal())
    table = _table("problems", "name", "what bench solves")
    for name, problem in load_problems().items():
        table.add(name, _not_loaded(problem) if isinstance(problem, NotLoaded) else problem.label)
    show(table.terminal())
    table = _table("engines", "name", "what it is")
    for name, words in describe_engines().items():
        table.add(name, words)
    show(table.terminal())


def _table(title: str, name: str, *heads: str) -> Table:
    """Return a table of which all columns but the first give way on a narrow screen."""
    return Table([Column(name), *(Column(head, wrap=True) for head in heads)], title)


def _not_loaded(item: NotLoaded) -> Text:
    return Text(f"not loaded: {item.reason}", style="red")


def _promises(item: Subject | Wrapper, every_trait: bool) -> str:
    if not isinstance(item, Subject):
        verbs = {"/NAME": "wraps another", "=PATH": "loads a file", "=KIND": "has kinds"}
        verb = next(words for ending, words in verbs.items() if item.form.endswith(ending))
        return f"{verb}, {item.form}{f': {item.summary}' if item.summary else ''}"
    statements = _statements(item.traits, every_trait) or ["nothing"]
    missing = ", ".join(part for part in OPTIONAL_PARTS if part not in item.provides)
    return "; ".join([*statements, *([f"not provided: {missing}"] if missing else [])])


def _statements(traits: Traits, every_trait: bool) -> list[str]:
    statements: list[str] = [] if traits.rules.enforcement == "penalty" else [f"by {traits.rules.enforcement}"]
    if traits.promises.patch.flat is not None:
        statements.append("passes the flat patch test" if traits.promises.patch.flat else "fails the flat patch test")
    if traits.promises.tangent is not None:
        statements.append(f"{traits.promises.tangent} tangent")
    if not every_trait:
        return statements
    values = traits.by_name()
    statements += [yes if values[name] else no for name, yes, no in _YES_OR_NO if values[name] is not None]
    for words, value in (
        ("area {}", traits.rules.area),
        ("penalty {}", traits.rules.penalty),
        ("gap by {}", traits.rules.gap),
        ("force along {}", traits.rules.force_along),
        ("{} when sliding", traits.promises.continuity),
        ("forces stated on {}", ", ".join(traits.evidence.published_forces)),
    ):
        statements += [words.format(value)] if value else []
    witnesses = sorted(traits.evidence.witnesses.items())
    return statements + [f"{property_id} fails on {case}" for property_id, case in witnesses]
