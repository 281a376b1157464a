"""Stones of the native format that are marked on oriented photographs."""

import numpy as np
import pytest

from survey.formats.native.reader import open_moma, read_moma
from survey.orientation.bundle.orient import orient
from survey.orientation.formats.result import orientation_values, write_orientation
from survey.orientation.projection import project
from survey.records.survey import Reject
from survey.registration.stones import survey_stones
from synthetic.formats import write_moma
from tests.survey.orientation.synthetic_block import noisy, spread_points, wall_block, with_points

HEAD = "moma-survey 1\norientation orientation.json\ndepth * 0.4 source guess\n{more}\n"
CORNERS = np.array([[3.0, 0.0, 1.5], [3.6, 0.0, 1.5], [3.6, 0.0, 1.9], [3.0, 0.0, 1.9]])
POINTS = np.array([[3.1, 0.0, 1.6], [3.5, 0.0, 1.6], [3.5, 0.0, 1.8], [3.1, 0.0, 1.8]])


@pytest.fixture(scope="module")
def result():
    truth = wall_block(columns=3, points=40)
    return orient(noisy(with_points(truth, spread_points(truth, 6), 0.0005), np.random.default_rng(1), 0.2))


def lines(result, places, role, photos, first="q"):
    network = result.network
    out = []
    for k, place in enumerate(places, start=1):
        for f in photos:
            photo = network.photos[f]
            x, y = project(network.cameras[0], photo.rotation, photo.station, place[None])[0]
            out.append(f"  mark {first}{k} {role} {photo.name} {x:.3f} {y:.3f}")
    return out


def stones(result, folder, *bodies, more=""):
    write_orientation(folder / "orientation.json", orientation_values(result))
    text = HEAD.format(more=more)
    for k, body in enumerate(bodies, start=1):
        text += "\n".join(["", f"stone S{k} header course 1", *body, "end", ""])
    (folder / "marked.moma").write_text(text, encoding="utf-8")
    return list(survey_stones(open_moma(folder / "marked.moma")).stones)


def test_corners_on_two_photographs_are_intersected(result, tmp_path):
    (stone,) = stones(
        result,
        tmp_path,
        lines(result, CORNERS, "vertex", (0, 3, 5)) + lines(result, POINTS, "point", (1, 4), "p"),
    )
    np.testing.assert_allclose(np.sort(stone.face.outline, axis=0), np.sort(CORNERS, axis=0), atol=0.002)
    assert stone.face.fit.normal[1] < -0.99  # towards the photographs
    evidence = stone.face.record.evidence
    assert [one["role"] for one in evidence] == ["point"] * 4 + ["vertex"] * 4
    assert [len(one["rays"]) for one in evidence] == [2] * 4 + [3] * 4
    assert (stone.vertex_sigma[:4] > 1e-4).all()
    assert (stone.vertex_sigma[:4] < 2e-3).all()


def test_corners_on_one_photograph_meet_the_plane_of_the_other_points(result, tmp_path):
    points = lines(result, POINTS, "point", (0, 2, 5), "p")
    drawn = [line.split()[-2:] for line in lines(result, CORNERS, "vertex", (1,))]
    name = result.network.photos[1].name
    polygon = [f"  photo {name}", *(f"  pixel {x} {y}" for x, y in drawn)]
    marked, pixels = stones(
        result, tmp_path, lines(result, CORNERS, "vertex", (1,)) + points, polygon + points
    )
    np.testing.assert_allclose(marked.face.outline, pixels.face.outline, atol=1e-12)
    np.testing.assert_allclose(np.sort(marked.face.outline, axis=0), np.sort(CORNERS, axis=0), atol=0.003)
    assert "on the plane of 4 points" in marked.face.record.evidence[-1]["how"]


def test_points_measured_in_space_define_the_plane_too(result, tmp_path):
    measured = ["  sigma 0.001", *("  point {:.4f} {:.4f} {:.4f}".format(*place) for place in POINTS)]
    (stone,) = stones(result, tmp_path, measured + lines(result, CORNERS, "vertex", (1,)))
    np.testing.assert_allclose(np.sort(stone.face.outline, axis=0), np.sort(CORNERS, axis=0), atol=0.003)
    assert stone.face.record.evidence[0]["how"] == "measured in space"


