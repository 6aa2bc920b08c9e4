"""A few plugins that a test asks in a process of their own, which this file is the program of."""

import sys

if __name__ == "__main__":
    sys.path[:], sys.argv[1:] = sys.argv[1:], []

import contextlib
import os
import signal
import time
from importlib import import_module

import numpy as np
from scipy import sparse

from contactverif import Handle, Subject
from contactverif.isolation.remote import python_program
from contactverif.isolation.worker import main
from contactverif.plugins.registry import subject_of

PROGRAM = python_program(__file__)


class Springs:
    """Springs from the slave nodes to the line y = 0: right enough for a test of how answers travel."""

    def __init__(self, *, penalty):
        self.penalty = penalty

    def pair(self, interface, z):
        return {"active": z[1 : 2 * interface.n_slave_nodes : 2] < 0}

    def residual(self, interface, pairing, z):
        forces = np.zeros_like(z)
        depths = slice(1, 2 * interface.n_slave_nodes, 2)
        forces[..., depths] = self.penalty * np.where(pairing["active"], z[..., depths], 0)
        return forces


class NoNumberTangent(Springs):
    """Its tangent holds no number."""

    def tangent(self, interface, pairing, z):
        return np.full((z.size, z.size), np.nan)


class HandledSprings(Springs):
    """Springs again; who is active is in an object that cannot leave the process."""

    def pair(self, interface, z):
        active = super().pair(interface, z)["active"]
        return {"object": Handle(lambda: active)}

    def residual(self, interface, pairing, z):
        return super().residual(interface, {"active": pairing.handle()}, z)


class HandledAtTimes(HandledSprings):
    def pair(self, interface, z):
        return super().pair(interface, z) if z[0] < 1000 else Springs.pair(self, interface, z)


class KnowsItsProcess(Springs):
    """Its forces depend on the seed of hashes, which differs from process to process."""

    def residual(self, interface, pairing, z):
        return super().residual(interface, pairing, z) * (1 + 1e-9 * (hash("spring") % 1000))


class WearsOut(Springs):
    """Its forces are one percent too large after 500 calls of one instance."""

    calls = 0

    def residual(self, interface, pairing, z):
        self.calls += 1
        return super().residual(interface, pairing, z) * (1.01 if self.calls > 500 else 1.0)


class WrongAtFirst(Springs):
    """Its first forces in a process are one percent too large."""

    answered = False

    def residual(self, interface, pairing, z):
        factor = 1.0 if WrongAtFirst.answered else 1.01
        WrongAtFirst.answered = True
        return super().residual(interface, pairing, z) * factor


def count_threads():
    """Return how many threads OpenMP, linear algebra and numba may use here."""
    import numba
    from threadpoolctl import threadpool_info

    libraries = [entry["num_threads"] for entry in threadpool_info()]
    return int(os.environ.get("OMP_NUM_THREADS", "0")), max(libraries), numba.get_num_threads()


class PairsByThreads(Springs):
    """Its pairing depends on the number of threads, and on that of the cores that its process had at its first call.

    TBB counts those cores once.
    """

    cores = 0

    def pair(self, interface, z):
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
        PairsByThreads.cores = PairsByThreads.cores or cores
        return {**super().pair(interface, z), "threads": np.array([*count_threads(), PairsByThreads.cores])}


class RaisesInMake:
    def __init__(self, *, penalty):
        if penalty != 1.0:
            raise ValueError("no other penalty")

    def residual(self, interface, pairing, z):
        return np.zeros_like(z)


class KillsAtTimes(Springs):
    """It ends its process in some states, on a slave of many nodes."""

    def residual(self, interface, pairing, z):
        if interface.n_slave_nodes >= 6:
            os.kill(os.getpid(), signal.SIGSEGV)
        return super().residual(interface, pairing, z)


class Counts(Springs):
    """It has multipliers, and promises none."""

    def n_multipliers(self, interface):
        return 3


