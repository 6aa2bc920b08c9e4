"""The store of a run: its plan, and each outcome as it comes, in a journal, so that no case is judged twice.

Verdicts are never read: they follow from the stored numbers. A random share of each row is judged again before its
stored outcomes count (`recheck_store`).
"""

import os
import shlex
from array import array
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, product
from pathlib import Path
from secrets import token_hex
from typing import IO, Any

import msgspec
import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case import Case, CaseSummary
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Measurement, Outcome, PropertyInfo, Verdict, judge_stored
from contactverif.plugins.provenance import CODE, machine
from contactverif.plugins.registry import loads_file
from contactverif.run.journal import RecordFile, decode, read_header, read_message, read_messages, record_files
from contactverif.run.run_options import ISOLATION, PLACE, Isolation, RunOptions, group_names

FORMAT = 6  # A change of a record is a new one.
WITNESS = -1  # The number of the outcome of a row's witness.
STORED = "stored_outcomes"  # The attribute of a report that says how many outcomes came from earlier processes.
_MOST_FORMS = 10_000  # The most forms that a process remembers.
_MOST_FILES = 4  # The most stores that a process has open for writing.
_FILE_BITS = 40  # A place is the number of its file, then this many bits for the byte.
_LEAST_ROOM = 10_000  # A finite list may have this many cases.
_MOST_ROWS, _MOST_EXAMPLES = 1 << 20, 1 << 40  # More are no plan of a run, and would not fit into a key.
# The options that say what a run may reach, write or excuse: a journal of a stranger does not choose them.
OF_USER = ("known", "pictures", "out", "jobs", *group_names(ISOLATION))


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """The plan of a run, the header of its store. A row is a formulation and a property, as on the command line."""

    command: str = ""
    versions: dict[str, str] = {}  # {library or package: version or digest}.
    options: RunOptions = msgspec.field(default_factory=RunOptions)  # They are settled.
    shard: str = ""  # The shard I/N of a campaign.
    folder: str = ""  # The working folder of the command, to which names of files are relative.
    machine: dict[str, str] = {}  # What the last bits of a number depend on, beside the versions.
    format: int = FORMAT


def read_plan(folder: Path, argument: str) -> Plan:
    """Return the plan of the store of a run, one of this format."""
    plan = read_header(folder, Plan, argument)
    if plan.format != FORMAT:
        raise MisuseError(argument, f"{folder.name} with format {plan.format}", f"a journal of format {FORMAT}")
    options, n_rows = plan.options, len(plan.options.names) * len(plan.options.properties)
    if n_rows > _MOST_ROWS or not 0 <= (options.examples or 0) <= _MOST_EXAMPLES:
        size = f"{n_rows} rows of {options.examples} cases"
        raise MisuseError(argument, f"{folder.name} with {size}", "an undamaged journal, or another name")
    return plan


def check_names(stored: Sequence[str], typed: Collection[str], argument: str) -> None:
    """Check that the user has typed each stored name that loads a file, and none that is not stored."""
    if untyped := [name for name in stored if loads_file(name) and name not in typed]:
        needed = f"{shlex.join(untyped)} typed behind it, if you trust the file"
        raise MisuseError(argument, f"{', '.join(untyped)}, which loads a file", needed)
    for name in typed:
        if name not in stored:
            raise MisuseError("NAME", name, f"one of {', '.join(stored)}")


def agree(stored: RunOptions, typed: RunOptions, argument: str) -> tuple[RunOptions, list[str]]:
    """Return the options of a journal that a stranger may have made with those of the user, and what it asked beyond.

    A file is named by both, or nothing begins.
    """
    check_names(stored.names, typed.names, argument)
    if stored.place_words != typed.place_words:
        words = shlex.join(stored.words(group_names(PLACE)))
        places = f"a journal with {words or 'no mesh or scene'}, and here {typed.place_words or 'none'}"
        trusted = "the same options, if you trust the files"
        raise MisuseError(argument, places, trusted if argument.startswith("--") else "one on random cases")
    options = replace(stored, **{name: getattr(typed, name) for name in OF_USER}).with_settings()
    place, opened = options.settled_isolation()
    options = replace(options, isolation=place, opened=opened)
    weaker = max(stored.isolation or place, place, key=[*Isolation].index)  # A stronger place is none to agree to.
    stored = replace(stored, out=options.out, jobs=options.jobs, isolation=weaker)
    refused = [name for name in OF_USER if stored.words([name]) != options.words([name])]
    return options, stored.words(refused)


