"""fedoo 1.1.0: the nearest element need not be one of those at the nearest node.

A slave node is 0.05 deep in the middle of a long element, the upper side of a plate. The nearest node is on the lower
side, so that the slave node is pushed through the plate.
"""

import fedoo
import numpy as np


def force(search: str) -> float:
    """Return the force on the slave node, of a stiffness of 20; 1 is right."""
    space = fedoo.ModelingSpace("2D")
    for axis in ("DispX", "DispY"):
        space.new_variable(axis)
    space.new_vector("Disp", ("DispX", "DispY"))
    places = [[2.0, -0.05], [0.0, 0.0], [4.0, 0.0], [4.0, -0.5], [2.0, -0.5], [0.0, -0.5]]  # A plate of thickness 0.5.
    mesh = fedoo.Mesh(np.array(places), np.array([[1, 2], [3, 4], [4, 5]]), "lin2")
    contact = fedoo.constraint.Contact(np.array([0]), mesh, search_algorithm=search)
    contact.eps_n, contact.max_dist = 20.0, 5.0
    contact.contact_search({}, True)
    return float(np.reshape(contact.global_vector, (2, 6))[1, 0])


if __name__ == "__main__":
    print(f"search_nearest: force {force('search_nearest'):.2f}, upwards")
