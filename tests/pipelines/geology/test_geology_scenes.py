"""Geological scenes: keys are checked with their lines, the shipped ones are the paper's, runs leave their measures."""

import json
from dataclasses import replace
from typing import get_args

import meshio
import numpy as np
import pytest
from sqlalchemy import select

from archmodel.database.session import open_database
from archmodel.tables.runs import CellResult
from ground.errors import MomaError, SceneError
from mechanics.planar.model import build_planar_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime
from mechanics.planar.simulate import simulate_planar
from moma.cli.geology import ExperimentName
from pipelines.geology.file import EXPERIMENTS, parse_geology, read_geology
from pipelines.geology.observe import CELL_COLUMNS, Fields, read_rows
from pipelines.geology.results import quality_of
from pipelines.geology.run import planar_scene, run_geology
from pipelines.geology.sample import PreparedSample, prepare
from tests.docs.test_docs import commands
from tests.moma.commands import answer, fails, prints
from tests.paths import ROOT
from tests.pipelines.scenes import small_geology

SAMPLES = ROOT / "data/samples/geology"
SMALL = """
[scene]
name = "Small fault"
[sample]
smallest = 0.2
largest = 0.3
layers = 3
[time]
step = 0.01
steps = 30
[solver]
min_iterations = 20
max_iterations = 40
[fault]
length = 12.0
thickness = 3.0
tip = 6.0
dip = 30.0
speed = 0.5
[output]
every = 10
fields_every = 15
checkpoint = 10
figures = false
[[cells]]
name = "W1"
centre = [7.0, 1.5]
radius = 1.0
"""


@pytest.mark.parametrize(("name", "kind"), [("fold", "fold"), ("fault", "fault")])
def test_shipped_scenes_are_those_of_the_paper_and_a_tenth_has_its_lengths_over_the_root_of_ten(name, kind):
    whole, tenth = (read_geology(SAMPLES / f"{name}{part}.toml", kind) for part in ("", "-tenth"))
    smaller = tuple(top / np.sqrt(10) for top in whole.sample.layer_tops)
    assert tenth.sample.layer_tops == pytest.approx(smaller, rel=1e-3)
    assert replace(tenth.sample, layer_tops=whole.sample.layer_tops) == whole.sample
    assert whole.time == tenth.time
    assert tenth.experiment.length == pytest.approx(whole.experiment.length / np.sqrt(10), rel=1e-3)
    assert [cell.name for cell in whole.cells] == [cell.name for cell in tenth.cells]
    for one, other in zip(whole.cells, tenth.cells, strict=True):
        assert np.array(other.centre) == pytest.approx(np.array(one.centre) / np.sqrt(10), rel=1e-3)


def test_the_fold_has_the_area_of_its_disks():
    """43,000 disks of 0.42 to 0.56 m fill the profile at 0.82 to 0.83 of its area (Renouf et al. 2006)."""
    fold = read_geology(SAMPLES / "fold.toml", "fold").experiment
    x = np.linspace(0.0, fold.length, 100_001)
    area = float(np.mean(fold.top(x)) * fold.length)
    mean = np.pi * (0.42**2 + 0.42 * 0.56 + 0.56**2) / 3.0
    assert 43_000 * mean / area == pytest.approx(0.825, abs=0.01)


