"""GetFEM 5.4.2: blocks that overlap by a twenty-fifth of a cell end the process, by a division of integers by zero.

No point of the slave finds a place on the master then. With springs of 10 the pressure is (0.1 + overlap) / (2 + 1/10).
"""

import subprocess
import sys

CODE = "from getfem_blocks import press; print(press([0, 1, 2], [0, 2], overlap={}))"

for overlap in (0.03, 0.04, 0.1, -0.04):
    run = subprocess.run([sys.executable, "-c", CODE.format(overlap)], capture_output=True, text=True, check=False)
    lines = [line for line in run.stdout.splitlines() if line.startswith("[")]
    print(f"overlap {overlap}: exit status {run.returncode}, pressures {lines}")
