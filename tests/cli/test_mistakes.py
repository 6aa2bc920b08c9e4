"""The mistakes of a user: each is one line that says what is needed, and nothing is judged, solved or written."""

import os
from pathlib import Path
from typing import Any

import pytest
from asking import Ask, check_mistake

from contactverif.run import judge as judging
from contactverif.studies import solved_scenes

ROOT = Path(__file__).parents[2]
PUNCH = ROOT / "tests" / "data" / "punch.msh"
FREE = "needed a name that is free"

MISTAKES = {  # {command line: argument, found, needed}
    "verify": r"NAME: found nothing; needed --all, or some of c, chen-hisada, feap, fedoo, ipctk, mortar, .*",
    "verify vts-pt": r"formulation: found 'vts-pt'; needed a name that exists; the nearest: vts-ppt.*",
    "verify vts-ppt -p scaling": "property: found 'scaling'; needed 'units', the new id of that property",
    "verify nts-ar:area=now": r"area: found 'now'; needed 'current' or 'reference'",
    "verify nts:tau=2": r"tau: found 2; needed a number ≥ 0 and < 1",
    "verify nts nts": r"formulation: found nts 2 times; needed each of them once",
    "verify nts --all": r"NAME: found nts and --all; needed one of the two",
    "verify nts -p patch.* -p pach.*": r"property: found 'pach.\*'; needed .*",
    "verify nts --known purity": r"--known: found 'purity'; needed ID=REASON, .*",
    "verify nts --known =why": r"--known: found '=why'; needed ID=REASON, .*",
    "verify nts --known puritty=why": r"--known: found 'puritty'; needed .* nearest: purity, purity.long",
    "verify nts -p patch.* --known purity=why": r"--known: found 'purity'; needed .*patch.flat.*",
    "verify nts --profile nigthly": r"--profile: found 'nigthly'; needed .* nearest: nightly",
    "verify nts --examples 0": r"--examples: found 0; needed at least 1, at most 1000000000",
    "verify nts --examples ten": r"--examples: found 'ten'; needed a valid integer",
    "list --isolation foo": r"--isolation: found 'foo'; needed one of box, landlock, process, inline",
    "verify nts --seed -1": r"--seed: found -1; needed a whole number ≥ 0 and < 2\^63",
    "verify nts --exampels 5": r"No such option: --exampels.*--examples.* \(see .*--help\)",
    "verfy": r"No such command 'verfy'.* \(see contactverif --help\)",
    "verify nts --out=": r"--out: found '.'; needed a name that ends in .nc, .html, .json or .xml",
    "verify nts --out no/such/folder/nts.nc": r"--out: .* is no folder; needed a folder that exists",
    "verify nts --out nts.txt": r"--out: found 'nts.txt'; needed a name that ends in .nc, .*",
    "verify nts --out a.nc --out b.NC": r"--out: found a.nc and b.NC; needed one file .* .nc",
    "verify nts --report nts.nc": r"--report: found an option of an earlier version; needed --out.*",
    f"verify nts --pictures {PUNCH}": r"--pictures: found .*punch.msh, which is no folder; needed .*",
    "verify nts --mesh no.msh --slave a --master b": r"--mesh: found no.msh, .*; needed .*",
    f"verify nts --mesh {PUNCH} --slave punch": r"--master: found nothing; needed one of .*'punch' \(line\).*",
    f"verify nts --mesh {PUNCH} --master base": r"--slave: found nothing; needed one of .*'base' \(line\).*",
    f"verify nts --mesh {PUNCH} --slave punch --master bace": r"--master: found 'bace', .*; needed 'base'\?.*",
    f"verify nts --mesh {PUNCH} --slave punch --master punch": r"--master: found 'punch', which is the slave too; .*",
    "verify nts --slave punch": r"--mesh: found none, but --slave; needed --mesh FILE, .*",
    "verify nts --master base": r"--mesh: found none, but --master; needed --mesh FILE, .*",
    "verify nts --slave punch --master base": r"--mesh: found none, but --slave; needed --mesh FILE, .*",
    f"verify nts --mesh {PUNCH} --slave punch --master base --flip slave": r"--flip: found slave, and cells .*",
    "verify nts --flip both": r"--mesh: found none, but --flip; needed --mesh FILE, .*",
    "verify nts --material base=1,0.3": r"--mesh: found none, but --material; needed --mesh FILE, .*",
    "verify nts --support lid=0,0": r"--mesh: found none, but --support; needed --mesh FILE, .*",
    "compare c --against nts --against vts-me": "--against: found 2: nts, vts-me; needed one",
    "paper --out=": "--out: found ''; needed the name of a folder",
    "replay": r"Missing argument 'REPORT'.* \(see contactverif replay --help\)",
    "replay no.nc": r"REPORT: found no.nc, which does not exist; needed a report .*",
    f"replay {PUNCH}": r"REPORT: found .*punch.msh, which is no netCDF file.*; needed a report that .*",
    f"replay {ROOT}": r"REPORT: found .*, which is a folder; needed a report .*",
    "compare": r"--against: found nothing; needed the formulation to compare with, or two reports OLD.nc NEW.nc",
    "compare nts": r"--against: found nothing; needed .*",
    "compare --against vts-ppt": r"NAME: found nothing; needed some of .*nts, .*, or two reports OLD.nc NEW.nc",
    "compare nts --against vts-pt": r"--against: found 'vts-pt'; needed .* nearest: vts-ppt.*",
    "compare vts-pt --against nts": r"formulation: found 'vts-pt'; needed .* nearest: vts-ppt.*",
    "compare nts --against nts": r"--against: found nts, which is compared too; needed another formulation .*",
    "compare nts nts --against vts-ppt": r"formulation: found nts 2 times; needed each of them once",
    "compare nts --against vts-ppt --examples 0": r"--examples: found 0; needed at least 1, at most 1000000000",
    "compare a.nc": r"NAME: found 1 report; needed two, OLD.nc NEW.nc",
    "compare a.nc b.nc c.nc": r"NAME: found 3 reports; needed two, OLD.nc NEW.nc",
    "compare a.nc nts": r"NAME: found nts and the report a.nc; needed formulations alone, or two reports",
    f"compare {PUNCH} nts": r"NAME: found nts and the report .*punch.msh; needed formulations alone, or two reports",
    "compare a.nc b.nc --against nts": r"--against: found two reports beside it; needed formulations: a report .*",
    "compare a.nc b.nc --seed 1": r"--seed: found two reports beside it; needed formulations: a report .*",
    "compare a.nc b.nc --out r.nc": r"--out: found 'r.nc'; needed a name that ends in .html",
    "compare a.nc b.nc": r"OLD.nc: found a.nc, which does not exist; needed a report that .*",
    f"compare {PUNCH} b.nc": r"OLD.nc: found .*punch.msh, which is no netCDF file.*; needed a report that .* wrote",
    "draw": r"--scene: found nothing to draw; needed --scene NAME, or REPORT --case ID",
    "draw file": r"--case: found nothing; needed --case ID; `contactverif replay file` lists the ids",
    "draw hertz": r"REPORT: found hertz, which does not exist; needed a report .*, or --scene NAME",
    "draw --case a.b": r"REPORT: found none, but --case a.b; needed the report that holds the case",
    "draw r.nc --case a.b": r"REPORT: found r.nc, which does not exist; needed a report .*",
    "draw r.nc --case a.b --scene c": r"--scene: found c and --case a.b; needed one of the two",
    "draw r.nc --scene c -f nts": r"--scene: found c and REPORT r.nc; needed one of the two",
    "draw --scene c": r"--formulation: found nothing; needed some of .*nts, .*vts-ppt.*",
    "draw --scene cc -f nts": r"--scene: found 'cc'; needed a name that exists; the nearest: .*",
    "draw --scene c:refien=2 -f nts": r"--scene: option of .*: found 'refien'; needed .* refine.*",
    "draw --scene c:sides=up -f nts": r"--scene: sides of .*: found 'up'; needed rollers or free",
    "draw --scene c -f nst": r"formulation: found 'nst'; needed .* nearest: .*nts.*",
    "draw --scene c -f nts -f nts": r"--formulation: found nts twice; needed each .* once",
    "draw --scene c -f vts-ppt --out c.pdf": r"--out: found 'c.pdf'; needed a name that ends in .png, .svg or .vtu",
    "draw --scene c -f vts-ppt --out no/c.png": r"--out: found no/c.png in .*, which is no folder; needed a folder .*",
    "draw --scene c -f vts-ppt --out file/c.png": r"--out: found file/c.png in .*, which is no folder; needed .*",
    "draw --scene c -f vts-ppt --out a.svg --out b.svg": r"--out: found a.svg and b.svg; needed one file .* .svg",
    "draw --scene c -f vts-ppt --vtu c.vtu": r"--vtu: found an option of an earlier version; needed --out FILE, .*",
    "draw --scene c -f vts-ppt -f nts --out c.vtu": r"--out: found c.vtu for 2 formulations; needed one .*",
    "verify nts --scene c --mesh m.msh": r"--scene: found c and --mesh m.msh; needed one of the two",
    "verify nts --scene d": r"--scene: found 'd'; needed one of a1, .*",
    "verify nts --scene c:young=0": r"--scene: young of .*: found 0; needed a number > 0",
    "report nowhere.nc": r"REPORT: found nowhere.nc, which does not exist; needed a report that .*",
    "report .": r"REPORT: found ., which is a folder; needed a report that .*",
    "report words.nc": r"REPORT: found words.nc, which is no netCDF file.*",
    "report words.nc --out page.html": r"REPORT: found words.nc, which is no netCDF file.*",
    "report words.nc --out page.pdf": r"--out: found 'page.pdf'; needed a name that ends in .html.*",
    "report words.nc --out none/page.html": r"--out: found none/page.html in .*",
    "audit words.nc": r"REPORT: found .*; needed a report that .*",
    "bench": r"NAME: found nothing; needed --all, or some of .*",
    "bench nts --scene disk": r"--scene: found 'disk'; needed one of .*",
    "bench nts --instances 0": r"--instances: found 0; needed at least 1, at most 1000",
    "bench nts --against no-such.nc": r"FILE: found no-such.nc, which does not exist; needed a file that .*",
    "bench a.nc nts": r"NAME: found a.nc and more; needed formulations alone, or one file of a bench",
    "bench nts --out a.svg": r"--out: found 'a.svg'; needed a name that ends in .nc, .html or .md",
    "verify --resume none.nc": r"--resume: found no journal none.nc.journal; needed that of a run that was stopped",
    **{
        f"{command} --resume {folder}": rf"--resume: found {folder}, a folder; needed the report of a run that was .*"
        for command in ("verify", "compare")
        for folder in ("/", ".")
    },
    **{
        f"campaign nts --shard={shard} --out r": rf"--shard: found '{shard}'; needed I/N.*"
        for shard in ("0/3", "4/3", "1", "a/3", "-1/3", "1/3/5")
    },
    "explain witnes": r"NAME: found 'witnes'; needed a name that exists; the nearest: witness.*",
    "explain patch.flat.noda": r"NAME: found 'patch.flat.noda'; needed a name .*; the nearest: patch.flat.nodal.*",
    "explain swap --case nts.swap": r"--report: found nothing; needed the report that has the case 'nts.swap'",
    "explain xyzzy": r"NAME: found 'xyzzy'; needed a property, a term, a symbol, a trait or a named case; .*",
    "new 'two words'": r"NAME: found 'two words'; needed a name of letters, digits.*",
    "new a/b": r"NAME: found 'a/b'; needed a name of letters.*",
    "new ../mine": r"NAME: found '../mine'; needed a name of letters.*",
    "new mine-": r"NAME: found 'mine-'; needed a name of letters.*",
    "new 1mine": r"NAME: found '1mine'; needed .* first a letter.*",
    "new mïne": r"NAME: found 'mïne'; needed a name of letters.*",
    f"new {'m' * 61}": r"NAME: found 'm+'; needed .*at most 60; .*",
    "new class": r"NAME: found 'class', a word of Python; needed a name that a module can have",
    "new vts-ppt": f"NAME: found 'vts-ppt', but a formulation vts-ppt is registered; {FREE}",
    "new Scikit-FEM": f"NAME: found 'Scikit-FEM', a package that is installed; {FREE}",
    "new random": f"NAME: found 'random', but Python has a module random; {FREE}",
    "new file": r"NAME: found 'file', which exists in this folder; needed the name of a new folder",
    "new nowhere": r"NAME: found 'nowhere', which exists in this folder; needed the name of a new folder",
    "new mine --c --fortran": r"NAME: found --c and --fortran; needed one of them",
    "new mine --3d --c": r"NAME: found --3d and --c; needed one of them",
}  # fmt: skip


@pytest.mark.parametrize("content", [b"\xff\xfe", b"[group]\nno value", None], ids=["binary", "malformed", "pipe"])
def test_entry_points_that_cannot_be_read_are_named(
    ask: Ask, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, content: bytes | None
) -> None:
    file = tmp_path / "odd-1.0.dist-info" / "entry_points.txt"
    file.parent.mkdir()
    os.mkfifo(file) if content is None else file.write_bytes(content)
    monkeypatch.syspath_prepend(tmp_path)
    check_mistake(ask("list"), f"{file}: found .*; needed a file of entry points, .*")


@pytest.mark.parametrize("line", MISTAKES, ids=lambda line: line.replace(str(ROOT), "")[-60:])
def test_a_mistake_is_one_line_and_nothing_is_judged(
    ask: Ask, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, line: str
) -> None:
    called: list[Any] = []
    monkeypatch.setattr(judging, "judge_case", lambda *anything: called.append(anything))
    monkeypatch.setattr(solved_scenes, "solve", lambda *anything, **more: called.append(anything))
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    Path("words.nc").write_text("no report")
    Path("nowhere").symlink_to("else")
    check_mistake(ask(line), MISTAKES[line])
    assert not called
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "nowhere", "words.nc"]