def test_stones_share_a_surface_that_the_points_of_all_define(result, tmp_path):
    others = [POINTS + np.array([dx, 0.0, 0.0]) for dx in (0.0, 1.0)]
    first = lines(result, others[0], "point", (0, 2, 5), "p") + lines(result, CORNERS, "vertex", (1,))
    second = lines(result, others[1], "point", (0, 2, 5), "p") + lines(
        result, CORNERS + np.array([1.0, 0.0, 0.0]), "vertex", (1,)
    )
    bare = lines(result, CORNERS + np.array([0.0, 0.0, 1.0]), "vertex", (1,))
    made = stones(
        result,
        tmp_path,
        *([*body, "  on wall"] for body in (first, second, bare)),
        more="surface wall plane sigma 0.002",
    )
    assert all("on the plane of 8 points" in one.face.record.evidence[-1]["how"] for one in made)
    np.testing.assert_allclose(
        np.sort(made[2].face.outline, axis=0), np.sort(CORNERS + np.array([0, 0, 1.0]), axis=0), atol=0.004
    )


def test_a_survey_with_marks_is_written_and_read_back(result, tmp_path):
    body = lines(result, CORNERS, "vertex", (0, 3)) + lines(result, POINTS, "point", (1, 4), "p")
    body[0] += " sigma 0.25"
    stones(result, tmp_path, [*body, "  on wall"], more="surface wall cylinder sigma 0.002")
    survey = read_moma(tmp_path / "marked.moma")
    write_moma(survey, tmp_path / "again.moma")
    back = read_moma(tmp_path / "again.moma")
    assert (back.head.orientation, [(s.name, s.kind, s.sigma) for s in back.head.surfaces]) == (
        "orientation.json",
        [("wall", "cylinder", 0.002)],
    )
    for one, other in zip(survey.blocks[0].marks, back.blocks[0].marks, strict=True):
        assert (one.name, one.role, one.photograph, one.image.tolist(), one.sigma) == (
            other.name, other.role, other.photograph, other.image.tolist(), other.sigma,
        )  # fmt: skip
    assert back.blocks[0].surface == "wall"


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (["mark c1 corner P01 1 2"], "point c1 is 'corner'"),
        (["mark c1 vertex P01 1"], "mark has 1 coordinates"),
        (["mark c1 vertex P01 1 2", "mark c1 vertex P01 3 4"], "marked twice on P01, first on line 7"),
        (["mark c1 vertex P01 1 2", "mark c1 point P02 3 4"], "is a point here and a vertex on line 7"),
        (["on vault"], "no surface vault"),
        (["mark c1 vertex P01 1 2"] + ["vertex 0 0 0"] * 3, "marked vertices and vertices in space"),
        (["mark c1 vertex P01 1 2"], "stone S1 has 1 vertices"),
    ],
)
def test_mistakes_in_a_stone(result, tmp_path, body, message):
    (refused,) = stones(result, tmp_path, [f"  {line}" for line in body])
    assert isinstance(refused, Reject)
    assert message in str(refused.error)
    assert f"{tmp_path / 'marked.moma'}:" in str(refused.error)


def test_mistakes_that_the_photographs_show(result, tmp_path):
    good = lines(result, CORNERS, "vertex", (0, 3))
    unknown = [good[0].replace("P01", "P99"), *good[1:]]
    outside = [" ".join([*good[0].split()[:-2], "9000", "100"]), *good[1:]]
    apart = [" ".join([*good[0].split()[:-1], "3999"]), *good[1:]]
    few = lines(result, CORNERS, "vertex", (1,)) + lines(result, POINTS[:2], "point", (0, 2), "p")
    messages = ["no photograph P99", "lies outside photograph P01", "miss|behind", "2 points define no plane"]
    import re

    made = stones(result, tmp_path, unknown, outside, apart, few)
    for one, message in zip(made, messages, strict=True):
        assert isinstance(one, Reject)
        assert re.search(message, str(one.error)), one.error
        assert f"{tmp_path / 'marked.moma'}:" in str(one.error)


def test_marks_need_an_orientation(tmp_path):
    (tmp_path / "a.moma").write_text(
        "moma-survey 1\ndepth * 0.4 source guess\nstone S1 header\nmark a vertex P1 1 2\nend\n",
        encoding="utf-8",
    )
    (refused,) = open_moma(tmp_path / "a.moma").blocks
    assert "the head names no orientation" in str(refused.error)
    (tmp_path / "b.moma").write_text(
        "moma-survey 1\norientation gone.json\ndepth * 0.4 source guess\nstone S1 header\n"
        + "".join(f"mark {c} vertex P1 1 2\n" for c in "abc")
        + "end\n",
        encoding="utf-8",
    )
    from ground.errors import SurveyError

    with pytest.raises(SurveyError, match="moma orient"):
        list(survey_stones(open_moma(tmp_path / "b.moma")).stones)
