"""An engine with numpy alone: springs along the slave's normals on the common mesh of both surfaces, one fault or none.

Its process has an interpreter that may lack everything else, so nothing but the contract is imported.
"""

import os
import sys
import time
from importlib.util import find_spec

import numpy as np

from contactverif.contract.engine import EngineAnswer, EngineTraits

ROOTS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)])
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18


class Plain:
    """Springs on the common mesh, with a fault: the name says what is wrong."""

    def __init__(self, fault="", passes=True, inclined=True):
        self.fault, self.calls = fault, 0
        self.traits = EngineTraits(
            "penalty", inclined_supports=inclined, passes_flat_patch=passes or None, converges=passes or None
        )

    def solve(self, scene):
        self.calls += 1
        if self.fault == "hangs":
            time.sleep(1e6)
        if self.fault == "dies":
            os.abort()
        if self.fault == "tells its modules":
            strangers = {name.partition(".")[0] for name in sys.modules} - sys.stdlib_module_names - {"__mp_main__"}
            words = " ".join(sorted(name for name in strangers if not name.startswith("_")))
            return EngineAnswer(np.zeros_like(scene.nodes), False, message=words)
        if self.fault == "tells what it finds":
            names = ("contactverif", "contactverif_engines", "numpy", "plain_engine", "scipy", "test_calculix")
            words = " ".join(name for name in names if find_spec(name) is not None)
            return EngineAnswer(np.zeros_like(scene.nodes), False, message=words)
        if self.fault == "raises":
            raise ArithmeticError("no pivot")
        frames = scene.frames()
        stiffness = assemble(scene)
        u = np.where(scene.fixed, scene.imposed, np.einsum("nij,ni->nj", frames, scene.start)).reshape(-1)
        free = np.flatnonzero(~scene.fixed.reshape(-1))
        for _ in range(40):
            forces, springs = contact(scene, scene.nodes + turn(frames, u), self.fault, self.calls)
            residual = stiffness @ u + turn_back(frames, forces) - scene.load.reshape(-1)
            matrix = (stiffness + turn_matrix(frames, springs))[np.ix_(free, free)]
            change = np.linalg.lstsq(matrix, -residual[free], rcond=None)[0]
            u[free] += change
            if np.abs(change).max(initial=0.0) <= 1e-13 * np.abs(u).max():
                break
        if self.fault == "finds nothing":
            return EngineAnswer(turn(frames, u), False, 40, "too many cutbacks")
        if self.fault.startswith("reports"):
            pushes = -contact(scene, scene.nodes + turn(frames, u), "", 0)[0].reshape(-1, 2)
            halves = np.repeat(np.linalg.norm(np.diff(scene.nodes[scene.slave], axis=1)[:, 0], axis=1) / 2, 2)
            nodes, lengths = np.unique(scene.slave), np.bincount(scene.slave.reshape(-1), halves)
            pressures = np.linalg.norm(pushes[nodes], axis=1) / lengths[nodes]
            pushes *= -1.0 if self.fault == "reports what pushes the other side" else 1.0
            pressures *= 0.999 if self.fault == "reports a pressure that is too small" else 1.0
            return EngineAnswer(turn(frames, u), True, 1, "", pushes, pressures)
        return EngineAnswer(turn(frames, u), True, 1)


def turn(frames, u):
    return np.einsum("nij,nj->ni", frames, u.reshape(-1, 2))


def turn_back(frames, forces):
    return np.einsum("nij,ni->nj", frames, forces.reshape(-1, 2)).reshape(-1)


def turn_matrix(frames, matrix):
    n = len(frames)
    return np.einsum("nai,naMb,Mbj->niMj", frames, matrix.reshape(n, 2, n, 2), frames).reshape(2 * n, 2 * n)


def assemble(scene):
    """Return the stiffness of all cells in plane strain, in the axes of the bodies."""
    n = len(scene.nodes)
    total = np.zeros((2 * n, 2 * n))
    for cell, body in zip(scene.cells, scene.body_of_cell, strict=True):
        corners = cell[cell >= 0]
        young, nu = scene.young[body], scene.poisson[body]
        factor = young / (1 + nu) / (1 - 2 * nu)
        law = factor * np.array([[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, (1 - 2 * nu) / 2]])
        unknowns = (2 * corners[:, None] + [0, 1]).reshape(-1)
        total[np.ix_(unknowns, unknowns)] += cell_stiffness(scene.nodes[corners], law)
    return turn_matrix(scene.frames(), total)