def check_versions(stored: Mapping[str, str], here: Mapping[str, str], argument: str) -> None:
    """Check that a run goes on with what it began with; the message names the first version or digest that differs."""
    for name in sorted({*stored, *here}):
        if stored.get(name) != here.get(name):
            versions = f"{stored.get(name, 'nothing')} in the journal and {here.get(name, 'nothing')} here"
            raise MisuseError(argument, f"{name.replace('_', ' ')}: {versions}", "the same, or a new run")


class FormRecord(msgspec.Struct, frozen=True, array_like=True, tag="form"):
    """The form of outcomes that stand behind it in the same file: their words and names."""

    form: bytes


class OutcomeRecord(msgspec.Struct, frozen=True, array_like=True, tag="outcome"):
    """The outcome of one case."""

    row: int  # Its number in the plan.
    number: int  # The number of the case in the row; `WITNESS` for its witness.
    form: int  # The place of the form in the file, in bytes.
    numbers: bytes  # As little-endian float64.


class RejectedRecord(msgspec.Struct, frozen=True, array_like=True, tag="rejected"):
    """A row of which a stored outcome was wrong: none of its outcomes in these files counts."""

    row: int
    files: tuple[str, ...]


_PARTS = tuple[CaseSummary, str, str, Measurement | None, float, bool]  # The parts of an outcome that are stored.
_ENCODER = msgspec.msgpack.Encoder()
_DECODER: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(FormRecord | OutcomeRecord | RejectedRecord)


def encode_outcome(outcome: Outcome) -> tuple[bytes, list[float]]:
    """Return the form of an outcome, which many outcomes have in common, and its numbers.

    The form is a message of MessagePack with all words of the outcome, and 0 or 0.0 in place of each number.
    """
    numbers: list[float] = []

    def take(number: float) -> float:
        numbers.append(float(number))
        return 0 if isinstance(number, int) else 0.0

    verdict, breach = outcome.verdict.name, bool(outcome.breach)
    parts = outcome.summary, verdict, outcome.reason, outcome.measurement, outcome.seconds, breach
    tree = _change_numbers(msgspec.to_builtins(parts, enc_hook=_plain), take)
    try:
        return _ENCODER.encode(tree), numbers
    except UnicodeEncodeError:  # Words of a plugin may hold half of a character.
        return _ENCODER.encode(_spell_out(tree)), numbers


def decode_outcome(form: bytes, numbers: Iterable[float]) -> Outcome:
    """Return the outcome of a form and numbers; a ValueError says that one of them is damaged."""
    rest = iter(numbers)

    def put(place: float) -> float:
        number = next(rest)
        return int(number) if isinstance(place, int) and number.is_integer() else number

    try:
        tree = _change_numbers(msgspec.msgpack.decode(form), put)
        parts = msgspec.convert(tree, _PARTS, dec_hook=lambda _, values: freeze(values, np.float64))
        outcome = Outcome(parts[0], Verdict[parts[1]], *parts[2:])
    except (msgspec.MsgspecError, StopIteration, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"form and numbers are not those of an outcome: {error}") from error
    if next(rest, None) is not None:
        raise ValueError("more numbers than the form of an outcome has")
    return outcome


def _change_numbers(item: Any, change: Callable[[float], float]) -> Any:
    """Return lists and mappings, one in another, with each number changed."""
    if isinstance(item, str | bool):
        return item
    if isinstance(item, int | float):
        return change(item)
    if isinstance(item, dict):
        return {key: _change_numbers(value, change) for key, value in item.items()}
    return [_change_numbers(each, change) for each in item] if isinstance(item, list | tuple) else item


def _spell_out(item: Any) -> Any:
    if isinstance(item, dict):
        return {_spell_out(key): _spell_out(value) for key, value in item.items()}
    if isinstance(item, list):
        return [_spell_out(each) for each in item]
    return item.encode("utf-8", "backslashreplace").decode() if isinstance(item, str) else item


