"""fedoo 1.1.0: the default search, "bucket", leaves out the nodes of the last bucket.

Six slave nodes are 0.1 deep in a flat master, and each should be in contact. Nodes in the bucket with the highest
number are in no list, on both surfaces. What was in memory before stands for their nearest node.
"""

import fedoo
import numpy as np


def nodes_in_contact(search: str) -> list[int]:
    """Return the numbers of the slave nodes that the search finds in contact."""
    space = fedoo.ModelingSpace("2D")
    for axis in ("DispX", "DispY"):
        space.new_variable(axis)
    space.new_vector("Disp", ("DispX", "DispY"))
    slave = [[x, -0.1] for x in (0.25, 1.25, 2.25, 3.25, 4.25, 5.25)]
    master = [[x, 0.0] for x in range(7)]  # From left to right, so that the normal points up.
    segments = np.array([[n, n + 1] for n in range(6, 12)])
    mesh = fedoo.Mesh(np.array(slave + master), segments, "lin2")
    contact = fedoo.constraint.Contact(np.arange(6), mesh, search_algorithm=search)
    return sorted(map(int, contact.contact_search({}, True)))


if __name__ == "__main__":
    print("in contact:", nodes_in_contact("bucket"))
