"""Names, options, wrappers, and plugins that do not load; all entry points here are fakes."""

import sys
import types
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Any, Literal

import pytest

from contactverif import MisuseError, Property, Subject, Traits
from contactverif.contract.result import NotLoaded
from contactverif.isolation.box import Box
from contactverif.isolation.limits import Limits
from contactverif.plugins import registry
from contactverif.plugins.registry import (
    formulation_names,
    load_formulation,
    load_formulations,
    load_properties,
    subject_of,
)

PATH = "/a/b.c/nts/e/lib.so"


class Plugin:
    def __init__(self, **options: Any) -> None:
        self.options = options

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return 0 * z


def plain(*, penalty: float) -> Plugin:
    return Plugin(penalty=penalty)


def with_options(
    *,
    penalty: float,
    n: int = 2,
    factor: float = 1.0,
    area: Literal["reference", "current"] = "current",
    on: bool = True,
) -> Plugin:
    if n < 1:
        raise MisuseError("n", str(n), "at least 1")
    return Plugin(penalty=penalty, n=n, factor=factor, area=area, on=on)


def any_options(*, penalty: float, **options: Any) -> Plugin:
    return Plugin(penalty=penalty, **options)


def needing(*, penalty: float, order: int) -> Plugin:
    return Plugin(order=order)


def twice(*, penalty: float, inner: Any, mode: str = "average") -> Plugin:
    """Two of it.

    And more about them.
    """
    return Plugin(inner=inner(penalty=penalty), mode=mode)


def loads(*, penalty: float, file: str, nodes: int = 3) -> Plugin:
    """Load a file."""
    return Plugin(penalty=penalty, file=file, nodes=nodes)


def raising(*, penalty: float) -> Plugin:
    raise RuntimeError("no licence")


def question(name: str) -> Property:
    return Property(name, "family", "", (), lambda interface: None, lambda case, subject: None, lambda traits: None)  # type: ignore[arg-type, return-value]


IDS = ("balance.force", "patch.flat.solve", "patch.flat.transmission")
FORMULATIONS: dict[str, Any] = {
    "nts": plain,
    "vts-ppt": with_options,
    "vts-me": with_options,
    "any": any_options,
    "needing": needing,
    "twice": twice,
    "loads": loads,
    "raising": raising,
    "empty": lambda *, penalty: object(),
    "number": 7,
}


class Entry:
    """The part of an entry point that the registry reads, with a count of how often it was loaded."""

    dist, pattern, module = None, EntryPoint.pattern, "fake"

    def __init__(self, name: str, target: Any, value: str = "") -> None:
        self.name, self.target, self.value = name, target, value or f"fake:{name.replace('-', '_')}"
        self.loads = 0

    def load(self) -> Any:
        self.loads += 1
        if isinstance(self.target, BaseException):
            raise self.target
        return self.target


@pytest.fixture
def entries(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[Entry]]:
    installed = {
        registry.FORMULATIONS: [Entry(name, make) for name, make in reversed(FORMULATIONS.items())],
        registry.PROPERTIES: [Entry(name, question(name)) for name in reversed(IDS)],
    }
    monkeypatch.setattr(registry, "entry_points", lambda *, group: installed[group])
    return installed


def load(text: str) -> Any:
    subject = load_formulation(text)
    assert isinstance(subject, Subject)
    assert subject.name == text
    return subject.with_penalty(3.0).plugin


def reason_of(item: Any, name: str = "") -> str:
    assert isinstance(item, NotLoaded)
    assert name in ("", item.formulation)
    return item.reason


