"""Scenes that `moma check` finds unsound are not run without a word."""

import pytest

from archmodel.database.session import open_database
from archmodel.describe.runs import describe_run, list_runs
from ground.errors import UnsoundSceneError
from pipelines.draw import pictures as pictures_module
from pipelines.ingest.ingest import ingest
from pipelines.run.check import check_scene
from pipelines.run.run import run_scene
from tests.moma.commands import fails, invoke, prints

SCENE = """
[scene]
name = "Boxes"
[materials.limestone]
density = 2000.0
young = 12e9
poisson = 0.2
[bodies]
default = "rigid"
fixed = ["BASE"]
[joints]
mode = "as-surveyed"
[time]
duration = 0.05
[output]
pictures = ["displacement"]
"""
BASE = ("BASE", (0.0, 0.0, 0.0), (1.0, 1.0, 0.5))
STONE = ("STONE", (0.0, 0.0, 0.5), (1.0, 1.0, 1.0))


def box(name, low, high):
    """OBJ of a box between two opposite corners."""
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    faces = (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)
    rows = [f"o {name}:ashlar", *(f"v {x} {y} {z}" for x, y, z in corners)]
    return "\n".join([*rows, *(f"f {' '.join(str(i - 8) for i in face)}" for face in faces)]) + "\n"


@pytest.fixture
def boxes(tmp_path):
    """Return a function that ingests boxes; it returns the scene file and the database."""

    def build(*boxes, text=SCENE):
        (tmp_path / "boxes.obj").write_text("".join(box(*one) for one in boxes))
        (tmp_path / "boxes.toml").write_text(text)
        url = f"sqlite:///{tmp_path / 'boxes.db'}"
        ingest([tmp_path / "boxes.obj"], url, "solids")
        return tmp_path / "boxes.toml", url

    return build


def lifted(name, by):
    """Return the stone above the base, raised by a height [m]."""
    return name, (0.0, 0.0, 0.5 + by), (1.0, 1.0, 1.0 + by)


@pytest.mark.parametrize(
    ("stones", "said"),
    [
        ((lifted("STONE", -0.05),), "BASE and STONE lie 50 mm in each other"),
        ((STONE, lifted("TWIN", 0.0)), "STONE and TWIN lie 500 mm in each other"),
        ((STONE, lifted("ABOVE", 0.8)), "no chain of touching stones ties these to a fixed one: ABOVE"),
    ],
)
@pytest.mark.parametrize("command", ["run", "trade"])
def test_run_and_trade_refuse_the_problems_of_check_in_its_words(boxes, tmp_path, stones, said, command):
    scene, url = boxes(BASE, *stones)
    problems = check_scene(scene, url).problems
    assert any(said in one for one in problems)
    message = fails(1, command, scene, "--db", url, "--out", tmp_path / "out")
    assert all(one in message for one in problems)
    assert "--accept-unsound" in message
    assert not (tmp_path / "out").exists()


def test_a_scene_without_support_is_refused(boxes, tmp_path):
    scene, url = boxes(BASE, STONE, text=SCENE.replace('fixed = ["BASE"]\n', ""))
    with pytest.raises(UnsoundSceneError, match="no stone is fixed"):
        run_scene(scene, url, tmp_path / "out")


def test_a_stone_that_is_thrown_needs_no_support(boxes, tmp_path):
    text = SCENE + "[[throw]]\nstones = ['ABOVE']\nvelocity = [0.0, 0.0, 1.0]\n"
    scene, url = boxes(BASE, STONE, lifted("ABOVE", 0.8), text=text)
    assert check_scene(scene, url).problems == ()
    (caution,) = run_scene(scene, url, tmp_path / "out").summary["cautions"]
    assert caution.startswith("whether it stands is not decided")


def test_an_unsound_scene_that_is_accepted_is_marked_in_every_output(boxes, tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(
        pictures_module,
        "draw_apart",
        lambda module, surface, jobs, ready: titles.extend(one["title"] for one in jobs),
    )
    scene, url = boxes(BASE, lifted("STONE", -0.05))
    options = ("--db", url, "--out", tmp_path / "out", "--accept-unsound")
    told = "run although the scene is unsound: BASE and STONE lie 50 mm in each other"
    ran = invoke("run", scene, *options)
    assert told in ran.stdout.splitlines()[0]
    assert titles
    assert all(told[:60] in one for one in titles)
    assert told in (tmp_path / "out/report.html").read_text(encoding="utf-8")
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        (listed,) = list_runs(session)
        full = describe_run(session, 1)
    assert listed["cautions"] == full["cautions"]
    assert told in full["cautions"]
    assert "(caution)" in prints("runs", "--db", url)
