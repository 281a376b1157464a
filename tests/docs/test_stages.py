"""docs/howto/stages.md is true: its arch stands on the centring and after it, and falls without."""

import re
from itertools import count

import pytest

from pipelines.scene.file import parse_scene
from tests.moma.commands import answer, fails, invoke, prints
from tests.paths import ROOT

PAGE = (ROOT / "docs/howto/stages.md").read_text(encoding="utf-8")
HOLD = 'hold = ["kind != springer"]\n'
STAGES, PHASES = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def arch(tmp_path_factory):
    """The sample of the page, in a folder of its own."""
    folder = tmp_path_factory.mktemp("stages") / "arch"
    prints("sample", "arch", "--out", folder)
    prints("ingest", folder / "arch.moma", "--db", url(folder))
    return folder


def url(folder):
    return f"sqlite:///{folder}/arch.db"


def written(folder, stages, name="arch"):
    """Write the scene with stages and no pictures."""
    scene = folder / f"{name}-staged.toml"
    text = (folder / "arch.toml").read_text(encoding="utf-8")
    scene.write_text(re.sub(r"pictures = .*", "pictures = []", text) + stages, encoding="utf-8")
    return scene


def test_the_commands_of_the_page_run(arch):
    scene = written(arch, STAGES)
    checked = prints("check", scene, "--db", url(arch))
    assert "stage left half: 9 stones, 7 held" in checked
    assert "stage ring: 17 stones, 15 held" in checked
    printed = prints("run", scene, "--db", url(arch), "--out", arch / "results")
    assert printed.splitlines()[0].startswith(
        "Semicircular arch (synthetic): equilibrium after 0.025 s of stage 3, 'centring struck'"
    )
    assert "stage 2, ring: equilibrium after 0.025 s, 17 stones (8 laid, 15 held), weight 0.00 kN" in printed


def test_the_reaction_is_the_weight_after_every_stage_and_the_database_keeps_the_stages(arch):
    scene = written(
        arch, STAGES.replace('hold = ["kind != springer"]', 'hold = ["kind like voussoir"]'), "free"
    )
    summary = answer("run", scene, "--db", url(arch), "--out", arch / "free")
    assert [one["name"] for one in summary["stages"]] == ["left half", "ring", "centring struck"]
    weights = [one["weight"] for one in summary["stages"]]
    assert weights[0] == 0.0 < weights[1] < weights[2]
    for one in summary["stages"]:
        assert one["outcome"] == "equilibrium"
        assert one["errors"]["reaction"] < 1e-6
        vertical = sum(support["force"][2] for support in one["supports"])
        assert vertical == pytest.approx(one["weight"], rel=1e-6, abs=1e-3)
    runs = answer("runs", "--db", url(arch))
    assert answer("runs", runs[-1]["run"], "--db", url(arch))["stages"] == summary["stages"]
    assert "centring struck  equilibrium" in prints("runs", runs[-1]["run"], "--db", url(arch))
    assert "Stages of building" in (arch / "free/report.html").read_text(encoding="utf-8")


def test_a_run_in_stages_goes_on_where_it_was_stopped(arch, monkeypatch):
    scene, folder = written(arch, STAGES, "resumed"), arch / "resumed"
    whole = answer("run", scene, "--db", url(arch), "--out", arch / "unbroken")
    steps = count()
    with monkeypatch.context() as patched:
        patched.setattr("moma.cli.progress.Interruption.__call__", lambda _: next(steps) == 9)
        assert invoke("run", scene, "--db", url(arch), "--out", folder).exit_code == 1
    again = answer("run", scene, "--db", url(arch), "--out", folder, "--resume")
    assert [one["step"] for one in again["resumed"]] == [402]
    assert again["stages"] == whole["stages"]
    assert again["errors"] == whole["errors"]


def test_without_its_centring_the_arch_falls_and_the_first_line_says_so(arch):
    scene = written(arch, STAGES.replace(HOLD, ""), "bare")
    first = prints("run", scene, "--db", url(arch), "--out", arch / "bare").splitlines()[0]
    assert "of stage 1, 'left half'" in first
    assert "but 2 of 3 stages were not built, as stage 'left half' did not come to rest" in first


