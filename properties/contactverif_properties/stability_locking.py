"""Ask whether an interface of springs stays as compliant, and its pressure as smooth, as the springs become stiff.

**Question.** A block is pressed on another with meshes of 8 and 12 segments, and a pressure that varies as one wave is
added. As the penalty rises from 10 to 1e8 E/h, does the interface become stiffer than matching meshes do? Does its
pressure vary more than theirs?

**Why it matters.** Springs at more points than the surfaces can follow are more conditions than unknowns. With a high
penalty all gaps go to zero together, and the interface locks: it is too stiff, and its pressures are rough. The flat
patch test does not see it, since a uniform pressure needs no gap to vary.

**How it is judged.** No node of one mesh faces a node of the other, but for the ends. Both blocks are under a mean
pressure of 64 times the wave. The answer to the wave is the difference between the solutions with it and without it,
both on the pairing of the uniform state, so that nothing opens and the answer is linear.

The *drift* is the loss of compliance from 10 E/h to the penalty of the case, beside that of matching meshes: 1 −
(c/c_m)/(c/c_m at 10 E/h). The compliance c is the work of the wave's load, and c_m is the mean of two matching meshes,
one with the segments of the slave and one with those of the master. Their springs are as stiff as those of the
formulation are under the mean pressure at 10 E/h. So springs that act twice are held against springs twice as stiff.
The drift is at most 1 %. With multipliers there is no soft penalty to begin with, and no drift is judged.

The *roughness* is the largest minus the smallest pressure, over that of matching meshes. Pressures are nodal forces
over the lengths beside their nodes, on both surfaces, and those that the formulation reports. The roughness is at most
2.

The bounds were measured. NTS, NTS-AR, mortar, dual mortar and Chen–Hisada do not lock: at every penalty their drift is
at most 0.1 % and their roughness at most 1.2. Springs at two points or more between the nodes (VTS-G, VTS-ME, VTS-PPT,
segment-to-segment) and two passes lock. At 1e2 E/h their drift is 1 % to 3 % and their roughness 4; at 1e8 E/h the
drift is 33 % to 34 % and the roughness 90 to 400. (With two points a segment this needs a slave that is finer than the
master.) Two half passes lock too: their drift is 33 %, though their pressures remain smooth.

**Undecided.** Where Newton's method finds no solution on that pairing.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.problems.wave_blocks import SOFT, WaveAnswer, matching_answer, wave_blocks, wave_cases
from contactverif_properties.shared.applicability import refuse_dependent_multipliers, refuse_unstated_penalty
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.wave_answer import answer_to_wave

MOST_DRIFT, MOST_ROUGHNESS = 0.01, 2.0
DRIFT = Quantity(
    "drift of the compliance",
    "1",
    "0.01",
    "Without locking it was at most 0.001 at any penalty, with locking at least 0.33 at the highest.",
)
ROUGHNESS = Quantity(
    "roughness of the pressure",
    "1",
    "2",
    "Without locking it was at most 1.2 at any penalty, with springs between the nodes at least 90 at the highest.",
)
_UNSOLVED = "Newton's method finds no solution on the pairing of the uniform state"


def measure_locking(case: Case, subject: Subject) -> Measurement:
    """Measure what a high penalty does to the answer of two blocks to a wave.

    Parameters
    ----------
    case : Case
        A scene from `wave_cases`.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The drift of the compliance since the softest penalty, if the formulation has a penalty, and the roughness.
        Details: roughness of nodal forces and of reported pressures, stiffness of the springs over the penalty.
    """
    n_slave, n_master = case.parameters["columns"].astype(int).tolist()
    columns, penalty = (n_slave, n_master), case.parameter("stiffness")
    answer = answer_to_wave(columns, penalty, subject)
    if answer is None:
        return Measurement(undecided=_UNSOLVED)
    smooth = matching_answer(n_slave, case.penalty).pressure_range
    by_forces, by_points = answer.force_range / smooth, answer.point_range / smooth
    values = {ROUGHNESS: float(np.fmax(by_forces, by_points))}
    details = {"roughness of nodal forces": by_forces}
    if np.isfinite(by_points):
        details["roughness of reported pressures"] = by_points
    if subject.traits.enforcement == "penalty":
        soft = answer_to_wave(columns, SOFT, subject)
        if soft is None:
            return Measurement(undecided=_UNSOLVED)
        at_soft = wave_blocks(*columns, SOFT, wave=0.0).penalty
        factor = soft.stiffness / at_soft  # Springs may act twice.
        ratio = answer.compliance / mean_of_matching(columns, factor * case.penalty)
        values[DRIFT] = 1 - ratio * mean_of_matching(columns, factor * at_soft) / soft.compliance
        details["stiffness of the springs over the penalty"] = factor
    tolerances = {DRIFT: MOST_DRIFT, ROUGHNESS: MOST_ROUGHNESS}
    return Measurement(check_all(values, tolerances), details=details)


def mean_of_matching(columns: tuple[int, int], distributed: float) -> float:
    """Return the mean compliance of matching meshes with the segments of the slave and with those of the master."""
    answers: list[WaveAnswer] = [matching_answer(number, distributed) for number in columns]
    return sum(answer.compliance for answer in answers) / len(answers)


def refuse_undefined_pressure(traits: Traits) -> str:
    """Return why springs or multipliers have no pressure that is known, or an empty string."""
    return refuse_dependent_multipliers(traits) or refuse_unstated_penalty(traits)


def promise_smoothness(traits: Traits) -> bool | None:
    """Return whether the formulation promises not to lock; None if it promises nothing."""
    return None if traits.locks is None else not traits.locks


LOCKING = Property(
    id="stability.locking",
    family="stability",
    summary="With stiff springs the interface is no stiffer and its pressure no rougher than with matching meshes.",
    quantities=(DRIFT, ROUGHNESS),
    needs=frozenset({"pair"}),
    cases=unless_given(wave_cases),
    measure=measure_locking,
    promise=promise_smoothness,
    applicable=refuse_undefined_pressure,
    bodies=True,
)
