"""Many files that are one survey: a folder, or one scanned stone a file."""

import pytest

from ground.errors import SurveyError, UsageError
from pipelines.ingest.ingest import ingest
from pipelines.run.check import check_scene
from tests.moma.commands import fails, prints
from tests.survey.scanned_stones import scanned_box, scanned_wall, write_ply

SCENE = """
[scene]
name = "scanned wall (synthetic)"
[materials.stone]
density = 2300.0
young = 10e9
poisson = 0.2
[bodies]
default = "rigid"
fixed = ["kind = support"]
"""


@pytest.fixture
def scans(tmp_path):
    """Thirteen scanned stones in two courses, a file each."""
    scanned_wall(tmp_path / "wall", courses=2, spacing=0.03)
    return tmp_path / "wall"


@pytest.mark.parametrize("named", ["the folder", "all files"])
def test_a_folder_of_scans_is_one_survey_whose_joints_close(tmp_path, scans, named):
    url = f"sqlite:///{tmp_path}/wall.db"
    paths = [scans] if named == "the folder" else sorted(scans.iterdir())
    (file,) = ingest(paths, url, "solids").files
    assert (file.survey, file.stones) == ("wall", {"ashlar": 13})
    assert file.solids is not None
    assert file.solids.convex == 13
    assert all("6 plane faces recognised" in texts[0] for texts in file.solids.remarks.values())
    path = tmp_path / "wall.toml"
    path.write_text(SCENE.replace("kind = support", "code like 'S0%'"))
    report = check_scene(path, url)
    assert report.problems == ()
    assert report.joints is not None
    # 11 head joints, and under each stone of the upper course one bed joint at its ends, two elsewhere
    assert (report.joints.count, report.joints.left_open) == (5 + 6 + 2 + 2 * 5, {})
    assert report.joints.mean_width == pytest.approx(0.010, abs=0.0005)


def test_bad_files_of_a_folder_are_rejects_and_the_others_a_survey(tmp_path, scans):
    points, triangles = scanned_box((0.5, 0.3, 0.24), 0.03)
    write_ply(scans / "open.ply", points + 10.0, triangles[: 4 * len(triangles) // 5])
    write_ply(scans / "small.ply", points + 20.0, triangles[:-3])  # a hole that is covered
    (scans / "torn.ply").write_bytes(b"ply\nformat ascii 1.0\n")
    url, rejects = f"sqlite:///{tmp_path}/wall.db", tmp_path / "rejects.txt"
    with pytest.raises(SurveyError, match=r"open\.ply: solid 'open': the solid is not closed"):
        ingest([scans], url, "solids")
    told = prints(
        "ingest", scans, "--format", "solids", "--keep-going", "--rejects", rejects, "--db", url, "-v"
    )
    assert "14 stones of survey 'wall'" in told
    assert "small: 1 hole covered, the largest" in told
    assert "2 stones rejected" in told
    text = rejects.read_text()
    assert "open.ply: solid 'open': the solid is not closed" in text
    assert "torn.ply:" in text


def test_two_files_with_one_stone_are_refused(tmp_path, scans):
    (tmp_path / "more").mkdir()
    first = sorted(scans.iterdir())[0]
    (tmp_path / "more" / first.name).write_bytes(first.read_bytes())
    with pytest.raises(SurveyError, match="a second of that name"):
        ingest([scans, tmp_path / "more"], f"sqlite:///{tmp_path}/wall.db", "solids")


def test_the_provenance_of_a_stone_names_its_own_file(tmp_path, scans):
    url = f"sqlite:///{tmp_path}/wall.db"
    ingest([scans], url, "solids")
    assert "S0-00.ply" in prints("show", "S0-00", "--db", url)


def test_a_folder_without_surveys_is_refused(tmp_path):
    for format in ("solids", "moma", "csv"):
        with pytest.raises(UsageError, match="the folder has no"):
            ingest([tmp_path], f"sqlite:///{tmp_path}/none.db", format)


def list_of_points(order, first, origin=(20.0, 5.0)):
    """Return a list of four stones in a row along the easting, and of the station that two lists share."""
    rows = [
        (origin[0] + 0.6 * k + right, origin[1], 1.0 + up, f"{first}-{k}:v")
        for k in range(4)
        for right, up in ((0.0, 0.0), (0.5, 0.0), (0.5, 0.3), (0.0, 0.3))
    ]
    rows.append((origin[0] + 2.0, origin[1] - 6.0, 1.5, "S1:s"))
    places = [(n, e) if order == "pnezd" else (e, n) for e, n, _, _ in rows]
    return "".join(
        f"{k} {a} {b} {z} {code}\n"
        for k, ((a, b), (*_, z, code)) in enumerate(zip(places, rows, strict=True))
    )


@pytest.mark.parametrize(
    ("origin", "shared", "reason"),
    [
        ((20.0, 5.0), True, "station S1 is that of a.txt only if"),
        ((5000.0, 1000.0), False, "its stones are beside those of a.txt only if"),
    ],
)
def test_two_lists_of_one_survey_in_different_orders(tmp_path, origin, shared, reason):
    head = tmp_path / "head.moma"
    head.write_text("moma-survey 1\nname wall\ndepth * 0.4 source drilled\n")
    for name, order in (("a", "penzd"), ("b", "pnezd")):
        text = list_of_points(order, name, origin)
        (tmp_path / f"{name}.txt").write_text(text if shared else text.replace("S1", f"S{name}"))
    words = ["--format", "penzd", "--header", head, "--db", f"sqlite:///{tmp_path}/w.db"]
    line = fails(1, "ingest", tmp_path / "a.txt", tmp_path / "b.txt", *words)
    assert reason in line
    assert "--format pnezd (northing first), the other with penzd" in line
    (tmp_path / "b.txt").write_text(list_of_points("penzd", "b", origin))
    assert prints("ingest", tmp_path / "a.txt", tmp_path / "b.txt", *words).count("4 stones") == 2
