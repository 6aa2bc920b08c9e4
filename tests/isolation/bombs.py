"""Plugins that send the judge more than an answer needs, or less at a time; this file is their program."""

import sys

if __name__ == "__main__":
    sys.path[:], sys.argv[1:] = sys.argv[1:], []

import contextlib
import os
import struct
import time

import numpy as np
from isolation.hostile_few import Springs

from contactverif.isolation.remote import python_program
from contactverif.isolation.worker import main
from contactverif.plugins.registry import subject_of

PROGRAM = python_program(__file__)
MEGABYTE = 1 << 20


def write(data):
    """Write to the line to the judge, which is the only socket here."""
    for number in range(3, 1000):
        with contextlib.suppress(OSError):
            if os.readlink(f"/proc/self/fd/{number}").startswith("socket"):
                os.write(number, data)


class LongAnswer(Springs):
    """It says that 100 MB of forces come."""

    def residual(self, interface, pairing, z):
        write(struct.pack("<Q", 100 * MEGABYTE))
        time.sleep(1000)


class LongTraits(Springs):
    """It says that 2 MB of traits come, when it loads."""

    def __init__(self, *, penalty):
        write(struct.pack("<Q", 2 * MEGABYTE))
        time.sleep(1000)


class LargePairings(Springs):
    """Every pairing has a megabyte."""

    def pair(self, interface, z):
        return super().pair(interface, z) | {"large": np.zeros(MEGABYTE // 8, np.int64)}


class Dribbles(Springs):
    """Its answer comes byte by byte, and it counts that as progress."""

    def residual(self, interface, pairing, z):
        write(struct.pack("<Q", 1000))
        for count in range(1000):
            for number in range(3, 1000):
                with contextlib.suppress(OSError):  # The file of the progress is one of them.
                    os.pwrite(number, bytes([count % 256]), 0)
            write(b"\x91")
            time.sleep(0.05)


def load(name):
    """Return the formulation of a class above."""
    return subject_of(name, globals()[name])


if __name__ == "__main__":
    main(load, load)
