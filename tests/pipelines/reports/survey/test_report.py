"""Survey reports: whole or not at all, and true of surveys whose faults are known."""

import json
import subprocess
import sys
from copy import copy
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np
import pytest

from archmodel.quantities import quantities_of
from ground.errors import SurveyError, UsageError
from moma.cli.text.runs_and_surveys import survey_report_lines
from pipelines.ingest.reading_options import reading_options
from pipelines.reports.survey import report as survey_report
from pipelines.reports.survey.campaigns import compare_campaigns, comparison_lines
from pipelines.reports.survey.page import write_survey_page
from pipelines.reports.survey.report import report_surveys
from pipelines.reports.survey.study import study_surveys
from survey.quality.precision import StoneQuality
from tests.moma.commands import answer, fails, prints
from tests.paths import ROOT
from tests.pipelines.reports.page import Page

SAMPLE = ROOT / "data/samples/window/window.moma"
WALL = ROOT / "docs/howto/survey"
CODES = "{block} {kind} {course} {role}"

HEAD = "moma-survey 1\nname {name}\nobserver 0 -9 0\nsigma 0.002\ndepth header 0.4 source guess\n"
SQUARE = "  vertex 0 0 0\n  vertex 0.4 0.001 0\n  vertex 0.4 0 0.3\n  vertex 0 0.001 0.3\n  point 0.2 0 0.1\n"


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    return report_surveys([SAMPLE], tmp_path_factory.mktemp("report") / "window")


@pytest.fixture(scope="module")
def wall(tmp_path_factory):
    options = reading_options(WALL / "head.moma", CODES)
    return report_surveys([WALL / "points.txt"], tmp_path_factory.mktemp("report") / "wall", "pnezd", options)


def survey_file(folder, text, name="wall (x)"):
    path = folder / "wall.moma"
    path.write_text(HEAD.format(name=name) + text, encoding="utf-8")
    return path


def contents(report):
    return json.loads((report.folder / "survey.json").read_text(encoding="utf-8"))


def test_the_folder_holds_what_its_index_names(window):
    names = {entry.name for entry in window.folder.iterdir()}
    pictures = {"elevation.png", "courses.png", "plumb.png", "residuals.png"}
    assert names == {"survey.json", "report.html", *pictures}
    assert set(contents(window)["files"]) == names
    for name in names:
        if name.endswith(".png"):
            assert (window.folder / name).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_numbers_are_those_of_the_sample(window):
    content = contents(window)
    quality = content["quality"]
    assert (quality["stones"], quality["rejects"], len(content["stones"])) == (98, 0, 98)
    assert abs(quality["sigma0"] - 1.0) < 3.0 * quality["sigma0_sigma"]  # its noise is what it says
    assert "is right" in quality["verdict"]
    assert sum(quality["residuals"]["counts"]) == sum(len(one.standardised) for one in window.study.stones)
    (facade,) = content["facades"]
    assert facade["stones"] == 98
    assert content["contradictions"] == []
    first = content["stones"][0]
    assert (first["code"], first["kind"], first["course"], first["facade"]) == (
        "W01-01",
        "header",
        1,
        "facade 1",
    )
    assert first["depth"] == pytest.approx(0.51)
    assert first["depth_origin"] == "stone"


@pytest.mark.parametrize("table", ["courses", "kinds", "stones"])
def test_what_the_page_shows_of_a_table_stands_under_that_name_in_the_file(window, table):
    # heights between beds and stones that differ from their kind come from other tables
    elsewhere = {"courses": {"height"}, "kinds": {"odd"}}.get(table, set())
    rows = contents(window)[table]
    assert rows
    assert set(quantities_of(table)) - elsewhere <= set(rows[0])