def test_names_are_sorted_and_nothing_is_loaded(entries: dict[str, list[Entry]]) -> None:
    assert (registry.formulation_names(), registry.property_ids()) == (tuple(sorted(FORMULATIONS)), IDS)
    load("nts")
    assert {entry.name for entry in entries[registry.FORMULATIONS] if entry.loads} == {"nts"}


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("vts-ppt", {"n": 2, "factor": 1.0, "area": "current", "on": True}),
        ("vts-me:n=4", {"n": 4, "factor": 1.0, "area": "current", "on": True}),
        ("vts-me:factor=1,area=reference,on=false", {"n": 2, "factor": 1, "area": "reference", "on": False}),
        ("any:a=1,b=1e-3,c=true,d=-2,e=word", {"a": 1, "b": 1e-3, "c": True, "d": -2, "e": "word"}),
        (f"loads:file={PATH},nodes=4", {"file": PATH, "nodes": 4}),  # A slash in a value wraps nothing.
    ],
)
@pytest.mark.usefixtures("entries")
def test_options_are_read(text: str, options: dict[str, Any]) -> None:
    assert repr(load(text).options) == repr({"penalty": 3.0, **options})


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("vts-pt", ["formulation: found 'vts-pt'", "nearest: vts-ppt"]),
        ("zzz", ["found 'zzz'", "one of any, empty", "vts-ppt"]),
        ("", ["formulation: found ''", "NAME"]),
        ("vts-me:", ["'vts-me:'", "OPTION=VALUE"]),
        ("vts-me:n", ["found 'n' in 'vts-me:n'"]),
        ("vts-me:n=", ["found 'n='"]),
        ("vts-me:=4", ["found '=4'"]),
        ("vts-me:n=1,", ["found ''"]),
        ("vts-me:n=1,n=2", ["n twice"]),
        ("vts-me:N=4", ["'N'", "it has n, factor, area, on"]),
        ("vts-me:facto=4", ["'facto'", "nearest: factor"]),
        ("nts:n=4", ["'n'", "it has none"]),
        ("vts-me:fact\u043er=4", [r"'fact\u043er'", "nearest: factor"]),
        ("vts-me:n=4.5", ["option n", "found 4.5", "a whole number"]),
        ("vts-me:n=true", ["option n", "found True", "a whole number"]),
        ("vts-me:factor=much", ["option factor", "'much'", "a number"]),
        ("vts-me:on=1", ["option on", "found 1", "true or false"]),
        ("vts-me:area=Reference", ["option area", "'Reference'", "one of reference, current"]),
        ("vts-me:n=0", ["n: found 0; needed at least 1"]),
        ("vts-me:penalty=4", ["option penalty", "the harness sets it"]),
        ("any:inner=nts", ["option inner", "the harness sets it"]),
        ("twice/", ["found ''"]),
        ("nts/vts-me", ["nts wraps nothing"]),
        ("vts-me:n=4/nts", ["option n", "found '4/nts'", "a whole number"]),
        ("loads:file=a/b,node=4", ["'node'", "nearest: nodes"]),
        ("twice/vts-m", ["found 'vts-m'", "nearest: vts-me"]),
        ("twice/vts-me:n=0", ["n: found 0"]),
        ("twice/twice/twice/twice/nts", ["found 4 wrappers", "at most 3"]),
        ("a/b/c/d/mine.py:Mine", ["found a file, 'a/b/c/d/mine.py:Mine'", "contactverif new NAME"]),
    ],
)
@pytest.mark.usefixtures("entries")
def test_what_the_caller_wrote_wrong_is_said(text: str, messages: list[str]) -> None:
    with pytest.raises(MisuseError) as error:
        load_formulation(text)
    for part in messages:
        assert part in str(error.value)


@pytest.mark.usefixtures("entries")
def test_a_wrapper_gets_a_factory_of_what_it_wraps() -> None:
    plugin = load("twice:mode=sum/vts-me:n=4")
    assert plugin.options["mode"] == "sum"
    assert plugin.options["inner"].options == {"penalty": 3.0, "n": 4, "factor": 1.0, "area": "current", "on": True}
    assert load("twice/twice/nts").options["inner"].options["inner"].options == {"penalty": 3.0}
    assert load(f"twice:mode=sum/twice/loads:file={PATH}").options["inner"].options["inner"].options["file"] == PATH


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("raising", "make: RuntimeError: no licence"),
        ("empty", "make: returned a object without a `residual`"),
        ("number", "the entry point gives a int; needed a factory"),
        ("needing", "options of 'needing': found no order; needed order=VALUE"),
        ("twice", "formulation: found 'twice'; needed a formulation that twice wraps: twice/NAME"),
        ("twice/raising", "raising: make: RuntimeError: no licence"),
        ("twice/number", "number: the entry point gives a int"),
    ],
)
@pytest.mark.usefixtures("entries")
def test_what_the_plugin_does_wrong_is_a_row(text: str, reason: str) -> None:
    assert reason in reason_of(load_formulation(text), text)


