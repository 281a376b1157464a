"""docs/howto/photographs.md is true: its commands run, and the stones are those of the true wall."""

import json
import tomllib

import numpy as np
import pytest
from PIL import Image

from pipelines.orient.project import read_project
from survey.formats.reading import open_survey
from survey.orientation.bundle.orient import orient
from survey.orientation.formats.control import read_control
from survey.registration.stones import survey_stones
from synthetic.buildings.window import make_window
from synthetic.measure import inset
from synthetic.photographs import true_cameras
from tests.docs.pages import blocks, ran

PAGE = "docs/howto/photographs.md"

pytestmark = pytest.mark.draws


@pytest.fixture(scope="module")
def bay(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photographs")
    said = ran(folder, "".join(blocks(PAGE, "bash")))
    return folder, said


def discs(folder, photo, near):
    """Centres of the white discs of targets on a rendered photograph, near places on it [px of the camera]."""
    with Image.open(folder / f"out/bay/pictures/{photo}.jpg") as picture:
        grey = np.asarray(picture.convert("L"), dtype=float)
    down, across = np.mgrid[-5:6, -5:6]
    found = []
    for u, v in near / 4.0:
        rows, columns = int(v) + down, int(u) + across
        weight = np.clip(grey[rows, columns] - 80.0, 0.0, None)
        weight *= np.hypot(columns + 0.5 - u, rows + 0.5 - v) < 4.5  # the wall about the plate is bright too
        found.append([(weight * (columns + 0.5)).sum(), (weight * (rows + 0.5)).sum()] / weight.sum())
    return 4.0 * np.array(found)


def test_the_rendered_photographs_show_what_the_camera_does(bay):
    """The centres of targets, measured in the pixels, orient the photographs and calibrate the lens."""
    window = make_window()
    points = {
        row.number: row.place
        for row in read_control(bay[0] / "out/bay/control.txt")
        if row.number not in ("T05", "T10", "T15", "T20")  # some are cut off by the edge of the wall
    }
    lines = []
    for camera in true_cameras(window):
        seen = camera.see(np.array(list(points.values())))
        measured = discs(bay[0], camera.photo.name, seen)
        lines += [f"{camera.photo.name}, {p}, {x}, {y}" for p, (x, y) in zip(points, measured, strict=True)]
    project = bay[0] / "out/bay/pixels.toml"
    (bay[0] / "out/bay/pixels.txt").write_text("\n".join(lines), encoding="utf-8")
    text = (bay[0] / "out/bay/photographs.toml").read_text(encoding="utf-8")
    text = text.replace("marks.txt", "pixels.txt").replace('"T14"', '"T13"')
    project.write_text(text.replace("sigma = 0.5", "sigma = 0.2"), encoding="utf-8")
    found = orient(read_project(project).network)
    assert found.statistics.sigma0 == pytest.approx(1.0, abs=0.3)
    inner, sigma = found.solution.unknowns.inner[0], np.sqrt(np.diag(found.statistics.cameras))[-7:]
    true = [24.0, 18.06, 11.95, 1.1e-4, -1.4e-7, 1.2e-5, -0.8e-5]
    assert (np.abs(inner[[0, 1, 2, 5, 6, 8, 9]] - true) < 4.0 * sigma).all()


def told(bay, beginning):
    (text,) = [text for command, text in bay[1].items() if command.startswith(beginning)]
    return text


def test_the_project_file_of_the_page_is_that_of_the_sample(bay):
    (shown,) = blocks(PAGE, "toml")
    written = (bay[0] / "out/bay/photographs.toml").read_text(encoding="utf-8")
    assert tomllib.loads(shown) == tomllib.loads(written)


def test_the_photographs_are_oriented_and_their_camera_is_found(bay):
    values = json.loads((bay[0] / "out/bay/photographs/orientation.json").read_text(encoding="utf-8"))
    assert values["sigma0"] == pytest.approx(1.0, abs=0.05)
    true = {"c": 24.0, "xp": 18.06, "yp": 11.95, "K1": 1.1e-4, "K2": -1.4e-7, "P1": 1.2e-5, "P2": -0.8e-5}
    for name, value in true.items():
        found = values["camera"][name]
        assert abs(found["value"] - value) < 4.0 * found["sigma"], name
    assert {one["use"] for one in values["control"]} == {"weighted", "check"}
    assert max(one["test"] for one in values["control"]) < 3.5
    assert "12 photographs, 100 points" in told(bay, "moma orient")
    page = (bay[0] / "out/bay/photographs/report.html").read_text(encoding="utf-8")
    assert page.count("<img") == 2
    folder = bay[0] / "out/bay/photographs"
    assert all((folder / one["picture"]).is_file() for one in values["photos"])
    assert "Suspected marks" in page


def test_stones_from_photographs_are_those_of_the_wall_and_of_the_survey(bay):
    """Corners within three predicted standard deviations of the truth, and of the points of the survey."""
    made = {
        name: {
            one.code: one
            for one in survey_stones(open_survey(bay[0] / f"out/bay/{name}.moma", "moma")).stones
        }
        for name in ("marked", "window")
    }
    window = make_window()
    of_truth, of_survey = [], []
    for stone, measured in zip(window.stones, window.measured, strict=True):
        seen, surveyed = made["marked"][stone.plan.code], made["window"][stone.plan.code]
        true = stone.on_face(window.frame, inset(stone.plan.corners, measured.half_joints))
        for k, corner in enumerate(seen.face.outline):
            nearest = true[np.argmin(np.linalg.norm(true - corner, axis=1))]
            of_truth.append((corner - nearest) / seen.vertex_sigma[k])
            if measured.worn is None:
                i = np.argmin(np.linalg.norm(surveyed.face.outline - corner, axis=1))
                off = corner - surveyed.face.outline[i]
                of_survey.append(off / np.hypot(seen.vertex_sigma[k], surveyed.vertex_sigma[i]))
    for tests in (np.array(of_truth), np.array(of_survey)):
        assert len(tests) > 250
        assert np.mean(np.abs(tests) < 3.0) >= 0.99
        assert np.sqrt(np.mean(tests**2)) == pytest.approx(1.0, abs=0.15)


def test_the_evidence_reaches_the_pixel(bay):
    shown = told(bay, "moma show")
    assert "points marked on oriented photographs" in shown
    lines = [line for line in shown.splitlines() if " px from " in line]
    assert len(lines) == 10  # four corners and six points
    marks = (bay[0] / "out/bay/marked.moma").read_text(encoding="utf-8")
    block = marks[marks.index("stone V4 ") :].split("\nend")[0]
    pixels = [line.split()[-2:] for line in block.splitlines() if line.split()[0] in ("pixel", "mark")]
    assert len(pixels) == 4 + 6 * 3
    for x, y in pixels:
        assert f"({float(x):.2f}, {float(y):.2f}) px" in shown


def test_the_survey_report_names_the_photographs_behind_each_corner(bay):
    report = bay[0] / "out/bay/report"
    page = (report / "report.html").read_text(encoding="utf-8")
    assert "Corners and the rays behind them" in page
    assert "intersection of 3 rays" in page
    assert page.count("<img") == 7
    values = json.loads((report / "survey.json").read_text(encoding="utf-8"))
    names = {f"photographs-1-{name}.png" for name in ("network", "outlines", "photo-residuals")}
    assert names <= set(values["files"])
    stone = next(one for one in values["stones"] if one["code"] == "V4")
    assert [one["role"] for one in stone["evidence"]] == ["point"] * 6 + ["vertex"] * 4
