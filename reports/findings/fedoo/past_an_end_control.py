"""The same with `tol` of 0: the node is over the first segment, however the scene is turned."""

import past_an_end

for degrees in (0, 1, 5, 30, 45, 90):
    print(f"turned by {degrees:2}:", past_an_end.forces(degrees, tol=0.0).round(3) + 0.0)
