"""Ask formulations that are right everything, and keep the cases that accuse one of them.

`tox -e trust` writes into `reports/trust`: `campaign.csv`, a line for each seed and property with random cases;
`strangers.csv`, one for each seed and right formulation of `zoo.right`, with all named cases in the first seed;
`options.csv`, one for each built-in formulation with up to two options; `faces.csv`, one for each formulation on faces
and property. An accusation is a failure of what a formulation promises, a crash, or a breach of the contract. Options
and their words are read from the factories themselves, so that a new option is asked without a change here.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import entry_points
from inspect import Parameter, signature
from itertools import combinations, product

from every_formulation import FORMULATIONS
from expected_verdicts import FAILS
from planned_cases import draw_cases
from tables import fill_all
from zoo.killing import properties
from zoo.right import STRANGERS

from contactverif import Case, Property, Row, Subject, Verdict, judge_case, load_formulation
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import checked_numbers
from contactverif.run.run import run

CAMPAIGN, STRANGERS_FILE, OPTIONS, FACES = "campaign.csv", "strangers.csv", "options.csv", "faces.csv"
EXAMPLES = {1: 60, 2: 30}  # {seed: random cases of each property and built-in formulation}
SOLVED = 5 / 12  # The share of these cases where bodies are solved.
NUMBERS = ("cases", "accusations", "undecided", "idle", "nearest")


@dataclass
class Count:
    """The outcomes of some cases, and the number nearest to its tolerance in one that passes, where it must."""

    cases: int = 0
    undecided: int = 0
    idle: int = 0
    nearest: float = 0.0
    closest: tuple[str, str] = ("", "")  # The formulation and the property of that number.
    accused: list[str] = field(default_factory=list)

    def ask(self, question: Property, cases: Sequence[Case], subject: Subject) -> None:
        """Judge the cases, if the property makes sense for the formulation."""
        if question.refusal_of(subject) or question.needs - subject.provides:
            return
        promised = question.promise(subject.traits) is True
        for number, case in enumerate(cases, 1):
            outcome = judge_case(question, case, subject)
            self.cases += 1
            self.undecided += outcome.verdict is Verdict.UNDECIDED
            self.idle += outcome.measurement is not None and outcome.measurement.idle
            if outcome.verdict is Verdict.CRASHED or outcome.breach or (promised and outcome.verdict is Verdict.FAIL):
                self.accused.append(f"{subject.name}, {question.id}, case {number}: {outcome.reason}")
            if promised and outcome.verdict is Verdict.PASS:
                ratios = [number.ratio for number in checked_numbers(question.info, outcome.measurement)]
                if max(ratios, default=0.0) > self.nearest:
                    self.nearest, self.closest = max(ratios), (subject.name, question.id)

    @property
    def numbers(self) -> list[str]:
        """The cells of a table, by `NUMBERS`."""
        counts = (self.cases, len(self.accused), self.undecided, self.idle)
        return [*map(str, counts), f"{self.nearest:.3g}"]


@cache
def right_formulations() -> tuple[Subject, ...]:
    """Return the built-in formulations with their options, and the right ones of `zoo.right`."""
    built_in = [load_formulation(name) for name in sorted({*FAILS, *FORMULATIONS})]
    strangers = [Subject(f"stranger: {name}", make) for name, make in STRANGERS.items()]
    return (*(subject for subject in built_in if isinstance(subject, Subject)), *strangers)


def random_cases(question: Property, seed: str, examples: int) -> tuple[Case, ...]:
    """Return random cases of a property; of those that solve bodies, a share."""
    count = round(examples * (SOLVED if question.bodies else 1))
    return draw_cases(question.cases(None), seed=seed, examples=count).cases


def has_random_cases(question: Property) -> bool:
    return not isinstance(question.cases(None), tuple)


def count_property(key: str) -> list[str]:
    """Return the cells of a line, whose key is the seed of a run's cases, such as "1/mirror"."""
    seed, _, name = key.partition("/")
    question = properties()[name]
    cases, total, n_formulations = random_cases(question, key, EXAMPLES[int(seed)]), Count(), 0
    for subject in right_formulations():
        before = total.cases
        total.ask(question, cases, subject)
        n_formulations += total.cases > before
    return [*total.numbers, total.closest[0], str(n_formulations), "; ".join(total.accused)]