def test_the_true_beds_of_the_sample_are_level_and_found_so(window):
    """12 level courses: slopes over their standard deviations are Student's t, of which none exceeds 4."""
    lines = window.study.courses
    assert [line.course for line in lines] == list(range(1, 13))
    (beds,) = window.study.beds
    assert beds.movements == ()
    assert beds.odd == ()
    for line in lines:
        assert beds.finding(line.course).startswith("no movement found; more than ")
    scores = np.array([line.slope / line.slope_sigma for line in lines])
    assert abs(scores).max() < 4.0
    assert 0.3 < (scores**2).mean() < 2.5  # of 12 values with variance 1.4 or so
    truth = json.loads((SAMPLE.parent / "truth.json").read_text(encoding="utf-8"))["stones"]
    for line in lines:
        # the true bed of a course is where the true stones stand: half a joint, 4 to 7.5 mm, below the measured
        beds = [min(v[2] for v in one["vertices"]) for one in truth if one["code"] in line.stones]
        assert 0.002 < line.level - np.median(beds) < 0.0095


def test_the_report_is_one_page_that_needs_nothing_else(window, wall):
    for report in (window, wall):
        page = Page(report.folder / "report.html")
        assert all(source.startswith("data:image/png;base64,") for source in page.sources)
        assert len(page.sources) == 4
        text = " ".join(page.text)
        for heading in ("What to measure again", "Courses", "Kinds", "Stones", report.study.name):
            assert heading in text


def test_what_is_wrong_with_the_synthetic_wall_is_found(wall):
    """The faults that docs/howto/survey/wall.py makes, and nothing else."""
    content = contents(wall)
    (rejected,) = content["rejects"]
    assert rejected["code"] == "G05-03"
    assert "112.423O" in rejected["reason"]
    assert {one["code"] for one in content["remeasure"]} == {"G05-03", "G06-05", "G02-04"}
    assert [one["urgency"] for one in content["remeasure"][:2]] == ["missing", "unchecked"]
    assert {one["code"] for one in content["contradictions"]} == {"G02-04"}
    (blunder,) = [one for one in content["stones"] if one["blunders"]]
    assert blunder["code"] == "G03-02"
    assert blunder["blunders"][0].isdigit()  # as the instrument numbered it
    control = content["inputs"][0]["control"]
    assert control["rejected"] == ["C4"]
    (moved,) = [one for one in control["points"] if one["name"] == "C4"]
    assert abs(moved["residual"][0]) == pytest.approx(0.04, abs=0.012)
    text = "\n".join(survey_report_lines(wall, False))
    for words in ("G05-03", "C4", "G02-04", "it sags by 14."):
        assert words in text


def test_the_sag_of_the_lower_courses_is_measured_with_its_precision(wall):
    """The wall sagged by 14 mm when four courses stood; the four above are straight."""
    (beds,) = wall.study.beds
    for line in wall.study.courses:
        truth = -0.014 if line.course <= 4 else 0.0
        assert abs(line.sag - truth) < 3.5 * line.sag_sigma
        assert beds.finding(line.course).startswith(
            "sags -" if line.course <= 4 else "laid level above older"
        )


def test_the_settlement_of_the_garden_wall_is_dated(wall):
    (movement,) = wall.study.beds[0].movements
    assert (movement.kind, movement.first, movement.last, movement.older_than) == ("sag", 1, 4, 5)
    assert abs(movement.amount + 0.014) < 3.0 * movement.sigma < 0.004
    (written,) = contents(wall)["beds"][0]["movements"]
    assert written["dating"].startswith("older than course 5")
    assert [one["course"] for one in written["courses"]] == list(range(1, 9))


def test_a_survey_says_the_same_in_the_frame_of_the_site(wall, tmp_path):
    """Without its control points it stays in the frame of the instrument; on site coordinates are 5·10⁶ m."""
    head = tmp_path / "head.moma"
    lines = (WALL / "head.moma").read_text(encoding="utf-8").splitlines(keepends=True)
    head.write_text("".join(line for line in lines if not line.startswith("control")), encoding="utf-8")
    bare = study_surveys([WALL / "points.txt"], "pnezd", reading_options(head, CODES))
    site = wall.study
    scale = site.files[0].transform.scale
    assert abs(site.stones[0].outline[0][1]) > 5e6
    assert abs(bare.stones[0].outline).max() < 200.0
    for one, other in zip(bare.stones, site.stones, strict=True):
        assert one.rms == pytest.approx(other.rms / scale, rel=1e-5)
        assert one.blunders == other.blunders
    for one, other in zip(bare.courses, site.courses, strict=True):
        # control points 5 m apart with 3 mm tilt the frame by a milliradian at most
        assert one.slope == pytest.approx(other.slope, abs=1.5e-3)
        assert one.sag == pytest.approx(other.sag, abs=2e-4)
    for one, other in zip(bare.beds, site.beds, strict=True):
        assert [(m.kind, m.first, m.last) for m in one.movements] == [
            (m.kind, m.first, m.last) for m in other.movements
        ]


