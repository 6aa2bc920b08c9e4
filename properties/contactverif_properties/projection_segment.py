"""Ask whether each contact point is measured against the right master segment.

**Question.** A formulation states by which rule a point gets its master segment: the closest one, or the nearest that
its slave segment sees along its normal. Does each point that it reports have a segment by that rule?

**Why it matters.** A wrong segment is a wrong gap, a wrong normal and a force on wrong nodes. It happens where search
is hard: past free ends, at sharp vertices, where the nearest node is not on the nearest segment. Meshes for tests
rarely have such places, and assemblies do.

**How it is judged.** The point is formed in rationals from the stored nodes and c. The number is how much farther the
reported segment is than the nearest, a length that is exact, over the lengths of which a gap is a difference. It must
be at most 4u. So a tie needs no rule: of segments at the same distance any is right. Along the slave's normal, a
segment must face the slave and be met by the line. Of one that is seen edge-on, rounding may leave an overlap: a point
whose weight is at most 8u of those lengths may name it. For `cells` it may be the nearest at the point or in the middle
of its overlap, and segments beyond two lengths of both are no rivals.

**Undecided.** Never. The number of exact ties is a detail. A point that names no segment is not judged here.
"""

from __future__ import annotations

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.oracle.exact_choices import closest_excess, seen_excess
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.exact_places import (
    CELLS,
    CLOSEST,
    LOCAL_REASON,
    PROJECTED_KINDS,
    Places,
    Reported,
    largest,
    projected_cases,
    refuse_without_rule,
)

# Two ends of an overlap are scalar products of two terms, each rounded by 2u of the lengths.
OVERLAP_ROUNDOFF = 8 * UNIT_ROUNDOFF

FARTHER = Quantity("distance beyond the nearest segment", "1", "4u", LOCAL_REASON)


def measure_segments(case: Case, subject: Subject) -> Measurement:
    """Measure how much farther the reported master segments are than the nearest by the rule of the formulation.

    Parameters
    ----------
    case : Case
        Any state.
    subject : Subject
        A formulation that states its rule in the trait `gap`.

    Returns
    -------
    Measurement
        The largest distance beyond the nearest segment over L + |P − A|, dimensionless. Broken: a segment does not
        face the slave. Detail: the number of points with an exact tie.
    """
    reported = Reported.from_case(case, subject)
    rule, value, ties, broken = subject.traits.gap, 0.0, 0, ""
    for each in reported.passes:
        places = Places.from_pass(each, rule, reported.distant)
        segments = places.reported.master_segment
        if rule == CLOSEST:
            excess, tied = closest_excess(places.lattice, places.exact, segments)
            ties += int((tied > 1).sum())
        else:
            carrier = places.reported.slave_segment
            excess = seen_excess(places.lattice, places.exact, carrier, segments, cells=rule in CELLS)
        facing = places.view.cosine > 0
        value = max(value, largest(excess[facing] / places.scale[facing]))
        rounded = places.reported.weight <= OVERLAP_ROUNDOFF * (places.view.lengths + reported.distant)
        if not (facing | rounded).all():
            broken = "a master segment does not face the slave segment of its point"
    return Measurement(
        [FARTHER.check(value, 4 * UNIT_ROUNDOFF)],
        broken=broken,
        details={"tied points": ties},
        idle=not reported.points.active.any(),
    )


PROJECTION_SEGMENT = Property(
    id="projection.segment",
    family="projection",
    summary="Each contact point is measured against the master segment that the stated rule names.",
    quantities=(FARTHER,),
    cases=projected_cases,
    kinds=PROJECTED_KINDS,
    measure=measure_segments,
    promise=lambda traits: True,
    needs=frozenset({"contact_points"}),
    applicable=lambda traits: refuse_without_rule(traits) or refuse_barrier(traits),
)
