"""The formulations that the paper compares, under the paper's names, and some of ours beside them.

A formulation has two names here: `legend`, which the paper's figures use, and `name`, which the command line uses. Its
`pen` is the number of its line style; it is the same in every figure.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from contactverif.contract.case import Case
from contactverif.contract.measurement import Measurement
from contactverif.contract.subject import Subject
from contactverif.plugins.registry import the_formulation, the_property
from contactverif.run.judge import judge_case


@dataclass(frozen=True, slots=True)
class PaperFormulation:
    """A formulation with its legend, its name on the command line, and the number of its pen."""

    legend: str
    name: str
    pen: int = 0


NTS = PaperFormulation("NTS", "nts", 3)
NTS_AR = PaperFormulation("NTS-AR", "nts-ar", 1)
TWO_PASS = PaperFormulation("two-pass NTS-AR", "two-pass/nts-ar", 2)
VTS_G = PaperFormulation("VTS-G", "vts-g", 5)
VTS_ME = PaperFormulation("VTS-ME", "vts-me", 4)
BASIC = PaperFormulation("VTS-PPT basic", "vts-ppt-basic", 2)
VTS_PPT = PaperFormulation("VTS-PPT", "vts-ppt", 0)
BALANCED = PaperFormulation("VTS-PPT balanced (ours)", "vts-ppt-balanced", 2)
STS = PaperFormulation("segment-to-segment", "sts", 3)
MORTAR = PaperFormulation("mortar", "mortar", 5)
DUAL = PaperFormulation("dual mortar", "mortar-dual", 3)
CHEN_HISADA = PaperFormulation("Chen–Hisada", "chen-hisada", 1)
REFERENCE_AREAS = PaperFormulation("VTS-ME, reference areas", "vts-me:area=reference", 1)

# The formulations with virtual slave nodes; a figure shows their pressures at these nodes.
VIRTUAL = (VTS_G, VTS_ME, BASIC, VTS_PPT, BALANCED)


def measure(property_id: str, case: Case, formulation: PaperFormulation) -> Measurement | None:
    """Return what a property measures of a formulation on a case."""
    return judge_case(the_property(property_id), case, subject_of(formulation)).measurement


@cache
def subject_of(formulation: PaperFormulation) -> Subject:
    """Load the formulation."""
    return the_formulation(formulation.name)