# Right formulations of `zoo.right`. Where one states nothing of a property, only a crash or a breach can accuse it:
# where bodies are solved, such a property is asked with every tenth case.
SEEDS, EXAMPLES_STRANGERS, UNSTATED = (1, 2, 3), 300, 10


def count_stranger(key: str) -> list[str]:
    """Return the cells of a line, whose key is a seed and a formulation, such as "1/nodal least squares"."""
    seed, _, name = key.partition("/")
    total, subject = Count(), Subject(name, STRANGERS[name])
    for question in properties().values():
        part = UNSTATED if question.bodies and question.promise(subject.traits) is not True else 1
        listed = question.cases(None)
        if not isinstance(listed, tuple):
            total.ask(question, random_cases(question, f"{seed}/{question.id}", EXAMPLES_STRANGERS // part), subject)
        elif int(seed) == SEEDS[0]:
            total.ask(question, listed[::part], subject)
    return [*total.numbers, total.closest[1], "; ".join(total.accused)]


# Formulations on faces.
ON_FACES = ("sts-3d", "mortar-3d", "vts-cell-3d", "vts-ppt-3d", "vts-ppt-balanced-3d", "nts-3d", "nts-ar-3d")
# Random cases of each property and formulation, and where bodies are solved. A list of cases is asked once.
EXAMPLES_FACES, EXAMPLES_IN_SPACE = 700, 300


@cache
def face_cases(question: Property) -> tuple[Case, ...]:
    """Return the cases of a variant of a property."""
    examples = EXAMPLES_IN_SPACE if question.bodies else EXAMPLES_FACES
    return draw_cases(question.cases(None), seed=f"faces/{question.id}", examples=examples).cases


def count_on_faces(key: str) -> list[str]:
    """Return the cells of a line, whose key is a formulation and a property, such as "sts-3d/mirror"."""
    name, _, property_id = key.partition("/")
    subject, total = load_formulation(name), Count()
    assert isinstance(subject, Subject)
    question = properties(True)[property_id].for_traits(subject.traits)
    total.ask(question, face_cases(question), subject)
    return [*total.numbers, "; ".join(total.accused)]


# Options of built-in formulations. The words that an option takes are those that the factory lists where it refuses
# another one.
COUNTS = range(1, 6)  # The numbers of points on a slave segment.
SHARES = (0, 0.25)  # The values of options that are parts of a segment.
WRAPPED = "inner"  # The argument of a factory that wraps another formulation.
NO_OPTIONS = ("penalty", WRAPPED, "threads")  # The last one changes no bit of an answer.
LOADERS = "contactverif_foreign"  # Its factories load a library, and are nothing without its file.
FACTORIES = {
    entry.name: entry.load()
    for entry in entry_points(group="contactverif.formulations")
    if entry.dist is not None and entry.dist.name == "contactverif" and not entry.module.startswith(LOADERS)
}
SEED, EXAMPLES_OPTIONS, EXAMPLES_SOLVED = 1, 12, 4
# Properties that solve many scenes each: two options at a time are asked without them.
SLOW = ("accuracy.hertz", "accuracy.wavy", "accuracy.wavy-curved", "patch.curved", "hard.touch", "tangent.long")


@cache
def values(name: str, option: str) -> tuple[str, ...]:
    """Return the values of an option to ask about, without its default."""
    default = signature(FACTORIES[name]).parameters[option].default
    if isinstance(default, str):
        try:
            load_formulation(f"{name}:{option}=?")
        except MisuseError as error:
            words = re.findall(r"'([\w-]+)'", str(error).partition("needed")[2])
            return tuple(word for word in words if word != default)
        raise AssertionError(f"{name} takes any word for {option}")
    numbers = COUNTS if isinstance(default, int) else SHARES
    return tuple(str(number) for number in numbers if number != default and takes(f"{name}:{option}={number}"))


def takes(text: str) -> bool:
    """Return whether a factory takes the option with which a name ends."""
    try:
        load_formulation(text)
    except MisuseError:
        return False
    return True


def variants(name: str, most_options: int) -> list[str]:
    """Return the name of a formulation, and its names with up to so many options that are not the default."""
    options = [option for option in signature(FACTORIES[name]).parameters if option not in NO_OPTIONS]
    names = []
    for n in range(most_options + 1):
        for selection in combinations(options, n):
            for words in product(*(values(name, option) for option in selection)):
                text = ",".join(f"{option}={word}" for option, word in zip(selection, words, strict=True))
                names.append(f"{name}:{text}" if text else name)
    return names


def all_variants(most_options: int = 1) -> list[str]:
    """Return the names of all built-in formulations, alone and in wrappers, with up to so many options each.

    Wrappers are asked with formulations in the plane alone.
    """
    parameters = {name: signature(make).parameters.get(WRAPPED) for name, make in FACTORIES.items()}
    wrappers = [name for name, inner in parameters.items() if inner is not None and inner.default is Parameter.empty]
    inner = {name: load_formulation(name) for name in FACTORIES if name not in wrappers}
    plane = [name for name, it in inner.items() if not isinstance(it, Subject) or it.traits.abilities.in_plane]
    alone = [text for name in inner for text in variants(name, most_options)]
    outer_names = [text for name in wrappers for text in variants(name, most_options)]
    return alone + [f"{outer}/{name}" for outer in outer_names for name in plane]


def is_pair(name: str) -> bool:
    """Return whether a formulation has two options."""
    return "," in name


def ask_options(name: str) -> list[str]:
    """Return the cells of a formulation: counts of properties, cases, undecided cases and accusations; texts.

    An accusation is what makes `contactverif verify` fail. Where too few cases could be judged, the property stands in
    a column of its own.
    """
    subject = load_formulation(name)
    assert isinstance(subject, Subject), subject
    apt = [question for question in properties().values() if not (is_pair(name) and question.id in SLOW)]
    rows: list[Row] = []
    for solved, examples in ((False, EXAMPLES_OPTIONS), (True, EXAMPLES_SOLVED)):
        of_kind = [question for question in apt if question.bodies == solved]
        rows += run([subject], of_kind, examples=examples, seed=SEED, shrink="none").rows
    rows = [row for row in rows if row.verdict is not Verdict.NOT_APPLICABLE]
    accused = [
        f"{row.property_id}: {row.unexpected}: {row.reason}"
        for row in rows
        if row.unexpected and row.verdict is not Verdict.NOT_JUDGED
    ]
    open_rows = [f"{row.property_id}: {row.reason}" for row in rows if row.verdict is Verdict.NOT_JUDGED]
    numbers = len(rows), sum(len(row.outcomes) for row in rows), sum(row.undecided for row in rows), len(accused)
    return [*map(str, numbers), "; ".join(accused), "; ".join(open_rows)]


if __name__ == "__main__":
    random = [name for name, question in properties().items() if has_random_cases(question)]
    fill_all(
        (CAMPAIGN, ("seed/property", *NUMBERS, "formulation", "formulations", "accused"), count_property,
         [f"{seed}/{name}" for seed in EXAMPLES for name in random]),
        (STRANGERS_FILE, ("seed/formulation", *NUMBERS, "property", "accused"), count_stranger,
         [f"{seed}/{name}" for seed in SEEDS for name in STRANGERS]),
        (OPTIONS, ("formulation", "asked", "cases", "undecided", "accusations", "accused", "not judged"), ask_options,
         sorted(all_variants(2), key=is_pair)),
        (FACES, ("formulation/property", *NUMBERS, "accused"), count_on_faces,
         [f"{name}/{property_id}" for name in ON_FACES for property_id in properties(True)]),
    )  # fmt: skip