def test_a_bad_stone_is_in_the_report_and_does_not_stop_it(tmp_path):
    text = (
        f"stone A header course 1\n{SQUARE}end\n"
        f"stone B header course 1\n  station T9\n{SQUARE}end\n"
        "stone C header course 1\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 2 0 0\nend\n"
        "stone D header course 1\n  vertex 0 0 0\n  vertex 1 0\nend\n"
    )
    report = report_surveys([survey_file(tmp_path, text)], tmp_path / "out")
    content = contents(report)
    assert [one["code"] for one in content["stones"]] == ["A"]
    reasons = {one["code"]: one["reason"] for one in content["rejects"]}
    assert set(reasons) == {"B", "C", "D"}
    assert "T9" in reasons["B"]
    assert "line" in reasons["C"]


def test_a_mistyped_kind_is_told_before_the_database_refuses_it(tmp_path):
    path = survey_file(tmp_path, f"stone A heder course 1\n  depth 0.4 source measured\n{SQUARE}end\n")
    report = report_surveys([path], tmp_path / "out")
    (warning,) = contents(report)["warnings"]
    assert warning == "1 stone of an unknown kind 'heder'; did you mean header?"
    assert "did you mean header?" in (report.folder / "report.html").read_text(encoding="utf-8")


def test_a_survey_without_a_single_good_stone_is_still_reported(tmp_path):
    report = report_surveys(
        [survey_file(tmp_path, "stone B header\n  vertex 0 0 0\nend\n")], tmp_path / "out"
    )
    content = contents(report)
    assert (content["stones"], len(content["rejects"])) == ([], 1)
    assert content["quality"]["sigma0"] is None
    assert set(content["files"]) == {"survey.json", "report.html"}


def test_a_course_of_one_corner_is_drawn_where_it_is(tmp_path):
    """The face is a triangle that stands on its side, and one of its two lower corners is worn."""
    places = (
        (0.05, 0.02),
        (0.15, 0.02),
        (0.25, 0.02),
        (0.3, 0.03),
        (0.2, 0.15),
        (0.15, 0.2),
        (0.25, 0.2),
        (0.2, 0.25),
    )
    rows = "".join(f"  point {x} 0 {z}\n" for x, z in places)
    text = f"  vertex 0 0 0\n  vertex 0.4 0.03 0\n  vertex 0.2 0 0.3\n{rows}"
    report = report_surveys(
        [survey_file(tmp_path, f"stone A header course 1\n{text}end\n")], tmp_path / "out"
    )
    (line,) = contents(report)["courses"]
    assert (line["slope"], line["left_out"]) == (None, 1)
    assert "courses.png" in contents(report)["files"]


def test_a_file_that_cannot_be_read_leaves_no_folder(tmp_path):
    bad = tmp_path / "bad.moma"
    bad.write_text("not a survey\n", encoding="utf-8")
    with pytest.raises(SurveyError, match=r"bad\.moma:1"):
        report_surveys([bad], tmp_path / "out")
    with pytest.raises(UsageError, match="no such file"):
        report_surveys([tmp_path / "none.moma"], tmp_path / "out")
    with pytest.raises(UsageError, match="unknown format"):
        report_surveys([SAMPLE], tmp_path / "out", "dxf")
    assert not (tmp_path / "out").exists()


