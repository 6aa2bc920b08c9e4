"""OpenSeesPy 3.7.1.2: the stiffness leaves out that the normal turns with the segment.

One slave node is over one segment. The stiffness is compared with a central difference of the forces.
"""

import numpy as np
import openseespy.opensees as ops


def error(depth: float) -> float:
    """Return the largest error of an entry of the stiffness, relative to the largest entry."""
    places = np.array([[0.3, -depth], [9.0, 9.0], [1.0, 0.0], [0.0, 0.0]])  # The second slave node is far away.

    def ask(x: np.ndarray, answer: str) -> np.ndarray:
        ops.wipe()
        ops.model("basic", "-ndm", 2, "-ndf", 2)
        for tag, place in enumerate(x.reshape(-1, 2).tolist()):
            ops.node(tag, *place)
        counts = "-sNdNum", 2, "-mNdNum", 2
        ops.element("zeroLengthContactNTS2D", 1, *counts, "-Nodes", *range(4), 1.0, 0.0, 0.0)
        return np.array(ops.eleResponse(1, answer))

    x, h = places.ravel(), 1e-6
    differences = [(ask(x + h * e, "force") - ask(x - h * e, "force")) / (2 * h) for e in np.eye(8)]
    return float(np.abs(ask(x, "stiff").reshape(8, 8) - np.transpose(differences)).max())


if __name__ == "__main__":
    print(*(f"depth {depth}: error {error(depth):.1e}" for depth in (0.3, 0.1, 0.01)), sep="\n")
