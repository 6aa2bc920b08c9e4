"""Two strips in CalculiX alone, one on the other, 1 high and 1 thick, pressed together by 0.01."""

import subprocess
import tempfile
from pathlib import Path

PUSHED, STIFFNESS = 0.01, 100.0


def press(upper, lower, kind="SURFACE TO SURFACE", modulus=1.0):
    """Return how ccx ends, and the displacements of the slave's nodes across the contact.

    The columns of the strips are between these places x. The upper strip is the slave, and its upper side is pushed
    down. Springs hold the slave's nodes along z with mortar contact, which finds no pivot where supports do.
    """
    lines, nodes, cells, held = ["*NODE, NSET=ALL"], [], [], []
    for xs, base in ((upper, 0), (lower, -1)):
        first, n = len(nodes) + 1, len(xs)
        nodes += [(x, y, z) for z in (0, 1) for y in (base, base + 1) for x in xs]
        cells += [
            (a, a + 1, a + 1 + n, a + n, a + 2 * n, a + 1 + 2 * n, a + 1 + 3 * n, a + 3 * n)
            for a in range(first, first + n - 1)
        ]
        outer, move = (first + n, -PUSHED) if base == 0 else (first, 0.0)
        held += [(node, move) for a in (outer, outer + 2 * n) for node in range(a, a + n)]
    lines += [f"{k}, {x:.12e}, {y}, {z}" for k, (x, y, z) in enumerate(nodes, 1)]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=E", *(f"{k}, {', '.join(map(str, c))}" for k, c in enumerate(cells, 1))]
    above = len(upper) - 1
    lines += ["*SURFACE, NAME=S", *(f"{k}, S3" for k in range(1, above + 1))]
    lines += ["*SURFACE, NAME=M", *(f"{k}, S5" for k in range(above + 1, len(cells) + 1))]
    slave = [k for k in (*range(1, len(upper) + 1), *range(2 * len(upper) + 1, 3 * len(upper) + 1)) if "MORTAR" in kind]
    if slave:
        lines += ["*ELEMENT, TYPE=SPRING1, ELSET=Z", *(f"{len(cells) + k}, {n}" for k, n in enumerate(slave, 1))]
        lines += ["*SPRING, ELSET=Z", "3", f"{1e7 * modulus:.6e}"]
    lines += ["*MATERIAL, NAME=A", "*ELASTIC", f"{modulus:.6e}, 0.", "*SOLID SECTION, ELSET=E, MATERIAL=A"]
    lines += [
        "*SURFACE INTERACTION, NAME=C",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{STIFFNESS * modulus:.6e}",
    ]
    lines += [f"*CONTACT PAIR, INTERACTION=C, TYPE={kind}", "S, M", "*STEP", "*STATIC", "1., 1."]
    across = [f"{k}, 3, 3" for k in range(1, len(nodes) + 1) if k not in slave]
    lines += ["*BOUNDARY", *across, *(line for k, y in held for line in (f"{k}, 1, 1", f"{k}, 2, 2, {y}"))]
    lines += ["*NODE PRINT, NSET=ALL", "U", "*END STEP"]
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "strips.inp").write_text("\n".join(lines) + "\n")
        said = subprocess.run(["ccx", "strips"], cwd=folder, capture_output=True, text=True, check=False).stdout
        rows = [line.split() for line in Path(folder, "strips.dat").read_text().splitlines()]
    moves = {int(words[0]): float(words[2]) for words in rows if len(words) == 4}
    ended = "converged" if "Job finished" in said and "*ERROR" not in said else "no solution"
    return ended, [moves[k] for k in range(1, len(upper) + 1)]
