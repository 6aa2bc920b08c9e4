"""The table of the command `score`: a row for each kind of query, and what the columns mean."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from contactverif.cli.console import plain_table
from contactverif.studies.queries.query_scores import Score, Scores

_COLUMNS = {
    "wrong": "decisions with a segment that is not nearest, or a wrong sign of the gap",
    "sign": "wrong decisions about the sign alone: the gap exceeds 4u(L + |P − A|)",
    "mistakes": "wrong decisions that roundoff does not explain",
    "undecided": "queries to which the program says that it does not know",
    "ξ, distance": "worst errors over right segments, in units of u(L + |P − A|)/L and u(L + |P − A|)",
    "µs": "time of one decision",
}


def score_table(scores: Scores) -> Table:
    """Return the table of the scores."""
    table = plain_table("")
    table.add_column("kind", no_wrap=True)
    for name in ("queries", "wrong", "a million", "sign", "mistakes", "undecided", "ξ", "distance", "µs"):
        table.add_column(name, justify="right", no_wrap=True)
    for score in [*scores.kinds, scores.total]:
        if score is scores.total:
            table.add_section()
        table.add_row(*_cells(score), style="bold" if score is scores.total else None)
    return table


def score_words(scores: Scores) -> Text:
    """Return what the columns mean, and the first wrong decision of each kind."""
    width = max(map(len, _COLUMNS)) + 2
    lines = [f"  {name:{width}}{meaning}" for name, meaning in _COLUMNS.items()]
    if scores.total.other_rule:
        lines += ["", f"In {scores.total.other_rule} ties another segment was chosen than that of smallest overshoot."]
    if scores.first_wrong:
        lines += ["", "the first wrong decision of each kind", *(f"  {words}" for words in scores.first_wrong)]
    return Text("\n".join(lines))


def _cells(score: Score) -> list[str]:
    """Return a row of the table."""
    each = score.seconds_each
    return [
        score.kind,
        f"{score.queries}",
        f"{score.wrong}",
        f"{score.wrong_per_million:.0f}",
        f"{score.wrong_signs}",
        f"{score.beyond_roundoff}",
        f"{score.undecided}",
        f"{score.worst_xi:.3g}",
        f"{score.worst_distance:.3g}",
        "–" if each is None else f"{1e6 * each:.3g}",
    ]
