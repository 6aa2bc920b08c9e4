"""The queries: always the same, of the kind whose name they bear, with answers that a plain loop confirms."""

import hashlib
from collections import Counter
from fractions import Fraction
from pathlib import Path

import pytest

from contactverif.contract.errors import MisuseError
from contactverif.studies import queries as queries_package
from contactverif.studies.queries.query_file import ExactAnswer, exact_text, queries_text, read_exact, read_queries
from contactverif.studies.queries.query_making import KINDS, exact_path, make_queries, write_queries
from contactverif.studies.queries.surfaces import RandomNumbers, Shape

N_EACH = 10
QUERIES, EXACT = make_queries(3, N_EACH * len(KINDS))
TEXT = queries_text(QUERIES)


def plain_answer(shape: Shape, point: tuple[float, float]) -> ExactAnswer:
    """Return the exact answer of a plain loop over all segments; lengths are compared by their squares."""
    px, py = map(Fraction, point)
    ranked = []
    for number, (first, second) in enumerate(shape.segments.tolist()):
        (ax, ay), (bx, by) = (map(Fraction, shape.nodes[node].tolist()) for node in (first, second))
        dx, dy = bx - ax, by - ay
        squared = dx * dx + dy * dy
        xi = ((px - ax) * dx + (py - ay) * dy) / squared
        clipped = min(max(xi, Fraction(0)), Fraction(1))
        distance = (px - ax - clipped * dx) ** 2 + (py - ay - clipped * dy) ** 2
        cross = (px - ax) * dy - (py - ay) * dx
        foot = (first, second)[xi >= 1] if not 0 < xi < 1 else -1 - number
        ranked.append((distance, (xi - clipped) ** 2 * squared, number, xi, cross * abs(cross) / squared, foot))
    nearest = sorted(entry for entry in ranked if entry[0] == min(ranked)[0])
    gaps = {foot: gap for *_, gap, foot in reversed(nearest)}
    segments = tuple((number, xi, gaps[foot]) for _, _, number, xi, _, foot in nearest)
    first_overshoot = nearest[0][1]
    return ExactAnswer(nearest[0][0], segments, sum(past == first_overshoot for _, past, *_ in nearest))  # type: ignore[arg-type]


def test_every_answer_is_that_of_a_plain_loop_in_fractions() -> None:
    for query, answer in zip(QUERIES.queries, EXACT, strict=True):
        if query.kind == "long-chain":  # Its thousand segments take a plain loop too long; a few of them do.
            continue
        expected = plain_answer(QUERIES.surfaces[query.surface], query.point)
        assert answer.squared_distance == expected.squared_distance
        assert answer.n_first == expected.n_first
        assert [(near.segment, near.xi, near.signed_squared_gap) for near in answer.segments] == list(expected.segments)


def test_what_is_exact_shares_no_code_with_what_is_scored() -> None:
    folder = Path(queries_package.__file__).parent
    users = {path.stem for path in folder.glob("*.py") if "contactverif.geometry" in path.read_text(encoding="utf-8")}
    assert users == {"built_in_search"}


def test_there_are_as_many_queries_of_each_kind() -> None:
    counts = Counter(query.kind for query in QUERIES.queries)
    assert counts == {kind.name: N_EACH for kind in KINDS}
    more, _ = make_queries(0, len(KINDS) + 2)
    assert sorted(Counter(query.kind for query in more.queries).values()) == [1] * (len(KINDS) - 2) + [2, 2]


def test_a_kind_is_one_word_with_a_meaning_of_its_own() -> None:
    assert len({kind.name for kind in KINDS}) == len({kind.meaning for kind in KINDS}) == len(KINDS)
    assert all(kind.name.split() == [kind.name] and kind.meaning for kind in KINDS)


