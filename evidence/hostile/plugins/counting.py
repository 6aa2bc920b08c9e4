"""No hostile plugin, but a witness: VTS-PPT, which notes in a file which states it was asked about.

The environment variable CASES_ASKED names the file. Each state gives a line of fixed length, appended in one write, so
that a line is whole even if the process is killed.
"""

import hashlib
import os
import time
from typing import Any

import contactverif_nts

SECONDS = 0.002  # A pause in each call, so that a kill finds cases in flight.


class Counting:
    """VTS-PPT with a note of each state that is paired."""

    def __init__(self, penalty: float) -> None:
        self._right = contactverif_nts.vts_ppt(penalty=penalty)
        self.traits = self._right.traits

    def pair(self, interface: Any, z: Any) -> Any:
        if file := os.environ.get("CASES_ASKED"):
            line = hashlib.sha256(interface.nodes.tobytes() + z.tobytes()).hexdigest()[:31].encode() + b"\n"
            number = os.open(file, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
            os.write(number, line)
            os.close(number)
            time.sleep(SECONDS)
        return self._right.pair(interface, z)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._right.residual(interface, pairing, z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._right.tangent(interface, pairing, z)


def make(*, penalty: float) -> Any:
    """Make VTS-PPT that notes what it is asked."""
    return Counting(penalty)
