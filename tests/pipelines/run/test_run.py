"""From survey file to results in folder and database, on the two lowest courses of the sample."""

import json
import sqlite3
from dataclasses import replace

import numpy as np
import pytest

from archmodel.database.session import open_database
from archmodel.describe.entity import describe
from archmodel.describe.runs import describe_run
from archmodel.quantities import quantities_of
from archmodel.query.api import find_rows
from ground.errors import MissingLibraryError, UsageError
from mechanics.dynamics.outcome import Outcome
from mechanics.scene.scene import Fidelity
from pipelines.ingest.records import surveyed_block
from pipelines.results.stone_values import stone_results
from pipelines.run import run as run_module
from pipelines.run.assemble import assemble
from pipelines.run.run import RunOptions, Writing, run_scene, write_results
from pipelines.scene.file import parse_scene
from pipelines.scene.selection import select_groups, select_stones
from tests.moma.commands import answer, fails
from tests.pipelines.results_by_hand import result_of, rigid_body
from tests.pipelines.scenes import TWO_COURSES_MIXED, fails_at_line

LOW = (
    TWO_COURSES_MIXED
    + """\
[mesh]
size = 0.3
[time]
step = 0.005
"""
)
THIN = "6 stones are thinner than the wall"


def selected(text, session):
    return select_stones(parse_scene(text, "scene.toml"), session)


def test_fixed_goes_before_the_other_lists_and_the_default_comes_last(session):
    text = LOW.replace('["W02-02"]', '["course = 1 and depth < 0.4", "W02-02"]')
    blocks = assemble(parse_scene(text, "scene.toml"), session).scene.blocks
    fidelity = {block.code: block.fidelity for block in blocks}
    assert fidelity["W02-02"] is Fidelity.DEFORMABLE
    assert fidelity["W02-01"] is Fidelity.RIGID
    assert all((one is Fidelity.FIXED) == code.startswith("W01") for code, one in fidelity.items())


def test_excluded_stones_are_left_out_by_code_or_expression(session):
    text = LOW.replace("[materials", 'exclude = ["W02-01", "course = 2 and depth > 0.4"]\n[materials', 1)
    codes = {model.record.code for model in selected(text, session)}
    deep = {row["code"] for row in find_rows(session, "entity", ["course = 2 and depth > 0.4"])}
    every = {row["code"] for row in find_rows(session, "entity", ["course <= 2"])}
    assert deep
    assert codes == every - deep - {"W02-01"}


def test_every_stone_has_the_material_of_its_rule(session):
    text = (
        LOW
        + '[materials.granite]\ndensity = 2700\nyoung = 5e10\npoisson = 0.25\nstones = ["kind = header"]\n'
    )
    for model in selected(text, session):
        assert (model.material.name == "granite") == (model.record.kind == "header")


@pytest.mark.parametrize(
    ("written", "instead", "line", "said"),
    [
        ('"course <= 2"', '"course > 99"', 4, "no stone is selected"),
        ('"course <= 2"', '"curse <= 2"', 5, "unknown attribute 'curse'"),
        ("where", 'kind = "vossoir"\nwhere', 5, "unknown kind 'vossoir'; did you mean voussoir"),
        ('"W02-02"', '"W02-20"', 12, "'W02-20' is not the code of a selected stone; did you mean 'W02-0"),
        ('"W02-02"', '"V4"', 12, "'V4' is not the code of a selected stone"),
        ('"course = 1"', '"course = 7"', 13, "fixed: no selected stone satisfies 'course = 7'"),
        ('"course = 1"', '"course = = 1"', 13, "fixed: "),
        (
            'deformable = ["W02-02"]',
            'rigid = ["W02-02"]\ndeformable = ["W02-02"]',
            13,
            "both rigid and deformable",
        ),
        ("poisson = 0.2", 'poisson = 0.2\nstones = ["W02-02"]', 6, "stones have no material, e.g. W01-01"),
        ("[materials", 'exclude = ["course <= 2"]\n[materials', 6, "all selected stones are excluded"),
    ],
)
def test_a_selection_that_fails_is_named_with_its_line(session, written, instead, line, said):
    assert written in LOW
    fails_at_line(line, said, lambda text: selected(text, session), LOW.replace(written, instead, 1))