def test_ties_are_ties_and_near_ties_are_none() -> None:
    answers: dict[str, list[ExactAnswer]] = {}
    for query, answer in zip(QUERIES.queries, EXACT, strict=True):
        answers.setdefault(query.kind, []).append(answer)
    assert all(answer.n_first >= 2 for answer in answers["bisector"])
    assert all(len(answer.segments) >= 3 for answer in answers["three-feet"])
    assert all(len(answer.segments) == 1 for answer in answers["near-tie"])
    assert all(answer.squared_distance == 0 for answer in answers["touching"])
    assert all(0 < answer.squared_distance <= Fraction(10) ** -30 for answer in answers["tiny-gap"])
    assert all(len(answer.segments) == 2 and answer.n_first == 1 for answer in answers["sharp-tip"])
    signs = [answer.segments[0].signed_squared_gap > 0 for answer in answers["inside"]]
    assert True in signs
    assert False in signs


def test_the_same_seed_gives_the_same_file_on_every_machine() -> None:
    """The sum was computed once. If it changes, every file that somebody has kept has other queries than a new one."""
    queries, answers = make_queries(0, 2 * len(KINDS))
    text = queries_text(queries)
    assert (
        hashlib.sha256(text.encode()).hexdigest() == "60a627d2ea0279842d1a3864d91fe6cb311d4246b5ad0b29d8435cda2c127a8c"
    )
    assert (
        hashlib.sha256(exact_text(answers, text).encode()).hexdigest()
        == "18d1e9140c278d56af8343b43396d36269de1519c2c412c029ab4642be48d7ec"
    )


def test_another_seed_gives_other_queries() -> None:
    assert queries_text(make_queries(1, len(KINDS))[0]) != queries_text(make_queries(2, len(KINDS))[0])


@pytest.mark.parametrize(
    ("seed", "number", "words"), [(-1, 100, "seed: found -1"), (0, 3, "-n: found 3; needed at least")]
)
def test_impossible_wishes_are_refused(seed: int, number: int, words: str) -> None:
    with pytest.raises(MisuseError, match=words):
        make_queries(seed, number)


def test_dice_stay_between_their_limits() -> None:
    dice = RandomNumbers(5, 0)
    assert {dice.integer(2, 4) for _ in range(100)} == {2, 3, 4}
    assert all(-1 <= dice.real(-1, 1) < 1 for _ in range(100))
    assert all(2.0**-3 <= dice.power(-3, -1) < 1 for _ in range(100))
    assert sorted(dice.shuffle(range(10))) == list(range(10))
    assert all(abs(c * c + s * s - 1) < 1e-15 for c, s in (dice.direction() for _ in range(100)))
    assert RandomNumbers(5, 1).real(0, 1) != RandomNumbers(5, 2).real(0, 1)


def test_files_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    path = tmp_path / "queries.txt"
    assert write_queries(path, 3, N_EACH * len(KINDS)) == len(KINDS)
    queries, fingerprint = read_queries(path)
    assert queries_text(queries) == TEXT
    assert read_exact(exact_path(path), fingerprint, len(EXACT)) == EXACT
    assert "# near-tie: one unit in the last place off a tie\n" in path.read_text()


def test_ends_of_lines_and_comments_do_not_make_another_file(tmp_path: Path) -> None:
    path, exact = tmp_path / "queries.txt", tmp_path / "exact.txt"
    exact.write_text(exact_text(EXACT, TEXT))
    path.write_bytes(TEXT.replace("\n", "\r\n# a comment\r\n\r\n").encode())
    assert read_exact(exact, read_queries(path)[1], len(EXACT)) == EXACT


