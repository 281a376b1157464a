"""moma export into files of other programs: by ending, never another format under it, and scripts of the same scene."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pipelines.record.export.export import ENDINGS
from tests.moma.commands import answer, fails, invoke, prints
from tests.paths import SAMPLE
from tests.pipelines.scenes import TWO_COURSES

SCENE = (
    TWO_COURSES
    + """\
[contact]
friction = 0.55
[time]
duration = 0.002
"""
)


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    url = f"sqlite:///{folder}/window.db"
    invoke("ingest", str(SAMPLE / "window.moma"), "--db", url)
    (folder / "units.csv").write_text("unit;relation;unit\n102;cuts;101\n", encoding="utf-8")
    invoke("record", str(folder / "units.csv"), "--author", "A", "--source", "seen", "--db", url)
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    invoke("run", str(folder / "scene.toml"), "--db", url, "--out", str(folder / "out"))
    return url


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("ending", ENDINGS)
def test_every_ending_gives_its_format_and_the_same_bytes_again(url, ending):
    run = () if ending in (".graphml", ".ttl") else ("--run", "1")  # knowledge, without results
    told = answer("export", f"a{ending}", *run, "--db", url)
    assert told["stones"] == (98 if run else 0)
    assert told["bytes"] == Path(f"a{ending}").stat().st_size
    invoke("export", f"b{ending}", *run, "--db", url)
    content = Path(f"a{ending}").read_bytes()
    assert content == Path(f"b{ending}").read_bytes()
    assert not content.startswith(b'{\n"format": "moma')
    assert sorted(one.name for one in Path().iterdir()) == [f"a{ending}", f"b{ending}"]


def test_the_line_says_what_was_written(url):
    line = prints("export", "wall.glb", "--db", url)
    assert re.match(r"wall\.glb: 98 stones, \d+ groups from sqlite:///.*window\.db \(0\.\d MB\)", line)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["out.stl"], "no format that is written here has the ending '.stl'"),
        (["out.ifc", "--run", "7"], "there is no run 7"),
        (["out.3ddat"], "a script for 3DEC needs a scene"),
        (["out.results.json"], "results of no run"),
        (["out.json", "--run", "1"], "--run with a JSON document"),
        (["out.glb", "--crs", "EPSG:25832"], "a file .glb has no coordinate reference system"),
        (["out.ifc", "--crs", "Gauss"], "'Gauss' is no reference system"),
    ],
)
def test_mistakes_are_one_line_and_leave_nothing(url, arguments, said):
    assert said in fails(2, "export", *arguments, "--db", url)
    assert list(Path().iterdir()) == []


def test_forces_on_joints_go_to_compas_and_balance_the_weight(url):
    invoke("export", "w.results.json", "--run", "1", "--db", url)
    invoke("export", "w.compas.json", "--run", "1", "--db", url)
    results = json.loads(Path("w.results.json").read_text(encoding="utf-8"))
    model = json.loads(Path("w.compas.json").read_text(encoding="utf-8"))
    assert results["data"]["model_id"] == model["guid"]
    names = [one["name"] for one in model["data"]["elements"].values()]
    fixed = {one["name"] for one in model["data"]["elements"].values() if one["data"]["is_support"]}
    assert fixed == {name for name in names if name.startswith("W01")}
    upwards = 0.0
    for edge, values in results["data"]["edge_data"].items():
        first, second = (names[int(end)] in fixed for end in edge.split(","))
        # forces act on the first stone
        upwards += values["resultant_global"][2] * (second - first)
    weight = 0.0
    for one in answer("query", "entity", "--where", "course = 2", "--db", url, "--columns", "volume"):
        weight += 2350.0 * 9.81 * one["volume"]
    assert abs(upwards / weight - 1) < 0.05  # joints are closed for the run, which changes volumes


def test_the_script_for_lmgc90_builds_every_body_and_law(url, tmp_path):
    invoke("export", "w.lmgc90.py", "--run", "1", "--db", url)
    (tmp_path / "pylmgc90").mkdir()
    (tmp_path / "pylmgc90/__init__.py").write_text("", encoding="utf-8")
    # a stand-in that writes down what it is asked for
    (tmp_path / "pylmgc90/pre.py").write_text(
        """
import json
calls = []
class Any:
    def __init__(self, name, values): self.name, self.values = name, values
    def __getattr__(self, name):
        return lambda *given, **named: calls.append([name, {k: str(v) for k, v in named.items()}])
def __getattr__(name):
    def call(*given, **named):
        calls.append([name, {k: v if isinstance(v, (str, float)) else str(type(v)) for k, v in named.items()}])
        if name == "writeDatbox": json.dump(calls, open("calls.json", "w"))
        return Any(name, named)
    return call
""",
        encoding="utf-8",
    )
    script = Path("w.lmgc90.py").read_text(encoding="utf-8")
    compile(script, "w.lmgc90.py", "exec")
    # pairs are looked at within a twentieth of the largest stone, which is in metres
    (alert,) = re.findall(r"^ALERT = (\S+)", script, re.MULTILINE)
    placed = answer("query", "entity", "--where", "course <= 2", "--db", url, "--columns", "length")
    largest = max(one["length"] for one in placed)
    assert 0.5 < float(alert) / (0.05 * largest) < 2.0
    subprocess.run([sys.executable, "w.lmgc90.py"], check=True, env={"PYTHONPATH": str(tmp_path)})
    calls = json.loads(Path("calls.json").read_text(encoding="utf-8"))
    names = [name for name, _ in calls]
    stones = len(answer("query", "entity", "--where", "course <= 2", "--db", url))
    assert names.count("rigidPolyhedron") == names.count("addAvatar") == stones
    assert names.count("imposeDrivenDof") == len(
        answer("query", "entity", "--where", "course = 1", "--db", url)
    )
    (law,) = (values for name, values in calls if name == "tact_behav")
    assert law == {"name": "law01", "law": "IQS_CLB", "fric": 0.55}
    assert next(values["density"] for name, values in calls if name == "material") == 2350.0


def test_the_file_for_3dec_has_closed_blocks_and_the_angle_of_friction(url):
    invoke("export", "w.3ddat", "--run", "1", "--db", url)
    text = Path("w.3ddat").read_text(encoding="utf-8")
    blocks = text.partition("\nblock property")[0].split("block create polyhedron")[1:]
    assert len(blocks) == len(answer("query", "entity", "--where", "course <= 2", "--db", url))
    for block in blocks:
        faces = [re.findall(r"\([^)]*\)", face) for face in block.split("face ")[1:]]
        sides = {(a, b) for face in faces for a, b in zip(face, face[1:] + face[:1], strict=True)}
        assert {(b, a) for a, b in sides} == sides
    assert re.search(r"friction 28\.81\d*", text)
    # every command is one of 3DEC 7's that are written here, with a line that goes on where it ends in dots
    lines = [line for line in text.replace(" ...\n", " ").splitlines() if not line.startswith(";")]
    known = r"(model (new|large-strain on|gravity \(.*\))|block (create polyhedron|property|fix|contact|mechanical) .*)"
    assert [line for line in lines if not re.fullmatch(known, line)] == []
    assert all(line.count("(") == line.count(")") and line.count("'") % 2 == 0 for line in lines)
