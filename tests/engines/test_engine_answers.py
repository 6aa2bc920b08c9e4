"""An engine is loaded, asked and judged, in this process and in one of its own, whatever it does."""

import sysconfig
from pathlib import Path
from venv import EnvBuilder

import numpy as np
import pytest
from plain_engine import Plain
from subjects import load_property

from contactverif import MisuseError, Verdict, judge_case, load_scene
from contactverif.contract.engine import EngineAnswer, EngineTraits, SceneArrays
from contactverif.contract.errors import ContractError
from contactverif.contract.subject import EngineSubject
from contactverif.isolation.host import end_all
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import engine_program, load_remote_engine
from contactverif.plugins.registry import load_engine, load_subject
from contactverif.problems.catalogue import load_scene_case

PATCH = "patch.flat.solve"


@pytest.fixture(autouse=True)
def _end_processes():
    yield
    end_all()


def remote(seconds: float = 20.0, **options: object) -> EngineSubject:
    """Return the plain engine in a process of its own that finds it by a folder."""
    command = (*engine_program("plain_engine:Plain", options), str(Path(__file__).parent))
    subject = load_remote_engine(command, "engine/plain", Limits(seconds))
    assert isinstance(subject, EngineSubject), subject
    return subject


def judge(subject: EngineSubject, scene: str = "c-prime", property_id: str = PATCH) -> tuple[Verdict, str]:
    outcome = judge_case(load_property(property_id), load_scene_case(scene), subject)
    return outcome.verdict, outcome.reason


@pytest.mark.parametrize("subject", [EngineSubject("engine/plain", Plain()), "remote"], ids=["inline", "remote"])
def test_a_right_engine_passes(subject: EngineSubject | str) -> None:
    engine = remote() if isinstance(subject, str) else subject
    for scene in ("a1", "c-prime", "c:degrees=17"):
        assert judge(engine, scene) == (Verdict.PASS, "")


def test_springs_that_are_half_as_stiff_fail() -> None:
    verdict, reason = judge(EngineSubject("engine/plain", Plain("half as stiff")))
    assert verdict is Verdict.FAIL
    assert "gap error" in reason


def test_who_finds_no_solution_is_undecided_in_its_own_words() -> None:
    assert judge(remote(fault="finds nothing")) == (Verdict.UNDECIDED, "did not converge: too many cutbacks")


@pytest.mark.parametrize(
    ("fault", "seconds", "words"),
    [
        ("raises", 20.0, "exception: solve: ArithmeticError: no pivot (plain_engine.py, line "),
        ("dies", 20.0, "signal: solve: SIGABRT"),
        ("hangs", 1.0, "hang: solve: no answer within"),
    ],
)
def test_whatever_it_does_is_an_outcome(fault: str, seconds: float, words: str) -> None:
    verdict, reason = judge(remote(seconds, fault=fault))
    assert verdict is Verdict.CRASHED
    assert words in reason


class Answers:
    """An engine that gives the same answer to all scenes."""

    traits = EngineTraits("penalty")

    def __init__(self, answer: object) -> None:
        self.answer = answer

    def solve(self, scene: object) -> object:
        return self.answer(scene) if callable(self.answer) else self.answer


NOTHING = np.zeros(1)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (None, "breaks the contract: solve: returned a NoneType; needed an EngineAnswer"),
        (EngineAnswer(np.zeros((2, 2)), True), "displacements: returned shape (2, 2); needed shape"),
        (lambda scene: EngineAnswer(np.zeros(scene.nodes.shape, int), True), "returned dtype int64; needed float64"),
        (lambda scene: EngineAnswer(np.full(scene.nodes.shape, np.nan), True), "not finite: solve: converged, with"),
        (
            lambda scene: EngineAnswer(0 * scene.nodes, True, pressures=NOTHING),
            "pressures: returned shape (1,); needed",
        ),
    ],
)
def test_an_answer_of_the_wrong_kind_breaks_the_contract(answer: object, words: str) -> None:
    verdict, reason = judge(EngineSubject("engine/answers", Answers(answer)))
    assert verdict is Verdict.FAIL
    assert words in reason


