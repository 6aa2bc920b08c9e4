"""The memory that the judge takes for what a plugin sends is little, whatever comes and however much of it."""

import struct
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import msgspec
import pytest
from isolation import bombs, hostile_few

from contactverif import Subject, named_case
from contactverif.contract.errors import PluginError
from contactverif.contract.result import NotLoaded
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import RemoteSubject, load_remote
from contactverif.isolation.wire import MessageError, decode_replies

CASE = named_case("c")
QUICK = Limits(seconds=20.0, memory=2000)
MANY = 1_000_000
MEGABYTE = 1 << 20

pack = msgspec.msgpack.encode


def many(kind: int, count: int = MANY) -> bytes:
    """Return the head of a list (0xdd) or a mapping (0xdf) of so many entries."""
    return bytes([kind]) + struct.pack(">I", count)


def message(*parts: object) -> bytes:
    """Return a list of one message; bytes among its parts are encoded already."""
    encoded = [part if isinstance(part, bytes) else pack(part) for part in parts]
    return b"".join([bytes([0x91, 0x90 + len(parts)]), *encoded])


@contextmanager
def most_memory(n_bytes: float) -> Iterator[None]:
    """Open a block that may take so many bytes at a time."""
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] <= n_bytes
    finally:
        tracemalloc.stop()


LONG_SHAPE = b"\x81\xa8residual\x93\xa3<f8" + many(0xDD) + b"\x01" * MANY + b"\xc4\x00"
MANY_NAMES = b"".join([many(0xDF), *(b"\xa8%8d\x93\xa3<f8\x91\x00\xc4\x00" % number for number in range(MANY))])
LISTS = b"\x81\xa1a" + many(0xDD) + b"\x90" * MANY


@pytest.mark.parametrize(
    ("data", "loading"),
    [
        (message("answer", 1, LONG_SHAPE, 0.0, 0.0), False),
        (message("answer", 1, MANY_NAMES, 0.0, 0.0), False),
        (message("failure", 1, "plugin", "exception", many(0xDD) + b"\xa0" * MANY), False),
        (many(0xDD) + pack(["failure", 1, "plugin", "exception", []]) * MANY, False),
        (message("loaded", 1, LISTS, []), False),
        (message("loaded", 1, {}, many(0xDD) + b"\xa1a" * MANY), True),
        (many(0xDD) + pack(["unloaded", 1, ""]) * MANY, True),
        (message("answer", 1, {}, 0.0, 0.0), True),
    ],
    ids=["shape", "names", "words", "replies", "traits of no question", "methods", "loads", "answer of no question"],
)
def test_a_message_with_very_much_in_it_is_refused_by_its_head(data: bytes, loading: bool) -> None:
    with most_memory(20_000), pytest.raises(MessageError):
        decode_replies(data, loading=loading)


def load(name: str) -> Subject:
    subject = load_remote(bombs.PROGRAM, name, QUICK)
    assert isinstance(subject, Subject), subject
    return subject


def test_an_answer_has_no_more_bytes_than_its_question_may_need() -> None:
    formulation = load("LongAnswer").for_case(CASE)
    pairing = formulation.pair(CASE.interface, CASE.z)
    most = (1 << 20) + (1 << 17) * CASE.z.size
    with pytest.raises(PluginError, match=f"residual: an answer of 104857600 bytes; needed at most {most}") as caught:
        formulation.residual(CASE.interface, pairing, CASE.z)
    assert caught.value.cause == "memory"


def test_traits_have_no_more_than_a_megabyte() -> None:
    refused = load_remote(bombs.PROGRAM, "LongTraits", QUICK)
    assert isinstance(refused, NotLoaded)
    assert refused.reason == "memory: import: an answer of 2097152 bytes; needed at most 1048576"


@pytest.mark.parametrize("look", [dict, bool], ids=["looked into", "used"])
def test_pairings_that_nobody_holds_are_not_kept(look: Callable[[object], object]) -> None:
    formulation = load("LargePairings").for_case(CASE)
    with most_memory(20 * MEGABYTE):
        for number in range(40):
            z = CASE.z + 1e-6 * number
            pairing = formulation.pair(CASE.interface, z)
            formulation.residual(CASE.interface, pairing, z)
            look(pairing)


def test_pairings_that_go_to_a_second_process_are_not_kept() -> None:
    subject = load("LargePairings")
    assert isinstance(subject, RemoteSubject)
    first, second = (each.for_case(CASE) for each in (subject, subject.restart()))
    with most_memory(20 * MEGABYTE):
        for number in range(40):
            z = CASE.z + 1e-6 * number
            pairing = first.pair(CASE.interface, z)
            forces = [formulation.residual(CASE.interface, pairing, z) for formulation in (first, second)]
            assert (forces[0] == forces[1]).all()


def test_a_pairing_that_is_held_is_the_same_however_many_others_came() -> None:
    formulation = load_remote(hostile_few.PROGRAM, "HandledSprings", QUICK).for_case(CASE)
    first = formulation.own_pairing(CASE.interface, CASE.z)
    forces = formulation.residual(CASE.interface, first, CASE.z)
    for number in range(200):
        z = -CASE.z - number
        formulation.residual(CASE.interface, formulation.own_pairing(CASE.interface, z), z)
    assert (formulation.residual(CASE.interface, first, CASE.z) == forces).all()