def test_a_report_takes_the_place_of_an_earlier_one_only_when_it_is_complete(tmp_path, monkeypatch):
    path = survey_file(tmp_path, f"stone A header course 1\n{SQUARE}end\n")
    first = contents(report_surveys([path], tmp_path / "out"))

    def fail(*arguments):
        raise RuntimeError("disk full")

    with monkeypatch.context() as patch:
        patch.setattr(survey_report, "write_survey_page", fail)
        with pytest.raises(RuntimeError):
            report_surveys([path], tmp_path / "out")
        with pytest.raises(RuntimeError):
            report_surveys([path], tmp_path / "new")
    assert contents(report_surveys([path], tmp_path / "out")) == first
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["out", "wall.moma"]
    (tmp_path / "out" / "thesis.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(UsageError, match=r"thesis\.txt"):
        report_surveys([path], tmp_path / "out")


def test_names_are_escaped(tmp_path):
    text = f"stone A header course 1\n  depth 0.4 source <script>alert(1)</script> & more\n{SQUARE}end\n"
    text += f"stone <script>B</script> header\n{SQUARE}end\n"
    report = report_surveys([survey_file(tmp_path, text, name="<b>wall & tower")], tmp_path / "out")
    page = Page(report.folder / "report.html")
    assert not page.tags & {"script", "b"}
    for words in ("<script>alert(1)</script> & more", "<script>B</script>", "<b>wall & tower"):
        assert any(words in one for one in page.text)
    assert "&lt;b&gt;wall &amp; tower" in (report.folder / "report.html").read_text(encoding="utf-8")


def marked(value):
    """A copy of frozen dataclasses and what they hold, in which every text begins like a script."""
    if isinstance(value, str) and not isinstance(value, Enum):
        return f"<script>{value}"
    if isinstance(value, dict):
        return {marked(name): marked(one) for name, one in value.items()}
    if isinstance(value, tuple | list):
        return type(value)(map(marked, value))
    if not is_dataclass(value):
        return value
    copied = copy(value)
    for one in fields(value):
        object.__setattr__(copied, one.name, marked(getattr(value, one.name)))
    return copied


def test_no_text_of_a_survey_becomes_markup(wall, tmp_path):
    """Codes, kinds, zones, reasons, control points: whatever the page shows."""
    write_survey_page(tmp_path / "report.html", marked(wall.study), {}, "<script>")
    page = Page(tmp_path / "report.html")
    assert "script" not in page.tags
    assert sum("<script>" in one for one in page.text) > 5 * len(wall.study.stones)
    for code in ("G03-02", "C4", "G05-03"):
        assert any(f"<script>{code}" in one for one in page.text)


def test_several_files_are_one_survey_with_a_picture_per_facade(tmp_path):
    other = tmp_path / "other.moma"
    turned = SQUARE.replace(" 0.001 ", " 0 ")  # the same stone lying: a face that looks up
    lying = "".join(
        f"  {word} {x} {z} {y}\n" for word, x, y, z in (line.split() for line in turned.splitlines())
    )
    other.write_text(
        HEAD.format(name="floor").replace("0 -9 0", "0 0 9") + f"stone F header\n{lying}end\n",
        encoding="utf-8",
    )
    first = survey_file(tmp_path, f"stone A header course 1\n{SQUARE}end\n")
    content = contents(report_surveys([first, other], tmp_path / "out"))
    assert [one["name"] for one in content["facades"]] == ["facade 1", "faces up"]
    assert content["facades"][1]["azimuth"] is None
    assert {"elevation.png", "elevation-2.png", "courses.png"} <= set(content["files"])
    assert [one["stones"] for one in content["inputs"]] == [1, 1]


def test_stones_on_a_photograph_say_where_their_plane_is_from(tmp_path):
    report = report_surveys([WALL / "gable.moma"], tmp_path / "gable")
    content = contents(report)
    lifted = [one for one in content["stones"] if one["source"] == "photograph"]
    assert (len(lifted), len(content["stones"])) == (7, 14)
    assert all(one["provenance"].startswith("photograph P1, in the plane of ") for one in lifted)
    assert all(one["sigma0"] is None for one in lifted)
    measured = max(one["dimension_sigma"] for one in content["stones"] if one["source"] == "points")
    assert (
        min(one["dimension_sigma"] for one in lifted) > measured
    )  # 1.5 px are 4 mm on this wall, a point is 2 mm
    for one in lifted:  # stones 0.63 m by 0.30 m
        for value, truth in ((one["length"], 0.63), (one["height"], 0.30)):
            assert (
                abs(value / content["inputs"][0]["control"]["scale"] - truth) < 4.0 * one["dimension_sigma"]
            )
    assert "photograph P1" in (report.folder / "report.html").read_text(encoding="utf-8")


def test_solids_have_an_elevation_and_no_residuals(tmp_path):
    """A cube of 0.4 m, modelled: nothing of it was measured."""
    corners = [(x, y, z) for z in (0, 0.4) for y in (0, 0.4) for x in (0, 0.4)]
    sides = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (2, 4, 8, 6), (4, 3, 7, 8), (3, 1, 5, 7)]
    lines = [
        "o A1:header",
        *(f"v {x} {y} {z}" for x, y, z in corners),
        *(f"f {' '.join(map(str, side))}" for side in sides),
    ]
    (tmp_path / "cube.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "head.moma").write_text("moma-survey 1\nobserver 0.2 -9 0.2\n", encoding="utf-8")
    options = reading_options(tmp_path / "head.moma")
    report = report_surveys([tmp_path / "cube.obj"], tmp_path / "out", "solids", options)
    content = contents(report)
    (stone,) = content["stones"]
    assert (stone["source"], stone["depth_origin"], stone["kind"]) == ("solid", "solid", "header")
    assert (stone["length"], stone["depth"]) == pytest.approx((0.4, 0.4))
    assert stone["dimension_sigma"] is None
    assert content["quality"]["sigma0"] is None
    text = "\n".join(survey_report_lines(report, True))
    assert "nan" not in text
    assert "nothing was measured" in text
    assert set(content["files"]) == {"survey.json", "report.html", "elevation.png"}
    assert "nan" not in " ".join(content["quality"]["verdict"].split())


def test_the_files_of_the_how_to_are_what_its_script_makes(tmp_path):
    subprocess.run([sys.executable, WALL / "wall.py", tmp_path], check=True)
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (WALL / path.name).read_bytes(), path.name
    assert {path.name for path in tmp_path.iterdir()} == {"points.txt", "head.moma", "gable.moma"}


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_command_needs_no_database_and_says_where_its_report_lies(place):
    text = prints("survey-report", SAMPLE)
    assert "out/survey-window/report.html" in text
    assert "98 stones" in text
    assert [entry.name for entry in place.iterdir()] == ["out"]


def test_the_command_prints_json_for_programs_and_takes_the_options_of_readers(place):
    content = answer(
        "survey-report", WALL / "points.txt", "--format", "pnezd", "--codes", CODES,
        "--header", WALL / "head.moma", "--sigma", "0.004", "--out", "wall",
    )  # fmt: skip
    assert content == json.loads((place / "wall/survey.json").read_text(encoding="utf-8"))
    assert "sigma is too large" in content["quality"]["verdict"]  # 2 mm are right, 4 were stated
    assert content["quality"]["sigma"] == pytest.approx(0.004, rel=1e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.moma",), "no such file"),
        ((SAMPLE, "--sigma", "0"), "--sigma"),
        ((SAMPLE, "--header", "none"), "--header"),
        ((SAMPLE, "--out", ROOT), "holds files that no run of MOMA wrote"),
    ],
)
def test_wrong_use_is_told_in_one_line(place, arguments, words):
    assert words in fails(2, "survey-report", *arguments)
    assert list(place.iterdir()) == []


