"""OpenSeesPy 3.7.1.2: where a node faces a node, rounding decides how many springs push it.

Two flat surfaces penetrate each other by 1/4. The stiffness is 4, so that each spring pushes with a force of 1. The
force on the middle slave node should not depend on how the whole scene is turned.
"""

import numpy as np
import openseespy.opensees as ops


def push(degrees: float, shift: float) -> float:
    """Return the force on the middle slave node, whose partner on the master is shifted along the surface."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, -s], [s, c]])
    slave = [[-1, -0.25], [0, -0.25], [1, -0.25]]
    master = [[1.5 + shift, 0], [shift, 0], [-1.5 + shift, 0]]
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 2)
    for tag, place in enumerate([*slave, *master]):
        ops.node(tag, *(turn @ place).tolist())
    counts = "-sNdNum", 3, "-mNdNum", 3
    ops.element("zeroLengthContactNTS2D", 1, *counts, "-Nodes", *range(6), 4.0, 0.0, 0.0)
    return -float((np.reshape(ops.eleForce(1), (6, 2)) @ turn)[1, 1])


if __name__ == "__main__":
    for degrees in (0, 1, 5, 30, 45, 90, 180):
        print(f"turned by {degrees:3}: force {push(degrees, 0.0):.2f}")
