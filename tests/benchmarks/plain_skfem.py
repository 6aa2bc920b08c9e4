"""The patch test as a plain script: what a scikit-fem user would write for it, without any verification tool.

It is here to be timed, and neither tuned nor slowed down: two elastic blocks in plane strain, the penalty of the gap
integrated on the supermesh of both traces, one linear solve, and the stresses compared with the exact ones, as in
scikit-fem's own contact example (ex04). Without friction, and with contact everywhere, the problem is linear.

The supermesh rounds its nodes to ten decimals: on meshes whose nodes are not such numbers the error may reach 1e-10,
and is not roundoff.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from skfem.helpers import jump, sym_grad
from skfem.models.elasticity import lame_parameters, linear_elasticity, linear_stress
from skfem.supermeshing import elementwise_quadrature, intersect

FloatArray = NDArray[np.float64]

ELEMENT = skfem.ElementVector(skfem.ElementQuad1())


@dataclass(frozen=True)
class TwoBlocks:
    """Two blocks over the same interval: the slave stands on y = 0, the master hangs below it. Upper first in pairs."""

    slave_x: FloatArray
    slave_y: FloatArray
    master_x: FloatArray
    master_y: FloatArray
    young: tuple[float, float]
    poisson: tuple[float, float]
    approach: float
    penalty: float


def squared_gap(u: Any, v: Any, w: Any) -> Any:
    gap_u, gap_v = jump(w, u[1], v[1])
    return w.penalty * gap_u * gap_v


def penalty_blocks(upper: Any, lower: Any, penalty: float) -> list[list[Any]]:
    """Return the penalty's share of the stiffness, [[upper-upper, upper-lower], [lower-upper, lower-lower]]."""
    (trace_1, facets_1), (trace_2, facets_2) = (
        mesh.trace(side, mtype=skfem.MeshLine, project=lambda p: p[:1])
        for mesh, side in ((upper, "bottom"), (lower, "top"))
    )
    common, of_1, of_2 = intersect(trace_1, trace_2)
    bases = []
    for mesh, trace, facets, numbers in ((upper, trace_1, facets_1, of_1), (lower, trace_2, facets_2, of_2)):
        quadrature = elementwise_quadrature(trace, common, numbers, intorder=2)
        bases.append(skfem.FacetBasis(mesh, ELEMENT, facets=facets[numbers], quadrature=quadrature))
    form = skfem.BilinearForm(squared_gap)
    return [[form.assemble(bases[j], bases[i], idx=(j, i), penalty=penalty) for j in range(2)] for i in range(2)]


def exact_pressure(blocks: TwoBlocks) -> float:
    """Return the uniform pressure: two columns that cannot widen and the penalty, as springs in series."""
    compliance = 1 / blocks.penalty
    for y, young, nu in zip((blocks.slave_y, blocks.master_y), blocks.young, blocks.poisson, strict=True):
        compliance += (y[-1] - y[0]) * (1 + nu) * (1 - 2 * nu) / (young * (1 - nu))
    return float(blocks.approach / compliance)


def solve(blocks: TwoBlocks) -> float:
    """Return the largest |sigma - sigma_exact| / p over the Gauss points of both blocks."""
    meshes = [
        skfem.MeshQuad.init_tensor(x, y).with_defaults()
        for x, y in ((blocks.slave_x, blocks.slave_y), (blocks.master_x, blocks.master_y))
    ]
    bases = [skfem.Basis(mesh, ELEMENT, intorder=2) for mesh in meshes]
    lame = [lame_parameters(young, nu) for young, nu in zip(blocks.young, blocks.poisson, strict=True)]

    stiffness = penalty_blocks(meshes[0], meshes[1], blocks.penalty)
    for i in range(2):
        stiffness[i][i] = stiffness[i][i] + linear_elasticity(*lame[i]).assemble(bases[i])

    upper, lower = bases
    pushed = upper.get_dofs("top").all("u^2")
    fixed = [basis.get_dofs({"left", "right"}).all("u^1") for basis in bases]
    u = np.zeros(upper.N + lower.N)
    u[pushed] = -blocks.approach
    prescribed = np.concatenate([pushed, fixed[0], upper.N + fixed[1], upper.N + lower.get_dofs("bottom").all("u^2")])
    u = skfem.solve(*skfem.condense(skfem.bmat(stiffness, "csr"), x=u, D=prescribed))

    pressure, worst = exact_pressure(blocks), 0.0
    for basis, part, (lam, mu), nu in zip(bases, np.split(u, [upper.N]), lame, blocks.poisson, strict=True):
        stress = linear_stress(lam, mu)(sym_grad(basis.interpolate(part)))
        exact = -pressure * np.diag([nu / (1 - nu), 1.0])
        worst = max(worst, float(np.abs(stress - exact[:, :, None, None]).max()))
    return worst / pressure