def test_faces_are_judged_before_any_depth_is_known(tmp_path):
    path = survey_file(tmp_path, f"stone A stretcher\n{SQUARE}end\nstone B header\n{SQUARE}end\n")
    report = report_surveys([path], tmp_path / "report")
    assert not report.study.rejects
    a, b = report.study.stones
    assert (a.depth, a.depth_sigma, a.depth_origin) == (None, None, "none")
    assert (b.depth, b.depth_origin) == (0.4, "kind")
    assert a.rms == b.rms
    assert any("1 stones without a depth" in line for line in survey_report_lines(report, False))
    (stone,) = [one for one in contents(report)["stones"] if one["code"] == "A"]
    assert stone["depth"] is None


def settled_survey(folder, seed=5):
    """A wall of eight courses whose right half sank by 8 mm, stone 4-7 with three points only."""
    rng = np.random.default_rng(seed)
    lines = [HEAD.format(name="pier").replace("observer 0 -9 0", "observer 3 -9 1")]
    for course in range(1, 9):
        for k in range(10):
            start = 0.5 * k - 0.25 * (course % 2)
            low = 0.3 * course - (0.008 if start > 2.3 else 0.0)
            corners = [(start, low), (start + 0.49, low), (start + 0.49, low + 0.29), (start, low + 0.29)]
            inside = [(start + 0.49 * u, low + 0.29 * v) for u, v in rng.random((5, 2)).tolist()]
            bare = (course, k) == (4, 6)
            places = [("vertex", one) for one in (corners[:3] if bare else corners)]
            places += [] if bare else [("point", one) for one in inside]
            lines.append(f"stone {course}-{k + 1} header course {course}")
            for word, (x, z) in places:
                noise = rng.normal(0, 0.002, 3)
                lines.append(f"  {word} {x + noise[0]:.5f} {noise[1]:.5f} {z + noise[2]:.5f}")
            lines.append("end")
    path = folder / "pier.moma"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_the_report_names_what_moved_and_what_is_excluded(tmp_path):
    report = report_surveys([settled_survey(tmp_path)], tmp_path / "out")
    content = contents(report)
    (movement,) = content["beds"][0]["movements"]
    assert (movement["kind"], movement["first"], movement["last"]) == ("step", 1, 8)
    assert movement["amount"] == pytest.approx(-0.008, abs=4.0 * movement["sigma"])
    assert movement["text"].startswith("settlement: its right part")
    assert {one["finding"][:7] for one in content["courses"]} == {"settled"}
    assert content["faces"][0]["movements"] == []
    assert content["faces"][0]["excluded"] > 0.0
    assert [one["code"] for one in content["measure_again"]] == ["4-7"]
    assert len(content["faces"][0]["stones"]) == 80
    text = " ".join(Page(report.folder / "report.html").text)
    for words in ("What has moved", "settlement: its right part", "Quality of the masonry", "4-7"):
        assert words in text
    lines = "\n".join(survey_report_lines(report, False))
    assert "facade 1: settlement: its right part" in lines
    assert "facade 1, face: no movement found; more than" in lines
    assert "measure again, what changes a verdict first:" in lines