def test_traits_are_checked() -> None:
    with pytest.raises(ValueError, match="enforcement: found 'glue'"):
        EngineTraits("glue")
    with pytest.raises(ValueError, match=r"accuracy: found 0.*needed a number above 0, at most 1"):
        EngineTraits("penalty", accuracy=0.0)
    with pytest.raises(ContractError, match="without a `solve`"):
        EngineSubject("engine/none", object())
    with pytest.raises(ContractError, match="found a dict; needed"):
        EngineSubject("engine/dict", type("E", (), {"traits": {}, "solve": print})())


def test_a_name_on_the_command_line_finds_its_engine() -> None:
    subject = load_subject("engine/control", Limits())
    assert isinstance(subject, EngineSubject)
    assert subject.engine_traits.passes_flat_patch is True
    with pytest.raises(MisuseError, match="nearest: control"):
        load_engine("engine/kontrol")
    with pytest.raises(MisuseError, match=r"option of 'engine/calculix:kinds=nodes'.*nearest: kind"):
        load_engine("engine/calculix:kinds=nodes")


def test_the_process_of_an_engine_imports_numpy_and_the_standard_library_alone() -> None:
    answer = remote(fault="tells its modules").solve(load_scene("a1").arrays())
    assert set(answer.message.split()) == {"contactverif", "numpy", "plain_engine"}
    assert answer.converged is False


def test_another_interpreter_gets_of_this_one_the_harness_and_its_engine_alone(tmp_path: Path) -> None:
    """Everything else that lies beside them stayed visible, such as `landlockpy` or a scipy of another numpy."""
    EnvBuilder(symlinks=True, system_site_packages=False).create(tmp_path)
    packages = Path(sysconfig.get_path("purelib", "venv", {"base": str(tmp_path)}))
    for folder in Path(np.__file__).parents[1].glob("numpy*"):
        (packages / folder.name).symlink_to(folder)
    command = engine_program("plain_engine:Plain", {"fault": "tells what it finds"}, str(tmp_path / "bin" / "python"))
    subject = load_remote_engine(command, "engine/plain", Limits(20.0))
    assert isinstance(subject, EngineSubject), subject
    answer = subject.solve(load_scene("a1").arrays())
    assert answer.message.split() == ["contactverif", "numpy", "plain_engine"]


def test_a_question_about_forces_says_why_an_engine_is_not_asked() -> None:
    subject = EngineSubject("engine/plain", Plain())
    assert load_property("tangent.directional").refusal_of(subject) == "displacements alone do not answer it"
    assert load_property(PATCH).refusal_of(subject) == ""


def with_traits(engine: Plain, *arguments: str, **more: bool) -> EngineSubject:
    engine.traits = EngineTraits(*arguments, **more)
    return EngineSubject("engine/plain", engine)


def test_a_barrier_is_not_asked_of_scenes_that_penetrate() -> None:
    assert "barrier" in load_property(PATCH).refusal_of(with_traits(Plain(), "barrier"))


def test_a_code_with_a_stiffness_of_its_own_is_judged_by_its_mean_pressure() -> None:
    engine = with_traits(Plain("half as stiff"), "own", inclined_supports=True)
    outcome = judge_case(load_property(PATCH), load_scene_case("c-prime"), engine)
    assert outcome.verdict is Verdict.PASS
    assert outcome.measurement is not None
    assert "mean pressure over that of hard contact" in outcome.measurement.details


def test_a_body_that_flies_away_does_not_widen_its_own_tolerance() -> None:
    """A code has said so in small units: displacements of 1e16 segments, no stress, and that it converged."""

    class Flying(Plain):
        def solve(self, scene: SceneArrays) -> EngineAnswer:
            return EngineAnswer(np.where(scene.body_of_node[:, None] == 0, [0.0, 1e9], 0.0), True)

    verdict, reason = judge(with_traits(Flying(), "own", inclined_supports=True))
    assert verdict is Verdict.FAIL
    assert "stress error 1" in reason
