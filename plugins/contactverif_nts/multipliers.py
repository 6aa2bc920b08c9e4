"""NTS, VTS-ME and VTS-PPT with Lagrange multipliers: the same points, each held by a multiplier instead of a spring.

A multiplier λ ≥ 0 is the pressure at its point, of NTS the force. It stands behind the positions in z; its row is
−area × g where the point is active (λ − c g ≥ 0, c > 0 the penalty that the factory is given, and the foot on the
surface), else area × λ. What c is changes no solution.

Where more points lie on a segment than gaps can differ there, as with n ≥ 2, constraints depend on one another and
multipliers are not unique. NTS has one constraint for each slave node, and those are independent.

Source: Zavarise & De Lorenzis (2009), Sections 5.1.3, 6 and 7.1, say which of them pass the patch test; how they are
written down here is ours.
"""

from __future__ import annotations

from dataclasses import replace

from contactverif.contract.formulation import Traits
from contactverif_nts.options import chosen
from contactverif_nts.points import PointContact, nts, vts_me
from contactverif_nts.ppt import PatchTestPassing, vts_ppt, vts_ppt_balanced


def nts_lm(*, penalty: float, tau: float = 1e-2) -> PointContact:
    """Node to segment with a multiplier at each slave node, a force.

    Parameters
    ----------
    penalty : float
        Scale c > 0 of the decision λ − c g ≥ 0, force per length.
    tau : float
        How far past a free end of the master a foot still counts, in lengths of its segment.
    """
    held = nts(penalty=penalty, tau=tau)
    witnesses = {**held.traits.witnesses, "patch": "b"}  # on A1 and A2 nodal forces are free to be the right ones
    promises = replace(held.traits, enforcement="multiplier", independent_multipliers=True, witnesses=witnesses)
    return replace(held, traits=promises)


def vts_me_lm(*, penalty: float, n: int = 2, area: str = "current", tau: float = 1e-2) -> PointContact:
    """VTS-ME with a multiplier at each virtual slave node, a pressure.

    Parameters
    ----------
    penalty : float
        Scale c > 0 of the decision λ − c g ≥ 0, force per length per length.
    n, area, tau : int or str or float
        As for `vts_me`.
    """
    held = vts_me(penalty=penalty, n=n, area=area, tau=tau)
    return replace(held, traits=_of_virtual_slave_nodes(held.traits, n))


def vts_ppt_lm(
    *, penalty: float, n: int = 2, transmission: str = "printed", free_end: str = "", tau: float = 1e-2
) -> PatchTestPassing:
    """VTS-PPT with a multiplier at each virtual slave node, a pressure that both sides are given.

    Its forces are spread by Box 3 and its gaps are those of Eq. 6, so that the saddle point is unsymmetric. With a fine
    slave it is singular: multipliers are not unique, and then not always positions either, so that Newton's method
    finds no solution though the exact one is one (case C with each cell divided by two). n = 1 has none of this.

    Parameters
    ----------
    penalty : float
        Scale c > 0 of the decision λ − c g ≥ 0, force per length per length.
    transmission : str
        "printed" as that of `vts_ppt`, or "balanced" as that of `vts_ppt_balanced`.
    n, free_end, tau : int or str or float
        As for `vts_ppt` or `vts_ppt_balanced`, free_end with the default of the one chosen.
    """
    springs = chosen("transmission", transmission, {"printed": vts_ppt, "balanced": vts_ppt_balanced})
    held = springs(penalty=penalty, n=n, tau=tau, **({"free_end": free_end} if free_end else {}))
    return replace(held, traits=_of_virtual_slave_nodes(held.traits, n))


def _of_virtual_slave_nodes(traits: Traits, n: int) -> Traits:
    witnesses = {**traits.witnesses, "multipliers": "a1"} if n > 1 else traits.witnesses
    return replace(traits, enforcement="multiplier", independent_multipliers=n == 1, witnesses=witnesses)