def test_a_doubtful_stone_on_which_a_verdict_depends_says_so():
    """A row of stones whose only settlement is that of few: without one of them it is not found."""
    from pipelines.reports.survey.study import _movements, _verdicts
    from survey.quality.courses import measure_courses
    from survey.quality.facades import facades_of
    from tests.survey.quality.departures.walls_by_hand import wall

    stones = wall(4, lambda s, c: -0.05 if s > 5.2 and c <= 2 else 0.0, beds=0.001, sigma=0.001)
    facades = facades_of(stones)
    beds, faces = _movements(stones, facades, measure_courses(stones, facades), ())
    assert len(beds[0].movements[0].stones) == 3
    ask = _verdicts(stones, facades, (), beds, faces)
    assert (ask("1-12") or "").endswith("which is not found without it")
    assert (ask("5-3"), ask("none")) == (None, None)


def test_a_frame_that_control_points_may_have_tilted_leans_no_wall():
    from pipelines.reports.survey.study import _movements
    from survey.quality.courses import measure_courses
    from survey.quality.facades import facades_of
    from tests.survey.quality.departures.walls_by_hand import wall

    stones = wall(2, out=lambda s, c: 0.01 * (c - 1) * 0.3 / 2.1)
    facades = facades_of(stones)
    for axis, leans in (
        (0, False),
        (1, True),
        (2, True),
    ):  # the wall runs along x: only a turn about x leans it
        tilt = np.zeros((3, 3))
        tilt[axis, axis] = 0.01**2
        lines = measure_courses(stones, facades, [tilt])
        _, (face,) = _movements(stones, facades, lines, [tilt])
        assert bool(face.movements) == leans


