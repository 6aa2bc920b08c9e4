"""Two blocks in OpenSees alone, one on the other, of height 1 and E = 1, pressed together by 0.1."""

from itertools import pairwise

import openseespy.opensees as ops


def press(upper, lower, stiffness=10.0, handler="Transformation"):
    """Return whether it converged, and the pressure of each upper element, of blocks with columns at these places x."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 2)
    ops.nDMaterial("ElasticIsotropic", 1, 1.0, 0.0)
    rows, nodes = [], 0
    for places, y in ((upper, 0), (upper, 1), (lower, -1), (lower, 0)):
        rows.append(range(nodes + 1, nodes + 1 + len(places)))
        nodes += len(places)
        for number, x in zip(rows[-1], places, strict=True):
            ops.node(number, float(x), float(y))
            ops.fix(number, int(x in (places[0], places[-1])), int(y == -1))  # Rollers at the sides
    number = 0
    for low, high in (rows[:2], rows[2:]):
        for first, above in zip(low[:-1], high[:-1], strict=True):
            number += 1
            ops.element("quad", number, first, first + 1, above + 1, above, 1.0, "PlaneStrain", 1)
    counts = ("-sNdNum", len(upper), "-mNdNum", len(lower))
    # The body of either surface is on the left.
    ops.element("zeroLengthContactNTS2D", number + 1, *counts, "-Nodes", *rows[0], *rows[3][::-1], stiffness, 0.0, 0.0)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node in rows[1]:
        ops.sp(node, 2, -0.1)
    ops.constraints(handler)
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-12, 60, 0)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    converged = ops.analyze(1) == 0
    y = {node: ops.nodeDisp(node, 2) for node in (*rows[0], *rows[1])}
    heights = [y[low] - y[high] for low, high in zip(rows[0], rows[1], strict=True)]
    return converged, [(a + b) / 2 for a, b in pairwise(heights)]
