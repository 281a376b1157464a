"""`moma orient`: project files, exports, and what is written for other programs."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from survey.orientation.formats.colmap import read_colmap
from survey.orientation.formats.control import ControlRow, write_control
from survey.orientation.formats.metashape import read_metashape
from survey.orientation.formats.photomodeler import write_photomodeler
from tests.moma.commands import answer, fails, prints
from tests.survey.orientation.synthetic_block import (
    noisy,
    spread_points,
    wall_block,
    with_points,
    write_marks,
)

PROJECT = """\
marks = "marks.txt"
control = "control.txt"
sigma = 0.5
{more}

[[cameras]]
name = "D800"
size = [6000, 4000]
pixel = 0.006
c = 24.0
xp = 18.05
yp = 11.97
{camera}
"""
INNER = "as = 2e-4\nsk = 1e-4\nK1 = 1.2e-4\nK2 = -1.5e-7\nK3 = 1e-10\nP1 = 1.1e-5\nP2 = -0.7e-5\n"


def network(forward=False, plain=False):
    truth = wall_block(columns=3, points=40, forward=forward)
    made = noisy(with_points(truth, spread_points(truth, 6)), np.random.default_rng(1))
    if plain:
        inner = made.cameras[0].inner * np.r_[np.ones(3), np.zeros(7)]
        made = replace(made, cameras=(replace(made.cameras[0], inner=inner),))
    return made


def project(folder, more="", camera=INNER, made=None):
    made = made or network()
    write_marks(made, folder / "marks.txt")
    rows = [ControlRow(made.names[one.point], "", one.place, one.covariance) for one in made.control]
    write_control(rows, folder / "control.txt")
    path = folder / "project.toml"
    path.write_text(PROJECT.format(more=more, camera=camera), encoding="utf-8")
    return path


def test_a_project_is_oriented_and_its_result_kept(tmp_path):
    path = project(tmp_path, f'check = ["{network().names[network().control[5].point]}"]')
    said = prints("orient", path, "--out", tmp_path / "out")
    assert "6 photographs, 40 points" in said
    assert "1 check points" in said
    values = json.loads((tmp_path / "out/orientation.json").read_text(encoding="utf-8"))
    assert set(values["files"]) == {entry.name for entry in (tmp_path / "out").iterdir()}
    assert values["sigma0"] == pytest.approx(1.0, abs=0.15)
    prints("orient", path, "--out", tmp_path / "out")  # earlier results are replaced


def test_what_programs_may_rely_on(tmp_path):
    path = tmp_path / "export.txt"
    made = network(plain=True)
    write_photomodeler(made, path)
    control = tmp_path / "control.txt"
    write_control([ControlRow(made.names[c.point], "", c.place, c.covariance) for c in made.control], control)
    calibrate = "c,xp,yp,as,sk,K1,K2,K3,P1,P2"
    told = answer(
        "orient",
        "--photomodeler",
        path,
        "--control",
        control,
        "--calibrate",
        calibrate,
        "--out",
        tmp_path / "a",
    )
    assert {
        *("sigma0", "redundancy", "observations", "unknowns", "iterations", "camera", "photos"),
        "points",
    } <= told.keys()
    assert set(told["camera"]) == set(calibrate.split(","))
    assert all(set(one) == {"value", "sigma"} and one["sigma"] > 0 for one in told["camera"].values())
    assert {"name", "omega", "phi", "kappa", "x", "y", "z", "sigma"} <= told["photos"][0].keys()
    assert set(told["photos"][0]["sigma"]) == {"omega", "phi", "kappa", "x", "y", "z"}
    assert {"id", "xyz", "covariance"} == told["points"][0].keys()
    assert told["observations"] - told["unknowns"] == told["redundancy"]
    fixed = answer(
        "orient", "--photomodeler", path, "--control", control, "--fixed-control", "--out", tmp_path / "b"
    )
    assert fixed["observations"] == told["observations"] - 18


def test_results_are_written_for_other_programs(tmp_path):
    made = network(forward=True)
    inner = made.cameras[0].inner * np.r_[np.ones(4), 0.0, np.ones(5)]
    made = replace(made, cameras=(replace(made.cameras[0], inner=inner),))
    path = project(
        tmp_path,
        'write = ["colmap", "metashape", "dbat"]',
        INNER.replace("sk = 1e-4\n", "") + 'model = "forward"\n',
        made,
    )
    told = answer("orient", path, "--out", tmp_path / "out")
    for back in (read_colmap(tmp_path / "out/colmap"), read_metashape(tmp_path / "out/metashape.xml")):
        for photo, one in zip(back.photos, told["photos"], strict=True):
            np.testing.assert_allclose(photo.station, [one["x"], one["y"], one["z"]], atol=1e-9)
    assert (tmp_path / "out/dbat/project.xml").exists()


def test_a_model_of_another_program_is_oriented_again(tmp_path):
    made = network(forward=True)
    from survey.orientation.formats.colmap import write_colmap

    inner = made.cameras[0].inner * np.r_[np.ones(4), 0.0, np.ones(5)]
    write_colmap(replace(made, cameras=(replace(made.cameras[0], inner=inner),)), tmp_path / "model")
    path = tmp_path / "project.toml"
    path.write_text('colmap = "model"\nsigma = 0.5\n', encoding="utf-8")
    told = answer("orient", path, "--out", tmp_path / "out")
    assert told["datum"] == "inner constraints of the points"
    assert "nothing tells their error" in prints("orient", path, "--out", tmp_path / "out")
    assert told["sigma0"] == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize(
    ("more", "camera", "message", "line"),
    [
        ("marcs = 1", INNER, "unknown key 'marcs' in the project; did you mean 'marks' or 'markers'?", 4),
        ('blunders = "forget"', INNER, "blunders = 'forget' is unknown", 4),
        ('check = ["901"]', INNER, "no control point '901' to check", None),
        ('calibrate = ["f"]', INNER, "no parameter 'f' of a camera", 4),
        ('write = ["bundler"]', INNER, "no format 'bundler'", 4),
        ('colmap = "model"', INNER, "marks and colmap", 4),
        ("", "model = 'sideways'", "model = 'sideways' is unknown", 13),
        ("", "size = [1, 2]", "given twice", 13),
        ("", "calibrate = ['K9']", "no parameter 'K9' of a camera", 13),
        ("", '[[photos]]\nname = "P01"\ncamera = "D80"', "no camera 'D80'", 15),
        ("", '[[photos]]\nname = "P01"\nfixed = true', "a fixed photograph without station and angles", 15),
        ("", '[[photos]]\nname = "P01"\nstation_sigma = [1, 1, 1]', "station_sigma without station", 15),
        ("", '[[photos]]\nname = "P01"', "no photograph P02", None),
    ],
)
def test_mistakes_of_a_project_are_named(tmp_path, more, camera, message, line):
    path = project(tmp_path, more, camera)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        said = fails(2 if line else 1, "orient", path.name, "--out", "out")
    assert message in said
    if line:
        assert f"project.toml:{line}: " in said
    assert not (tmp_path / "out").exists()


def test_wrong_data_leave_nothing_behind(tmp_path):
    made = network()
    path = project(tmp_path, made=replace(made, control=made.control[:2]))
    said = fails(1, "orient", path, "--out", tmp_path / "out")
    assert f"{tmp_path / 'control.txt'}:2: 2 control points" in said
    assert not (tmp_path / "out").exists()
    assert "neither or both" in fails(2, "orient")
    assert "--control with a project file" in fails(2, "orient", path, "--control", path)
    assert "--fixed-control or --check without --control" in fails(
        2, "orient", "--photomodeler", _export(tmp_path), "--check", "1"
    )


def _export(folder):
    write_photomodeler(network(plain=True), folder / "export.txt")
    return folder / "export.txt"


def test_an_export_that_does_not_state_the_size_of_its_photographs(tmp_path):
    made = network(plain=True)
    write_photomodeler(made, tmp_path / "export.txt")
    lines = (tmp_path / "export.txt").read_text(encoding="utf-8").splitlines()
    lines[1] = "0.0005 20"
    (tmp_path / "export.txt").write_text("\n".join(lines), encoding="utf-8")
    given = ("orient", "--photomodeler", tmp_path / "export.txt", "--out", tmp_path / "out")
    assert "export.txt:2: the line of tolerance, iterations, width and height has 2 numbers" in fails(
        1, *given
    )
    assert "write width and height" in fails(2, *given, "--size", "6000")
    assert "6 photographs" in prints(*given, "--size", "6000x4000")
    project = tmp_path / "project.toml"
    project.write_text('photomodeler = "export.txt"\nsize = [6000, 4000]\n', encoding="utf-8")
    assert "6 photographs" in prints("orient", project, "--out", tmp_path / "other")


def pictures(folder, made, size):
    folder.mkdir()
    for photo in made.photos:
        Image.new("L", size).save(folder / f"{photo.name.lower()}.PNG")


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ((400, 600), "turn it back as the camera took it"),
        ((600, 300), "has 600 × 300 pixels, its camera 6000 × 4000"),
    ],
)
def test_pictures_of_other_proportions_are_refused(tmp_path, size, message):
    path = project(tmp_path, 'pictures = "pictures"')
    assert "project.toml:4: no folder" in fails(2, "orient", path, "--out", tmp_path / "out")
    pictures(tmp_path / "pictures", network(), size)
    assert message in fails(2, "orient", path, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_results_are_drawn_on_pictures_of_any_resolution(tmp_path):
    path = project(tmp_path, 'pictures = "pictures"')
    pictures(tmp_path / "pictures", network(), (600, 400))
    prints("orient", path, "--out", tmp_path / "out")
    values = json.loads((tmp_path / "out/orientation.json").read_text(encoding="utf-8"))
    assert values["photos"][0]["picture"] == "../pictures/p01.PNG"
    (tmp_path / "pictures/p02.PNG").unlink()
    assert "no picture of photograph P02" in fails(2, "orient", path, "--out", tmp_path / "out")


def test_control_points_of_an_export_are_results_unless_they_are_fixed(tmp_path):
    write_photomodeler(network(plain=True), tmp_path / "export.txt")
    path = tmp_path / "project.toml"
    for more, points in (("", 0), ("fixed_control = true\n", 6)):
        path.write_text(f'photomodeler = "export.txt"\n{more}', encoding="utf-8")
        told = answer("orient", path, "--out", tmp_path / "out")
        assert len(told["control"]) == points
        assert any("are left out, as it has their adjusted places" in one for one in told["remarks"]) == (
            not points
        )
    path.write_text('photomodeler = "export.txt"\ncheck = ["1"]\n', encoding="utf-8")
    assert "check without control points" in fails(2, "orient", path, "--out", tmp_path / "out")


def test_a_picture_is_not_taken_for_two_photographs(tmp_path):
    path = project(tmp_path, 'pictures = "pictures"')
    pictures(tmp_path / "pictures", network(), (600, 400))
    marks = tmp_path / "marks.txt"
    marks.write_text(
        marks.read_text(encoding="utf-8").replace("P01,", "a/P01,").replace("P02,", "b/P01,"),
        encoding="utf-8",
    )
    assert "would be the picture of a/P01 and of b/P01" in fails(2, "orient", path, "--out", tmp_path / "out")
