"""The named scenes: all of them solve, their options do what they say, and what is no scene has its line."""

import itertools
from typing import Any

import numpy as np
import pytest
from subjects import load_subject

from contactverif import MisuseError, Scene
from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.errors import parse_name, unknown_name_error
from contactverif.mechanics import newton
from contactverif.mechanics.system import System
from contactverif.problems.blocks import exact_unknowns, is_uniform, pressure_of
from contactverif.problems.catalogue import BLOCKS, OPTIONS, SCENES, load_scene, make_scene, options_of
from contactverif.problems.disk import disk_on_foundation
from contactverif.problems.flat_states import overhangs

every_name = pytest.mark.parametrize("name", BLOCKS)
every_name_of_the_paper = pytest.mark.parametrize("name", [name for name, drawing in BLOCKS.items() if drawing.source])


def coordinates(scene: Scene) -> list[list[float]]:
    """Along the interface, in the scene's own axes, ascending."""
    along = scene.interface.nodes @ scene.bodies[0].frame[:, 0]
    return [sorted(side.tolist()) for side in np.split(along, [scene.interface.n_slave_nodes])]


def printed_nodes(name: str) -> list[list[float]]:
    """Return the nodes as the drawing has them."""
    drawing = BLOCKS[name]
    sides = ((drawing.slave_from, drawing.slave), (drawing.master_from, drawing.master))
    return [[start, *(start + total for total in itertools.accumulate(map(float, each)))] for start, each in sides]


# --- the scenes -------------------------------------------------------------------------------------------------


@every_name
@pytest.mark.parametrize("text", ["", ":refine=2", ":degrees=17.3,ratio=0.25", ":penalty=1e8,poisson=0"])
def test_every_scene_solves(name: str, text: str) -> None:
    """With a formulation that passes: the pressure is the one on top, in every body."""
    scene, p = load_scene(name + text), BLOCKS[name].pressure
    formulation = load_subject("vts-ppt-balanced").for_case(scene.case())
    trace = newton.solve(scene, formulation)
    assert trace.converged
    system = System(scene, formulation)
    matrix, floor = system.matrix(trace.solution, system.pair(trace.solution))
    # The error of displacements, if the residual is roundoff.
    off = np.abs(np.linalg.inv(matrix)).sum(axis=1).max() * floor.max()
    elastic = [body for body in scene.bodies if not body.rigid]
    shortest = min(body.nodes[body.cells][:, [0, 1, 2]].std(axis=1).max(axis=1).min() for body in elastic)
    for body, stresses in zip(scene.bodies, scene.stresses(trace.solution), strict=True):
        if not body.rigid:
            expected = [-p * body.poisson / (1 - body.poisson), -p, 0]
            assert np.abs(stresses - expected).max() <= 2 * body.oedometric_modulus * off / shortest
    assert np.abs(trace.solution - exact_unknowns(scene, p, scene.penalty)).max() <= 2 * off


@every_name_of_the_paper
def test_what_is_known_of_a_scene(name: str) -> None:
    drawing, scene = BLOCKS[name], make_scene(name)
    assert all((scene.name == name, drawing.summary, drawing.source, drawing.assumptions))
    slave, master = coordinates(scene)
    assert [slave, master] == printed_nodes(name)
    assert master[0] <= slave[0] < slave[-1] <= master[-1]
    assert scene.bodies[1].rigid == drawing.rigid_master
    assert (scene.bodies[0].young, scene.bodies[0].poisson) == (1e4, 0.3)
    assert scene.penalty == 10 * 1e4 / np.mean(drawing.slave)
    case = scene.case()
    assert is_uniform(case)
    assert pressure_of(case, 123.0) == drawing.pressure
    # What the summaries say: areas lie over one master segment or across a master node, quarter points on it or not.
    halves = np.sort(np.concatenate([slave, np.add(slave[1:], slave[:-1]) / 2]))  # Ends of areas of two points.
    quarters = (halves[1:] + halves[:-1]) / 2
    crossing = any(low < node < high for low, high in itertools.pairwise(halves) for node in master)
    assert crossing == (name in ("c", "c-prime", "example-1bis"))
    assert set(quarters.tolist()) & set(master) == ({9.0} if name == "c" else set())
    if name in ("example-1", "example-1bis"):
        assert all(side == [-x for x in reversed(side)] for side in (slave, master))


