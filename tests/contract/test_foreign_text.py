"""Foreign text: what is spelled out, what is cut, and which classes hold none."""

from types import SimpleNamespace

import numpy as np
import pytest
from foreign_texts import TEXTS, hidden_characters

from contactverif import Case, Finding, Interface, Measurement, MisuseError, Quantity, Subject
from contactverif.contract.counterexample import case_id, typeable
from contactverif.contract.errors import LONGEST_LINE, LONGEST_NAME, describe_error, name_line, one_line, printable
from contactverif.contract.property import Outcome, PropertyInfo, Verdict
from contactverif.contract.result import NotLoaded, Row, Run

texts = pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)


@texts
def test_a_line_holds_no_hidden_character_and_no_line_break(text: str) -> None:
    line = one_line(text)
    assert not hidden_characters(line)
    assert "\n" not in line
    assert len(line) < LONGEST_LINE + 30
    assert one_line(line) == line or len(text) > LONGEST_LINE


@pytest.mark.parametrize("words", ["ε̂ = 10 E/h, −σₙ ≤ 1e-12 · κ", "plain", "", "größer", "漢字", "a b", "C′", "1 000"])
def test_words_of_any_language_stay(words: str) -> None:
    assert one_line(words) == printable(words) == words


def test_hidden_characters_are_spelled_out() -> None:
    assert one_line("a\x1b[0m\r\x07b\x9b\u202e\u200b\ud800") == r"a\x1b[0m\r\x07b\x9b\u202e\u200b\ud800"


def test_what_is_cut_says_how_long_it_was() -> None:
    assert name_line("x" * 201) == "x" * LONGEST_NAME + "… (201 characters)"


def test_line_breaks_within_become_spaces_and_those_at_the_end_go() -> None:
    assert one_line("first\n    second\r\n\tthird\n") == "first second third"


class _Sly(str):
    def __len__(self) -> int:
        return 1

    def isprintable(self) -> bool:
        return True

    def isascii(self) -> bool:
        return True


def test_a_subclass_of_str_cannot_vouch_for_itself() -> None:
    assert one_line(_Sly("a\x1b")) == printable(_Sly("a\x1b")) == r"a\x1b"


class _Mute(Exception):
    def __str__(self) -> str:
        raise SystemExit(0)


class _NoText(Exception):
    def __str__(self) -> str:
        return 3  # type: ignore[return-value]


def test_an_exception_whose_message_cannot_be_read_is_described_all_the_same() -> None:
    assert describe_error(_Mute()) == "_Mute, whose message cannot be read"
    assert describe_error(_NoText()) == "_NoText, whose message cannot be read"
    assert describe_error(type("a\x1b[2J", (Exception,), {})("b\x1b")) == r"a\x1b[2J: b\x1b"
    assert describe_error(ValueError("x" * 20_000_000)).endswith("xxx… (20000000 characters)")


@texts
def test_cases_and_results_hold_clean_text(text: str) -> None:
    interface = Interface.from_chains(slave=[[0, 0], [1, 0]], master=[[2, 0], [-1, 0]])
    case = Case(interface, np.zeros(8), parameters={text: np.zeros(1)}, name=text, kind=text)
    measurement = Measurement(undecided=text, broken=text, finding=Finding(text, remark=text))
    outcome = Outcome(case, Verdict.FAIL, text, measurement)
    info = PropertyInfo("id", "family", text, (Quantity("q", text, text),))
    row = Row(text, info, Verdict.FAIL, None, known=text, reason=text, shrunk=outcome)
    run = Run((row,), (NotLoaded(text, text),), {text: {}}, {text: text}, (text,))
    words = [case.name, case.kind, *case.parameters, measurement.undecided, measurement.broken]
    words += [str(measurement.finding), outcome.reason, outcome.summary.name, info.summary, info.quantities[0].reason]
    words += [row.formulation, row.known, row.reason, run.not_loaded[0].formulation, run.not_loaded[0].reason]
    words += [*run.provided, *run.provenance, *run.provenance.values(), *run.opposite_signs]
    for word in words:
        assert not hidden_characters(word)
        assert "\n" not in word
        assert len(word) < 20_100


@pytest.mark.parametrize("name", ["escape", "control", "bidirectional", "unseen", "surrogate", "lines", "long"])
def test_names_that_others_refer_to_are_refused(name: str) -> None:
    text = TEXTS[name]
    for make in (
        lambda: Quantity(text, "", ""),
        lambda: PropertyInfo(text, "family", "", ()),
        lambda: PropertyInfo("id", "family", "", (), kinds=(text,)),
    ):
        with pytest.raises(MisuseError, match="needed at most 200 characters that can be shown"):
            make()


@texts
def test_the_name_of_a_formulation_is_clean(text: str) -> None:
    name = Subject(text, lambda *, penalty: SimpleNamespace(residual=np.zeros_like)).name
    assert not hidden_characters(name)
    assert len(name) < LONGEST_NAME + 30


@texts
def test_ids_and_file_names_made_of_foreign_names_are_safe(text: str) -> None:
    for id_ in (case_id(text, "patch.flat"), case_id("nts", text, witness=True), typeable(f"a.b.{text}")):
        assert id_.isascii()
        assert len(f".{id_}.png.4194304.part") < 255
        assert not set(id_) & set("/\\ $'\"\n\0")
        assert not id_.startswith((".", "-"))


def test_long_names_that_begin_alike_stay_apart() -> None:
    assert typeable("x" * 300) != typeable("x" * 301)
    assert typeable("x" * 300) == typeable("x" * 300)