@pytest.mark.parametrize(
    ("written", "instead", "line", "said"),
    [
        ("smallest = 0.2", "smalest = 0.2", 5, "unknown key 'smalest' in [sample]; did you mean 'smallest'?"),
        ("dip = 30.0", "dip = 95.0", 18, "dip = 95"),
        ("largest = 0.3", "largest = 0.1", 4, "largest = 0.1 is less than smallest = 0.2"),
        ("min_iterations = 20", "min_iterations = 50", 11, "max_iterations = 40 is less than"),
        ("tip = 6.0", "tip = 16.0", 14, "tip = 16 is not within the length"),
        ("radius = 1.0", "radius = -1.0", 28, "radius = -1"),
        ("[fault]", "[fold]", 14, "this is a scene of `moma geology fold`"),
        ("centre = [7.0, 1.5]", "centre = [7.0]", 27, "give x and y"),
        ("step = 0.01", "step = 0", 9, "step = 0 is out of range"),
        ("steps = 30", "steps = 30\ngravity = 0", 11, "gravity = 0 is out of range"),
        ("speed = 0.5", "speed = 20.1", 9, "the wall 'fault' goes 0.201 m"),
        ("speed = 0.5", "speed = nan", 19, "speed = nan is out of range"),
        ("steps = 30", "steps = 3000", 14, "the tip goes 12.9904 m of the 6 m ahead of it"),
        (
            "centre = [7.0, 1.5]",
            "centre = [7.0, 3.0]",
            25,
            "cell 'W1' reaches out of the sample by 1 m at (7, 4)",
        ),
        ("centre = [7.0, 1.5]", "centre = [50.0, 1.5]", 25, "cell 'W1' reaches out of the sample by 39 m"),
        ('name = "W1"', 'name = "whole sample"', 26, "is the name of all disks"),
        ("[[cells]]", "[cells]", 25, "'cells' is not a list of tables"),
        ('[scene]\nname = "Small fault"', "scene = 3", 2, "'scene' is not a table"),
    ],
)
def test_what_is_wrong_is_refused_at_its_line(written, instead, line, said):
    assert written in SMALL
    with pytest.raises(SceneError) as caught:
        parse_geology(SMALL.replace(written, instead, 1), "fault.toml", "fault")
    assert str(caught.value).startswith(f"fault.toml:{line}: ")
    assert said in str(caught.value)


def test_both_readings_of_the_fault_have_the_paper_s_number_of_disks_and_its_cell():
    """15,000 disks fill 150 × 15 m with the paper's radii, and the paper's 300 × 30 m with twice these."""
    for name, size in (("fault", 1.0), ("fault-doubled", 2.0)):
        scene = read_geology(SAMPLES / f"{name}.toml", "fault")
        own, (cell,) = scene.experiment, scene.cells
        assert (own.length, own.thickness, scene.sample.smallest) == (150.0 * size, 15.0 * size, 0.13 * size)
        mean = np.pi * (0.13**2 + 0.13 * 0.26 + 0.26**2) / 3.0 * size**2
        assert 15_000 * mean / (own.length * own.thickness) == pytest.approx(0.82, abs=0.02)
        assert (cell.centre, cell.radius, own.tip) == ((85.0, 7.5), 6.0, 75.0)


@pytest.mark.parametrize(
    ("written", "instead", "said"),
    [
        ("layers = 3", "layer_tops = [1.0, 0.5]", "layer_tops = [1.0, 0.5] do not grow from 0"),
        ("layers = 3", "layer_tops = [0.0, 0.5]", "layer_tops = [0.0, 0.5] do not grow from 0"),
        ("figures = false", "figures_at = [-1.0]", "figures_at = [-1.0]; give times from 0 on"),
        ("[time]", "[contact]\nfriction = 11\n[time]", "friction = 11"),
    ],
)
def test_settings_of_layers_figures_and_friction_are_checked(written, instead, said):
    with pytest.raises(SceneError) as caught:
        parse_geology(SMALL.replace(written, instead), "fault.toml", "fault")
    assert said in str(caught.value)


def test_disks_accept_the_friction_that_stones_accept():
    scene = parse_geology(SMALL.replace("[time]", "[contact]\nfriction = 9.5\n[time]"), "fault.toml", "fault")
    assert scene.contact.friction == 9.5


def test_marker_layers_have_the_heights_that_are_given(tmp_path):
    text = SMALL.replace("layers = 3", "layer_tops = [0.5, 2.0]")
    sample = prepare(parse_geology(text, "fault.toml", "fault"), tmp_path)
    assert sample.layer.tolist() == np.digitize(sample.centre[:, 1], [0.5, 2.0]).tolist()


def test_figures_are_drawn_of_the_instants_that_are_asked_for(tmp_path):
    text = SMALL.replace("figures = false", "figures_at = [0.0, 0.07]").replace(
        "fields_every = 15", "fields_every = 40"
    )
    (tmp_path / "fault.toml").write_text(text, encoding="utf-8")
    run_geology(tmp_path / "fault.toml", "fault", tmp_path / "out")
    drawn = sorted(path.name for path in (tmp_path / "out").glob("layers-*.png"))
    assert drawn == ["layers-00000000.png", "layers-00000007.png", "layers-00000030.png"]
    assert (tmp_path / "out/arrays/fields-00000007.npz").exists()
    assert {"course.png", "shapes.png"} <= {path.name for path in (tmp_path / "out").iterdir()}


