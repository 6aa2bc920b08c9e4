"""fedoo 1.1.0: with the default `tol` of 0.1, a node may be paired with an element that it does not lie over.

A slave node is 0.1 deep in a flat master, 0.1 before the middle node of segments from 0 to 2 and from 2 to 4. Both
segments are closed to it, and the larger gap wins. On a flat interface the gaps are equal, so that rounding chooses.
"""

import fedoo
import numpy as np


def forces(degrees: float, tol: float = 0.1) -> np.ndarray:
    """Return the forces along the normal on the slave node and the three master nodes."""
    space = fedoo.ModelingSpace("2D")
    for axis in ("DispX", "DispY"):
        space.new_variable(axis)
    space.new_vector("Disp", ("DispX", "DispY"))
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    places = np.array([[1.9, -0.1], [0.0, 0.0], [2.0, 0.0], [4.0, 0.0]]) @ [[c, s], [-s, c]]
    mesh = fedoo.Mesh(places, np.array([[1, 2], [2, 3]]), "lin2")
    contact = fedoo.constraint.Contact(np.array([0]), mesh, search_algorithm="search_nearest")
    contact.eps_n, contact.max_dist, contact.tol = 10.0, 5.0, tol
    contact.contact_search({}, True)
    return contact.global_vector.reshape(2, 4).T @ [-s, c]


if __name__ == "__main__":
    for degrees in (0, 1, 5, 30, 45, 90):
        print(f"turned by {degrees:2}:", forces(degrees).round(3) + 0.0)
