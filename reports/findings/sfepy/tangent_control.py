"""The same with edges that match."""

import tangent

print(f"2 edges on 2: the matrix is wrong by {tangent.compare(2, 2):.4f} of its largest entry")