def test_negative_cohesion_is_refused():
    text = SMALL.replace("[time]", "[contact]\ncohesion = -1.0\n[time]")
    with pytest.raises(SceneError, match="cohesion = -1"):
        parse_geology(text, "fault.toml", "fault")


@pytest.mark.parametrize(
    ("written", "instead", "said"),
    [
        (
            "smallest = 0.2\nlargest = 0.3",
            "smallest = 3\nlargest = 4",
            "length = 12.0; give more than two of",
        ),
        ("thickness = 3.0", "thickness = 1.1", "highest = 1.1; give more than two of the widest"),
        (
            "smallest = 0.2\nlargest = 0.3",
            "smallest = 0.001\nlargest = 0.001",
            "1.01e+07 disks of 0.001 to 0.001 m",
        ),
    ],
)
def test_a_sample_that_cannot_be_made_is_refused_at_its_line(tmp_path, written, instead, said):
    assert written in SMALL
    text = SMALL.replace(written, instead).partition("[[cells]]")[0].replace("speed = 0.5", "speed = 0.01")
    with pytest.raises(SceneError) as caught:
        prepare(parse_geology(text, "fault.toml", "fault"), tmp_path)
    assert str(caught.value).startswith("fault.toml:4: ")
    assert said in str(caught.value)


LAYERED = """
[[layers]]
top = 1.0
density = 3000.0
friction = 0.1
cohesion = 50.0
[[layers]]
top = 2.0
[[layers]]
top = 9.0
friction = 0.3
cohesion = 20.0
"""


def test_layers_have_their_density_and_the_contacts_between_two_the_smaller_friction_and_cohesion(tmp_path):
    scene = parse_geology(SMALL + LAYERED, "fault.toml", "fault")
    sample = prepare(scene, tmp_path)
    planar = planar_scene(scene, sample)
    height = sample.centre[:, 1]
    assert [disk.density for disk in planar.disks] == np.where(height < 1.0, 3000.0, 2800.0).tolist()
    layer = np.digitize(height, [1.0, 2.0])
    model, _ = build_planar_model(planar)
    some = [int(np.flatnonzero(layer == number)[0]) for number in range(3)]
    others = [int(np.flatnonzero(layer == number)[1]) for number in range(3)]
    pairs = np.array([(some[one], others[two]) for one in range(3) for two in range(3)])
    laws = [model.laws.laws[number] for number in model.laws.of(pairs)]
    assert [law.friction for law in laws] == [0.1, 0.1, 0.1, 0.1, 0.4, 0.3, 0.1, 0.3, 0.3]
    assert [getattr(law, "force", 0.0) for law in laws] == [
        50.0,
        0.0,
        20.0,
        0.0,
        0.0,
        0.0,
        20.0,
        0.0,
        20.0,
    ]


def test_layers_that_do_not_follow_each_other_are_refused_at_their_line():
    text = SMALL + LAYERED.replace("top = 2.0", "top = 0.5")
    line = text.splitlines().index("top = 0.5") + 1
    with pytest.raises(
        SceneError, match=f"^fault.toml:{line}: top = 0.5 is not above that of the layer before, 1"
    ):
        parse_geology(text, "fault.toml", "fault")


def test_two_sizes_have_their_share(tmp_path):
    text = SMALL.replace("layers = 3", "layers = 3\nlarge_share = 0.25")
    radius = prepare(parse_geology(text, "fault.toml", "fault"), tmp_path).radius
    assert set(radius.tolist()) == {0.2, 0.3}
    # binomial: 3 standard deviations of some 200 disks
    assert (radius == 0.3).mean() == pytest.approx(0.25, abs=0.1)


def test_a_sample_is_made_once(tmp_path):
    scene = parse_geology(SMALL, "fault.toml", "fault")
    first = prepare(scene, tmp_path)
    (path,) = tmp_path.glob("*.npz")
    made = path.stat().st_mtime_ns
    again = prepare(scene, tmp_path)
    assert path.stat().st_mtime_ns == made
    assert np.array_equal(first.centre, again.centre)
    assert sorted(set(first.layer.tolist())) == [0, 1, 2]
    path.write_bytes(b"cut short")
    assert np.array_equal(prepare(scene, tmp_path).centre, first.centre)


