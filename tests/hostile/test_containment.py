"""The nastiest hostile plugins, in processes of their own: the run goes on, and nobody else notices.

`tox -e hostile` runs all of them one by one.
"""

import pytest
from catalogue import KINDS, PLUGINS
from containment import CHECKS, HEADS, judge, run_command, scratch

from contactverif.isolation.box import why_no_box
from contactverif_reports.bench_results import Outcome
from contactverif_reports.netcdf.bench_file import read_bench

LEAST_PLUGINS = 80
EXAMPLES = 2  # A plugin that ends its process is started again for the second case; further ones start it in vain.
# Plugins that run together: those that must be caught or are nobody's fault, and those that must be judged as NTS is.
CAUGHT = (
    "dies-exit-0",
    "dies-at-import",
    "raises-name-with-controls",
    "prints-write-rubbish-everywhere",
    "says-say-misuse",
)
REACHES = (
    "reaches-write-file",
    "reaches-write-pipe",
    "reaches-stop-process",
    "reaches-connect-port",
    "reaches-setting",
    "reaches-namespaces",
    "reaches-endless-code",
)
needs_box = pytest.mark.skipif(bool(why_no_box()), reason=why_no_box() or "there are boxes")
LIKE_NTS = ("prints-print-escapes", "leaves-daemon", "process-no-paths", "process-other-folder")


def test_there_are_enough_plugins_of_every_kind_and_each_says_what_it_does() -> None:
    assert len(PLUGINS) >= LEAST_PLUGINS
    assert {plugin.kind for plugin in PLUGINS.values()} == set(KINDS)
    assert all(plugin.summary.endswith(".") for plugin in PLUGINS.values())


@pytest.mark.parametrize(
    ("mode", "names"),
    [
        pytest.param("process" if why_no_box() else "box", CAUGHT, id="caught"),
        pytest.param("process", LIKE_NTS, id="like nts"),
        pytest.param("box", REACHES, id="reaches out of a box", marks=needs_box),
    ],
)
def test_hostile_plugins_are_contained(mode: str, names: tuple[str, ...]) -> None:
    lines = judge([PLUGINS[name] for name in names], mode, EXAMPLES)
    for name, line in lines.items():
        cells = dict(zip(HEADS[1:], line, strict=True))
        assert all(cells[check] == "yes" for check in CHECKS), f"{name}: {cells}"


def test_a_bench_goes_on_beside_hostile_plugins() -> None:
    """Every cell has an outcome, and the errors of others are those of a bench without it."""
    options = ["--quick", "--scene=wavy", "--instances=1", "--processes=1", "--isolation=process"]
    results = []
    for names in (["vts-ppt"], ["vts-ppt", "dies-exit-0", "process-patched-numpy"]):
        with scratch() as folder:
            finish = run_command(folder, "bench", *names, *options, "--out=report.nc")
            assert not finish.left
            results.append(read_bench(finish.report))
    assert finish.status == 1
    alone, beside = results
    assert beside.errors[0].tolist() == alone.errors[0].tolist()
    assert (beside.outcomes == Outcome.CRASHED).all(axis=(1, 2)).tolist() == [False, True, True]
    assert "its process ended with status 0" in beside.remarks["dies-exit-0", 0, 0]
    assert "its process ended 3 times" in beside.remarks["dies-exit-0", 1, 0]


def test_a_scene_is_drawn_without_a_hostile_plugin() -> None:
    with scratch() as folder:
        options = ["--out", "report.nc.png", "--isolation", "process"]
        finish = run_command(folder, "draw", "--scene", "c", "-f", "dies-exit-0", "-f", "vts-ppt", *options)
    assert finish.status == 1
    assert finish.left == ("file report.nc.png",)
    assert b"its process ended with status 0" in finish.output
