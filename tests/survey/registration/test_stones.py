"""From records to stones: frames, stations, photographs, rejects, one stone at a time."""

import weakref
from dataclasses import replace

import numpy as np
import pytest

from ground.errors import GeometryError, SurveyError
from survey.conventions import TRIALS
from survey.extrusion.extrusion import SurveyedBlock
from survey.formats.reading import open_survey
from survey.records.survey import (
    BlockRecord,
    ControlPoint,
    DepthRule,
    Extrusion,
    Photograph,
    PhotoMark,
    Reject,
    SolidRecord,
    Station,
    SurveyHead,
    SurveyStream,
)
from survey.registration.stones import survey_stones

RULES = (DepthRule(None, 0.4, 0.05, "thickness", 2),)
OBSERVER = Station("observer", np.array([2.0, -9.0, 1.5]), 3)
BACK = np.array([0.0, 0.05, 0.0])
BOX = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
# a survey about the instrument: turned by 35°, tilted, and far from the site's origin
TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]) @ np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.96, -0.28], [0.0, 0.28, 0.96]]
)
SITE = np.array([652_010.0, 6_862_000.0, 41.0])


def face(x=0.0, z=0.5):
    return np.array([(x, 0, z), (x + 0.6, 0, z), (x + 0.6, 0, z + 0.3), (x, 0, z + 0.3)], dtype=float)


def stone(code, x=0.0, line=10, **more):
    noise = np.random.default_rng(sum(map(ord, code))).normal(0.0, 0.002, (7, 3))
    points = np.array([(x + 0.1, 0, 0.6), (x + 0.3, 0, 0.7), (x + 0.5, 0, 0.55)]) + noise[:3]
    given = {"kind": "header", "course": 1, "vertices": face(x) + noise[3:], "points": points, "sigma": 0.002}
    given |= {"line": line, "spans": (range(line, line + 9),)} | more
    return BlockRecord(code=code, **given)


def survey(blocks, **head):
    given = {"stations": (OBSERVER,), "depth_rules": RULES} | head
    return SurveyStream(SurveyHead("wall", "wall.moma", **given), iter(blocks))


def made(stream):
    return list(survey_stones(stream).stones)


def control(count=4):
    """Points known in both frames: site = SITE + TURN · survey."""
    places = np.array([(0, 0, 0), (5, 0.1, 0), (0.2, 0, 3), (4, 1.5, 2)], dtype=float)[:count]
    return tuple(
        ControlPoint(f"C{k}", place, 0.002, SITE + TURN @ place, 0.003, 4 + k)
        for k, place in enumerate(places)
    )


def to_site(record):
    """Return the stone as if it had been measured in the frame of the site."""
    if isinstance(record, SolidRecord):
        return replace(record, vertices=SITE + record.vertices @ TURN.T)
    extrusion = record.extrusion
    if extrusion is not None and extrusion.direction is not None:
        extrusion = replace(extrusion, direction=TURN @ extrusion.direction)
    return replace(
        record,
        vertices=SITE + record.vertices @ TURN.T,
        points=SITE + record.points @ TURN.T,
        extrusion=extrusion,
    )


PHOTO = Photograph(
    "P1",
    0.5,
    tuple(
        PhotoMark(np.array([1000.0 * x, 1000.0 * z]), np.array([x, 0.0, z]), 0.001, 20 + k)
        for k, (x, z) in enumerate([(0, 0), (4, 0), (4, 2), (0, 2)])
    ),
    "S2",
    19,
)


def on_photograph(code, line, pixels=((1000, 1200), (1600, 1200), (1600, 1500), (1000, 1500)), **more):
    nothing = np.empty((0, 3))
    return stone(
        code,
        line=line,
        vertices=nothing,
        points=nothing,
        photograph="P1",
        image=np.array(pixels, float),
        **more,
    )


def test_control_points_move_stones_stations_directions_photographs_and_solids():
    records = [
        stone("A"),
        stone("B", 0.7, extrusion=Extrusion(np.array([0.2, 1.0, 0.1]), 0.8)),
        on_photograph("P", 40),
        SolidRecord("S", "ashlar", None, BOX * [0.6, 0.4, 0.3] + [2.0, 0.0, 0.5], SIDES, 60),
    ]
    stations = (OBSERVER, Station("S2", np.array([1.0, -6.0, 1.0]), 4))
    along = Extrusion(np.array([0.0, 1.0, 0.2]))
    surveyed = survey_stones(
        survey(records, control=control(), stations=stations, photographs=(PHOTO,), extrusion=along)
    )
    moved_photo = replace(
        PHOTO, marks=tuple(replace(one, position=SITE + TURN @ one.position) for one in PHOTO.marks)
    )
    there = survey_stones(
        survey(
            [to_site(record) for record in records],
            stations=tuple(replace(one, position=SITE + TURN @ one.position) for one in stations),
            photographs=(moved_photo,),
            extrusion=Extrusion(TURN @ along.direction),
        )
    )
    assert there.transform is None
    assert surveyed.transform.scale == pytest.approx(1.0, abs=1e-9)
    for one, other in zip(surveyed.head.stations, there.head.stations, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=1e-8)
    first, second = list(surveyed.stones), list(there.stones)
    assert [one.code for one in first] == [one.code for one in second] == ["A", "B", "S", "P"]
    for one, other in zip(first, second, strict=True):
        np.testing.assert_allclose(one.solid.vertices, other.solid.vertices, atol=2e-8)
        np.testing.assert_allclose(one.face.fit.normal, other.face.fit.normal, atol=1e-8)
        np.testing.assert_allclose(one.vertex_sigma, other.vertex_sigma, rtol=1e-4)
        assert one.depth.value == pytest.approx(other.depth.value, abs=1e-8)