@pytest.mark.parametrize(
    ("samples", "url", "said"),
    [
        ("taken", None, "the samples cannot be kept here"),
        ("samples", "none/geology.db", "there is no folder"),
    ],
)
def test_places_that_cannot_be_written_are_refused_before_a_sample_is_deposited(
    tmp_path, monkeypatch, samples, url, said
):
    def refuse(*_):
        raise AssertionError("deposits")

    monkeypatch.setattr("pipelines.geology.sample.deposit", refuse)
    (tmp_path / "taken").write_text("", encoding="utf-8")
    scene = tmp_path / "fault.toml"
    scene.write_text(SMALL, encoding="utf-8")
    database = None if url is None else f"sqlite:///{tmp_path / url}"
    with pytest.raises(MomaError, match=said):
        run_geology(scene, "fault", tmp_path / "out", tmp_path / samples, url=database)


def test_a_run_leaves_rows_of_its_cells_fields_and_a_summary(tmp_path):
    (tmp_path / "fault.toml").write_text(SMALL, encoding="utf-8")
    summary = answer("geology", "fault", tmp_path / "fault.toml", "--out", tmp_path / "out")
    assert summary == json.loads((tmp_path / "out/summary.json").read_text(encoding="utf-8"))
    assert summary["steps"] == 30
    assert summary["overlap"]["max"] <= 0.01
    assert set(summary["cells"]) == {"W1", "whole sample"}
    rows = read_rows(tmp_path / "out" / summary["cells"]["W1"])
    assert list(rows) == list(CELL_COLUMNS)
    assert rows["step"].tolist() == [10.0, 20.0, 30.0]
    assert (rows["p"] > 0).all()
    assert sorted(path.name for path in (tmp_path / "out/fields").iterdir()) == [
        "00000015.vtu",
        "00000030.vtu",
    ]


def test_a_run_says_first_how_far_it_can_be_trusted(tmp_path):
    (tmp_path / "fault.toml").write_text(SMALL, encoding="utf-8")
    lines = prints("geology", "fault", tmp_path / "fault.toml", "--out", tmp_path / "out").splitlines()
    summary = json.loads((tmp_path / "out/summary.json").read_text(encoding="utf-8"))
    assert summary["unconverged_steps"] == 30
    assert lines[0] == "caution: 30 of 30 steps (100%) were left above η = 0.0001"
    assert "overlap over the smallest radius: mean " in lines[2]
    assert "γ = 0 N within d_w = 0.01 m" in lines[2]
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert "Caution: 30 of 30 steps" in page
    assert "<th>W1</th>" in page


def test_a_note_of_the_scene_stands_in_the_first_lines_of_print_and_report(tmp_path):
    text = SMALL.replace("[sample]", 'note = "Half of the lengths."\n[sample]', 1)
    (tmp_path / "fault.toml").write_text(text, encoding="utf-8")
    lines = prints("geology", "fault", tmp_path / "fault.toml", "--out", tmp_path / "out").splitlines()
    assert lines[2] == "  Half of the lengths."
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert page.index("Half of the lengths.") < page.index("What was measured")


def test_the_shipped_faults_note_which_of_two_readings_they_are():
    for name, other in (
        ("fault", "fault-doubled"),
        ("fault-doubled", "fault"),
        ("fault-tenth", "fault-doubled"),
    ):
        assert f"{other}.toml is the other reading" in read_geology(SAMPLES / f"{name}.toml", "fault").note


def test_a_cohesive_run_tells_its_blocks_at_each_instant(tmp_path):
    text = SMALL.replace("[time]", "[contact]\ncohesion = 1e4\n[time]")
    (tmp_path / "fault.toml").write_text(text, encoding="utf-8")
    rows = run_geology(tmp_path / "fault.toml", "fault", tmp_path / "out").summary["blocks"]
    assert [row["time"] for row in rows] == pytest.approx([0.15, 0.3])
    assert all(0.5 < row["largest_share"] <= 1.0 for row in rows)
    assert all(5 * row["detached"] <= row["detached_disks"] for row in rows)
    without = run_geology(_written(tmp_path / "without.toml", SMALL), "fault", tmp_path / "without").summary
    assert without["blocks"] == []


