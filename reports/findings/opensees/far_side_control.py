"""The same node on the upper side of the wedge alone: it is pushed up, by a stiffness of 32 times a depth of 1/32."""

import far_side

x, y = far_side.push(far_side.WEDGE[:3])
print(f"upper side: force on the slave node {x:.3f}, {y:.3f}")