SMALL = """contactverif-queries 1 1 2
# a comment
surface 0 3 2
0.0 0.0
-1.0 0.0
-2.0 0.5
0 1
1 2
query 0 0 -0.5 0.25 inside
query 1 0 0.25 0.25 free-end
"""
SMALL_EXACT = ["0 1 1 1/16 0 1/2 1/16", "1 1 1 1/8 0 -1/4 1/16"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("queries 1 1 2", "queries 9 1 2", "line 1: found 'contactverif-queries 9 1 2'; needed contactverif-queries 1"),
        ("queries 1 1 2", "queries 1 x 2", "line 1: found 'x'; needed an integer of at least 0"),
        ("surface 0 3", "surface 1 3", "line 3: found 'surface 1 3 2'; needed surface 0 NODES SEGMENTS"),
        ("-1.0 0.0", "-1.0 nan", "line 5: found 'nan'; needed a finite number"),
        ("-1.0 0.0", "-1.0 0,5", "line 5: found '0,5'; needed a number"),
        ("-1.0 0.0\n", "", "line 8: found 'query 0 0 -0.5 0.25 inside'; needed FIRST SECOND"),
        ("\n1 2\n", "\n1 3\n", "line 8: found '3'; needed an integer from 0 to 2"),
        ("\n1 2\n", "\n1 1\n", "line 3: found segment 1 that begins and ends at node 1"),
        ("query 1 0", "query 1 4", "line 10: found '4'; needed an integer from 0 to 0"),
        ("query 1 0", "query 7 0", "line 10: found 'query 7 0 0.25 0.25 free-end'; needed query 1 SURFACE X Y KIND"),
        ("query 1 0 0.25 0.25 free-end\n", "", "line 10: found the end of the file; needed query 1 SURFACE"),
        ("free-end\n", "free-end\nmore\n", "line 11: found 'more'; needed the end of the file"),
    ],
)
def test_a_wrong_line_of_queries_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "queries.txt"
    path.write_text(SMALL.replace(old, new, 1))
    with pytest.raises(MisuseError, match=words):
        read_queries(path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("1/16 0 1/2", "1/0 0 1/2", "line 2: found '1/0'; needed a rational number P/Q"),
        ("0 1 1", "0 2 1", "line 2: found '0 2 1 1/16 0 1/2 1/16'; needed 0 TIED FIRST SQUARED_DISTANCE"),
        ("0 1 1", "0 1 2", "line 2: found '2'; needed an integer from 1 to 1"),
        ("\n1 1 1", "\n2 1 1", "line 3: found '2 1 1 1/8 0 -1/4 1/16'; needed 1 TIED"),
        (
            "exact 1 2",
            "exact 1 3",
            "line 1: found 'contactverif-exact 1 3 .*'; needed the line contactverif-exact 1 2 ",
        ),
    ],
)
def test_a_wrong_line_of_exact_answers_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    path, exact = tmp_path / "queries.txt", tmp_path / "exact.txt"
    path.write_text(SMALL)
    queries, fingerprint = read_queries(path)
    text = "\n".join([f"contactverif-exact 1 2 {fingerprint}", *SMALL_EXACT]) + "\n"
    exact.write_text(text)
    assert exact_text(read_exact(exact, fingerprint, 2), SMALL) == text
    exact.write_text(text.replace(old, new, 1))
    with pytest.raises(MisuseError, match=words):
        read_exact(exact, fingerprint, len(queries.queries))


def test_answers_to_other_queries_are_refused(tmp_path: Path) -> None:
    path, exact = tmp_path / "queries.txt", tmp_path / "exact.txt"
    exact.write_text("\n".join(["contactverif-exact 1 2 " + "0" * 64, *SMALL_EXACT]))
    path.write_text(SMALL)
    with pytest.raises(
        MisuseError, match=r"needed the line contactverif-exact 1 2 [0-9a-f]{64} of the answers to these"
    ):
        read_exact(exact, read_queries(path)[1], 2)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(MisuseError, match=r"missing\.txt, which does not exist"):
        read_queries(tmp_path / "missing.txt")
    (tmp_path / "binary.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MisuseError, match=r"binary\.txt: found bytes that are no UTF-8 text"):
        read_queries(tmp_path / "binary.txt")