@pytest.mark.parametrize(
    ("written_", "instead", "said"),
    [
        ("lay = [\"code <= 'A08'\"]", "lay = [\"code <= 'A07'\"]", "1 stones are never laid, e.g. A08"),
        (
            "lay = [\"code <= 'A08'\"]",
            "lay = [\"code <= 'A09'\"]",
            "A09 is laid, but stands already in stage 'ring'",
        ),
        ("lay = [\"code <= 'A08'\"]", "lay = [\"code > 'Z'\"]", "lay: no selected stone satisfies"),
        ("lay = [\"code <= 'A08'\"]", "lays = []", "unknown key 'lays' in [[stages]]; did you mean 'lay'?"),
        (
            "lay = [\"code <= 'A08'\"]",
            "remove = ['A05']",
            "A05 is removed before it is laid in stage 'left half'",
        ),
        (
            'hold = ["kind != springer"]',
            'hold = ["A12"]',
            "A12 is held, but does not stand in stage 'left half'",
        ),
        ('name = "ring"', 'name = "left half"', "two stages named 'left half'"),
        ('name = "left half"', "", "[[stages]] has no 'name'"),
    ],
)
def test_wrong_stages_are_refused_at_their_line(arch, written_, instead, said):
    scene = written(arch, STAGES.replace(written_, instead, 1), "wrong")
    line = fails(2, "check", scene, "--db", url(arch))
    assert re.search(rf"{re.escape(str(scene))}:\d+: ", line)
    assert said in line


def load(stages):
    return f'[[loads]]\ntype = "settlement"\nstones = ["A01"]\ndisplacement = [0, 0, -0.01]\nduration = 0.1\n{stages}\n'


@pytest.mark.parametrize(
    ("stages", "loads", "said"),
    [
        (STAGES, load(""), "a load that does not say in which stages it acts"),
        (STAGES, load('stages = ["rang"]'), "no stage 'rang'; did you mean 'ring'?"),
        ("", load('stages = ["ring"]'), "stages of a load, in a scene without"),
        (
            STAGES,
            '[[loads]]\ntype = "force"\nstones = ["A12"]\nforce = [0, 0, -1]\nstages = ["left half"]\n',
            "none of its stones stands in stage 'left half'",
        ),
        (
            STAGES,
            '[[throw]]\nstones = ["A09"]\nvelocity = [1, 0, 0]\n',
            "begin in motion, in a building in stages",
        ),
    ],
)
def test_loads_of_a_building_in_stages_name_them(arch, stages, loads, said):
    assert said in fails(2, "check", written(arch, stages + loads, "loads"), "--db", url(arch))


def test_a_stage_that_leaves_stones_without_support_is_warned_of(arch):
    alone = STAGES.replace("code <= 'A08'", "code = 'A05'").replace("code > 'A08'", "code != 'A05'")
    scene = written(arch, alone.replace("code < 'A17'", "kind != springer").replace(HOLD, "", 1), "lonely")
    warned = invoke("check", scene, "--db", url(arch)).stderr
    assert "in stage 'left half' no chain of touching stones ties these to a fixed or held one: A05" in warned


@pytest.mark.parametrize("command", ["assess", "compare", "trade"])
def test_commands_that_know_no_stages_refuse_them(arch, command):
    line = fails(2, command, written(arch, STAGES, command), "--db", url(arch), "--out", arch / command)
    assert f"moma {command} knows no stages of building" in line


def test_the_phases_of_the_page_are_stages():
    materials = "[materials.m]\ndensity = 1\nyoung = 1\npoisson = 0\n"
    scene = parse_scene(materials + PHASES, "phases.toml")
    assert [one.values["name"] for one in scene.stages] == ["first phase", "settling", "second phase"]
    assert scene.loads[0].values["stages"] == ("settling",)
