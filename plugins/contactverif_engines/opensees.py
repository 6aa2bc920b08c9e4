"""OpenSees: springs between nodes and edges, of the slave's nodes and of the master's.

Source: the element zeroLengthContactNTS2D of OpenSees, its manual and `SRC/element/zeroLength`. Each node of either
surface has a spring to each edge of the other one that it lies behind, whatever the length of its own edges.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contactverif.contract.engine import EngineAnswer, EngineTraits, IntArray, SceneArrays
from contactverif_engines.filled import FilledScene, fill_rigid_bodies

_STEPS = 60
_MANY = 60  # With the handler "Transformation" an element of 67 nodes damages memory (`reports/findings`).
_CONVERGED = 1e-12  # The norm of the last step over the size of displacements.
_ROUNDED = 1e-14  # Steps below this share of the largest coordinate are roundoff of the gaps.


@dataclass(frozen=True)
class OpenSees:
    """OpenSees with node-to-segment springs."""

    # The stiffness of all springs of a length of the surface over ε̂, in the mean: nodes of both sides have springs.
    stiffness: float = 1.0

    # Springs of nodes are ε̂ in the mean alone, and no uniform pressure is promised.
    traits = EngineTraits("penalty", accuracy=1e-9, load_scale=2.0**-10)

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Make a model, solve it in a static step, and read the displacements of its nodes."""
        import openseespy.opensees as ops

        plane = fill_rigid_bodies(scene)
        ops.wipe()
        ops.model("basic", "-ndm", 2, "-ndf", 2)
        _add_bodies(ops, plane)
        _add_supports_and_loads(ops, plane)
        self._add_contact(ops, plane)
        # The size of displacements is that of those imposed, of those that loads cause, or of the first guess.
        loaded = float(np.abs(scene.load).sum()) / float(scene.young[~scene.rigid].max())
        size = max(float(np.abs(scene.imposed).max()), float(np.abs(scene.start).max()), loaded)
        tolerance = _CONVERGED * size + _ROUNDED * float(np.abs(scene.nodes).max())
        # "Plain" knows no imposed displacement but 0, and "Transformation" few nodes.
        many = len(np.unique(scene.slave)) + len(np.unique(scene.master)) > _MANY
        imposes = (plane.fixed & (plane.imposed != 0)).any()
        handler = ("Lagrange" if many else "Transformation") if imposes else "Plain"
        converged, n_steps = _run(ops, tolerance, handler)
        count = range(1, len(scene.nodes) + 1)
        moves = np.array([[ops.nodeDisp(node, part) for part in (1, 2)] for node in count], np.float64)
        ops.wipe()
        return EngineAnswer(moves, converged, n_steps, "" if converged else "analyze failed in one step")

    def _add_contact(self, ops: Any, plane: FilledScene) -> None:
        scene, number = plane.scene, sum(len(cells) for cells, _ in plane.cells)

        def mean_length(chain: list[int]) -> float:
            return float(np.linalg.norm(np.diff(scene.nodes[chain], axis=0), axis=1).mean())

        for slave in find_chains(scene.slave):
            for master in find_chains(scene.master):
                number += 1
                first, second = mean_length(slave), mean_length(master)
                stiffness = self.stiffness * float(scene.penalty) * first * second / (first + second)
                counts = ("-sNdNum", len(slave), "-mNdNum", len(master))
                nodes = (node + 1 for node in (*slave, *master))
                ops.element("zeroLengthContactNTS2D", number, *counts, "-Nodes", *nodes, stiffness, 0.0, 0.0)


def find_chains(edges: IntArray) -> list[list[int]]:
    """Return the nodes along each chain of edges, in their direction; a closed chain begins and ends in one node."""
    after = dict(edges.tolist())
    firsts = [node for node in after if node not in after.values()]
    chains = []
    while after:
        chain = [firsts.pop(0) if firsts else next(iter(after))]
        while chain[-1] in after:
            chain.append(after.pop(chain[-1]))
        chains.append(chain)
    return chains


def _add_bodies(ops: Any, plane: FilledScene) -> None:
    for number, (x, y) in enumerate(plane.nodes.tolist(), start=1):
        ops.node(number, x, y)
    for body, material in enumerate(plane.materials, start=1):
        ops.nDMaterial("ElasticIsotropic", body, *material)
    number = 0
    for kind, (cells, bodies) in zip(("tri31", "quad"), plane.cells, strict=True):
        for cell, body in zip((cells + 1).tolist(), bodies.tolist(), strict=True):
            number += 1
            ops.element(kind, number, *cell, 1.0, "PlaneStrain", body + 1)


def _add_supports_and_loads(ops: Any, plane: FilledScene) -> None:
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    supports = plane.fixed & (plane.imposed == 0)
    for node in np.flatnonzero(supports.any(axis=1)).tolist():
        ops.fix(node + 1, *supports[node].astype(int).tolist())
    for node, part in np.argwhere(plane.fixed & (plane.imposed != 0)).tolist():
        ops.sp(node + 1, part + 1, float(plane.imposed[node, part]))
    for node in np.flatnonzero(plane.load.any(axis=1)).tolist():
        ops.load(node + 1, *plane.load[node].tolist())


def _run(ops: Any, tolerance: float, handler: str) -> tuple[bool, int]:
    ops.constraints(handler)
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", tolerance, _STEPS, 0)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    converged = ops.analyze(1) == 0
    return bool(converged), int(ops.testIter())
