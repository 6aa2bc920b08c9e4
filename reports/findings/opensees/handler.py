"""OpenSees 3.7.1: with "Transformation" an element of 69 nodes finds nothing, and one of 73 ends the process.

One element is a whole surface, so that it has many nodes. The pressure is 0.05, and a hundredth more at the ends.
"""

import subprocess
import sys

CODE = """
from opensees_blocks import press
upper, lower = [2 * i / {n} for i in range({n} + 1)], [-0.01 + 2.02 * i / ({n} - 1) for i in range({n})]
converged, pressures = press(upper, lower, handler={handler!r})
print(f"converged {{converged}}, pressures of {{min(pressures):.6f}} to {{max(pressures):.6f}}")
"""

for n in (25, 33, 34, 36, 60):
    code = CODE.format(n=n, handler=sys.argv[1] if len(sys.argv) > 1 else "Transformation")
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    lines = [line for line in run.stdout.splitlines() if "pressures" in line]
    print(f"{2 * n + 1} nodes: exit status {run.returncode}, {lines}")
