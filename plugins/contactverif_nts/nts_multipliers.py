"""NTS, VTS-ME and VTS-PPT with Lagrange multipliers: a multiplier at each point takes the place of the spring.

A multiplier λ ≥ 0 is the pressure at its point; for NTS it is the force. In z the multipliers stand behind the
positions. The row of a multiplier is −area × g where its point is active, else area × λ. A point is active where
λ − c g ≥ 0 and its foot is on the surface. The factory's penalty is the scale c > 0 of that decision. No solution
depends on it.

With n ≥ 2 a segment carries more points than gaps can differ there. The constraints then depend on one another, and
the multipliers are not unique. NTS has one constraint for each slave node, and those are independent.

Source: Zavarise & De Lorenzis (2009), Sections 5.1.3, 6 and 7.1, say which of these methods pass the patch test. How
they are written down here is ours.
"""

from __future__ import annotations

from dataclasses import replace

from contactverif.contract.option_checks import choose
from contactverif.contract.traits import Traits
from contactverif_nts.patch_test_passing import PatchTestPassing, vts_ppt, vts_ppt_balanced
from contactverif_nts.point_contact import PointContact, nts, vts_me


def nts_lm(*, penalty: float, tau: float = 1e-2) -> PointContact:
    """Node to segment with a multiplier, a nodal force, at each slave node.

    It fails the flat patch test in one pass (case B): the multipliers fit the gaps at the slave nodes only, and the
    master nodes get what Eq. 6 hands on. Its constraints are independent, and its saddle point is symmetric.

    References
    ----------
    Zavarise & De Lorenzis (2009), Section 5.1.3; rows and tangent: here.
    """
    springs = nts(penalty=penalty, tau=tau)
    witnesses = {
        **springs.traits.evidence.witnesses,
        "patch": "b",
    }  # on A1 and A2 nodal forces are free to be the right ones
    traits = springs.traits.revise(
        normal=True, enforcement="multiplier", independent_multipliers=True, inf_sup=True, witnesses=witnesses
    )
    return replace(springs, traits=traits)


def vts_me_lm(*, penalty: float, n: int = 2, area: str = "current", tau: float = 1e-2) -> PointContact:
    """VTS-ME with a multiplier, a pressure, at each virtual slave node.

    Its promises are those of `vts_me`: it fails the flat patch test (case C′). With n ≥ 2 its multipliers are not
    unique (case A1).

    References
    ----------
    Zavarise & De Lorenzis (2009), Sections 5.1.3 and 6; rows and tangent: here.
    """
    springs = vts_me(penalty=penalty, n=n, area=area, tau=tau)
    return replace(springs, traits=_with_multipliers(springs.traits, n))


def vts_ppt_lm(
    *,
    penalty: float,
    n: int = 2,
    transmission: str = "printed",
    free_end: str = "",
    tau: float = 1e-2,
    threads: int = 1,
) -> PatchTestPassing:
    """VTS-PPT with a multiplier, a pressure, at each virtual slave node.

    It passes the flat patch test, as `vts_ppt` does. Box 3 spreads its forces and Eq. 6 measures its gaps, so its
    tangent is unsymmetric. With n ≥ 2 its multipliers are not unique (case A1). With a fine slave the saddle point is
    singular in the positions too, and Newton's method may find no solution though there is an exact one (case C with
    each segment divided by two). With n = 1 neither happens.

    References
    ----------
    Zavarise & De Lorenzis (2009), Sections 6 and 7.1; rows and tangent: here.
    """
    make = choose("transmission", transmission, {"printed": vts_ppt, "balanced": vts_ppt_balanced})
    springs = make(penalty=penalty, n=n, tau=tau, threads=threads, **({"free_end": free_end} if free_end else {}))
    return replace(springs, traits=_with_multipliers(springs.traits, n))


def _with_multipliers(traits: Traits, n: int) -> Traits:
    """Return the promises of springs at n virtual slave nodes a segment, for multipliers in their place.

    Where nodes coincide, some pressures at n ≥ 2 points a segment move nothing. At one point a segment, a pressure that
    alternates moves less and less as the mesh is refined: the inf-sup constant β falls as h. Nodal forces converge, for
    which such a pressure hardly counts, but the error of pressures is only bounded by that of gaps over β. On a slave
    four times finer than the master they do not converge (`accuracy.wavy`: off by 0.016, 0.082, 0.025 and 0.032 on
    finer and finer meshes; means over two neighbours by 0.011, 0.008, 0.003 and 0.002). So no convergence is promised.

    With n ≥ 3 there are more pressures than nodal forces, so that some of them give the exact ones on a kink, too.
    """
    witnesses = {**traits.evidence.witnesses, "stability.inf-sup": "matching"}
    if n > 1:
        witnesses["multipliers"] = "a1"
    return traits.revise(
        enforcement="multiplier",
        independent_multipliers=n == 1,
        converges=False if n == 1 and traits.promises.converges is False else None,
        kinked=traits.promises.patch.kinked if n < 3 or traits.promises.patch.kinked else None,
        inf_sup=False,
        locks=None,
        integrates_linear_gap=None,
        witnesses=witnesses,
    )