def test_a_series_of_no_stone_is_named_with_its_line(session):
    text = LOW + '[output]\nseries = ["W02-99"]\n'
    scene = parse_scene(text, "scene.toml")
    models = select_stones(scene, session)
    said = "series: 'W02-99' is not the code of a selected stone"
    fails_at_line(len(text.splitlines()), said, lambda _: select_groups(scene, session, models), text)


def test_a_stone_from_the_database_is_the_stone_that_was_surveyed(session):
    models = selected("[materials.a]\ndensity = 1\nyoung = 1\npoisson = 0\n", session)
    assert len(models) == 98
    for model in models:
        block = surveyed_block(model.record)
        assert np.allclose(block.solid.vertices, model.record.solid_vertices, rtol=0, atol=1e-12)
        assert block.face.rejected_points == model.record.rejected


def test_closed_stones_touch_and_open_ones_do_not(session):
    closed = assemble(parse_scene(LOW, "scene.toml"), session)
    opened = assemble(parse_scene(LOW + '[joints]\nmode = "as-surveyed"\n', "scene.toml"), session)
    assert (opened.closing.mode, opened.closing.largest_displacement) == ("as-surveyed", 0.0)
    assert closed.closing.largest_displacement > 0.0
    assert closed.towards == pytest.approx([0.12, -0.99, 0.0], abs=0.02)

    def bed(assembly):
        """Upper side of the fixed course, lower side of the next, at their middles [m]."""
        z = {block.code: block.vertices[:, 2] for block in assembly.scene.blocks}
        top = max(one.max() for code, one in z.items() if code.startswith("W01"))
        return min(one.min() for code, one in z.items() if code.startswith("W02")) - top

    assert bed(closed) < bed(opened)
    by_code = {block.code: block for block in closed.scene.blocks}
    assert by_code["W02-02"].mesh_size == 0.3
    assert by_code["W02-01"].mesh_size is None


def test_a_run_writes_its_folder_and_keeps_its_results(own_url, tmp_path):
    (tmp_path / "low.toml").write_text(LOW, encoding="utf-8")
    heard = []
    done = run_scene(tmp_path / "low.toml", own_url, tmp_path / "out", heard.append)
    assert {report.stage for report in heard} == {"blocks", "mesh", "check", "step", "confirm", "write"}
    summary = json.loads((tmp_path / "out/summary.json").read_text(encoding="utf-8"))
    assert summary == done.summary
    assert summary["outcome"] == "equilibrium"
    assert summary["bodies"]["deformable"] == 1
    assert summary["errors"]["reaction"] < 1e-3
    assert sorted(summary["files"]) == sorted(one.name for one in (tmp_path / "out").iterdir())
    assert {"report.html", "results.vtkhdf", "joints.csv", "von_mises.png", "scene.toml"} <= set(
        summary["files"]
    )
    with open_database(own_url, create=False) as database, database.session(read_only=True) as session:
        rows = find_rows(session, "entity", ["von_mises_max > 0"])
        worst = find_rows(session, "entity", ["stress_error > 0 and principal_compression < 0"])
        bearing = find_rows(session, "entity", ["joint_pressure > 1000", "joint_kern < 3"])
        (run,) = describe(session, "W02-02")["runs"]
        assert len(find_rows(session, "entity", ["fidelity = fixed"])) == summary["bodies"]["fixed"]
    assert [row["code"] for row in rows] == [row["code"] for row in worst] == ["W02-02"]
    assert 0 < rows[0]["stress_error"] < 1
    assert rows[0]["utilisation"] is None  # no strengths
    assert {"W02-02", "W01-03"} <= {row["code"] for row in bearing}
    assert set(run["values"]) <= {*quantities_of("stone"), "volume", "mass"}
    assert summary["stress"]["error"]["stone"] == "W02-02"
    assert summary["joints"]["count"] >= summary["joints"]["pressed"] > 8
    assert run["scene"] == "Two courses"
    assert rows[0]["von_mises_max"] == pytest.approx(summary["von_mises"]["max"])
    # once more, in the place of the first
    again = run_scene(tmp_path / "low.toml", own_url, tmp_path / "out")
    assert again.run > done.run
    assert again.summary["von_mises"] == done.summary["von_mises"]