def test_the_slave_of_the_dead_zone_overhangs_inside_its_segments() -> None:
    drawing, scene = BLOCKS["dead-zone"], make_scene("dead-zone")
    assert (drawing.source, scene.name) == ("", "dead-zone")
    slave, master = coordinates(scene)
    assert slave == pytest.approx([-6, -4.4, -2.1, -0.3, 1.9, 4, 6], abs=1e-15)
    assert master == pytest.approx([-3.3, -1.6, 0.4, 2.2, 3.3], abs=1e-15)
    assert overhangs(scene.case())
    assert pressure_of(scene.case(), 123.0) == drawing.pressure
    upper, lower = (body.load[:, 1].sum() for body in scene.bodies)
    assert upper == pytest.approx(-drawing.pressure * 6.6, rel=1e-14)  # what the master is pressed with
    assert lower == 0
    assert not any(overhangs(make_scene(name).case()) for name in BLOCKS if name != "dead-zone")


@every_name
@pytest.mark.parametrize("refine", [2, 3, 7])
def test_refining_keeps_the_printed_nodes_exactly(name: str, refine: int) -> None:
    fine = make_scene(name, refine=refine)
    for here, there in zip(coordinates(fine), printed_nodes(name), strict=True):
        assert here[::refine] == there
        assert len(here) == refine * (len(there) - 1) + 1
        gaps = np.diff(here).reshape(-1, refine)
        assert np.abs(gaps - gaps.mean(axis=1, keepdims=True)).max() <= 4 * UNIT_ROUNDOFF * np.abs(there).max()
    assert len(fine.bodies[0].cells) == 2 * refine * refine * len(BLOCKS[name].slave)
    assert fine.penalty == pytest.approx(refine * make_scene(name).penalty, rel=4 * UNIT_ROUNDOFF, abs=0)


@pytest.mark.parametrize(
    ("degrees", "turn"),
    [(90, [[0, -1], [1, 0]]), (180, [[-1, 0], [0, -1]]), (270, [[0, 1], [-1, 0]]), (360, np.eye(2))],
)
def test_quarter_turns_are_exact(degrees: int, turn: list[list[int]]) -> None:
    upright = make_scene("c-prime")
    for angle in (degrees, float(degrees), degrees - 360, degrees + 720):
        for body, other in zip(make_scene("c-prime", degrees=angle).bodies, upright.bodies, strict=True):
            assert np.array_equal(body.nodes, other.nodes @ np.transpose(turn))
            assert np.array_equal(body.frame, turn)
            assert np.array_equal(body.load, other.load)


def test_any_other_turn() -> None:
    cos, sin = np.cos(np.radians(17.3)), np.sin(np.radians(17.3))
    turn = np.array([[cos, -sin], [sin, cos]])
    for body, other in zip(make_scene("b", degrees=17.3).bodies, make_scene("b").bodies, strict=True):
        assert np.abs(body.nodes - other.nodes @ turn.T).max() <= 4 * UNIT_ROUNDOFF * 12 * np.sqrt(2)
        assert np.abs(body.frame - turn).max() <= UNIT_ROUNDOFF


def test_the_disk() -> None:
    """By name it is what `disk` makes, with the paper's numbers; no pressure is known of it."""
    assert SCENES["example-2"].source
    scene, other = make_scene("example-2"), disk_on_foundation()
    for body, same in zip(scene.bodies, other.bodies, strict=True):
        assert np.array_equal(body.nodes, same.nodes)
        assert (body.young, body.poisson) == (same.young, same.poisson)
    assert (scene.penalty, scene.name) == (other.penalty, "example-2")
    assert not is_uniform(scene.case())
    numbers = {"young": 2e8, "ratio": 2.0, "poisson": 0.25, "penalty": 2e9, "force": 3e6, "lowered": 0.01}
    stiffer = make_scene("example-2", refine=2, **numbers)
    assert [(body.young, body.poisson) for body in stiffer.bodies] == [(2e8, 0.25), (4e8, 0.25)]
    assert (stiffer.penalty, stiffer.bodies[0].load.sum()) == (2e9, -3e6)
    assert stiffer.bodies[0].start.tolist() == [0, -0.01]
    assert len(stiffer.bodies[1].cells) == 4 * 160 * 30


