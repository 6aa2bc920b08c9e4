"""The page about queries is true: its small files are read, scored and without an error."""

from pathlib import Path

from quotes import DOCS, blocks

from contactverif.oracle import nearest_segments
from contactverif.studies.queries.answers import read_answers
from contactverif.studies.queries.query_file import ExactAnswer, exact_text, read_exact, read_queries
from contactverif.studies.queries.query_scores import score_answers
from contactverif.studies.queries.text_lines import TextLines

PAGE = (DOCS / "how-to" / "score-your-search.md").read_text(encoding="utf-8")
QUESTIONS, ANSWERS, EXACT = blocks("text", PAGE)


def test_the_small_files_of_the_page_belong_together(tmp_path: Path) -> None:
    path, exact = tmp_path / "queries.txt", tmp_path / "exact.txt"
    path.write_text(QUESTIONS, encoding="utf-8")
    queries, fingerprint = read_queries(path)
    truth = [
        ExactAnswer.from_nearest(nearest_segments(shape.nodes, shape.segments, query.point))
        for query in queries.queries
        for shape in [queries.surfaces[query.surface]]
    ]
    assert exact_text(truth, QUESTIONS).splitlines()[1:] == EXACT.splitlines()
    exact.write_text(f"contactverif-exact 1 2 {fingerprint}\n{EXACT}", encoding="utf-8")
    assert read_exact(exact, fingerprint, 2) == truth
    scores = score_answers(queries, truth, read_answers(TextLines("page", ANSWERS), queries))
    assert (scores.total.wrong, scores.total.undecided, scores.total.seconds) == (0, 0, 0.0029)
    assert max(scores.total.worst_xi, scores.total.worst_distance) <= 1


def test_the_page_shows_the_program_that_is_tested() -> None:
    (program,) = blocks("c", PAGE)
    assert program == (DOCS.parent / "examples" / "nearest_segment.c").read_text(encoding="utf-8")
    assert len(program.splitlines()) <= 100