def cell_stiffness(nodes, law):
    total = 0.0
    for a in (-1, 1) if len(nodes) == 4 else (0,):
        for b in (-1, 1) if len(nodes) == 4 else (0,):
            s, t = a / np.sqrt(3), b / np.sqrt(3)
            if len(nodes) == 4:
                local = np.array([[t - 1, s - 1], [1 - t, -1 - s], [1 + t, 1 + s], [-1 - t, 1 - s]]) / 4
            else:
                local = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
            jacobian = nodes.T @ local
            slopes = local @ np.linalg.inv(jacobian)
            strain = np.zeros((3, 2 * len(nodes)))
            strain[0, ::2], strain[1, 1::2] = slopes[:, 0], slopes[:, 1]
            strain[2, ::2], strain[2, 1::2] = slopes[:, 1], slopes[:, 0]
            share = np.linalg.det(jacobian) / (1 if len(nodes) == 4 else 2)
            total = total + share * strain.T @ law @ strain
    return total


def contact(scene, positions, fault, calls):
    """Return the internal forces (2 n,) and the stiffness (2 n, 2 n) of the springs."""
    n = len(positions)
    forces, stiffness = np.zeros(2 * n), np.zeros((2 * n, 2 * n))
    penalty = scene.penalty * changes(scene, fault, calls)
    for number, (first, second) in enumerate(scene.slave):
        along = positions[second] - positions[first]
        length = np.hypot(*along)
        tangent = along / length
        normal = np.array([-tangent[1], tangent[0]])
        if fault == "upright normals" and abs(normal[1]) > 1e-9:
            normal = np.array([0.0, np.sign(normal[1])])
        for head, tail in scene.master:
            (s1, s2) = (positions[[head, tail]] - positions[first]) @ tangent / length
            low, high = np.clip([s2, s1], 0, 1)
            if s1 <= s2 or high <= low:
                continue
            s, shares = (low + high) / 2 + (high - low) / 2 * ROOTS, (high - low) * WEIGHTS
            glued = fault == "glued at the nodes"
            if glued:  # No fault where all is closed: it does not lock.
                s = np.array([end for end in (0.0, 1.0) if low - 1e-3 <= end <= high + 1e-3])
                shares = np.full(len(s), 0.5)
            xi = (s - s1) / (s2 - s1)
            points = positions[first] + s[:, None] * along
            feet = positions[head] + xi[:, None] * (positions[tail] - positions[head])
            gap = (points - feet) @ normal - 1e-6 * (fault == "thick surfaces")
            weights = penalty * length * shares * ((gap < 0) | glued)
            if fault == "short cells are left out" and length * (high - low) < 0.3:
                weights *= 0.999
            if fault == "a tiny edge spoils the first one" and number == 0 and shortest(scene) < 1e-3:
                weights *= 0.9
            if fault == "the first edge is soft" and number == 0:
                weights *= 0.9
            if fault == "the second node gets more":
                s = s**1.01
            shapes = np.stack([1 - s, s, xi - 1, -xi])
            unknowns = (2 * np.array([first, second, head, tail])[:, None] + [0, 1]).reshape(-1)
            forces[unknowns] += np.einsum("ap,p,i->ai", shapes, weights * gap, normal).reshape(-1)
            block = np.einsum("ap,p,bp,i,j->aibj", shapes, weights, shapes, normal, normal).reshape(8, 8)
            stiffness[np.ix_(unknowns, unknowns)] += block
    return forces, stiffness


def shortest(scene):
    """Return the length of the shortest contact edge."""
    edges = np.vstack([scene.slave, scene.master])
    return np.hypot(*(scene.nodes[edges[:, 1]] - scene.nodes[edges[:, 0]]).T).min()


def changes(scene, fault, calls):
    """Return the factor of the springs by a fault."""
    if fault == "half as stiff":
        return 0.5
    if fault == "softer at every call":
        return 0.99**calls
    if fault == "as stiff as the mean body":
        ends = scene.nodes[scene.cells[:, :2]]
        return 1.0 + 1e-3 * np.abs(ends[:, 1] - ends[:, 0]).sum() / len(ends) / np.ptp(scene.nodes[scene.slave[0]])
    if fault == "an absolute length":
        return 1.0 - 1e-3 * (np.ptp(scene.nodes[:, 0]) > 20)
    return 1.0
