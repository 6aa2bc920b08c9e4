"""The same distances in space, with z = 0: there the library takes differences first, and nothing is lost."""

import far_segment
import ipctk
import numpy as np

in_plane = ipctk.point_line_distance


def in_space(*points: np.ndarray) -> float:
    """Return the squared distance of a point from a line, both in the plane z = 0."""
    return float(in_plane(*(np.append(point, 0.0) for point in points)))


ipctk.point_line_distance = in_space
for shift in (0.0, 10.0, 100.0, 1000.0):
    print(f"at {shift:6}: error {far_segment.worst_error(shift, far_segment.GAP):.1e}")
