"""Clouds, masks and views on the command line."""

import csv
import json
import shlex
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from tests.moma.commands import answer, fails, prints
from tests.survey.clouds import scans
from tests.survey.clouds.test_outlines import label_image

HEAD = "moma-survey 1\nname garden wall (synthetic)\ndepth * 0.3 sigma 0.03 source synthetic\n"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with a cloud, outlines, a frame and a header."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MOMA_DB", raising=False)
    scans.las(tmp_path / "scan.laz", scans.scan())
    scans.geojson(tmp_path / "stones.geojson", course=[1, 1, 1, 2, 2, 2])
    scans.frame(tmp_path)
    (tmp_path / "head.moma").write_text(HEAD, encoding="utf-8")
    return tmp_path


CLOUD = (
    *("--cloud", "scan.laz", "--outlines", "stones.geojson", "--wall", "wall.toml", "--header"),
    "head.moma",
)


def test_a_cloud_with_outlines_is_ingested(place):
    said = prints("ingest", *CLOUD)
    assert "stones.geojson: 6 stones of survey 'garden wall (synthetic)' (6 ashlar)" in said
    rows = answer("query", "ashlar", "--where", "course = 2")
    assert [one["code"] for one in rows] == ["B1", "B2", "B3"]
    notes = prints("show", "B2")
    assert "independent ones" in notes
    assert "scan.laz" in notes
    assert "0.3 m" in notes


def test_the_review_is_a_table(place):
    shapes = [ring - (0.1, 0.0) if k == 1 else ring for k, ring in enumerate(scans.rings())]
    scans.geojson(place / "stones.geojson", shapes)
    said = prints("ingest", *CLOUD, "--review", "review.csv")
    assert "look at 1: 1 overlap" in said
    (row,) = csv.DictReader((place / "review.csv").read_text(encoding="utf-8").splitlines())
    assert (row["code"], row["reason"]) == ("A1", "overlap")


def test_rejected_outlines_are_ready_for_correction(place):
    shapes = [*scans.rings(), scans.rings()[0] + (0.0, 3.0)]
    scans.geojson(place / "stones.geojson", shapes, [*scans.CODES, "C1"])
    assert "too few points: 0 within its outline" in fails(1, "ingest", *CLOUD)
    said = prints("ingest", *CLOUD, "--keep-going")
    assert "1 stones rejected, to be corrected in stones.rejects.geojson" in said
    assert len(answer("query", "ashlar")) == 6
    rejects = json.loads((place / "stones.rejects.geojson").read_text(encoding="utf-8"))
    (feature,) = rejects["features"]
    assert feature["properties"]["code"] == "C1"
    ring = np.array(feature["geometry"]["coordinates"][0]) - (0.0, 3.0)
    feature["geometry"]["coordinates"] = [(ring + np.array([0.0, 0.6])).tolist()]  # still above the wall
    (place / "stones.rejects.geojson").write_text(json.dumps(rejects), encoding="utf-8")
    again = [word.replace("stones.geojson", "stones.rejects.geojson") for word in CLOUD]
    assert "none of its" in fails(1, "ingest", *again)
    scans.geojson(place / "other.rejects.geojson")
    mine = [word.replace("stones.geojson", "other.geojson") for word in CLOUD]
    scans.geojson(place / "other.geojson", shapes, [*scans.CODES, "C1"])
    assert "is not a file of rejected outlines" in fails(2, "ingest", *mine, "--keep-going")


def test_several_clouds_are_one_survey(place):
    points = scans.scan()
    for k in range(2):
        scans.xyz(place / f"part{k}.xyz", points[k::2])
    clouds = ("--cloud", "part0.xyz", "--cloud", "part1.xyz")
    assert "6 stones of survey" in prints("ingest", *clouds, *CLOUD[2:])