def test_two_campaigns_of_one_wall_are_not_pooled(tmp_path):
    def survey(name, *codes):
        stones = "".join(f"stone {code} header course 1\n{SQUARE}end\n" for code in codes)
        path = tmp_path / f"{name}.moma"
        path.write_text(HEAD.format(name=name) + stones, encoding="utf-8")
        return path

    first, second, other = survey("first", "A1", "A2"), survey("second", "A2"), survey("other", "B1")
    options = reading_options(None, None)
    with pytest.raises(
        UsageError, match=r"1 of its 1 stones a second time, after first\.moma: A2"
    ) as refused:
        study_surveys([first, second], "moma", options)
    assert "--since EARLIER" in str(refused.value.remedy)
    assert len(study_surveys([first, other], "moma", options).stones) == 3
    # said which is the earlier one, they are compared, and the later one alone is judged
    study = study_surveys([second], "moma", options, since=[first])
    assert [stone.code for stone in study.stones] == ["A2"]
    assert study.since is not None
    assert (study.since.name, study.since.gone, study.since.moved) == ("first", ("A1",), ())


def campaign(chance: np.random.Generator, moved: dict[str, Any], blur: float = 0.0) -> list[StoneQuality]:
    """Forty stones of a wall, measured with 1 mm; corners found with a scatter more along the face."""
    square = np.array([[0.0, 0, 0], [0.4, 0, 0], [0.4, 0, 0.3], [0.0, 0, 0.3]])
    blank = dict.fromkeys(StoneQuality.__dataclass_fields__)
    return [
        StoneQuality(
            **blank
            | {
                "code": f"S{k}",
                "normal": np.array([0.0, -1.0, 0.0]),
                "outline": square
                + [0.5 * k, chance.normal(0.0, 5e-4), 0.0]
                + chance.normal(0.0, 1e-3, (4, 3)) * [1, 0, 1]
                + chance.normal(0.0, blur, 3) * [1, 0, 1]
                + moved.get(f"S{k}", np.zeros(3)),
                "corner_sigma": np.full((4, 3), 1e-3),
                "tilt_sigma": 0.05,
                "offset_sigma": 5e-4,
            }
        )
        for k in range(40)
    ]


def test_stones_that_moved_between_two_campaigns_are_found_with_their_sigma() -> None:
    chance = np.random.default_rng(11)
    sunk = {"S7": np.array([0.0, 0.0, -0.012]), "S9": np.array([0.0, -0.008, 0.0])}
    found = compare_campaigns("1992", ["a"], campaign(chance, {}), campaign(chance, sunk))
    assert {one.code for one in found.moved} == {"S7", "S9"}
    by_code = {one.code: one for one in found.stones}
    assert by_code["S7"].displacement.distance == pytest.approx(0.012, abs=0.002)
    assert by_code["S9"].outwards == pytest.approx(0.008, abs=0.002)
    # the mean of four corners, twice
    assert by_code["S7"].displacement.sigma == pytest.approx(1e-3 / 2 * 2**0.5, rel=0.25)
    assert found.scatter < 4e-4
    first, *_ = comparison_lines(found)
    assert first.startswith("since 1992: 2 of 40 stones moved: S7 by 1")


def test_corners_that_are_not_the_same_points_make_no_movement() -> None:
    """A scatter of corners by 4 mm is found among the stones, and allowed for."""
    chance = np.random.default_rng(12)
    found = compare_campaigns("1992", ["a"], campaign(chance, {}, 0.004), campaign(chance, {}, 0.004))
    assert found.scatter == pytest.approx(0.004, rel=0.25)
    assert len(found.moved) <= 2
    everything = {f"S{k}": np.array([0.0, 0.02, 0.0]) for k in range(40)}
    shifted = compare_campaigns("1992", ["a"], campaign(chance, {}), campaign(chance, everything))
    assert any("the frames of both campaigns differ" in line for line in comparison_lines(shifted))
