"""Ask a whole code whether its interface locks as the penalty grows."""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.engine_subject import SOLVE, EngineSubject
from contactverif.contract.measurement import Measurement
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.problems.wave_blocks import wave_cases
from contactverif_properties.shared.wave_answer import answer_of_code
from contactverif_properties.stability_solutions import DRIFT, ROUGHNESS, measure_locking


@Property.define(
    id="engine.locking",
    family="engine",
    quantities=(DRIFT, ROUGHNESS),
    cases=Cases.from_list(wave_cases),
    promise=lambda traits: None,
    needs=frozenset({SOLVE}),
    bodies=True,
    engines=True,
)
def engine_locking(case: Case, subject: Subject) -> Measurement:
    """With stiff springs or multipliers the interface is no stiffer and its pressure no rougher than it should be.

    **Question.** The scenes of `stability.locking`: a block is pressed on another with meshes of 8 and 12 segments, and
    a wave of pressure is added. As the penalty rises from 10 to 1e8 E/h, is the interface as stiff, and its pressure as
    smooth, as on matching meshes?

    **Why it matters.** Users raise the penalty until nothing penetrates. A code whose springs ask for more than the
    surfaces can follow then answers with a stiffer joint and pressures that oscillate.

    **How it is judged.** As in `stability.locking`: the code solves the blocks with the wave and without it, and the
    difference counts. Pressures are the nodal forces that the bodies need over the lengths beside their nodes. A code
    with multipliers, or with a stiffness of its own, is judged by its roughness alone. No code promises this; the row
    says how it does.

    **Undecided.** Where the code finds no solution.
    """
    assert isinstance(subject, EngineSubject)
    return measure_locking(
        case,
        subject,
        lambda columns, penalty: answer_of_code(columns, penalty, subject),
        "the code finds no solution",
    )
