"""docs/howto/photographs.md is true: its commands run, and the stones are those of the true wall."""

import json
import tomllib

import numpy as np
import pytest

from pipelines.samples.buildings.window import make_window
from pipelines.samples.measure import inset
from survey.formats.reading import open_survey
from survey.stones import survey_stones
from tests.docs.pages import blocks, ran

PAGE = "docs/howto/photographs.md"


@pytest.fixture(scope="module")
def bay(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photographs")
    said = ran(folder, "".join(blocks(PAGE, "bash")))
    return folder, said


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
    assert page.count("<img") == 6
    values = json.loads((report / "survey.json").read_text(encoding="utf-8"))
    assert {"photographs-1-network.png", "photographs-1-photo-residuals.png"} <= set(values["files"])
    stone = next(one for one in values["stones"] if one["code"] == "V4")
    assert [one["role"] for one in stone["evidence"]] == ["point"] * 6 + ["vertex"] * 4