# --- options ----------------------------------------------------------------------------------------------------


def test_options_from_text_are_those_of_python() -> None:
    texts: dict[str, dict[str, Any]] = {
        "c:refine=2": {"refine": 2},
        "c:penalty=1e4": {"penalty": 1e4},
        "c:penalty=10000": {"penalty": 1e4},
        "c:young=2e3": {"young": 2e3},
        "c:ratio=0.5": {"ratio": 0.5},
        "c:poisson=-0.25": {"poisson": -0.25},
        "c:pressure=7": {"pressure": 7},
        "c:degrees=-45": {"degrees": -45},
        "c:sides=free": {"sides": "free"},
        "c:sides=rollers": {},
        "c:lowered=0": {"lowered": 0},
        "c:lowered=-0.5,refine=3": {"lowered": -0.5, "refine": 3},
        "c": {},
        "example-2:force=2e6,ratio=1": {"force": 2e6, "ratio": 1},
    }
    assert {option for options in texts.values() for option in options} == set(OPTIONS)
    for text, options in texts.items():
        scenes = load_scene(text), make_scene(text.partition(":")[0], **options)
        arrays, other = (scene.case().to_arrays() for scene in scenes)
        assert all(np.array_equal(arrays[key], other[key]) for key in arrays), text


def test_what_options_do() -> None:
    plain = make_scene("c")
    assert make_scene("c", young=2e4).penalty == 2 * plain.penalty
    assert [body.young for body in make_scene("c", young=2e3, ratio=0.5).bodies] == [2e3, 1e3]
    assert [body.poisson for body in make_scene("c", poisson=0.1).bodies] == [0.1, 0.1]
    assert make_scene("c", penalty=3.0).penalty == 3
    assert make_scene("c", pressure=7.0).bodies[0].load.sum() == -7 * 12
    assert plain.bodies[0].start.tolist() == [0, -100 / plain.penalty]
    assert make_scene("c", lowered=0).bodies[0].start.tolist() == [0, 0]
    assert make_scene("c", lowered=0.5).bodies[0].start.tolist() == [0, -0.5]
    assert plain.bodies[0].fixed[:, 0].sum() == 6
    assert make_scene("c", sides="free").bodies[0].fixed.sum() == 1
    assert not is_uniform(make_scene("c", sides="free").case())


NAMES = "a1, a2-graded, a2-uniform, b, c, c-prime, dead-zone, example-1, example-1bis, example-2"
FORM = "needed NAME or NAME:OPTION=VALUE,OPTION=VALUE"
ALL_OPTIONS = "there are refine, penalty, young, ratio, poisson, pressure, degrees, sides, lowered"
WRONG = {
    "": f"--scene: found ''; {FORM}",
    "c:": f"--scene: found '' in 'c:'; {FORM}",
    ":refine=2": f"--scene: found ':refine=2'; {FORM}",
    "c:refine": f"--scene: found 'refine' in 'c:refine'; {FORM}",
    "c:refine=": f"--scene: found 'refine=' in 'c:refine='; {FORM}",
    "c:=2": f"--scene: found '=2' in 'c:=2'; {FORM}",
    "c:refine=2,": f"--scene: found '' in 'c:refine=2,'; {FORM}",
    "c:refine=2,refine=2": "--scene: found refine twice in 'c:refine=2,refine=2'; needed each option once",
    "zzz": f"--scene: found 'zzz'; needed one of {NAMES}",
    "C": f"--scene: found 'C'; needed one of {NAMES}",
    "c-prim": "--scene: found 'c-prim'; needed a name that exists; the nearest: c-prime",
    "c:refin=2": "--scene: option of 'c:refin=2': found 'refin'; needed a name that exists; the nearest: refine; "
    + ALL_OPTIONS,
    "c:name=b": "--scene: option of 'c:name=b': found 'name'; needed one of degrees, lowered, penalty, poisson, "
    f"pressure, ratio, refine, sides, young; {ALL_OPTIONS}",
    **{
        f"c:{option}={value}": f"--scene: {option} of 'c:{option}={value}': found {word}; needed {needed}"
        for options, values, needed in (
            (["refine"], ["0", "-1", "65", "1.5", "true", "x"], "a whole number from 1 to 64"),
            (["penalty", "young", "ratio", "pressure"], ["0", "-1", "nan", "inf"], "a number > 0"),
            (["penalty", "young", "ratio", "pressure", "poisson", "degrees", "lowered"], ["soft", "true"], "a number"),
            (["degrees", "lowered"], ["nan", "inf", "-inf"], "a finite number"),
            (["poisson"], ["0.5", "-1.0", "2.0", "nan", "inf"], "Poisson's ratio above −1 and below 0.5"),
            (["sides"], ["fre", "1"], "rollers or free"),
            (["young"], [f"1{'0' * 400}"], "a number > 0"),
        )
        for option, value in itertools.product(options, values)
        for word in [{"true": "True", "x": "'x'", "soft": "'soft'", "fre": "'fre'"}.get(value, value)]
    },
    "example-2:refine=5": "--scene: refine of 'example-2:refine=5': found 5; needed a whole number from 1 to 4",
    "example-2:force=0": "--scene: force of 'example-2:force=0': found 0; needed a number > 0",
    "example-2:sides=free": "--scene: option of 'example-2:sides=free': found 'sides'; needed one of force, lowered, "
    "penalty, poisson, ratio, refine, young; there are refine, penalty, young, ratio, poisson, force, lowered",
}


