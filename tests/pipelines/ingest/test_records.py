"""A stone that went through the database is the stone that was surveyed, to the last bit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from archmodel.database.session import open_database
from archmodel.query.api import find
from archmodel.store.stones import load_stones
from pipelines.ingest.ingest import ingest
from pipelines.ingest.records import stone_record, surveyed_block
from survey.faces.faces import Provenance
from survey.formats.reading import open_survey
from survey.records.survey import Reject
from survey.registration.stones import survey_stones

HEAD = """\
moma-survey 1
name all there is
observer 12 -20 1
station S2 8 -15 2
sigma 0.003
photo P1 sigma 0.5 station S2
mark P1 0 0 at 9.5 0.002 0
mark P1 4000 0 at 13.5 -0.001 0
mark P1 4000 2000 at 13.5 0 2
mark P1 0 2000 at 9.5 0.001 2
depth header 0.5 sigma 0.03 source archive
depth header zone west 0.45 sigma 0.02 source core
depth * 0.4 source thickness
extrude tail 0.9
"""


def stone(name, words, x, z, corners=(0, 1, 2, 3), points=True, extra=(), lines=()):
    square = [(x, 0.0, z), (x + 0.6, 0.0, z), (x + 0.6, 0.0, z + 0.3), (x, 0.0, z + 0.3)]
    noise = np.random.default_rng(sum(map(ord, name))).normal(0.0, 0.002, (20, 3))
    places = [("vertex", square[k]) for k in corners]
    if points:
        places += [("point", (x + 0.05 + 0.1 * i, 0.0, z + 0.1 * (1 + i % 2))) for i in range(5)]
    rows = [
        f"{word} {a + da:.4f} {b + db:.4f} {c + dc:.4f}{' sigma 0.002' if k % 3 == 1 and name == 'SIGMAS' else ''}"
        for k, ((word, (a, b, c)), (da, db, dc)) in enumerate(zip(places, noise, strict=False))
    ]
    return "\n".join([f"stone {name} {words}", *lines, *rows, *extra, "end", ""])


STONES = "".join(
    [
        stone("PLAIN", "header course 1", 9.6, 0.1),
        stone("BARE", "header course 1 zone west", 10.3, 0.1, points=False),
        stone("SIGMAS", "header course 1", 11.0, 0.1, lines=["note edge eroded", "station S2"]),
        stone("BROKEN", "header course 1", 11.7, 0.1, extra=["vertex 11.66 0.05 0.25"]),
        stone("TWICE", "header course 1", 12.4, 0.1, (0, 1, 1, 2, 3, 0), points=False),
        stone("REVERSED", "header course 2", 9.6, 0.5, (3, 2, 1, 0)),
        stone("MIXED", "header course 2", 10.3, 0.5, (0, 2, 1, 3)),
        stone("DIRECTED", "header course 2", 11.0, 0.5, lines=["extrude along 0.2 1 0.1"]),
        stone("TAPERED", "stretcher course 2", 11.7, 0.5, lines=["extrude along 0 1 0.3 tail 0.6"]),
        stone("BLUNDER", "jamb", 12.4, 0.5, extra=["point 12.5 0.09 0.6", "point 12.6 -0.2 0.7"]),
        "stone SEEN header course 3\nphoto P1\npixel 200 900\npixel 800 905\npixel 795 1200\npixel 205 1195\nend\n",
        "stone UP header course 3\nphoto P1\npixel 905 1195\npixel 1495 1200\npixel 1500 905\npixel 900 900\n"
        "point 10.5 0.012 1.0 sigma 0.0005\npoint 10.9 0.011 1.1 sigma 0.0005\n"
        "point 10.6 0.009 1.15 sigma 0.0005\npoint 10.7 0.30 1.0 sigma 0.0005\n"
        "point 10.8 0.011 0.95 sigma 0.0005\n"
        "point 10.55 0.0105 1.12 sigma 0.0005\nextrude tail 0.5\nend\n",
    ]
)

OBJ = """\
o A:voussoir
v 0 0 0
v 0.5 0 0.1
v 0.45 0 0.4
v 0 0 0.35
v 0.1 0.6 0.05
v 0.4 0.6 0.1
v 0.4 0.6 0.3
v 0.1 0.6 0.3
f 1 2 3 4
f 8 7 6 5
f 2 1 5 6
f 3 2 6
f 3 6 7
f 4 3 7 8
f 1 4 8 5
o ROOF:ashlar
v 2 0 0
v 3 0 0
v 3 0 0.1
v 2 0 0.1
v 2 3 0
v 3 3 0
v 3 3 1.0
v 2 3 1.0
f 1 2 3 4
f 5 8 7 6
f 1 5 6 2
f 2 6 7 3
f 3 7 8 4
f 4 8 5 1
"""


def through(tmp_path: Path, name: str, text: str, format: str):
    """Pairs of a stone as surveyed and as the database gives it back."""
    path = tmp_path / name
    path.write_text(text)
    url = f"sqlite:///{tmp_path / 'wall.db'}"
    ingest([path], url, format)
    made = list(survey_stones(open_survey(path, format)).stones)
    assert not [one.error for one in made if isinstance(one, Reject)]
    with open_database(url) as database, database.session(read_only=True) as session:
        records = {one.code: one for one in load_stones(session, find(session, "entity", []))}
    return {one.code: (one, records[one.code]) for one in made}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    return through(tmp_path_factory.mktemp("measured"), "wall.moma", HEAD + STONES, "moma")


@pytest.fixture(scope="module")
def solids(tmp_path_factory):
    return through(tmp_path_factory.mktemp("solids"), "stones.obj", OBJ, "solids")


def same(before, after):
    """The same face, outline, solid and precision, bit for bit."""
    a, b = before.face, after.face
    for name in ("normal", "offset", "centroid", "axes", "covariance", "rms", "redundancy", "rejected"):
        np.testing.assert_array_equal(getattr(b.fit, name), getattr(a.fit, name), err_msg=name)
    np.testing.assert_array_equal(b.outline, a.outline)
    assert b.measures == a.measures
    assert (b.corner_of, b.rejected_points, b.rejected_vertices) == (
        a.corner_of,
        a.rejected_points,
        a.rejected_vertices,
    )
    assert (b.provenance, b.remarks) == (a.provenance, a.remarks)
    assert (b.shape.kind, b.shape.text) == (a.shape.kind, a.shape.text)
    assert (b.code, b.kind, b.course) == (a.code, a.kind, a.course)
    np.testing.assert_array_equal(after.solid.vertices, before.solid.vertices)
    assert after.solid.faces == before.solid.faces
    np.testing.assert_array_equal(after.vertex_sigma, before.vertex_sigma)
    one, other = before.depth, after.depth
    assert (other.value, other.sigma, other.source, other.origin) == (
        one.value,
        one.sigma,
        one.source,
        one.origin,
    )


CODES = [
    *("PLAIN", "BARE", "SIGMAS", "BROKEN", "TWICE", "REVERSED", "MIXED", "DIRECTED", "TAPERED"),
    *("BLUNDER", "SEEN", "UP"),
]


@pytest.mark.parametrize("code", CODES)
def test_a_measured_stone_comes_back_as_it_went(measured, code):
    before, record = measured[code]
    same(before, surveyed_block(record))


@pytest.mark.parametrize("code", ["A", "ROOF"])
def test_a_solid_comes_back_as_it_went(solids, code):
    before, record = solids[code]
    same(before, surveyed_block(record))


def test_what_the_stones_were_made_for_did_happen(measured):
    face = {code: made.face for code, (made, _) in measured.items()}
    assert face["BROKEN"].rejected_vertices == (4,)
    assert len(face["TWICE"].outline) == 4
    assert face["MIXED"].remarks
    assert face["REVERSED"].corner_of == (3, 2, 1, 0)
    assert set(face["BLUNDER"].rejected_points) == {5, 6}
    assert face["SIGMAS"].record.sigmas is not None
    assert face["SEEN"].provenance.source == "photograph"
    assert face["UP"].rejected_points == (3,)
    assert measured["BARE"][0].depth.origin == "rule"
    assert measured["TAPERED"][0].depth.origin == "structure"
    assert np.isnan(measured["TAPERED"][0].vertex_sigma[4:]).all()


def test_records_hold_what_was_said_of_the_stone(measured):
    record = measured["SIGMAS"][1]
    assert (record.station, record.notes, record.zone, record.line) == ("S2", {"edge": "eroded"}, None, 32)
    assert record.tail == 0.9
    assert measured["BARE"][1].zone == "west"
    seen = measured["SEEN"][1]
    np.testing.assert_array_equal(seen.image, [[200, 900], [800, 905], [795, 1200], [205, 1195]])
    assert seen.photograph == "P1"


@pytest.mark.parametrize("code", CODES)
def test_what_is_kept_again_is_the_same_record(measured, code):
    record = measured[code][1]
    again = stone_record(surveyed_block(record))
    for name in ("vertices", "points", "normal", "outline", "solid_vertices", "vertex_sigma", "covariance"):
        np.testing.assert_array_equal(getattr(again, name), getattr(record, name), err_msg=name)
    for name in (
        *("depth", "depth_origin", "provenance", "provenance_text", "rejected", "rejected_vertices"),
        "shape",
    ):
        assert getattr(again, name) == getattr(record, name), name


@pytest.mark.parametrize("code", ["A", "ROOF"])
def test_a_hypothesis_keeps_its_solid_and_says_what_it_is(solids, code):
    _, record = solids[code]
    guess = replace(record, provenance="hypothesis", provenance_text="closes a hole", hypothesis=True)
    block = surveyed_block(guess)
    assert block.face.provenance == Provenance("hypothesis", "closes a hole")
    np.testing.assert_array_equal(block.solid.vertices, record.solid_vertices)
    np.testing.assert_array_equal(block.face.outline, record.outline)
    assert block.solid.faces == record.solid_faces
    again = stone_record(block)
    assert (again.hypothesis, again.provenance, again.provenance_text) == (
        True,
        "hypothesis",
        "closes a hole",
    )
    assert not record.hypothesis
    np.testing.assert_array_equal(again.solid_vertices, guess.solid_vertices)
