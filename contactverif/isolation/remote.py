"""Formulations and engines in processes of their own, with the methods of those in this one.

Rules: each answers as it does in this process, but for a process that dies or hangs. After its process has ended, a new
one answers in its place. Nothing of a plugin is imported here, and what its process states is checked like an answer.
"""

import json
import os
import sys
import weakref
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from stat import S_ISREG
from typing import Any, Generic, TypeVar

import msgspec
import numpy as np

from contactverif.contract.arrays import Array, FloatArray, compressed_matrix, sparse_of_scipy
from contactverif.contract.engine import EngineAnswer, EngineTraits, SceneArrays
from contactverif.contract.errors import ContractError, MisuseError, PluginError, one_line
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import FAST_PARTS, OPTIONAL_PARTS, Call, EngineSubject, Prefetching, Subject
from contactverif.contract.traits import Traits
from contactverif.isolation.box import ATTEMPTS
from contactverif.isolation.child import FORKS
from contactverif.isolation.host import Host, answer_of, host_of, raise_failure
from contactverif.isolation.limits import Limits
from contactverif.isolation.process import NoBoxError, PluginProcess, Question, mapped_files
from contactverif.isolation.wire import Answer, Load, Loaded, Reply, Unloaded, Wraps, encode

_COMPRESSED = ("csr", "csc")
_MOST_SECONDS = 1e9
_MOST_ITERATIONS = 1 << 31
_MOST_LIBRARIES = 500  # The number of files of compiled code that are read.
_LARGEST_LIBRARY = 1 << 25  # Bytes. A compiler such as LLVM has more, which would take a third of a second.
_DIGITS = 16
_Traits = TypeVar("_Traits", Traits, EngineTraits)


@dataclass(frozen=True, slots=True)
class Wrapper:
    """A name that stands for no formulation by itself: it needs another one, a file, or a kind."""

    name: str
    summary: str  # The first line of the factory's docstring.
    form: str  # What a user writes, `name/NAME`, `name:file=PATH` or `name:kind=KIND`.


@dataclass(frozen=True)
class _Remote(Generic[_Traits]):
    """A plugin that a program, `command`, has loaded by its name, in a process within limits. It can be pickled."""

    command: tuple[str, ...]
    name: str
    limits: Limits
    traits: _Traits
    provides: frozenset[str] = frozenset()  # The optional methods that the plugin has.
    second: bool = False  # A second process of the same plugin, which `purity` compares with the first.

    @property
    def host(self) -> Host:
        """The host in this process of the judge."""
        return host_of(self.command, self.name, self.limits, second=self.second)


class RemoteFactory(_Remote[Traits]):
    """A factory ``make(*, penalty)`` of a formulation."""

    def __call__(self, *, penalty: float) -> "RemoteFormulation":
        """Return the formulation with a penalty."""
        return RemoteFormulation(self, penalty)


class RemoteSubject(Subject):
    """A formulation that lives in a process of its own. It can be pickled."""

    def __init__(self, make: RemoteFactory) -> None:
        super().__init__(make.name, make)
        self.remote = make

    @property
    def host(self) -> Host:
        """The host in this process of the judge."""
        return self.remote.host

    def restart(self) -> Subject:
        """Return the same formulation in a second process."""
        return RemoteSubject(replace(self.remote, second=True))


def in_one_process(subject: Subject) -> Subject:
    """Return a formulation as one that is not started a second time."""
    return Subject(subject.name, subject.remote) if isinstance(subject, RemoteSubject) else subject