def test_results_that_cannot_be_stored_are_an_error_and_stay_in_their_folder(own_url, tmp_path):
    """The database takes no more runs by the time the simulation is over."""
    with sqlite3.connect(own_url.removeprefix("sqlite:///")) as database:
        full = "begin select raise(abort, 'the disk is full'); end"
        database.execute(f"create trigger full before insert on joint_result {full}")
    database.close()
    text = LOW.replace('deformable = ["W02-02"]\n', "") + "[output]\npictures = []\n"
    (tmp_path / "low.toml").write_text(text, encoding="utf-8")
    said = fails(1, "run", tmp_path / "low.toml", "--db", own_url, "--out", tmp_path / "out")
    assert f"the results are in {tmp_path / 'out'}, but could not be stored" in said
    assert "the disk is full" in said
    summary = json.loads((tmp_path / "out/summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"] == "equilibrium"
    assert sorted(summary["files"]) == sorted(one.name for one in (tmp_path / "out").iterdir())
    assert answer("runs", "--db", own_url) == []


def test_a_run_keeps_its_peaks_its_series_and_its_inputs(own_url, tmp_path):
    """Of W02-02 and of what it stands on, in files; of every stone, and of the run, in the database."""
    asked = 'series = ["W02-02", "course = 1"]\npictures = []\n'
    text = LOW.replace('deformable = ["W02-02"]\n', "") + f"theta = 1.0\n[output]\n{asked}"
    (tmp_path / "low.toml").write_text(text, encoding="utf-8")
    done = run_scene(tmp_path / "low.toml", own_url, tmp_path / "out")
    summary = done.summary
    lines = (tmp_path / "out/series_stones.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + summary["steps"] * (1 + summary["bodies"]["fixed"])
    joints = (tmp_path / "out/series_joints.csv").read_text(encoding="utf-8").splitlines()
    assert any("W02-02" in line for line in joints)
    assert {"series_stones.csv", "series_joints.csv"} <= set(summary["files"])
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    for words in (
        *("window bay (synthetic)", "density 2350 kg/m³", "DryJoint: friction", "W01-03"),
        "gravity (0, 0, -9.81)",
    ):
        assert words in page
    assert summary["inputs"]["Joints of the survey"][0].startswith("close: ")
    assert "numpy" in summary["versions"]
    with open_database(own_url, create=False) as database, database.session(read_only=True) as session:
        rows = find_rows(session, "entity", ["displacement_peak > 0"])
        told = describe_run(session, done.run)
    assert len(rows) == summary["bodies"]["rigid"]
    for name, peak in (("displacement_max", "displacement_peak"), ("joint_pressure", "joint_pressure_peak")):
        assert all(row[peak] >= row[name] * (1.0 - 1e-6) - 1e-12 for row in rows)
    peaks = {one["peak"]: one for one in told["peaks"]}
    assert peaks["pressure"]["value"] == summary["peaks"]["pressure"]["value"]
    assert " – " in peaks["pressure"]["stones"]
    assert (peaks["shear"]["unit"], peaks["shear"]["stones"]) == ("N", None)
    assert told["headline"] == summary["headline"]


def test_a_picture_that_shows_nothing_is_a_warning(own_url, tmp_path):
    text = LOW.replace('deformable = ["W02-02"]\n', "") + '[output]\npictures = ["error", "resultants"]\n'
    (tmp_path / "low.toml").write_text(text, encoding="utf-8")
    done = run_scene(tmp_path / "low.toml", own_url, tmp_path / "out")
    idle, thin, omitted = done.warnings
    assert THIN in thin
    assert "[mesh] has no effect: no stone deforms" in idle
    assert omitted == "no picture error: no stone deforms"
    assert [name for name in done.summary["files"] if name.endswith(".png")] == ["resultants.png"]


def test_without_pictures_the_rest_is_written_and_a_warning_says_what_to_install(
    own_url, tmp_path, monkeypatch
):
    def no_pictures(*_):
        raise MissingLibraryError("libGL.so.1: not there", remedy="apt-get install libgl1")

    monkeypatch.setattr(run_module, "draw_pictures", no_pictures)
    (tmp_path / "low.toml").write_text(LOW.replace('deformable = ["W02-02"]\n', ""), encoding="utf-8")
    done = run_scene(tmp_path / "low.toml", own_url, tmp_path / "out")
    assert done.warnings[2:] == ("no pictures: libGL.so.1: not there; apt-get install libgl1",)
    assert "apt-get install libgl1" in (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert (tmp_path / "out/results.vtkhdf").exists()


def test_a_place_that_is_taken_is_refused_before_anything_runs(tmp_path, url, monkeypatch):
    monkeypatch.setattr(run_module, "simulate", None)  # must not be reached
    (tmp_path / "low.toml").write_text(LOW, encoding="utf-8")
    with pytest.raises(UsageError, match=r"low\.toml"):
        run_scene(tmp_path / "low.toml", url, tmp_path)


@pytest.mark.parametrize(
    ("name", "deformable", "said"),
    [("wall.stl", True, "no format of meshes"), ("wall.msh", False, "no stone is deformable")],
)
def test_meshes_that_cannot_be_written_are_refused_before_anything_runs(
    tmp_path, url, monkeypatch, name, deformable, said
):
    monkeypatch.setattr(run_module, "simulate", None)  # must not be reached
    text = LOW if deformable else LOW.replace('deformable = ["W02-02"]\n', "")
    (tmp_path / "low.toml").write_text(text, encoding="utf-8")
    with pytest.raises(UsageError, match=said):
        run_scene(tmp_path / "low.toml", url, tmp_path / "out", options=RunOptions(meshes=tmp_path / name))
    assert not (tmp_path / "out").exists()


def test_a_static_start_is_told_and_a_warning_where_there_is_none(own_url, tmp_path):
    text = LOW + 'start = "equilibrium"\n[output]\npictures = []\n'
    (tmp_path / "low.toml").write_text(text, encoding="utf-8")
    done = run_scene(tmp_path / "low.toml", own_url, tmp_path / "out")
    assert done.summary["static"]["found"]
    (thin,) = done.warnings
    assert THIN in thin
    assert "Began in static equilibrium" in (tmp_path / "out/report.html").read_text(encoding="utf-8")
    # without the course that holds them up, the stones fall
    falling = (
        text.replace('where = ["course <= 2"]', 'where = ["course in (1, 3)"]')
        + "[joints]\nmode = 'as-surveyed'\n"
    )
    (tmp_path / "falling.toml").write_text(falling.replace('["W02-02"]', '["W03-02"]'), encoding="utf-8")
    done = run_scene(
        tmp_path / "falling.toml", own_url, tmp_path / "out2", options=RunOptions(accept_unsound=True)
    )
    assert not done.summary["static"]["found"]
    assert any("no static equilibrium was found" in one for one in done.warnings)


@pytest.mark.parametrize(
    ("relaxation", "outcome", "warned"),
    [(False, "equilibrium", True), (True, "equilibrium", False), (True, "moving", True)],
)
def test_unsolved_steps_are_a_warning_unless_only_the_end_counts(
    tmp_path, session, relaxation, outcome, warned
):
    scene = parse_scene(
        LOW + f"relaxation = {str(relaxation).lower()}\n[output]\npictures = []\n", "scene.toml"
    )
    assembly = assemble(scene, session)
    by_hand = result_of(
        [rigid_body("a", (0, 0, 0), (1, 1, 1))], outcome=Outcome(outcome), pairs=(), forces=()
    )
    result = replace(by_hand, scene=replace(assembly.scene, blocks=assembly.scene.blocks[:1]))
    _, warnings = write_results(result, stone_results(result), scene, assembly, tmp_path, Writing())
    assert any("1 of 10 steps" in one for one in warnings) == warned
