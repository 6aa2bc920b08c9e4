"""MessagePack for a program that has nothing but Python: none, booleans, numbers, text, bytes, lists and mappings."""

from __future__ import annotations

import struct
from io import BytesIO
from typing import Any

_WORDS = {0xC0: None, 0xC2: False, 0xC3: True}
_NUMBERS = {0xCA: ">f", 0xCB: ">d", **{0xCC + n: f">{form}" for n, form in enumerate("BHIQbhiq")}}
# The kind of an object with a length, from and to the first bytes that hold a short length, and {first byte: form of
# the length that follows}.
_KINDS: tuple[tuple[type, range, dict[int, str]], ...] = (
    (dict, range(0x80, 0x90), {0xDE: ">H", 0xDF: ">I"}),
    (list, range(0x90, 0xA0), {0xDC: ">H", 0xDD: ">I"}),
    (str, range(0xA0, 0xC0), {0xD9: ">B", 0xDA: ">H", 0xDB: ">I"}),
    (bytes, range(0), {0xC4: ">B", 0xC5: ">H", 0xC6: ">I"}),
)


def encode(item: Any) -> bytes:
    """Return an object as bytes."""
    match item:
        case None:
            return b"\xc0"
        case bool():  # It stands before int, of which it is a kind.
            return b"\xc3" if item else b"\xc2"
        case int():
            return struct.pack(">Bq", 0xD3, item)
        case float():
            return struct.pack(">Bd", 0xCB, item)
        case str():
            text = item.encode()
            return struct.pack(">BI", 0xDB, len(text)) + text
        case bytes():
            return struct.pack(">BI", 0xC6, len(item)) + item
        case list() | tuple():
            return struct.pack(">BI", 0xDD, len(item)) + b"".join(map(encode, item))
        case dict():
            pairs = (encode(key) + encode(value) for key, value in item.items())
            return struct.pack(">BI", 0xDF, len(item)) + b"".join(pairs)
    raise TypeError(f"a {type(item).__name__} cannot be encoded")


def decode(data: bytes) -> Any:
    """Return the object that bytes stand for; a ValueError says that they stand for none."""
    stream = BytesIO(data)
    item = _read(stream)
    if rest := stream.read():
        raise ValueError(f"{len(rest)} bytes too many")
    return item


def _read(stream: BytesIO) -> Any:
    head = stream.read(1)[0]
    if head < 0x80 or head >= 0xE0:
        return head - 0x100 * (head >= 0xE0)
    if head in _WORDS:
        return _WORDS[head]
    if head in _NUMBERS:
        return _unpack(_NUMBERS[head], stream)
    for kind, short, forms in _KINDS:
        if head not in short and head not in forms:
            continue
        size = head - short.start if head in short else _unpack(forms[head], stream)
        if kind is list:
            return [_read(stream) for _ in range(size)]
        if kind is dict:
            return {_read(stream): _read(stream) for _ in range(size)}
        data = stream.read(size)
        return data if kind is bytes else data.decode()
    raise ValueError(f"an object of the unknown kind {head:#x}")


def _unpack(form: str, stream: BytesIO) -> Any:
    return struct.unpack(form, stream.read(struct.calcsize(form)))[0]
