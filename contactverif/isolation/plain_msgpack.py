"""MessagePack for a program that has nothing but Python: none, booleans, numbers, text, bytes, lists and mappings."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

_WORDS = {0xC0: None, 0xC2: False, 0xC3: True}
_FORMS = ("B", "H", "I", "Q", "b", "h", "i", "q")
_NUMBERS = {0xCA: ">f", 0xCB: ">d", **{0xCC + n: f">{form}" for n, form in enumerate(_FORMS)}}
# {first byte: form of the length that follows}
_BYTES, _TEXTS = {0xC4: ">B", 0xC5: ">H", 0xC6: ">I"}, {0xD9: ">B", 0xDA: ">H", 0xDB: ">I"}
_LISTS, _MAPS = {0xDC: ">H", 0xDD: ">I"}, {0xDE: ">H", 0xDF: ">I"}

_Reader = Callable[[memoryview, int, int], tuple[Any, int]]


def encode(item: Any) -> bytes:
    """Return an object as bytes."""
    for kind, write in _WRITERS.items():
        if isinstance(item, kind):
            return write(item)
    raise TypeError(f"a {type(item).__name__} cannot be encoded")


def _write_several(head: bytes, count: int, items: Any) -> bytes:
    return head + struct.pack(">I", count) + b"".join(map(encode, items))


_WRITERS: dict[Any, Callable[[Any], bytes]] = {
    type(None): lambda _: b"\xc0",
    bool: lambda item: b"\xc3" if item else b"\xc2",  # It stands before int, of which it is a kind.
    int: lambda item: b"\xd3" + struct.pack(">q", item),
    float: lambda item: b"\xcb" + struct.pack(">d", item),
    str: lambda item: b"\xdb" + struct.pack(">I", len(item.encode())) + item.encode(),
    bytes: lambda item: b"\xc6" + struct.pack(">I", len(item)) + item,
    (list | tuple): lambda item: _write_several(b"\xdd", len(item), item),
    dict: lambda item: _write_several(b"\xdf", len(item), [part for pair in item.items() for part in pair]),
}


def decode(data: bytes) -> Any:
    """Return the object that bytes stand for; a ValueError says that they stand for none."""
    item, end = _read(memoryview(data), 0)
    if end != len(data):
        raise ValueError(f"{len(data) - end} bytes too many")
    return item


def _read(data: memoryview, place: int) -> tuple[Any, int]:
    """Return the object that begins at a place, and the place behind it."""
    head = data[place]
    if head < 0x80 or head >= 0xE0:
        return head - 0x100 * (head >= 0xE0), place + 1
    if head in _WORDS:
        return _WORDS[head], place + 1
    if head in _NUMBERS:
        return _unpack(_NUMBERS[head], data, place + 1)
    for forms, low, high, read in _KINDS:
        if low <= head < high:
            return read(data, place + 1, head - low)
        if head in forms:
            size, begin = _unpack(forms[head], data, place + 1)
            return read(data, begin, size)
    raise ValueError(f"an object of the unknown kind {head:#x}")


def _read_bytes(data: memoryview, place: int, size: int) -> tuple[bytes, int]:
    return bytes(data[place : place + size]), place + size


def _read_text(data: memoryview, place: int, size: int) -> tuple[str, int]:
    return bytes(data[place : place + size]).decode(), place + size


def _read_list(data: memoryview, place: int, count: int) -> tuple[list[Any], int]:
    items = []
    for _ in range(count):
        item, place = _read(data, place)
        items.append(item)
    return items, place


def _read_map(data: memoryview, place: int, count: int) -> tuple[dict[Any, Any], int]:
    items, place = _read_list(data, place, 2 * count)
    return dict(zip(items[::2], items[1::2], strict=True)), place


# The forms of lengths, the first bytes that hold a short length, from and to, and the reader.
_KINDS: tuple[tuple[dict[int, str], int, int, _Reader], ...] = (
    (_MAPS, 0x80, 0x90, _read_map),
    (_LISTS, 0x90, 0xA0, _read_list),
    (_TEXTS, 0xA0, 0xC0, _read_text),
    (_BYTES, 0, 0, _read_bytes),
)


def _unpack(form: str, data: memoryview, place: int) -> tuple[Any, int]:
    return struct.unpack_from(form, data, place)[0], place + struct.calcsize(form)
