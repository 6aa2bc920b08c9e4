"""A formulation as a program that speaks the protocol and imports nothing of contactverif: springs to y = 0."""

import os
import socket
import struct
import time

import msgspec
import numpy as np

line = socket.socket(fileno=int(os.environ["CONTACTVERIF_SOCKET"]))
stream = line.makefile("rb")
items = {}  # {number: a penalty, an interface or a pairing}


def pack(array):
    return [array.dtype.str, array.shape, array.tobytes()]


def unpack(packed):
    dtype, shape, data = packed
    return np.frombuffer(data, dtype).reshape(shape)


def depths(interface):
    """Return the numbers of the unknowns y of the slave nodes."""
    return 2 * np.unique(interface[1]) + 1


def pair(penalty, interface, pairing, z):
    return {"active": z[depths(interface)] < 0}


def residual(penalty, interface, pairing, z):
    forces, y = np.zeros_like(z), depths(interface)
    forces[..., y] = penalty * np.where(pairing["active"], z[..., y], 0)
    return {"residual": forces}


def tangent(penalty, interface, pairing, z):
    y = depths(interface)
    return {"row": y, "col": y, "data": penalty * pairing["active"].astype(float)}


METHODS = {"pair": pair, "residual": residual, "tangent": tangent}


def answer(question, method, formulation, interface, pairing, z, timed, counted):
    arguments = items[formulation], items[interface], items.get(pairing), unpack(z)
    start = time.perf_counter()
    arrays = METHODS[method](*arguments)
    if method == "pair":
        items[question] = arrays
    seconds = time.perf_counter() - start
    return ["answer", question, {name: pack(array) for name, array in arrays.items()}, seconds, 0]


def reply(kind, *content):
    """Return the reply to a message; None if it has none."""
    if kind == "ask":
        try:
            return answer(*content)
        except Exception as error:
            return ["failure", content[0], "plugin", "exception", [f"{content[1]}: {error!r}"]]
    if kind == "load":
        question, name, _ = content
        return ["loaded", question, {}, [*METHODS]] if name == "springs" else ["unloaded", question, "no such springs"]
    if kind == "forget":
        for number in content[0]:
            items.pop(number, None)
    elif kind == "make":
        items[content[0]] = content[1]
    elif kind == "interface":
        items[content[0]] = [unpack(array) for array in content[1:]]
    elif kind == "pairing":
        items[content[0]] = {name: unpack(array) for name, array in content[1].items()}
    return None


while head := stream.read(8):
    messages = msgspec.msgpack.decode(stream.read(*struct.unpack("<Q", head)))
    replies = [each for each in (reply(*message) for message in messages) if each is not None]
    if replies:
        frame = msgspec.msgpack.encode(replies)
        line.sendall(struct.pack("<Q", len(frame)) + frame)
