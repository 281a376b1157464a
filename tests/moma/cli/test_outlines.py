"""`moma outlines`: files of stones that ingest takes, corrections that come back, marks about others."""

import json

import numpy as np
import pytest
from PIL import Image, ImageDraw

from survey.clouds.outlines.reading import read_outlines
from tests.moma.commands import invoke, prints
from tests.survey.clouds.pictures.walls import courses, painted

pytest.importorskip("shapely")
pytestmark = pytest.mark.slow

HOSTILE = '</script><script>alert(1)</script><img src=x onerror="alert(2)">'


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("outlines")
    boxes, shape = courses()
    Image.fromarray(painted(boxes, shape)).save(folder / "wall.png")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        said = prints("outlines", "wall.png", "--pixel", 0.004, "--out", "drawn")
    return folder, boxes, said


def test_all_files_hold_the_same_stones(drawn):
    folder, boxes, said = drawn
    assert f"{len(boxes)} stones in 4 courses" in said
    read = [
        read_outlines(folder / "drawn" / f"outlines.{one}").outlines for one in ("geojson", "gpkg", "dxf")
    ]
    codes = [[one.code for one in outlines] for outlines in read]
    assert codes[0] == codes[1] == codes[2]
    for other in read[1:]:
        for one, same in zip(read[0], other, strict=True):
            np.testing.assert_allclose(one.corners, same.corners, atol=2e-5)
    first = read[1][0].said
    assert (first.course, first.kind, first.notes["evidence"]) == (1, "header", "proposed from image")
    assert 0.5 < first.score <= 1.0
    assert 0.0005 < first.sigma < 0.006


def test_ingest_takes_them_with_their_evidence(drawn, monkeypatch):
    folder, boxes, _ = drawn
    monkeypatch.chdir(folder)
    said = prints("ingest", "--outlines", "drawn/outlines.gpkg", "--depth", 0.3, "--db", "sqlite:///walls.db")
    assert f"{len(boxes)} stones" in said
    shown = prints("show", "C02-03", "--db", "sqlite:///walls.db")
    assert "proposed from image" in shown


def test_corrections_come_back_and_supersede(drawn, monkeypatch):
    folder, boxes, _ = drawn
    monkeypatch.chdir(folder)
    document = json.loads((folder / "drawn/outlines.geojson").read_text(encoding="utf-8"))
    kept = document["features"][1:]
    kept[0]["properties"] |= {"kind": "quoin", "evidence": "corrected by hand"}
    (folder / "corrected.geojson").write_text(json.dumps(document | {"features": kept}), encoding="utf-8")
    found = json.loads(
        prints(
            "outlines",
            "wall.png",
            "--pixel",
            0.004,
            "--corrected",
            "corrected.geojson",
            "--out",
            "back",
            "--json",
        )
    )
    assert (found["stones"], found["corrected"], found["superseded"]) == (len(boxes) - 1, 1, ["C01-01"])
    assert found["kinds"]["quoin"] == 1


def test_outlines_of_others_are_marked_where_the_picture_contradicts_them(drawn, monkeypatch):
    folder, boxes, _ = drawn
    monkeypatch.chdir(folder)
    labels = Image.new("I;16", courses()[1][::-1])
    pen = ImageDraw.Draw(labels)
    for number, (x0, y0, x1, y1) in enumerate(boxes, start=1):
        pen.rectangle((x0, y0, x1 - 1, y1 - 1), fill=number)
    # the second runs across the joint to the third, the ninth is parted in two
    pen.rectangle((boxes[1][0], boxes[1][1], boxes[2][2], boxes[1][3] - 1), fill=2)
    x0, y0, x1, y1 = boxes[9]
    pen.rectangle(((x0 + x1) // 2, y0, x1 - 1, y1 - 1), fill=99)
    labels.save("labels.png")
    prints("outlines", "wall.png", "--pixel", 0.004, "--review", "labels.png", "--out", "reviewed")
    page = (folder / "reviewed/outlines.html").read_text(encoding="utf-8")
    data = json.loads(page.split('id="data">')[1].split("</script>")[0])
    reasons = {(one["text"].split(":")[0], *one["stones"]) for one in data["doubts"]}
    assert ("leak", "S002") in reasons
    assert ("split", "S010", "S099") in reasons
    assert len(reasons) == 2


def test_a_picture_without_a_wall_is_refused_with_exit_code_1(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Image.fromarray(np.random.default_rng(1).integers(90, 170, (200, 200, 3)).astype(np.uint8)).save(
        "lawn.png"
    )
    done = invoke("outlines", "lawn.png", "--out", "drawn")
    assert done.exit_code == 1
    assert "nothing is proposed" in done.stdout
    assert "no wall" in done.stderr
    assert not (tmp_path / "drawn/outlines.gpkg").exists()


def test_hostile_codes_stay_text_in_the_page(drawn):
    from pipelines.reports.outlines.page import PageDoubt, editor_html

    stone = {"code": HOSTILE, "ring": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], "said": {"kind": HOSTILE}}
    page = editor_html(
        HOSTILE,
        np.zeros((4, 4, 3), np.uint8),
        np.eye(2),
        np.zeros(2),
        [stone],
        [PageDoubt((HOSTILE,), HOSTILE, 1.0, 0, 0)],
        [],
    )
    assert "<img src" not in page
    assert page.count("<script") == 2
    assert "alert(1)</script>" not in page