@pytest.mark.usefixtures("entries")
def test_a_loader_without_its_file_is_a_mistake_of_who_types_it() -> None:
    with pytest.raises(MisuseError, match="options of 'loads': found no file; needed file=PATH"):
        load_formulation("loads")


@pytest.mark.parametrize("error", [ImportError("no module named x"), SystemExit(3), AttributeError("make")])
def test_a_module_that_does_not_import_is_a_row(entries: dict[str, list[Entry]], error: BaseException) -> None:
    entries[registry.FORMULATIONS].append(Entry("broken", error))
    entries[registry.PROPERTIES].append(Entry("broken", error))
    reason = f"{type(error).__name__}: {error}"
    for item in (load_formulation("broken"), *load_properties(["broken"])):
        assert reason_of(item) == reason


@pytest.mark.parametrize("name", ["vts\u2011ppt", "n\u0442s", "nts" + "\u0301" * 600, "n" * 201])
def test_a_name_that_looks_like_another_is_not_loaded(entries: dict[str, list[Entry]], name: str) -> None:
    entries[registry.FORMULATIONS].append(Entry(name, plain))
    for item in (load_formulation(name) if len(name) < 200 else None, registry.load_with_defaults(name)):
        assert item is None or "needed at most 200 characters" in reason_of(item)
    with pytest.raises(MisuseError, match=r"found 'nts\\u2010ar'"):
        load_formulation("nts\u2010ar")


def test_an_entry_point_that_names_no_module_is_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "odd-1.0.dist-info").mkdir()
    entry = "[contactverif.formulations]\nodd = ../../x:!!\nold = json:FaceToFace\n"
    (tmp_path / "odd-1.0.dist-info" / "entry_points.txt").write_text(entry)
    registry._with_store(Limits(box=Box()), "odd")
    assert reason_of(load_formulation("odd")) == "its entry point is '../../x:!!'; needed MODULE:OBJECT"
    advice = "pyproject.toml names json:FaceToFace; after a change of entry points run pip install -e ."
    assert reason_of(load_formulation("old")).endswith(f"has no attribute 'FaceToFace'; {advice}")


def test_a_name_that_two_distributions_want_is_a_row(entries: dict[str, list[Entry]]) -> None:
    twice_on_path = Entry("nts", plain)
    entries[registry.FORMULATIONS] += [twice_on_path, Entry("nts", plain, "other:nts")]
    assert reason_of(load_formulation("nts")) == "registered 2 times: fake:nts, other:nts"


@pytest.mark.usefixtures("entries")
def test_all_are_loaded_for_a_list() -> None:
    formulations = load_formulations()
    names = [item.formulation if isinstance(item, NotLoaded) else item.name for item in formulations]
    assert names == sorted(FORMULATIONS)
    rows = {item.formulation for item in formulations if isinstance(item, NotLoaded)}
    assert rows == {"raising", "empty", "number", "needing"}
    assert [item for item in formulations if isinstance(item, registry.Wrapper)] == [
        registry.Wrapper("loads", "Load a file", "loads:file=PATH"),
        registry.Wrapper("twice", "Two of it", "twice/NAME"),
    ]
    assert set(registry.standalone_names()) == set(FORMULATIONS) - {"twice", "loads"}