def test_a_frame_in_millimetres_comes_to_metres_with_its_precision():
    places = [(0, 0, 0), (5000, 100, 0), (200, 0, 3000), (4000, 1500, 2000)]
    tied = tuple(
        ControlPoint(f"C{k}", np.array(p, float), 2.0, np.array(p) / 1000.0, 0.003, k)
        for k, p in enumerate(places)
    )
    record = stone("A")
    large = replace(record, vertices=1e3 * record.vertices, points=1e3 * record.points, sigma=2.0)
    station = replace(OBSERVER, position=1e3 * OBSERVER.position)
    (metres,), (plain,) = made(survey([large], control=tied, stations=(station,))), made(survey([record]))
    np.testing.assert_allclose(metres.solid.vertices, plain.solid.vertices, atol=1e-9)
    np.testing.assert_allclose(metres.vertex_sigma, plain.vertex_sigma, rtol=1e-6)


def test_control_points_that_tie_nothing_refuse_the_survey_before_any_stone():
    with pytest.raises(SurveyError, match="control point"):
        survey_stones(survey([stone("A")], control=control(2)))


@pytest.mark.parametrize("backwards", [False, True])
def test_faces_look_to_the_observer_else_to_the_only_station_and_a_stone_to_its_own(backwards):
    front, behind = np.array([2.0, -9.0, 1.5]), np.array([2.0, 9.0, 1.5])
    order = slice(None, None, -1) if backwards else slice(None)
    record = replace(stone("A"), vertices=stone("A").vertices[order])

    def looks(stations, one=record):
        return np.sign(made(survey([one], stations=stations))[0].face.fit.normal[1])

    assert looks((Station("observer", front),)) == -1.0
    assert looks((Station("observer", behind),)) == 1.0
    assert looks((Station("T", behind),)) == 1.0
    assert looks((Station("observer", front), Station("T", behind))) == -1.0
    own = replace(record, station="T")
    assert looks((Station("observer", front), Station("T", behind)), own) == 1.0
    # of several stations none is the observer's: then corners run counter-clockwise from outside
    assert looks((Station("S", behind), Station("T", behind))) == (1.0 if backwards else -1.0)
    assert looks(()) == (1.0 if backwards else -1.0)


def test_an_unknown_station_rejects_its_stone_alone():
    one, other = made(survey([stone("A", station="T9"), stone("B")]))
    assert isinstance(one, Reject)
    assert "no station 'T9'" in str(one.error)
    assert "stations of this survey: observer" in one.error.remedy
    assert isinstance(other, SurveyedBlock)