def _plain(value: Any) -> Any:
    if isinstance(value, str):  # Words of a plugin may be of a type of its own.
        return str.__str__(value)
    return dict(value) if isinstance(value, Mapping) else np.asarray(value, dtype=np.float64).tolist()


_files: dict[tuple[str, str, int], RecordFile] = {}  # The files into which this process writes.


@dataclass(frozen=True, slots=True)
class Writer:
    """The place in a store for the outcomes of some cases of a row. It travels to the process that judges them."""

    folder: str
    session: str  # A word for the process that began or resumed the run.
    row: int
    first: int  # The number of the first of the cases.

    @property
    def file(self) -> RecordFile:
        """The file of this process. A process that was forked has another one than its parent."""
        key = self.folder, self.session, os.getpid()
        if key not in _files:
            while len(_files) >= _MOST_FILES:
                _files.pop(next(iter(_files))).close()
            _files[key] = RecordFile(Path(self.folder))
        return _files[key]

    def add(self, place: int, outcome: Outcome) -> None:
        """Append the outcome of the case at a place behind the first."""
        file, (form, numbers) = self.file, encode_outcome(outcome)
        if form not in file.forms:
            if len(file.forms) >= _MOST_FORMS:
                file.forms.clear()
            byte = file.append(_ENCODER.encode(FormRecord(form)))
            if byte is None:
                return
            file.forms[form] = byte
        number = self.first + place
        file.append(_ENCODER.encode(OutcomeRecord(self.row, number, file.forms[form], array("d", numbers).tobytes())))