def _written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


DEPOSIT = """
[sample]
smallest = 0.2
largest = 0.3
layers = 3
[time]
step = 0.01
steps = 2
[deposit]
length = 12.0
height = 3.0
[output]
every = 1
figures = false
"""


@pytest.mark.parametrize(("tables", "count"), [("", 3), (LAYERED.replace("top = 2.0", "top = 1.5"), 3)])
def test_a_deposit_tells_the_fabric_of_its_layers(tmp_path, tables, count):
    (tmp_path / "deposit.toml").write_text(DEPOSIT + tables, encoding="utf-8")
    url = f"sqlite:///{tmp_path / 'runs.db'}"
    done = run_geology(tmp_path / "deposit.toml", "deposit", tmp_path / "out", url=url)
    names = [*(f"layer {number}" for number in range(1, count + 1)), "whole sample"]
    fabric = done.summary["fabric"]
    assert list(fabric) == names
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    kept = {one["cell"]: one for one in answer("runs", "1", "--db", url)["cells"]}
    ends = []
    for name in names:
        last = {
            key: values[-1]
            for key, values in read_rows(tmp_path / "out" / done.summary["cells"][name]).items()
        }
        assert fabric[name] == {key: last[key] for key in fabric[name]}
        assert kept[name]["porosity"] == fabric[name]["porosity"]
        assert 0.05 < fabric[name]["porosity"] < 0.3
        assert f"<th>{name}</th>" in page
        ends.append(last["y"])
    # from below, the boundaries of the layers between their mean heights
    tops = [1.0, 1.5 if tables else 2.0]
    assert ends[0] < tops[0] < ends[1] < tops[1] < ends[2]


def test_the_report_tells_the_layers_among_the_settings(tmp_path):
    (tmp_path / "fault.toml").write_text(SMALL + LAYERED, encoding="utf-8")
    run_geology(tmp_path / "fault.toml", "fault", tmp_path / "out")
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert "layers, 1 from below" in page
    assert "top = 1.0, density = 3000.0, friction = 0.1, cohesion = 50.0" in page
    assert "top = 9.0, friction = 0.3, cohesion = 20.0" in page


def test_overlaps_are_over_the_smallest_radius_and_a_large_one_is_a_caution():
    scene = parse_geology(SMALL, "fault.toml", "fault")
    sample = PreparedSample(np.zeros((2, 2)), np.array([0.2, 0.3]), np.zeros(2, dtype=np.int64), "")
    disks = (Disk("a", (0.0, 0.0), 0.2), Disk("b", (0.49, 0.0), 0.3))
    time = PlanarTime(1e-3, 1.0, 2e-3, stop_at_equilibrium=False)
    result = simulate_planar(PlanarScene("two", disks, time=time))
    quality = quality_of(scene, sample, result)
    assert quality["overlap"] == pytest.approx({"mean": 0.05, "max": 0.05}, rel=1e-3)
    assert quality["overlap_over_mean_radius"]["max"] == pytest.approx(0.04, rel=1e-3)
    assert quality["cautions"] == ["overlaps reach 5.00% of the smallest radius, more than 1%"]


