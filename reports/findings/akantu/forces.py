"""Akantu 5.0.7: where two slave nodes are on an edge, the forces on its ends are those of the last one alone."""

import akantu_blocks


def show(end: float) -> None:
    """Print the vertical forces of a slave edge from 1/2 to `end` on a master edge from 0 to 4."""
    blocks, _mesh = akantu_blocks.make_blocks(end)  # Without the mesh, what is made of it ends too.
    contact = blocks.getContactMechanicsModel()
    contact.search()
    contact.assembleInternalForces()
    forces = contact.getInternalForce()[:, 1]
    print("slave nodes: ", *(f"{force:8.4f}" for force in forces[4:6]))
    print("master nodes:", *(f"{force:8.4f}" for force in forces[[3, 2]]))
    print(f"sum: {forces.sum():.4f}")


if __name__ == "__main__":
    show(2.5)