def test_solids_look_to_the_observer_too():
    solid = SolidRecord("S", "ashlar", None, BOX, SIDES, 60)
    (front,) = made(survey([solid]))
    (back,) = made(survey([solid], stations=(Station("observer", np.array([2.0, 9.0, 1.5])),)))
    np.testing.assert_allclose(front.face.fit.normal, [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(back.face.fit.normal, [0, 1, 0], atol=1e-12)


def test_photographs_come_last_and_lie_in_the_plane_of_their_neighbours():
    # the marks lie in y = 0, the stones 50 mm behind: so does the stone between them
    def deeper(code, x):
        record = stone(code, x)
        return replace(record, vertices=record.vertices + BACK, points=record.points + BACK)

    seen = on_photograph(
        "P", 40, ((700, 500), (1300, 500), (1300, 800), (700, 800)), extrusion=Extrusion(tail=0.5)
    )
    stations = (OBSERVER, Station("S2", np.array([1.0, -600.0, 0.65]), 4))
    stream = survey(
        [seen, deeper("A", 0.0), deeper("B", 1.4), deeper("C", 2.1)], stations=stations, photographs=(PHOTO,)
    )
    *others, p = made(stream)
    assert [one.code for one in (*others, p)] == ["A", "B", "C", "P"]
    assert p.face.provenance.source == "photograph"
    assert p.face.provenance.text == "photograph P1, in the plane of the wall (3 faces)"
    np.testing.assert_allclose(p.face.outline[:, 1], 0.05, atol=0.006)
    assert p.face.measures.length == pytest.approx(0.6, abs=0.003)
    assert (p.depth.value, p.depth.origin, p.extrusion.tail) == (0.4, "structure", 0.5)
    hidden = p.solid.vertices[4:]
    assert np.ptp(hidden[:, 0]) == pytest.approx(0.3, abs=0.01)
    np.testing.assert_allclose(hidden[:, 1], 0.45, atol=0.01)
    assert np.isfinite(p.vertex_sigma).all()
    # 0.5 px is 0.5 mm on the wall, and marks of 1 mm cannot make it much worse
    assert (p.vertex_sigma[:4, [0, 2]] > 0.0005).all()
    assert (p.vertex_sigma[:4, [0, 2]] < 0.003).all()


def test_what_cannot_become_a_stone_keeps_its_lines_and_says_why():
    nothing = Reject("R", SurveyError("unreadable", where="wall.moma:5"), (range(5, 6),))
    items = [
        nothing,
        stone("FLAT", line=20, vertices=face() * [1, 1, 0], points=np.empty((0, 3))),
        stone("STEEP", line=30, extrusion=Extrusion(np.array([1.0, 0.1, 0.0]))),
        stone("GOOD", line=40),
        on_photograph("LOST", 50),
        on_photograph("CROSSED", 60, ((1000, 1200), (1600, 1500), (1500, 1400), (1600, 1200), (1000, 1500))),
    ]
    items[4] = replace(items[4], photograph="P9")
    stations = (OBSERVER, Station("S2", np.array([1.0, -6.0, 1.0]), 4))
    out = made(survey(items, stations=stations, photographs=(PHOTO,)))
    assert out[0] is nothing
    assert [one.code for one in out] == ["R", "FLAT", "STEEP", "GOOD", "LOST", "CROSSED"]
    assert isinstance(out[3], SurveyedBlock)
    for one, line, words in (
        (out[1], 20, "one line"),
        (out[2], 30, "direction of extrusion"),
        (out[4], 50, "no photograph 'P9'"),
        (out[5], 60, "crosses itself"),
    ):
        assert isinstance(one, Reject)
        assert str(one.error).startswith(f"wall.moma:{line}: stone {one.code}: ")
        assert words in str(one.error)
        assert one.error.remedy
        assert one.spans == (range(line, line + 9),)
    assert isinstance(out[1].error, GeometryError)
    assert isinstance(out[4].error, SurveyError)


def test_an_unknown_depth_rejects_a_stone_and_not_a_solid():
    solid = SolidRecord("S", "ashlar", None, BOX, SIDES, 60)
    stone_out, solid_out = made(survey([stone("A"), solid], depth_rules=()))
    assert isinstance(stone_out, Reject)
    assert "no depth is known for a header" in str(stone_out.error)
    assert isinstance(solid_out, SurveyedBlock)


@pytest.mark.parametrize("kind", ["points", "solid"])
def test_stones_are_handed_on_and_not_kept(kind):
    def items():
        for k in range(50):
            yield (
                stone(f"W{k}", 0.7 * k)
                if kind == "points"
                else SolidRecord(f"W{k}", "ashlar", None, BOX, SIDES, k)
            )

    alive = []
    for one in survey_stones(survey(items())).stones:
        alive.append(weakref.ref(one))
        del one
        assert sum(ref() is not None for ref in alive) <= 1


def test_stones_come_while_the_file_is_being_read():
    """With a stated roughness one by one; without, as soon as the first of them have shown it."""
    taken = []

    def items(count):
        for k in range(count):
            taken.append(k)
            yield stone(f"W{k}", 0.7 * k)

    stated = survey(items(3))
    stones = survey_stones(replace(stated, head=replace(stated.head, roughness=0.0))).stones
    assert taken == []
    next(stones)
    assert taken == [0]
    taken.clear()
    next(survey_stones(survey(items(TRIALS + 9))).stones)
    assert len(taken) == TRIALS


def test_a_file_of_two_frames_is_read_whole(tmp_path):
    rows = [
        f"control {one.name} {' '.join(map(repr, one.measured.tolist()))} site {' '.join(map(repr, one.site.tolist()))}"
        for one in control()
    ]
    lines = ["moma-survey 1", "observer 2 -9 1.5", "sigma 0.002", "depth * 0.4 source thickness", *rows]
    lines += ["stone A header", *(f"vertex {x} {y} {z}" for x, y, z in face().tolist()), "end"]
    path = tmp_path / "wall.moma"
    path.write_text("\n".join(lines) + "\n")
    (block,) = survey_stones(open_survey(path, "moma")).stones
    np.testing.assert_allclose(block.face.outline, SITE + face() @ TURN.T, atol=1e-8)
    np.testing.assert_allclose(block.face.fit.normal, TURN @ [0, -1, 0], atol=1e-8)
