"""The codec of results: a declared dataclass becomes a form and plain numbers, and comes back to the last bit.

The annotations of the fields are the declaration: nothing else says how an `Outcome` or any other result is stored.

    form, numbers = encode(outcome)            # (((), '', 'inside'), 1, …), [2.0, 1.0, 0.25, …]
    read = decoder(Outcome, form)              # ValueError unless the form fits the declaration; checked once for many
    outcome = read(numbers)                    # ValueError unless the numbers fit the form

The form is a nested tuple of words, truths, whole numbers and None: all that outcomes have in common. It can be
hashed, so that a store keeps it once, and written as JSON or MessagePack, from which it may come back as lists. The
numbers are floats, NaN and −0.0 included: `array("d", numbers)` holds them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import cache, partial
from itertools import islice
from math import prod
from operator import attrgetter
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from contactverif.contract.arrays import freeze

Form = tuple[Any, ...]
_Record = TypeVar("_Record")
_Reader = Callable[[Iterator[float]], Any]


@dataclass(frozen=True, slots=True)
class StoredAs:
    """The annotation of a field of which another attribute is stored: of a case only its summary."""

    attribute: str  # The attribute of the record that is stored, and comes back as the field.
    kind: type


def encode(record: Any) -> tuple[Form, list[float]]:
    """Return the form of a dataclass and its numbers."""
    kind: Any = type(record)
    numbers: list[float] = []
    return _codec_of(kind).write(record, numbers), numbers


def decoder(kind: type[_Record], form: Sequence[Any]) -> Callable[[Sequence[float]], _Record]:
    """Return the function that makes a record of its numbers, where many may have one form.

    A ValueError says that form or numbers are damaged.
    """
    hint: Any = kind
    try:
        read_record = _codec_of(hint).bind(form)
    except (TypeError, OverflowError) as error:
        raise ValueError(f"the form is of no {kind.__name__}: {error}") from error

    def read(numbers: Sequence[float]) -> _Record:
        rest = iter(numbers)
        try:
            record: _Record = read_record(rest)
        except (StopIteration, OverflowError) as error:
            raise ValueError(f"the numbers are not those of the form of a {kind.__name__}: {error}") from error
        if next(rest, None) is not None:
            raise ValueError(f"more numbers than the form of a {kind.__name__} has")
        return record

    return read


@dataclass(frozen=True, slots=True)
class _Codec:
    """The codec of the values of one annotation."""

    write: Callable[[Any, list[float]], Any]  # Appends the numbers of a value, and returns its form.
    bind: Callable[[Any], _Reader]  # Checks a form, and returns what makes the value of its numbers.
    has_form: bool = True  # A number has none.
    has_numbers: bool = True  # A word has none.


def _constant(check: Callable[[Any], Any], plain: Callable[[Any], Any] = lambda value: value) -> _Codec:
    """Return the codec of a value that is its own form, or of which `plain` is the form."""

    def bind(form: Any) -> _Reader:
        value = check(form)
        return lambda _: value

    return _Codec(lambda value, _: plain(value), bind, has_numbers=False)


@cache
def _codec_of(hint: Any) -> _Codec:
    """Return the codec of an annotation."""
    if hint in _LEAVES:
        return _LEAVES[hint]
    if is_dataclass(hint):
        return _record_codec(hint)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _constant(hint, lambda value: value.value)
    return _OF_ORIGINS[get_origin(hint)](*get_args(hint))


def _record_codec(kind: Any) -> _Codec:
    """Return the codec of a dataclass: the form is those of the arguments of its constructor that have one."""
    hints, parts = get_type_hints(kind, include_extras=True), []
    for name in [field.name for field in fields(kind) if field.init]:
        attribute, hint = name, hints[name]
        if get_origin(hint) is Annotated:
            (mark,) = hint.__metadata__
            attribute, hint = mark.attribute, mark.kind
        parts.append((name, attrgetter(attribute), _codec_of(hint)))
    names = [name for name, _, codec in parts if codec.has_form]
    writers = [(getter, codec.write, codec.has_form) for _, getter, codec in parts]

    def write(record: Any, numbers: list[float]) -> Form:
        form = []
        for getter, write_part, has_form in writers:
            part = write_part(getter(record), numbers)
            if has_form:
                form.append(part)
        return tuple(form)

    def bind(form: Any) -> _Reader:
        of_part = dict(zip(names, form, strict=True))
        readers = {name: codec.bind(of_part.get(name)) for name, _, codec in parts}
        nothing: Iterator[float] = iter(())
        words = {name: readers.pop(name)(nothing) for name, _, codec in parts if not codec.has_numbers}
        if not readers:
            record = kind(**words)
            return lambda _: record
        pairs = list(readers.items())
        return lambda rest: kind(**words, **{name: reader(rest) for name, reader in pairs})

    return _Codec(write, bind, has_numbers=any(codec.has_numbers for _, _, codec in parts))


def _optional_codec(*hints: Any) -> _Codec:
    """Return the codec of a value or None, of which the form is None; that of a number is True."""
    (codec,) = (_codec_of(hint) for hint in hints if hint is not NoneType)

    def write(value: Any, numbers: list[float]) -> Any:
        if value is None:
            return None
        form = codec.write(value, numbers)
        return form if codec.has_form else True

    def bind(form: Any) -> _Reader:
        return (lambda _: None) if form is None else codec.bind(form)

    return _Codec(write, bind, has_numbers=codec.has_numbers)


def _array_codec(_: Any, dtype_hint: Any) -> _Codec:
    """Return the codec of an array: the form is its shape."""
    (dtype,) = get_args(dtype_hint)

    def write(values: Any, numbers: list[float]) -> Form:
        array = np.asarray(values, dtype=np.float64)
        numbers += array.ravel().tolist()
        return array.shape

    def bind(form: Any) -> _Reader:
        shape = tuple(map(_check_length, form))
        size = prod(shape)
        return lambda rest: freeze(np.array([*islice(rest, size)], np.float64).reshape(shape), dtype)

    return _Codec(write, bind)


def _mapping_codec(_: Any, value_hint: Any) -> _Codec:
    """Return the codec of {word: value}: the form is the words and, if they have any, the forms of the values."""
    codec = _codec_of(value_hint)

    def write(values: Any, numbers: list[float]) -> Form:
        parts = [codec.write(value, numbers) for value in values.values()]
        names = tuple(map(_plain, values))
        return (names, tuple(parts)) if codec.has_form else names

    def bind(form: Any) -> _Reader:
        names, parts = form if codec.has_form else (form, [None] * len(form))
        readers = [(_check_word(name), codec.bind(part)) for name, part in zip(names, parts, strict=True)]
        return lambda rest: {name: reader(rest) for name, reader in readers}

    return _Codec(write, bind, has_numbers=codec.has_numbers)


def _sequence_codec(hint: Any, *_: Any, kind: type = tuple) -> _Codec:
    """Return the codec of values in a row: the form is that of each, or their number if they have none."""
    codec = _codec_of(hint)

    def write(values: Any, numbers: list[float]) -> Any:
        parts = [codec.write(value, numbers) for value in (sorted(values) if kind is frozenset else values)]
        return tuple(parts) if codec.has_form else len(parts)

    def bind(form: Any) -> _Reader:
        if not codec.has_form:
            length, reader = _check_length(form), codec.bind(None)
            return lambda rest: kind([reader(rest) for _ in range(length)])
        readers = [codec.bind(part) for part in form]
        return lambda rest: kind([reader(rest) for reader in readers])

    return _Codec(write, bind, has_numbers=codec.has_numbers)


def _plain(word: str) -> str:
    return word if type(word) is str else str.__str__(word)  # A plugin's may be of a type of its own.


def _check(form: Any, fits: bool) -> Any:
    if not fits:
        raise ValueError(f"{form!r} is not what the declaration says")
    return form


def _check_word(form: Any) -> Any:
    return _check(form, type(form) is str)


def _check_length(form: Any) -> Any:
    return _check(form, type(form) is int and form >= 0)


def _read_int(rest: Iterator[float]) -> int:
    number = next(rest)
    return int(_check(number, number.is_integer()))


def _number(reader: _Reader) -> _Codec:
    return _Codec(lambda value, numbers: numbers.append(float(value)), lambda _: reader, has_form=False)


_LEAVES: dict[Any, _Codec] = {
    float: _number(next),
    int: _number(_read_int),
    bool: _constant(lambda form: _check(form, type(form) is bool), bool),
    str: _constant(_check_word, _plain),
}
_OF_ORIGINS: dict[Any, Callable[..., _Codec]] = {
    Literal: lambda *words: _constant(lambda form: _check(form, form in words)),
    Union: _optional_codec,
    UnionType: _optional_codec,
    np.ndarray: _array_codec,
    Mapping: _mapping_codec,
    Sequence: _sequence_codec,
    tuple: _sequence_codec,
    frozenset: partial(_sequence_codec, kind=frozenset),
}
