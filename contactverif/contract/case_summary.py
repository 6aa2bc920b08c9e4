"""The numbers that say what kind of case was judged. A report stores them where it does not store the case itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from contactverif.contract.case import Case
from contactverif.contract.foreign_text import clean


@dataclass(frozen=True, slots=True)
class CaseSummary:
    """A case without its meshes. Two cases with equal summaries are taken for the same case."""

    n_slave_segments: int  # Numbers of segments.
    n_master_segments: int
    penalty: float  # Distributed stiffness ε̂, force per length per length of penetration.
    largest_coordinate: float  # The largest coordinate of state and reference, a length.
    shortest_segment: float  # The shortest current segment of both sides, a length.
    # {name: number} of the parameters that are one number each.
    parameters: Mapping[str, float] = field(default_factory=dict)
    name: str = ""  # The name of a case that has one ("C", "C′"), else empty.
    kind: str = ""  # The kind of situation, in words, of a case that has one, else empty.

    def __post_init__(self) -> None:
        clean(self, names=("name", "kind"))

    @classmethod
    def from_case(cls, case: Case) -> CaseSummary:
        """Return the summary of a case."""
        interface = case.interface
        return cls(
            n_slave_segments=len(interface.slave),
            n_master_segments=len(interface.master),
            penalty=case.penalty,
            largest_coordinate=case.largest_coordinate,
            shortest_segment=case.shortest_segment,
            parameters={name: values.item() for name, values in case.parameters.items() if values.size == 1},
            name=case.name,
            kind=case.kind,
        )