class RemoteEngine(_Remote[EngineTraits]):
    """An engine."""

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Return the answer of the engine, of which nothing is checked but its kind."""
        reply = self.host.solve(scene.to_arrays())
        iterations = reply.iterations if abs(reply.iterations) < _MOST_ITERATIONS else -1
        try:
            arrays: dict[str, Any] = {name: packed.unpack() for name, packed in reply.arrays.items()}
            doubles = {name: array.astype(float) for name, array in arrays.items() if array.dtype == np.float64}
            return EngineAnswer(
                converged=reply.converged, iterations=iterations, message=one_line(reply.message), **(arrays | doubles)
            )
        except (ValueError, TypeError) as error:
            raise ContractError(f"solve: {one_line(str(error))}") from None


class RemoteEngineSubject(EngineSubject):
    """An engine that lives in a process of its own. It can be pickled."""

    def __init__(self, engine: RemoteEngine) -> None:
        super().__init__(engine.name, engine)
        self.remote = engine


def _remote_of(subject: Subject) -> RemoteFactory | RemoteEngine | None:
    return subject.remote if isinstance(subject, RemoteSubject | RemoteEngineSubject) else None


def count_ends(subject: Subject) -> int:
    """Return how often the process of a subject has ended before it was told to; 0 if it has none of its own."""
    remote = _remote_of(subject)
    return 0 if remote is None else remote.host.n_ended


def has_process(subject: Subject) -> bool:
    """Return whether a process of a subject's own answers this process of the judge now."""
    remote = _remote_of(subject)
    return remote is not None and remote.host.has_process


def start_process(subject: Subject) -> None:
    """Start the process of a subject's own in this process of the judge, unless there is one."""
    remote = _remote_of(subject)
    if remote is not None and not remote.host.has_process:
        remote.host.load()


def code_files(subject: Subject) -> list[Path]:
    """Return the files whose compiled code the process of a subject has loaded; none if it has none of its own."""
    remote = _remote_of(subject)
    return [] if remote is None else remote.host.code_files


def note_code_files(subject: Subject, files: list[Path]) -> None:
    """Keep what the process of a subject has loaded that belongs to another process of the judge."""
    if (remote := _remote_of(subject)) is not None:
        remote.host.code_files_there = files


def places(subjects: Iterable[Subject]) -> dict[str, str]:
    """Return {attribute of the report: value}: where formulations lived, what was open to them, and their libraries."""
    facts: dict[str, set[str]] = {"isolation": set(), "opened": set(), "libraries": set()}
    for subject in subjects:
        remote = _remote_of(subject)
        box = None if remote is None else remote.limits.box
        facts["libraries"] |= set(list_libraries(code_files(subject)))
        facts["isolation"].add(box.kind if box is not None else "inline" if remote is None else "process")
        facts["opened"] |= set(box.opened) if box is not None else set()
    return {name: "; ".join(sorted(values)) for name, values in facts.items() if values}


def list_libraries(files: Iterable[Path]) -> list[str]:
    """Return name and digest of each of the files whose code this process does not run."""
    paths = sorted({*files} - {*mapped_files("self")})
    return [f"{one_line(path.name)} {_digest(path)}" for path in paths[:_MOST_LIBRARIES]]


@cache
def _digest(path: Path) -> str:
    try:
        # A plugin names the file. One that nobody writes to, such as a pipe, would not be read to its end.
        number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW)
    except OSError:
        return "which is gone"
    with os.fdopen(number, "rb") as file:
        facts = os.fstat(number)
        if not S_ISREG(facts.st_mode):
            return "which is no file"
        if facts.st_size > _LARGEST_LIBRARY:
            return f"of {facts.st_size} bytes"
        return sha256(file.read(_LARGEST_LIBRARY)).hexdigest()[:_DIGITS]