@pytest.mark.parametrize(
    ("globs", "ids"),
    [
        ([], IDS),
        (["patch.*"], IDS[1:]),
        (["patch.flat.t*", "balance.force", "balance.*"], IDS[::2]),
        (["patch.flat.t*", "family"], IDS),  # A family has members that do not begin with its name.
        (["family.*"], IDS),
    ],
)
def test_properties_match_patterns(entries: dict[str, list[Entry]], globs: list[str], ids: tuple[str, ...]) -> None:
    assert tuple(item.id for item in load_properties(globs) if isinstance(item, Property)) == ids
    imported = len(ids) * (1 + any(glob.startswith("family") for glob in globs))
    assert sum(entry.loads for entry in entries[registry.PROPERTIES]) == imported


@pytest.mark.usefixtures("entries")
def test_a_pattern_that_matches_nothing_is_said() -> None:
    with pytest.raises(MisuseError, match=r"property: found 'balance.forces'; .* nearest: balance.force"):
        load_properties(["patch.*", "balance.forces"])


@pytest.mark.parametrize(("target", "description"), [(question("other"), "the property 'other'"), (7, "a int")])
def test_a_property_goes_by_its_id(entries: dict[str, list[Entry]], target: Any, description: str) -> None:
    entries[registry.PROPERTIES] = [Entry("mine", target)]
    [loaded] = load_properties()
    words = f"gives {description}; needed a contactverif.contract.property.Property with the id mine"
    assert words in reason_of(loaded)


def test_real_entry_points_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Load a real entry point of importlib.metadata, from a module that exists only here."""
    module = types.ModuleType("a_strangers_plugin")
    module.make = plain  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "a_strangers_plugin", module)
    targets = {"stranger": "a_strangers_plugin:make", "misspelt": "a_strangers_plugin:mak"}
    real = EntryPoints(EntryPoint(*item, registry.FORMULATIONS) for item in targets.items())
    monkeypatch.setattr(registry, "entry_points", lambda *, group: real.select(group=group))
    load("stranger")
    assert "AttributeError" in reason_of(load_formulation("misspelt"))


def test_what_is_installed_meanwhile_is_found_at_the_next_look(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    assert "late" not in formulation_names()
    (tmp_path / "late-1.0.dist-info").mkdir()
    (tmp_path / "late-1.0.dist-info" / "entry_points.txt").write_text("[contactverif.formulations]\nlate = late:make\n")
    assert "late" in formulation_names()


def test_a_mere_name_is_no_mistake_of_the_user_whatever_its_factory_says() -> None:
    def refusing(*, penalty: float) -> Any:
        raise MisuseError("option", "nothing", "another plugin")

    assert "found nothing; needed another plugin" in reason_of(subject_of("refusing", refusing))
    for name in ("refusing:n=0", "refusing/other"):
        with pytest.raises(MisuseError, match="needed another plugin"):
            subject_of(name, refusing)


@pytest.mark.parametrize(
    ("traits", "message"),
    [
        (
            {"tangent": "exactly"},
            "Traits.promises.tangent: found 'exactly'; "
            "needed 'exact', 'approximate', None or a number above 0 and up to 0.01",
        ),
        ({"witnesses": ["a1"]}, "Traits.evidence.witnesses: found a list; needed {property id: name of a case}"),
    ],
)
def test_a_misspelt_promise_is_the_plugins_mistake_and_the_others_run(traits: dict[str, Any], message: str) -> None:
    assert reason_of(subject_of("misspelt", lambda *, penalty: Traits().revise(**traits))) == message


def test_a_library_keeps_no_kernels_and_other_code_finds_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A store that two libraries shared could hold what one of them left for the other to load."""
    boxes: list[Box | None] = []
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("contactverif.isolation.remote.load_remote", lambda *words: boxes.append(words[-1].box))
    digests = ("one", "other")
    for digest in digests:
        monkeypatch.setattr(registry, "digest_files", lambda files, digest=digest: digest)
        registry._digest_of.cache_clear()
        for name in ("nts", "c:file=x.so", "two-pass/uel:file=x.so"):
            load_formulation(name, Limits(box=Box()))
    registry._digest_of.cache_clear()
    stores = [box.store for box in boxes if box is not None]
    assert [bool(store) for store in stores] == [True, False, False] * 2
    assert [stores[0].endswith("-one"), stores[3].endswith("-other")] == [True, True]
