"""The function `verify` of scripts and notebooks: it takes what a person has at hand, and runs the properties on it.

Rule: what cannot be judged is a MisuseError that names the argument. No run is empty without a word.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import fields
from typing import Any

from contactverif.api.report import Report
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.formulation import ResidualOnly
from contactverif.contract.interface import Interface
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.isolation.host import end_all
from contactverif.isolation.limits import Limits
from contactverif.plugins.registry import load_formulation, load_properties
from contactverif.run.run import run
from contactverif.run.run_options import Isolation, Profile, RunOptions, Shrink
from contactverif.run.scheduler import Progress

_FORMULATIONS = "a name, a class or factory make(*, penalty), an instance with `residual`, a Subject, or a list"
_PROPERTIES = "an id or a pattern such as 'patch.*', a Property, a list of these, or None for all"
FormulationLike = str | Subject | NotLoaded | ResidualOnly | Callable[..., Any]
PropertyLike = str | Property | NotLoaded


def verify(
    formulations: FormulationLike | Iterable[FormulationLike],
    properties: PropertyLike | Iterable[PropertyLike] | None = None,
    *,
    profile: Profile | str = "dev",
    examples: int | None = None,
    seed: int | None = None,
    place: Interface | Case | None = None,
    known: Mapping[str, str] | None = None,
    shrink: Shrink = "new",
    progress: Callable[[Progress], None] | None = None,
    executor: Executor | None = None,
    keep_going: bool = True,
    isolation: str | None = None,
) -> Report:
    """Check properties of formulations, and return what fails.

    A registered name runs where it does on the command line: in a box, or in a process of its own. A class, factory,
    instance or `Subject` of the session runs in this process, without limits of time or memory.

    Parameters
    ----------
    formulations : FormulationLike | Iterable[FormulationLike]
        A name as on the command line, such as ``"vts-me:n=4"``; a class or another factory ``make(*, penalty)``; an
        instance; a `Subject`; or a list of these. The harness chooses the penalty of each case, so an instance is made
        anew by its class, whose other arguments are the attributes of the same names.
    properties : PropertyLike | Iterable[PropertyLike] | None
        Ids or patterns such as ``"patch.*"``, `Property` objects, or a list of these; None for all that are installed.
    profile : Profile | str
        The numbers of cases and the seed: ``"dev"``, ``"ci"`` or ``"nightly"``.
    examples, seed : int | None
        Numbers that overrule those of the profile.
    place : Interface | Case | None
        Check everything on this interface, with random states, or on this scene, instead of on random interfaces.
    known : Mapping[str, str] | None
        {property id: reason why its failure is known}.
    shrink : Shrink
        The failures that are shrunk: ``"new"`` those that neither the formulation nor `known` states, ``"one"`` the
        most telling one of each formulation, ``"all"`` or ``"none"``.
    progress : Callable[[Progress], None] | None
        A function that is called after every case.
    executor : Executor | None
        Worker processes that do the jobs of the run; the results are the same. What they cannot pickle, such as a class
        of a notebook, needs None.
    keep_going : bool
        Ask all properties of a formulation, even if the first ones show that it is wrong altogether.
    isolation : str | None
        The place where registered names run: ``"box"``, ``"landlock"``, ``"process"`` or ``"inline"``. None takes that
        of ``[tool.contactverif]`` in ``pyproject.toml``, or else the safest that the system has.

    Returns
    -------
    Report
        The results: a `Run` with a row for each formulation and property, its failures, tables, pictures and files.

    Raises
    ------
    MisuseError
        If an argument is nothing that can be judged: an unknown name, an empty list, a class that makes no formulation.
    WorkerError
        If a worker process dies.
    RunStopped
        If the user presses Ctrl-C. It is a `KeyboardInterrupt` with the rows as far as they are judged.

    Examples
    --------
    >>> from contactverif import verify
    >>> report = verify(["nts-ar", "vts-me"], "patch.flat.transmission", examples=5, seed=1)
    >>> report.count("fails as stated")
    2
    """
    if not isinstance(place, Interface | Case | None):
        raise MisuseError(
            "place", _describe(place), "an Interface or a Case: `read_interface` and `read_scene` make them"
        )
    questions = _load_questions(properties)
    items = _items(formulations, "formulations", _FORMULATIONS)
    limits = None  # Of the processes of registered names; None if there are none, or they run in this process.
    if any(isinstance(item, str) for item in items):
        if isolation not in (None, *Isolation):
            raise MisuseError("isolation", repr(isolation), "box, landlock, process, inline or None")
        limits = RunOptions(isolation=None if isolation is None else Isolation(isolation)).limits(argument="isolation")
    try:
        subjects = [_load_subject(item, limits) for item in items]
        result = run(
            subjects,
            questions,
            profile=profile,
            examples=examples,
            seed=seed,
            place=place,
            known=known,
            shrink=shrink,
            progress=progress,
            executor=executor,
            stop="never" if keep_going else "foundation",
        )
    finally:
        if limits is not None:
            end_all()
    return Report(
        **{entry.name: getattr(result, entry.name) for entry in fields(result)},
        subjects={item.name: item for item in subjects if isinstance(item, Subject)},
        questions={item.id: item for item in questions if isinstance(item, Property)},
    )


def _items(argument: Any, name: str, needed: str) -> list[Any]:
    """Return the members of a list, or what stands alone as a list of one; an empty list is a mistake."""
    alone = isinstance(argument, str | Subject | NotLoaded | Property) or callable(argument) or _is_instance(argument)
    if not alone and not isinstance(argument, Iterable):
        raise MisuseError(name, _describe(argument), needed)
    items = [argument] if alone else list(argument)
    if not items:
        raise MisuseError(name, "an empty list", needed)
    return items


def _is_instance(item: Any) -> bool:
    return not isinstance(item, type) and callable(getattr(item, "residual", None))


def _load_questions(properties: Any) -> list[Property | NotLoaded]:
    if properties is None:
        return list(load_properties())
    items = _items(properties, "properties", _PROPERTIES)
    for item in items:
        if not isinstance(item, str | Property | NotLoaded):
            raise MisuseError("properties", _describe(item), _PROPERTIES)
    names = [item for item in items if isinstance(item, str)]
    loaded = load_properties(names) if names else ()
    return [*loaded, *(item for item in items if not isinstance(item, str))]


def _load_subject(item: Any, limits: Limits | None) -> Subject | NotLoaded:
    if isinstance(item, Subject | NotLoaded):
        return item
    if isinstance(item, str):
        return load_formulation(item, limits)
    if _is_instance(item):
        name, make = type(item).__name__, _factory_of(item)
    elif callable(item) and not isinstance(item, Property):
        name, make = getattr(item, "__name__", type(item).__name__), item
    else:
        raise MisuseError("formulations", _describe(item), _FORMULATIONS)
    try:
        return Subject(name, make)
    except ContractError as error:  # The traceback of the user's own code is worth reading, so it stays.
        raise MisuseError("formulations", f"{name}, which cannot be judged ({error})", _FORMULATIONS) from error


def _factory_of(instance: Any) -> Callable[..., Any]:
    """Return a factory of an instance with another penalty: its class, with the arguments that it keeps."""
    make = type(instance)
    needed = "the class itself, or a factory make(*, penalty): the harness chooses the penalty"
    try:
        names = [name for name in inspect.signature(make).parameters if name != "penalty"]
        options = {name: getattr(instance, name) for name in names}
    except (AttributeError, TypeError, ValueError) as error:
        raise MisuseError("formulations", f"an instance of {make.__name__} ({error})", needed) from None
    return lambda *, penalty: make(penalty=penalty, **options)


def _describe(item: object) -> str:
    """Return what stands in the place of a formulation or a property, in words."""
    if isinstance(item, Property):
        return f"the property {item.id}"
    return repr(item) if item is None or isinstance(item, int | float) else f"an instance of {type(item).__name__}"