FAR = "more stiffness or less pressure: it starts too far away"


@pytest.mark.parametrize(("text", "message"), WRONG.items(), ids=lambda text: text[:24])
def test_what_is_no_scene(text: str, message: str) -> None:
    with pytest.raises(MisuseError) as error:
        load_scene(text)
    assert str(error.value) == message


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("zzz", {}, f"scene: found 'zzz'; needed one of {NAMES}"),
        ("c", {"sides": "fre"}, "sides of scene c: found 'fre'; needed rollers or free"),
        ("c", {"refine": 1.5}, "refine of scene c: found 1.5; needed a whole number from 1 to 64"),
        ("c", {"young": None}, "young of scene c: found None; needed a number"),
        ("c", {"penalty": "1"}, "penalty of scene c: found '1'; needed a number"),
        ("c", {"force": 1.0}, f"option of scene c: found 'force'; needed one of {', '.join(sorted(options_of('c')))}"),
        ("example-2", {"force": None}, "force of scene example-2: found None; needed a number"),
        ("c", {"lowered": float("nan")}, "lowered of scene c: found nan; needed a finite number"),
        *(
            ("c", {option: value}, f"options of scene c: found {option}={value}; needed {FAR}")
            for option, value in (("penalty", 1e-300), ("pressure", 1e300), ("young", 1e-300), ("penalty", 1e-12))
        ),
    ],
)
def test_what_is_no_scene_in_python(name: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(MisuseError) as error:
        make_scene(name, **options)
    assert str(error.value) == message


def test_numbers_of_numpy_are_numbers() -> None:
    make_scene("c", refine=np.int64(2), young=np.float32(8), degrees=np.int32(90))


# --- names ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "name", "options"),
    [
        ("nts", "nts", {}),
        ("vts-me:n=4", "vts-me", {"n": 4}),
        ("a:b=1.5,c=1e4,d=true,e=false", "a", {"b": 1.5, "c": 1e4, "d": True, "e": False}),
        ("a:f=word,g=-3", "a", {"f": "word", "g": -3}),
        ("a:b=c=d", "a", {"b": "c=d"}),
        ("a:b=x:y", "a", {"b": "x:y"}),
        ("a:b=True", "a", {"b": "True"}),
    ],
)
def test_names_with_options(text: str, name: str, options: dict[str, Any]) -> None:
    result = parse_name("formulation", text)
    assert result == (name, options)
    assert [type(value) for value in result[1].values()] == [type(value) for value in options.values()]


def test_an_unknown_name_suggests_the_nearest_or_lists_all() -> None:
    names = ["vts-ppt", "vts-me", "nts"]
    nearest = "found 'vts-pt'; needed a name that exists; the nearest: vts-ppt"
    assert str(unknown_name_error("formulation", "vts-pt", names)).startswith(f"formulation: {nearest}")
    for known, words in ((names, "one of nts, vts-me, vts-ppt"), ([], "a name, but there is none")):
        assert str(unknown_name_error("formulation", "xyz", known)) == f"formulation: found 'xyz'; needed {words}"
    assert unknown_name_error("formulation", "nts", ["nts-ar", "nts"]).found == "'nts'"
