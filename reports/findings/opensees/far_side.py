"""OpenSeesPy 3.7.1.2: a node is pushed by every master segment that it lies behind, however deep.

A slave node is 1/32 deep in the upper side of a wedge, and 1.6 deep behind its lower side. Only the upper side touches.
"""

import numpy as np
import openseespy.opensees as ops

WEDGE = [[8.0, 0.0], [4.0, 0.0], [0.0, 0.0], [4.0, -3.0], [8.0, -6.0]]  # The upper side first, the body on the left.


def push(master: list[list[float]]) -> tuple[float, float]:
    """Return the force on the slave node at (2.0, -1/32), with a stiffness of 32."""
    slave = [[1.5, -0.03125], [2.0, -0.03125], [2.5, -0.03125]]
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 2)
    for tag, place in enumerate([*slave, *master]):
        ops.node(tag, *place)
    nodes = range(3 + len(master))
    counts = "-sNdNum", 3, "-mNdNum", len(master)
    ops.element("zeroLengthContactNTS2D", 1, *counts, "-Nodes", *nodes, 32.0, 0.0, 0.0)
    x, y = np.negative(ops.eleForce(1)[2:4])
    return float(x), float(y)


if __name__ == "__main__":
    x, y = push(WEDGE)
    print(f"whole wedge: force on the slave node {x:.3f}, {y:.3f}; it should be pushed up")