def test_masks_alone_are_ingested(place):
    Image.fromarray(np.where(label_image() > 0, 255, 0).astype(np.uint8)).save(place / "wall.png")
    (place / "stones.geojson").unlink()
    said = prints("ingest", "--masks", "wall.png", "--size", "1.5x0.6", "--depth", 0.2)
    assert "wall.png: 6 stones of survey 'wall' (6 ashlar)" in said
    assert [one["depth"] for one in answer("query", "ashlar")] == [0.2] * 6


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--cloud scan.laz", "--cloud without --outlines; name the outlines of its stones"),
        ("--outlines stones.geojson", "--outlines without --cloud; give --cloud FILE and --outlines FILE"),
        ("--outlines stones.geojson --depth 0.2 --slab 0.1", "--slab with --outlines; leave it out"),
        ("--outlines stones.geojson --depth 0.2 head.moma", "survey files beside --outlines"),
        ("--size 1x1 head.moma", "--size without --masks; give --masks or --outlines too"),
        ("head.moma --cloud scan.laz --outlines stones.geojson", "survey files beside --cloud"),
        ("--cloud scan.laz --masks wall.png", "--masks beside --cloud"),
        ("--masks wall.png --slab 0.1", "--slab with --masks; leave it out"),
        ("--cloud scan.laz --outlines stones.geojson --size 1x1", "--size with --cloud"),
        ("--cloud scan.laz --outlines stones.geojson --slab 100", "--slab: is 100 m; give it in metres"),
        ("--cloud scan.laz --outlines stones.geojson", "the outlines lie in a plane"),
        ("--masks stones.geojson --size 1", "--size: is '1'; give width and height"),
        ("--cloud no.laz --outlines stones.geojson --wall wall.toml", "no.laz: no such file"),
        ("head.moma --review r.csv", "--review without --cloud"),
        ("", "no survey file"),
    ],
)
def test_wrong_use_is_told_in_a_line(words, said, place):
    assert said in fails(2, "ingest", *shlex.split(words))


def test_a_report_is_drawn_on_the_orthophoto(place):
    drawn = answer(
        "cloud", "scan.laz", "--wall", "wall.toml", "--pixel", 0.01, "--section", "z=10.2", "--out", "views"
    )
    assert drawn["points"] == len(scans.scan())
    assert [one["name"] for one in drawn["sections"]] == ["z=10.2"]
    assert all((place / path).is_file() for path in drawn["files"])
    text = (place / "views/sections.csv").read_text(encoding="utf-8").splitlines()
    assert text[0] == "section,line,x,y,z"
    assert text[1].endswith(",10.2000")
    import ezdxf

    lines = ezdxf.readfile(place / "views/sections.dxf").modelspace().query("POLYLINE")
    assert {one.dxf.layer for one in lines} == {"section_z_10.2"}
    said = prints("survey-report", *CLOUD, "--orthophoto", "views/wall.png", "--out", "report")
    assert "6 stones of survey" in said
    assert "the scatter cannot check it" in said
    plain = prints("survey-report", *CLOUD, "--out", "plain")
    assert "elevation.png" in plain
    pictures = [
        np.asarray(Image.open(place / f"{name}/elevation.png").convert("RGB")) for name in ("report", "plain")
    ]
    assert pictures[0].shape == pictures[1].shape
    assert (pictures[0] != pictures[1]).any(axis=2).mean() > 0.1


def test_an_orthophoto_without_its_place_is_told(place):
    Image.fromarray(np.zeros((4, 4), np.uint8)).save(place / "photo.png")
    words = ("survey-report", *CLOUD, "--orthophoto", "photo.png")
    assert "nothing says where it lies in its plane; put its world file" in fails(2, *words)
    (place / "photo.pgw").write_text("1\n0\n0\n-1\n0\n0\n", encoding="ascii")
    assert "put the frame of its wall beside it, photo.toml" in fails(2, *words)


def test_views_go_into_a_folder_of_their_own(place):
    prints("cloud", "scan.laz", "--wall", "wall.toml", "--pixel", 0.02, "--out", "views")
    prints("cloud", "scan.laz", "--wall", "wall.toml", "--pixel", 0.02, "--out", "views")
    (place / "views/stones.gpkg").write_bytes(b"drawn for hours")
    assert "holds files that no run of MOMA wrote (stones.gpkg)" in fails(
        2, "cloud", "scan.laz", "--wall", "wall.toml", "--pixel", 0.02, "--out", "views"
    )


def test_ingest_of_a_plain_survey_loads_nothing_of_clouds():
    code = (
        "import sys, pipelines.ingest.ingest, moma.cli;"
        "print(*[one for one in sys.modules if one.split('.')[0] in"
        " ('laspy', 'lazrs', 'pye57', 'pyogrio', 'shapely', 'ezdxf', 'PIL', 'contourpy')"
        " or one.startswith('survey.clouds._kernels')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