def test_a_run_leaves_its_contacts_and_cells_for_paraview_and_its_instants_as_arrays(tmp_path):
    (tmp_path / "fault.toml").write_text(SMALL, encoding="utf-8")
    run_geology(tmp_path / "fault.toml", "fault", tmp_path / "out")
    for name in ("fields", "contacts", "cells"):
        assert (tmp_path / f"out/{name}.pvd").read_text(encoding="utf-8").count(f'file="{name}/') == 2
    with np.load(tmp_path / "out/arrays/fields-00000030.npz") as data:
        fields = Fields(**{name: data[name] for name in data.files})
    disks = len(fields.pressure)
    length = np.linalg.norm(fields.branches[:, 1] - fields.branches[:, 0], axis=1)
    near = np.where(fields.bodies[:, 1] < disks, 0.4, 0.2)
    assert (length > 0.9 * near).all()
    assert (length < 1.6 * near).all()
    size = np.hypot(fields.force_normal, fields.force_tangential)
    assert size == pytest.approx(np.linalg.norm(fields.force, axis=1))
    assert (np.abs(fields.force_tangential) <= 0.4 * fields.force_normal * (1 + 1e-6)).all()
    grid = meshio.read(tmp_path / "out/contacts/00000030.vtu")
    assert len(grid.cells[0].data) == len(fields.bodies)
    assert grid.point_data["force_normal"][::2] == pytest.approx(fields.force_normal)
    cell = meshio.read(tmp_path / "out/cells/00000030.vtu")
    rows = read_rows(tmp_path / "out/cell-000.csv")
    assert cell.cell_data["p"][0].tolist() == [rows["p"][-1]]
    disks = meshio.read(tmp_path / "out/fields/00000030.vtu")
    group = disks.point_data["cell"] == 1
    assert np.ptp(cell.points, axis=0) == pytest.approx(np.ptp(disks.points[group], axis=0), rel=1e-6)
    assert rows["lambda_x"][-1] == pytest.approx(1.0, abs=0.2)
    course = read_rows(tmp_path / "out/experiment.csv")
    assert course["slip [m]"] == pytest.approx(0.5 * course["time"])


def test_a_run_is_kept_in_the_database_with_the_rows_of_its_cells(tmp_path):
    (tmp_path / "fault.toml").write_text(SMALL, encoding="utf-8")
    url = f"sqlite:///{tmp_path / 'runs.db'}"
    said = prints("geology", "fault", tmp_path / "fault.toml", "--out", tmp_path / "out", "--db", url)
    assert "run 1 in the database" in said
    run = answer("runs", "1", "--db", url)
    assert run["settings"]["kind"] == "fault"
    assert run["settings"]["fault"]["dip"] == 30.0
    assert list(run["measures"]) == list(answer("runs", "1", "--db", url)["measures"])
    rows = read_rows(tmp_path / "out/cell-000.csv")
    assert [one["cell"] for one in run["cells"]] == ["W1", "whole sample"]
    assert run["cells"][0]["p"] == rows["p"][-1]
    assert "cells of disks at the end" in prints("runs", "1", "--db", url)
    with open_database(url) as database, database.session(read_only=True) as session:
        stored = session.scalars(
            select(CellResult).where(CellResult.cell == "W1").order_by(CellResult.step)
        ).all()
    assert [one.step for one in stored] == [10, 20, 30]
    assert [one.lambda_x for one in stored] == rows["lambda_x"].tolist()


def test_a_run_that_was_stopped_goes_on_with_the_same_bits(tmp_path):
    (tmp_path / "fault.toml").write_text(SMALL, encoding="utf-8")
    whole = run_geology(tmp_path / "fault.toml", "fault", tmp_path / "whole")
    steps = iter([False] * 16)
    stopped = run_geology(
        tmp_path / "fault.toml", "fault", tmp_path / "parts", stop=lambda: next(steps, True)
    )
    assert stopped.summary["outcome"] == "interrupted"
    done = run_geology(tmp_path / "fault.toml", "fault", tmp_path / "parts", resume=True)
    assert done.summary["steps"] == 30
    for name in whole.summary["cells"].values():
        assert (tmp_path / "parts" / name).read_text() == (tmp_path / "whole" / name).read_text()


def test_a_cell_outside_the_sample_is_refused_at_its_line(tmp_path):
    text = SMALL.replace("centre = [7.0, 1.5]", "centre = [7.0, 50.0]")
    (tmp_path / "fault.toml").write_text(text, encoding="utf-8")
    said = fails(2, "geology", "fault", tmp_path / "fault.toml", "--out", tmp_path / "out")
    assert "cell 'W1' reaches out of the sample by 48" in said
    assert not (tmp_path / "out").exists()


def test_the_command_knows_all_experiments():
    assert {*get_args(ExperimentName)} == set(EXPERIMENTS)


@pytest.mark.slow
def test_the_commands_of_the_how_to_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small_geology(tmp_path / "data/samples/geology")
    asked = commands("docs/howto/geology.md")
    assert {command[2] for command in asked if command[1] == "geology"} == set(EXPERIMENTS)
    for command in asked:
        said = prints(*command[1:])
        assert ("results in" if command[1] == "geology" else "Fault with a tenth of the disks") in said
    assert (tmp_path / "out/geology/fault/cells.png").stat().st_size > 10_000
