"""Who plays in the reproduction of the paper: formulations as data, under the paper's names.

Another formulation joins a table or a figure by its name in a list here.
"""

from __future__ import annotations

from functools import cache

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.run.registry import load_formulation
from contactverif_paper.paper_data import Member

NTS = Member("NTS", "nts", 3)
NTS_AR = Member("NTS-AR", "nts-ar", 1)
TWO_PASS = Member("two-pass NTS-AR", "two-pass/nts-ar", 2)
VTS_G = Member("VTS-G", "vts-g", 5)
VTS_ME = Member("VTS-ME", "vts-me", 4)
BASIC = Member("VTS-PPT basic", "vts-ppt-basic", 2)
VTS_PPT = Member("VTS-PPT", "vts-ppt", 0)
BALANCED = Member("VTS-PPT balanced (ours)", "vts-ppt-balanced", 2)
STS = Member("segment-to-segment", "sts", 3)
MORTAR = Member("mortar", "mortar", 5)
DUAL = Member("dual mortar", "mortar-dual", 3)
CHEN_HISADA = Member("Chen–Hisada", "chen-hisada", 1)

VIRTUAL = (VTS_G, VTS_ME, BASIC, VTS_PPT, BALANCED)  # pressures are shown at their virtual slave nodes
FORCES = (NTS, NTS_AR, VTS_ME, VTS_PPT, BALANCED, STS, MORTAR)
PASSES = (NTS, NTS_AR, TWO_PASS, VTS_G, VTS_ME, BASIC, VTS_PPT, BALANCED, CHEN_HISADA, STS, MORTAR, DUAL)
CONVERGENCE = (VTS_ME, BASIC, VTS_PPT)
TANGENTS = (*CONVERGENCE, STS)
BALANCE = (VTS_ME, VTS_PPT, BALANCED, STS)
FREE_ENDS = (NTS_AR, VTS_ME, VTS_PPT, BALANCED, STS, MORTAR)
DISK = (NTS_AR, VTS_G, VTS_ME, VTS_PPT)
REFERENCE_AREAS = Member("VTS-ME, reference areas", "vts-me:area=reference", 1)
MULTIPLIERS = (
    Member("NTS, multipliers", "nts-lm"),
    Member("two-pass NTS, multipliers", "two-pass/nts-lm"),
    Member("VTS-ME, multipliers", "vts-me-lm"),
    Member("VTS-PPT, multipliers", "vts-ppt-lm"),
    Member("mortar, multipliers", "mortar-lm"),
    Member("dual mortar, multipliers", "mortar-dual-lm"),
)


@cache
def subject(member: Member) -> Subject:
    """The formulation itself; all of them are of this distribution.

    Raises
    ------
    MisuseError
        If it does not load.
    """
    found = load_formulation(member.formulation)
    if isinstance(found, NotLoaded):
        raise MisuseError("formulation", f"{member.formulation}, not loaded: {found.reason}", "one that loads")
    return found
