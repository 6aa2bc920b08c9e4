"""The same strip with a thin cell that lies, along y: then both sides of the cell move by 0.4, however thin it is."""

from getfem_strip import pull

for width in (1e-2, 3e-3, 2e-3, 1e-4):
    print(f"thin cell {width:g} high and 2 wide: its sides move by {pull(width, along=1)}")