class RemoteFormulation(Prefetching):
    """A formulation with one penalty in another process. Nothing that it answers is checked but its kind."""

    def __init__(self, make: RemoteFactory, penalty: float) -> None:
        self._make, self._penalty, self.traits = make, penalty, make.traits
        counted = self.traits.rules.enforcement == "multiplier"  # Else its process checks that there are none.
        for part in (*OPTIONAL_PARTS, *FAST_PARTS, "n_multipliers"):
            if part not in make.provides or (part == "n_multipliers" and not counted):
                setattr(self, part, None)
        self.timed = False  # True: the process times each call, and a short one when it is repeated.
        self.counted = False  # True: the process counts the methods that run in each call.
        self._number, self._started = 0, -1
        self._last: Question | None = None
        self._prefetched: deque[tuple[Call, Question]] = deque()

    @cached_property
    def _host(self) -> Host:
        return self._make.host

    def _ask(self, verb: str, interface: Interface, pairing: Pairing | None, z: Array | None) -> Question:
        host = self._host
        if not host.is_alive(self._started):
            self._number, self._started = host.make(self._penalty)
            weakref.finalize(self, host.forget, self._number, self._started)
        number = pairing.number_in(host) if isinstance(pairing, RemotePairing) else None
        of_pairing = pairing if number is None else number
        self._last = host.ask(verb, self._number, interface, of_pairing, z, timed=self.timed, counted=self.counted)
        return self._last

    def _answer(self, verb: str, interface: Interface, pairing: Pairing | None, z: Array | None) -> Answer:
        question = self._take_prefetched(verb, interface, pairing) or self._ask(verb, interface, pairing, z)
        if question.answer is None:
            self._host.flush()
        if isinstance(pairing, RemotePairing):
            pairing.check()
        if not (self.timed or self.counted):
            self._last = None  # It would keep the answer.
        return answer_of(question)

    @contextmanager
    def prefetch(self, calls: Sequence[Call]) -> Iterator[None]:
        """Open a block in which these methods are called, in this order: they go to the process in one message."""
        try:
            for verb, interface, pairing, z in calls:
                if verb in self._make.provides or verb == "residual":
                    self._prefetched.append(((verb, interface, pairing, z), self._ask(verb, interface, pairing, z)))
            yield
        finally:
            self._prefetched.clear()

    def _take_prefetched(self, verb: str, interface: Interface, pairing: Pairing | None) -> Question | None:
        if not self._prefetched:
            return None
        (next_verb, of_interface, of_pairing, _), question = self._prefetched[0]
        if next_verb != verb or of_interface is not interface or of_pairing is not pairing:
            return None
        self._last = question
        return self._prefetched.popleft()[1]

    def seconds(self) -> float:
        """Return the seconds that the last call, which was `timed`, took there.

        They hold neither the round trip nor any check. A plugin may say what it likes, within reason.
        """
        answer = self._last_answer()
        if not 0 <= answer.seconds <= _MOST_SECONDS:
            assert self._last is not None
            raise PluginError(f"{self._last.verb}: times that cannot be", "channel")
        return answer.seconds

    def calls(self) -> int:
        """Return the number of methods that ran in the last call, which was `counted`."""
        return self._last_answer().calls

    def _last_answer(self) -> Answer:
        assert self._last is not None
        self._host.flush()
        return answer_of(self._last)

    def n_multipliers(self, interface: Interface) -> int:
        """Return the number of multipliers."""
        return self._answer("n_multipliers", interface, None, None).count

    def pair(self, interface: Interface, z: FloatArray) -> Pairing:
        """Return the pairing at one state z (n_unknowns,). It is asked for together with the next question."""
        question = self._ask("pair", interface, None, z)
        return RemotePairing(self._host, question, interface)

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        """Return the forces (..., n_unknowns) at z (..., n_unknowns)."""
        return _pick(_unpack("residual", self._answer("residual", interface, pairing, z)), "residual", "residual")

    def tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> Any:
        """Return the tangent (n_unknowns, n_unknowns), an array or a matrix of scipy.sparse."""
        return _tangent(_unpack("tangent", self._answer("tangent", interface, pairing, z)), "tangent", z.size)

    def residual_and_tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> tuple[Any, Any]:
        """Return residual (n_unknowns,) and tangent."""
        verb = "residual_and_tangent"
        arrays = _unpack(verb, self._answer(verb, interface, pairing, z))
        return _pick(arrays, verb, "residual"), _tangent(arrays, verb, z.size)

    def contact_points(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> ContactPoints:
        """Return the contact points."""
        arrays = _unpack("contact_points", self._answer("contact_points", interface, pairing, z))
        try:
            return ContactPoints(**arrays)
        except (MisuseError, TypeError) as error:
            raise ContractError(f"contact_points: {error}") from None


class RemotePairing(Pairing):
    """A pairing that a plugin's process keeps as long as this is there. It comes, and is checked, when looked into."""

    __slots__ = ("_content", "_host", "_interface", "_question", "_started")

    def __init__(self, host: Host, question: Question, interface: Interface) -> None:
        self._host, self._question, self._interface, self._started = host, question, interface, host.n_started
        self._content: dict[str, Array] | None = None

    def __del__(self) -> None:
        self._host.forget(self._question.number, self._started)

    def number_in(self, host: Host) -> int | None:
        """Return the number under which the process of a host keeps it now; None if it does not."""
        return self._question.number if host is self._host and host.is_alive(self._started) else None

    @property
    def _arrays(self) -> dict[str, Array]:  # type: ignore[override]
        if self._content is None:
            if self._question.answer is None:
                self._host.flush()
            answer = answer_of(self._question)
            whole = Pairing(_unpack("pair", answer))
            whole.check_bounds(self._interface)
            self.check()
            self._content = dict(whole)
            answer.arrays.clear()  # They are copies by now.
        return self._content

    @property
    def opaque(self) -> bool:
        """Return whether pairings of the plugin have a handle, which stay in its process."""
        if self._host.opaque is None:
            _ = self._arrays
        return bool(self._host.opaque)

    @property
    def handle(self) -> None:
        """Return None: the object is in the plugin's process."""

    def check(self) -> None:
        """Raise the error of the plugin, if it made one when it paired."""
        answer = answer_of(self._question)
        if self._host.opaque is None:
            self._host.opaque = answer.handle
        elif self._host.opaque is not answer.handle:
            raise ContractError("pair: returned a handle in some states, and none in others")

    def check_bounds(self, interface: Interface) -> None:
        """Do nothing: the bounds are checked where the plugin is, and once more when the pairing is looked into."""


def _unpack(verb: str, answer: Answer) -> dict[str, Array]:
    try:
        return {name: array.unpack() for name, array in answer.arrays.items()}
    except ValueError as error:
        raise ContractError(f"{verb}: {error}") from None


def _pick(arrays: dict[str, Array], verb: str, name: str) -> Array:
    if name not in arrays:
        raise ContractError(f"{verb}: an answer without its {name}")
    return arrays[name]


def _tangent(arrays: dict[str, Array], verb: str, size: int) -> Any:
    """Return the tangent (size, size), dense or in the format in which it came. Only a coo is checked."""
    if "dense" in arrays:
        return arrays["dense"]
    kind = next((kind for kind in _COMPRESSED if f"{kind} data" in arrays), "coo")
    if kind != "coo":
        parts = (_pick(arrays, verb, f"{kind} {name}") for name in ("data", "indices", "indptr"))
        return compressed_matrix(kind, size, *parts)
    data, row, col = (_pick(arrays, verb, name) for name in ("data", "row", "col"))
    try:
        return sparse_of_scipy().coo_array((data, (row, col)), shape=(size, size))
    except (ValueError, TypeError, IndexError) as error:
        raise ContractError(f"{verb}: returned a broken coo matrix: {error}") from None


def python_program(file: str) -> tuple[str, ...]:
    """Return the command that runs a file, with the folders of this process's modules as its arguments."""
    return sys.executable, file, *filter(None, sys.path)


def engine_program(entry: str, options: Mapping[str, Any], python: str | None = None) -> tuple[str, ...]:
    """Return the command that makes an engine of an entry point, by default in the interpreter of this process.

    An interpreter of its own finds its own modules first, and of those of this process only the harness and the engine.
    """
    worker = str(Path(__file__).with_name("engine_worker.py"))
    places, folders = ({}, filter(None, sys.path)) if python is None else (_places_of(entry), ())
    return python or sys.executable, worker, entry, json.dumps(options), json.dumps(places), *folders


def _places_of(entry: str) -> dict[str, str]:
    """Return {module: folder} of the harness, of what is installed together with an entry point, and of `landlockpy`.

    The folder may be that of all packages of this interpreter, such as a numpy that another one cannot load.
    """
    import importlib.util
    from importlib.metadata import packages_distributions

    module, owners = entry.partition(":")[0].partition(".")[0], packages_distributions()
    installed = set(owners.get(module, ()))
    names = {"contactverif", module, "landlockpy", *(name for name in owners if installed & set(owners[name]))}
    specs = ((name, importlib.util.find_spec(name)) for name in sorted(names))
    return {
        name: str(Path(spec.origin).parents[bool(spec.submodule_search_locations)])  # The parent of a package's folder.
        for name, spec in specs
        if spec and spec.origin
    }


def load_remote(command: tuple[str, ...], name: str, limits: Limits) -> Subject | NotLoaded:
    """Load a formulation in a process of its own: a program that speaks the protocol and knows formulations by name.

    A wrong name or option is a MisuseError.
    """
    try:
        item = _read_reply(command, name, limits, host_of(command, name, limits).load())
    except ContractError as error:
        if isinstance(error.__cause__, MisuseError):
            raise error.__cause__ from None
        return _not_loaded(name, error)
    assert not isinstance(item, Wrapper)
    return item


def load_remote_engine(command: tuple[str, ...], name: str, limits: Limits) -> EngineSubject | NotLoaded:
    """Load an engine in a process of its own, and return it under a name, or why it does not load."""
    try:
        reply = host_of(command, name, limits).load()
        if isinstance(reply, Unloaded):
            return NotLoaded(name, one_line(reply.reason))
        if not isinstance(reply, Loaded):
            raise PluginError(f"import: a {type(reply).__name__} where an engine was needed", "channel")
        traits = _convert_traits(reply.traits, EngineTraits)
        return RemoteEngineSubject(RemoteEngine(command, name, limits, traits))
    except ContractError as error:
        return NotLoaded(name, str(error))


def survey(command: tuple[str, ...], names: Iterable[str], limits: Limits) -> Iterator[Subject | Wrapper | NotLoaded]:
    """Yield what is installed under each name.

    One process loads no plugin, and a copy of it loads each one. Where processes are not copied, each name has a new
    one. A process that ends is followed by another.
    """
    process: PluginProcess | None = None
    for name in names:
        for _ in range(ATTEMPTS):
            question = Question(0, "import")
            try:
                process = process or PluginProcess(command, limits)
                process.ask(encode([Load(0, name, survey=True)]), [question])
                item = _read_reply(command, name, limits, raise_failure(question))
            except ContractError as error:
                process = None if isinstance(error, PluginError) and error.ended else process
                item = _not_loaded(name, error)
                if isinstance(error, NoBoxError):
                    continue
            break
        yield item
        if process is not None and not FORKS:
            process.end()
            process = None
    if process is not None:
        process.end()


def _not_loaded(name: str, error: ContractError) -> NotLoaded:
    ended = isinstance(error, PluginError) and error.ended
    return NotLoaded(name, f"{error.cause}: {error}" if ended else str(error))  # type: ignore[attr-defined]


def _read_reply(command: tuple[str, ...], name: str, limits: Limits, reply: Reply) -> Subject | Wrapper | NotLoaded:
    match reply:
        case Unloaded(_, reason):
            return NotLoaded(name, one_line(reason))
        case Wraps(_, summary, form):
            return Wrapper(name, one_line(summary), one_line(form))
        case Loaded(_, traits, provides):
            evidence = traits.get("evidence")
            if isinstance(evidence, dict) and isinstance(evidence.get("source"), str):
                evidence["source"] = one_line(evidence["source"])
            stated = _convert_traits(traits, Traits)
            return RemoteSubject(RemoteFactory(command, name, limits, stated, frozenset(provides)))
    raise PluginError(f"import: a {type(reply).__name__} where a formulation was needed", "channel")


def _convert_traits(words: dict[str, Any], kind: type[_Traits]) -> _Traits:
    try:
        return msgspec.convert(words, kind)
    except (msgspec.ValidationError, RecursionError, ValueError) as error:
        raise ContractError(f"traits: {one_line(str(error))}") from None
