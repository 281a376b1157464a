"""The arch of a window that deforms within a rigid storey with a core, from the survey to rest."""

import json

import pytest
from typer.testing import CliRunner

from moma.cli import app
from pipelines.run.run import run_scene

NAME = "tower-small"
ARCH = """default = "rigid"
deformable = ["kind = voussoir and code like 'AO%'"]
"""


@pytest.mark.slow
def test_the_arch_of_a_window_deforms_in_a_rigid_storey_and_every_step_is_solved(tmp_path):
    db = f"sqlite:///{tmp_path / 'storey.db'}"
    for command in (
        ["sample", NAME, "--out", str(tmp_path)],
        ["ingest", str(tmp_path / f"{NAME}.moma"), "--db", db],
        ["propose", "infill", "--record", "--db", db],
    ):
        assert CliRunner().invoke(app, command).exit_code == 0
    scene = tmp_path / f"{NAME}.toml"
    text = scene.read_text(encoding="utf-8").replace('default = "rigid"\n', ARCH)
    scene.write_text(text, encoding="utf-8")
    run_scene(scene, db, tmp_path / "results")
    summary = json.loads((tmp_path / "results" / "summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"] == "equilibrium"
    assert summary["cautions"] == []
    assert summary["errors"]["unconverged_steps"] == 0
    assert summary["errors"]["reaction"] <= 1e-6
    assert summary["errors"]["balance"] <= 1e-4
    assert summary["static"]["found"]
