"""The arch of a window, and the bay about it, that deform within a rigid storey with a core, from survey to rest."""

import json

import pytest
from typer.testing import CliRunner

from moma.cli import app
from pipelines.run.run import run_scene

NAME = "tower"
ARCH, BAY = "kind = voussoir and code like 'AO%'", "code like 'A%' and course > 3"


SPRINGS = """
[[laws]]
type = "elastic_joint"
friction = 0.6
normal_stiffness = 1e10
shear_stiffness = 5e9
"""


def summary_of(folder, stones, laws=""):
    """Survey, ingest and run the storey with these stones deformable."""
    db = f"sqlite:///{folder / 'storey.db'}"
    for command in (
        ["sample", NAME, "--small", "--out", str(folder)],
        ["ingest", str(folder / f"{NAME}.moma"), "--db", db],
        ["propose", "infill", "--record", "--db", db],
    ):
        assert CliRunner().invoke(app, command).exit_code == 0
    scene = folder / f"{NAME}.toml"
    rigid = 'default = "rigid"\n'
    text = scene.read_text(encoding="utf-8").replace(rigid, f'{rigid}deformable = ["{stones}"]\n')
    scene.write_text(text + laws, encoding="utf-8")
    run_scene(scene, db, folder / "results")
    return json.loads((folder / "results" / "summary.json").read_text(encoding="utf-8"))


def rests(summary):
    assert summary["outcome"] == "equilibrium"
    assert summary["errors"]["unconverged_steps"] == 0
    assert summary["errors"]["reaction"] <= 1e-6
    assert summary["errors"]["balance"] <= 1e-4
    assert summary["static"]["found"]


@pytest.mark.slow
def test_the_arch_of_a_window_deforms_in_a_rigid_storey_and_every_step_is_solved(tmp_path):
    summary = summary_of(tmp_path, ARCH)
    rests(summary)
    assert summary["cautions"] == []


@pytest.mark.slow
def test_the_bay_about_it_does_and_says_what_its_joints_yield(tmp_path):
    summary = summary_of(tmp_path, BAY)
    rests(summary)
    assert summary["cautions"][0].startswith("joints gave way elastically in ")
    assert "stones overlap by at most 0.0" in summary["cautions"][0]


@pytest.mark.slow
def test_with_joints_of_a_stated_stiffness_nothing_else_yields(tmp_path):
    summary = summary_of(tmp_path, BAY, SPRINGS)
    rests(summary)
    assert summary["cautions"] == []
