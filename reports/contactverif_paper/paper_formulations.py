"""The formulations that the paper compares, under the paper's names, and some of ours beside them."""

from dataclasses import dataclass
from functools import cache
from typing import Annotated

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement
from contactverif.contract.subject import Subject
from contactverif.plugins.registry import the_property, the_subject
from contactverif.run.judge import judge_case
from contactverif_paper.paper_item import WORDS, Column


@dataclass(frozen=True, slots=True)
class PaperFormulation:
    """A formulation under two names, with the same pen in every figure."""

    legend: str  # The name that the paper's figures use.
    name: str  # The name on the command line.
    pen: int = 0  # The number of its line style.


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
ALL = (NTS, NTS_AR, TWO_PASS, VTS_G, VTS_ME, BASIC, VTS_PPT, BALANCED, CHEN_HISADA, STS, MORTAR, DUAL)
# The formulations with virtual slave nodes; a figure shows their pressures at these nodes.
VIRTUAL = (VTS_G, VTS_ME, BASIC, VTS_PPT, BALANCED)


def name_columns(dims: str) -> tuple[Column, Column]:
    """Return both names of the formulations of a field."""
    return (
        Column(dims, WORDS, "formulation, as on the command line", part="name", name="formulation"),
        Column(dims, WORDS, "its name in the paper's legends", part="legend", name="legend"),
    )


Formulations = Annotated[tuple[PaperFormulation, ...], name_columns("formulation")]


def measure(property_id: str, case: Case, formulation: PaperFormulation) -> Measurement | None:
    """Return what a property measures of a formulation on a case."""
    return judge_case(the_property(property_id), case, subject_of(formulation)).measurement


@cache
def subject_of(formulation: PaperFormulation) -> Subject:
    """Load the formulation."""
    return the_subject(formulation.name)
