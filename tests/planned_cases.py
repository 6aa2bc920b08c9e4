"""All planned cases of a strategy at once, as the blocks of a run have them."""

from contactverif import Case
from contactverif.sampling.draw import CaseSource, PlannedCases, draw_block, number_of_blocks


def draw_cases(source: CaseSource, *, seed: str, examples: int) -> PlannedCases:
    """Draw all planned cases; the first is the simplest that the strategy makes. Kinds follow one another in turn.

    A case that a strategy filters out is not counted. There are fewer if the strategy has fewer.
    """
    cases: list[Case] = []
    for number in range(number_of_blocks(examples)):
        block = draw_block(source, seed=seed, examples=examples, number=number)
        cases += block.cases
        if block.last:
            break
    return PlannedCases(tuple(cases), block.exhausted)