class Store:
    """The outcomes of a run that earlier processes judged (`sources`), and the folder for new ones; None to keep none.

    Of a stored outcome only its place is in memory. `write_error` is the first reason why a process could not write,
    and `remarks` are what the user should know of outcomes that do not count.
    """

    def __init__(self, plan: Plan | None = None, folder: Path | None = None, sources: Sequence[Path] = ()) -> None:
        self.plan = plan = plan or Plan()
        options = plan.options
        self.folder = folder
        self.write_error = ""
        self.remarks: list[str] = []
        # {(formulation, property id): case} of what failed in other runs. It is asked first, and is not stored.
        self.failures: Mapping[tuple[str, str], Case] = {}
        self.n_stored = self.n_rechecked = 0  # The numbers of stored outcomes of a run, and of those judged again.
        self._session = token_hex(4)
        self._rows = {key: number for number, key in enumerate(product(options.names, options.properties))}
        self._room = max(_LEAST_ROOM, 2 * (options.examples or 0)) + 1  # A case with a larger number is not believed.
        self._paths = [path for source in sources for path in record_files(source)]
        self.same_machine = all(_machine_of(source) == machine() for source in sources)
        self._forms: dict[tuple[int, int], bytes] = {}  # {(file, place of a form): form}
        self._keys, self._places = self._read_places()

    def _read_places(self) -> tuple[Any, Any]:
        keys, places, rejected = array("q"), array("q"), set[tuple[int, str]]()
        for file, path in enumerate(self._paths):
            for place, message in read_messages(path):
                match decode(message, _DECODER):
                    case None:
                        break
                    case OutcomeRecord(row, number) if 0 <= row < len(self._rows) and -1 <= number < self._room - 1:
                        keys.append(row * self._room + number + 1)
                        places.append(file << _FILE_BITS | place)
                    case RejectedRecord(row, names):
                        rejected |= {(row, name) for name in names}
        all_keys, all_places = (np.frombuffer(part, dtype=np.int64) for part in (keys, places))
        counts = np.ones(len(keys), dtype=bool)
        for row, name in rejected:
            files = [file for file, path in enumerate(self._paths) if path.name == name]
            counts &= ~((all_keys // self._room == row) & np.isin(all_places >> _FILE_BITS, files))
        all_keys, all_places = all_keys[counts][::-1], all_places[counts][::-1]
        self.n_records = len(all_keys)
        unique, first = np.unique(all_keys, return_index=True)
        return unique, all_places[first]

    @property
    def n_outcomes(self) -> int:
        """The number of different cases whose outcomes are stored, witnesses included."""
        return len(self._keys)

    def writer(self, formulation: str, property_id: str, first: int) -> Writer | None:
        """Return the place for the outcomes of some cases of a row; None if nothing is kept."""
        if self.folder is None:
            return None
        return Writer(str(self.folder), self._session, self._rows[formulation, property_id], first)

    def _range(self, formulation: str, property_id: str, first: int, count: int) -> slice:
        row = self._rows.get((formulation, property_id))
        if row is None:
            return slice(0)
        start = row * self._room + first + 1
        return slice(*np.searchsorted(self._keys, (start, start + count)).tolist())

    def numbers(self, formulation: str, property_id: str) -> list[int]:
        """Return the numbers of the cases of a row whose outcomes are stored."""
        keys = self._keys[self._range(formulation, property_id, WITNESS, self._room)]
        return (keys % self._room - 1).tolist()  # type: ignore[no-any-return]

    def outcomes(self, formulation: str, info: PropertyInfo, first: int, count: int) -> dict[int, Outcome]:
        """Return {place behind the first: outcome} of those of some cases of a row that are judged already."""
        part, outcomes = self._range(formulation, info.id, first, count), dict[int, Outcome]()
        pairs = zip((self._keys[part] % self._room).tolist(), self._places[part].tolist(), strict=True)
        for file, group in groupby(pairs, lambda pair: pair[1] >> _FILE_BITS):
            with self._paths[file].open("rb") as stream:
                for key, place in group:
                    outcome = self._read_outcome(stream, file, place & (1 << _FILE_BITS) - 1, info)
                    if outcome is not None:
                        outcomes[key - 1 - first] = outcome
        return outcomes

    def _read_outcome(self, stream: IO[bytes], file: int, place: int, info: PropertyInfo) -> Outcome | None:
        """Return an outcome with the verdict that follows from its numbers; None if it is to be judged again."""
        record = _read_record(stream, place)
        if not isinstance(record, OutcomeRecord) or not 0 <= record.form < place:
            return None
        key = file, record.form
        try:
            if key not in self._forms:
                if len(self._forms) >= _MOST_FORMS:
                    self._forms.clear()
                stored = _read_record(stream, record.form)
                if not isinstance(stored, FormRecord):
                    return None
                self._forms[key] = stored.form
            outcome = judge_stored(info, decode_outcome(self._forms[key], array("d", record.numbers)))
        except ValueError:  # They are damaged, do not belong together, or are of another property.
            return None
        return None if outcome.measurement is None and outcome.verdict is Verdict.PASS else outcome

    def reject(self, formulation: str, property_id: str, remark: str) -> None:
        """Let no stored outcome of a row count, so that they are judged again, also after this run is killed."""
        part = self._range(formulation, property_id, WITNESS, self._room)
        self._keys, self._places = np.delete(self._keys, part), np.delete(self._places, part)
        self.remarks.append(remark)
        if writer := self.writer(formulation, property_id, 0):
            writer.file.append(_ENCODER.encode(RejectedRecord(writer.row, tuple(path.name for path in self._paths))))

    def provenance(self) -> dict[str, str]:
        """Return what a report should say of where its outcomes come from: code, place, and how many were stored."""
        digests = {name: digest for name, digest in self.plan.versions.items() if name.startswith(CODE)}
        facts = {name.replace(" ", "_"): digest for name, digest in digests.items()}
        stored = f"{self.n_stored}, of which {self.n_rechecked} were judged again" if self.n_stored else ""
        entries = (("place", self.plan.options.place_words), (STORED, stored))
        return facts | {name: words for name, words in entries if words}

    def close(self) -> None:
        """Close the file of this process, once it is on the disk."""
        key = str(self.folder), self._session, os.getpid()
        if file := _files.pop(key, None):
            file.close()
            self.write_error = self.write_error or file.write_error


def _read_record(stream: IO[bytes], place: int) -> Any:
    message = read_message(stream, place)
    return None if message is None else decode(message, _DECODER)


def _machine_of(source: Path) -> dict[str, str]:
    try:
        return read_header(source, Plan, "").machine
    except MisuseError:
        return {}
