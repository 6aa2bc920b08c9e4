"""Akantu 5.0.7: with a deformable master, the matrix of a spring is not the derivative of its forces."""

import akantu
import akantu_blocks


def show(deformable: bool) -> None:
    """Print the stiffness of a spring of 1 for each length, by its force and by the matrix, over the length."""
    blocks, _mesh = akantu_blocks.make_blocks(6.5, deformable)  # Without the mesh, what is made of it ends too.
    contact = blocks.getContactMechanicsModel()
    contact.search()
    contact.assembleInternalForces()
    blocks.assembleMatrix("K")
    matrix = akantu.AkantuSparseMatrix(blocks.getDOFManager().getMatrix("K")).toarray()
    length = contact.getNodalArea()[4, 0]
    forces = contact.getInternalForce()[[4, 3, 2], 1] / 0.1 / length
    print("by the forces on the node and on the ends of the edge: ", *(f"{force:.4f}" for force in forces))
    print(
        "by the matrix, the node's own entry and those of ends: ", *(f"{x:.4f}" for x in matrix[9, [9, 7, 5]] / length)
    )


if __name__ == "__main__":
    show(True)