class Matrix(Springs):
    """Its tangent is a sparse matrix of scipy; the penalty says which."""

    def tangent(self, interface, pairing, z):
        depths = np.arange(1, 2 * interface.n_slave_nodes, 2)
        entries = sparse.coo_array((1.0 * pairing["active"], (depths, depths)), shape=(z.size, z.size))
        return MATRICES[self.penalty](entries)


def _change(part, change):
    """Return a function that makes a matrix of which a part is changed."""

    def make(entries):
        matrix = entries.tocsr()
        setattr(matrix, part, change(getattr(matrix, part)))
        return matrix

    return make


MATRICES = {
    1.0: sparse.coo_array.tocsr,
    2.0: sparse.coo_array.tocsc,
    3.0: sparse.coo_array.tobsr,
    4.0: sparse.coo_array.tocoo,
    # A type of indices that nobody else uses.
    5.0: _change("indices", lambda indices: indices.astype(np.int16)),
}
WRONG_MATRICES = {
    6.0: _change("indices", lambda indices: indices + np.int32(10**6)),
    7.0: _change("indices", lambda indices: indices[:-1]),
    8.0: _change("data", lambda data: data * np.nan),
}
MATRICES |= WRONG_MATRICES


class LoadsLibrary(Springs):
    """It loads compiled code that nobody else needs."""

    def __init__(self, *, penalty):
        import_module("_curses")
        super().__init__(penalty=penalty)


def write_everywhere(data):
    """Write to every open file of the process, so also to the line to the judge."""
    for number in range(3, 1000):
        with contextlib.suppress(OSError):
            os.write(number, data)


def cut_everywhere():
    """Cut and fill every open file of the process, so also the one that tells how far it is."""
    for number in range(3, 1000):
        with contextlib.suppress(OSError):
            os.pwrite(number, b"\xff" * 100, 0)
            os.ftruncate(number, 0)


def throw(error):
    raise error


class Forges(Springs):
    def residual(self, interface, pairing, z):
        write_everywhere(b"\x03" + b"\x00" * 7 + b"abc" * 100)
        return super().residual(interface, pairing, z)


class Unspeakable(Exception):
    def __str__(self):
        raise RuntimeError


class Prints(Springs):
    def residual(self, interface, pairing, z):
        print("printed", flush=True)
        os.write(2, b"and written\n")
        return super().residual(interface, pairing, z)


class LeavesChildren(Springs):
    """It starts a daemon in a session of its own."""

    def residual(self, interface, pairing, z):
        if os.fork() == 0:
            os.setsid()
            if os.fork() == 0:
                time.sleep(1000)
            os._exit(0)
        return super().residual(interface, pairing, z)


# {plugin: its method, and what that does instead}
INSTEAD = {
    "Kills": ("residual", lambda: os.kill(os.getpid(), signal.SIGSEGV)),
    "Exits": ("residual", lambda: (print("good bye", flush=True), os._exit(0))),
    "ExitsWithMinusOne": ("residual", lambda: os._exit(-1)),
    "KillsInPair": ("pair", os.abort),
    "RaisesInPair": ("pair", lambda: throw(RuntimeError("no pairing today"))),
    "Hangs": ("residual", lambda: time.sleep(1000)),
    "HangsInPair": ("pair", lambda: time.sleep(1000)),
    "Cuts": ("residual", lambda: (cut_everywhere(), time.sleep(1000))),
    "TakesAll": ("residual", lambda: np.ones(10**12)),
    # It promises an answer of an exabyte.
    "TooLong": ("residual", lambda: (write_everywhere(b"\xff" * 6 + b"\x00" * 2), time.sleep(1000))),
    "RaisesUnspeakable": ("residual", lambda: throw(Unspeakable())),
    "Shouts": ("residual", lambda: throw(ValueError("x" * 20_000_000))),
}
for _name, (_method, _act) in INSTEAD.items():
    globals()[_name] = type(_name, (Springs,), {_method: lambda self, *_, act=_act: act()})


def load(name: str) -> Subject:
    """Return the formulation of a class above."""
    return subject_of(name, globals()[name])


if __name__ == "__main__":
    main(load, load)
