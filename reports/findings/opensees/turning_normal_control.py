"""The same at a depth of 1e-4, where a normal that turns has nearly no force to turn."""

import turning_normal

print(f"depth 1e-4: error {turning_normal.error(1e-4):.1e}")
