"""sfepy 2026.3: the matrix of dw_contact is not the derivative of its residual. Two blocks overlap by 0.1."""

import numpy as np
import sfepy_blocks


def compare(n_lower: int, n_upper: int) -> float:
    """Return the largest difference of vertical forces by vertical moves, over the largest of these forces."""
    problem = sfepy_blocks.make_problem(n_lower, n_upper)
    evaluator, steps = problem.get_evaluator(), 1e-6 * np.eye(problem.domain.mesh.coors.size)[1::2]
    moved = np.array([evaluator.eval_residual(step) - evaluator.eval_residual(-step) for step in steps])
    forces = moved[:, 1::2].T / 2e-6
    matrix = evaluator.eval_tangent_matrix(0 * steps[0]).toarray()[1::2, 1::2]
    return float(np.abs(matrix - forces).max() / np.abs(forces).max())


if __name__ == "__main__":
    print(f"3 edges on 2: the matrix is wrong by {compare(2, 3):.4f} of its largest entry")
