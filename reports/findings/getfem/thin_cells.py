"""GetFEM 5.4.2: a cell that is a thousand times as high as wide has no width, and the mesh is torn beside it.

A strip of E = 1 is pulled by 0.8 at its end. Both sides of a thin cell in its middle should move by 0.4.
"""

from getfem_strip import pull

for width in (1e-2, 3e-3, 2e-3, 1e-4):
    print(f"thin cell {width:g} wide and 2 high: its sides move by {pull(width)}")
