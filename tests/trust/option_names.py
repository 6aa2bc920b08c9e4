"""The names of all built-in formulations with their options, from what the factories say of themselves.

Options and their defaults are those of a factory's signature. The words that an option takes are those that the factory
lists where it refuses another one. So an option that is new is asked about, without a change here.
"""

import re
from functools import cache
from importlib.metadata import entry_points
from inspect import Parameter, signature
from itertools import combinations, product

from contactverif import load_formulation
from contactverif.contract.errors import MisuseError
from contactverif.contract.subject import Subject

COUNTS = range(1, 6)  # The numbers of points on a slave segment.
# Options that change no bit of an answer.
WITHOUT_EFFECT = ("threads",)
SHARES = (0, 0.25)  # The values of options that are parts of a segment.
LOADERS = "contactverif_foreign"  # Its factories load a library, and are nothing without its file.
FACTORIES = {
    entry.name: entry.load()
    for entry in entry_points(group="contactverif.formulations")
    if entry.dist is not None and entry.dist.name == "contactverif" and not entry.module.startswith(LOADERS)
}
WRAPPED = "inner"  # The argument of a factory that wraps another formulation.


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


def options(name: str) -> tuple[str, ...]:
    """Return the options of a factory that may change an answer."""
    parameters = signature(FACTORIES[name]).parameters
    without_effect = ("penalty", WRAPPED, *WITHOUT_EFFECT)
    return tuple(option for option in parameters if option not in without_effect)


def is_wrapper(name: str) -> bool:
    """Return whether a factory wraps another formulation."""
    parameter = signature(FACTORIES[name]).parameters.get(WRAPPED)
    return parameter is not None and parameter.default is Parameter.empty


def variants(name: str, most_options: int) -> list[str]:
    """Return the name of a formulation, and its names with up to so many options that are not the default."""
    names = []
    for n in range(most_options + 1):
        for names_of_options in combinations(options(name), n):
            for words in product(*(values(name, option) for option in names_of_options)):
                text = ",".join(f"{option}={word}" for option, word in zip(names_of_options, words, strict=True))
                names.append(f"{name}:{text}" if text else name)
    return names


def all_variants(most_options: int = 1) -> list[str]:
    """Return the names of all built-in formulations, alone and in wrappers, with up to so many options each."""
    wrappers = [name for name in FACTORIES if is_wrapper(name)]
    inner = [name for name in FACTORIES if name not in wrappers]
    alone = [text for name in inner for text in variants(name, most_options)]
    outer_names = [text for name in wrappers for text in variants(name, most_options)]
    return alone + [f"{outer}/{name}" for outer in outer_names for name in inner if is_plane(name)]


def is_plane(name: str) -> bool:
    """Return whether a formulation takes interfaces in the plane; wrappers are asked with these alone."""
    subject = load_formulation(name)
    return not isinstance(subject, Subject) or subject.traits.abilities.in_plane


def is_pair(name: str) -> bool:
    """Return whether a formulation has two options."""
    return "," in name
