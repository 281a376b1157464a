"""The sample window in its own coordinates and in those of a national grid: the same stones.

Coordinates are first rounded to 2⁻²⁰ m, so that moving the survey by whole metres is exact in 64 bits. What is left
is the rounding of results that are themselves places 7·10⁶ m away: half of 2⁻³⁰ m, 0.5 nm, of each coordinate; a
cross product of such coordinates taken without a local origin would be wrong by 10⁻² m² instead.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from moma.cli import app
from pipelines.ingest.ingest import ingest
from pipelines.run.check import check_scene
from survey.extrusion.depth import depth_for
from survey.extrusion.extrusion import SurveyedBlock, extrude
from survey.faces.faces import outline_face
from survey.formats.native.reader import read_moma
from survey.formats.reading import open_survey
from survey.geometry.watertight import check_watertight
from survey.joints.close import close_joints
from survey.records.survey import ControlPoint, Survey
from survey.registration.stones import survey_stones
from synthetic.formats import write_moma
from tests.paths import ROOT

SAMPLE = ROOT / "data" / "samples" / "window" / "window.moma"
LAMBERT = np.array([650_000.0, 6_860_000.0, 300.0])
NANOMETRES = 3e-9


def moved(survey, shift):
    """The same survey elsewhere, on a grid of 2⁻²⁰ m."""

    def place(points):
        return np.round(points * 2.0**20) / 2.0**20 + shift

    head = survey.head
    stations = tuple(replace(one, position=place(one.position)) for one in head.stations)
    blocks = tuple(
        replace(one, vertices=place(one.vertices), points=place(one.points)) for one in survey.blocks
    )
    return Survey(replace(head, stations=stations), blocks)


def measured(survey):
    observer = survey.head.viewpoint(None)
    return [
        extrude(outline_face(one, observer), depth_for(one, survey.head.depth_rules), survey.head.extrusion)
        for one in survey.blocks
    ]


@pytest.fixture(scope="module")
def pair():
    survey = read_moma(SAMPLE)
    return measured(moved(survey, np.zeros(3))), measured(moved(survey, LAMBERT))


def test_planes_are_the_same(pair):
    for near, far in zip(*pair, strict=True):
        a, b = near.face.fit, far.face.fit
        assert a.rejected == b.rejected
        np.testing.assert_allclose(b.normal, a.normal, atol=1e-12)
        np.testing.assert_allclose(b.residuals, a.residuals, atol=1e-12)
        np.testing.assert_allclose(b.standardised, a.standardised, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(b.covariance, a.covariance, rtol=1e-9, atol=1e-20)
        np.testing.assert_allclose(b.centroid - LAMBERT, a.centroid, atol=NANOMETRES)
        assert b.rms == pytest.approx(a.rms, rel=1e-12)
        assert b.sigma0 == pytest.approx(a.sigma0, rel=1e-12)


def test_outlines_their_shapes_and_sizes_are_the_same(pair):
    for near, far in zip(*pair, strict=True):
        a, b = near.face, far.face
        np.testing.assert_allclose(b.outline - LAMBERT, a.outline, atol=NANOMETRES)
        assert (b.shape.kind, b.shape.bevel_points) == (a.shape.kind, a.shape.bevel_points)
        for name in ("area", "length", "height"):
            assert getattr(b.measures, name) == pytest.approx(getattr(a.measures, name), abs=1e-8)
        assert b.rejected_vertices == a.rejected_vertices


def test_solids_and_their_precision_are_the_same(pair):
    for near, far in zip(*pair, strict=True):
        np.testing.assert_allclose(far.solid.vertices - LAMBERT, near.solid.vertices, atol=NANOMETRES)
        np.testing.assert_allclose(far.vertex_sigma, near.vertex_sigma, rtol=1e-7)
        check_watertight(far.solid)


def test_closed_joints_are_the_same(pair):
    near, far = (close_joints(blocks) for blocks in pair)
    assert [set(one.stones) for one in far.report.joints] == [set(one.stones) for one in near.report.joints]
    for a, b in zip(near.solids, far.solids, strict=True):
        assert a.faces == b.faces
        np.testing.assert_allclose(b.vertices - LAMBERT, a.vertices, atol=1e-8)
    for code, change in near.report.volume_change.items():
        assert far.report.volume_change[code] == pytest.approx(change, abs=1e-7)
    for a, b in zip(near.report.joints, far.report.joints, strict=True):
        assert (b.width, b.area) == pytest.approx((a.width, a.area), abs=1e-8)


def test_a_survey_is_written_and_read_to_the_last_bit(tmp_path):
    far = moved(read_moma(SAMPLE), LAMBERT)
    write_moma(far, tmp_path / "far.moma")
    again = read_moma(tmp_path / "far.moma")
    for a, b in zip(far.blocks, again.blocks, strict=True):
        np.testing.assert_array_equal(a.vertices, b.vertices)
        np.testing.assert_array_equal(a.points, b.points)


def test_control_points_carry_stones_and_their_precision_to_the_site(tmp_path, pair):
    """A survey in the frame of its instrument, turned by 40° and 100 m off, with exact control points."""
    near, _ = pair
    angle = np.radians(40.0)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )
    own = moved(read_moma(SAMPLE), np.zeros(3))
    middle = own.blocks[0].vertices[0]

    def measured_at(points):
        return (points - middle) @ turn.T + [100.0, 0.0, 5.0]

    corners = middle + np.array([[0, 0, 0], [6, 1, 0], [5, -2, 4], [-3, 2, 3], [1, 4, 6.0]])
    control = tuple(
        ControlPoint(f"C{k}", measured_at(one), 0.001, one + LAMBERT, 0.001) for k, one in enumerate(corners)
    )
    stations = tuple(replace(one, position=measured_at(one.position)) for one in own.head.stations)
    blocks = tuple(
        replace(one, vertices=measured_at(one.vertices), points=measured_at(one.points)) for one in own.blocks
    )
    write_moma(Survey(replace(own.head, stations=stations, control=control), blocks), tmp_path / "own.moma")
    surveyed = survey_stones(open_survey(tmp_path / "own.moma", "moma"))
    assert surveyed.transform is not None
    assert surveyed.transform.scale == pytest.approx(1.0, abs=1e-9)
    for expected, found in zip(near, surveyed.stones, strict=True):
        assert isinstance(found, SurveyedBlock)
        assert found.face.fit.rejected == expected.face.fit.rejected
        # five control points that are themselves rounded to 0.5 nm
        np.testing.assert_allclose(found.solid.vertices - LAMBERT, expected.solid.vertices, atol=2e-8)
        np.testing.assert_allclose(found.vertex_sigma, expected.vertex_sigma, rtol=1e-6)


def test_what_the_database_says_of_the_stones_is_the_same(tmp_path):
    survey, said = read_moma(SAMPLE), {}
    for name, shift in (("near", np.zeros(3)), ("far", LAMBERT)):
        write_moma(moved(survey, shift), tmp_path / f"{name}.moma")
        url = f"sqlite:///{tmp_path / name}.db"
        ingest([tmp_path / f"{name}.moma"], url)
        answer = CliRunner().invoke(app, ["query", "ashlar", "--db", url, "--format", "json"])
        said[name] = {row["code"]: row for row in json.loads(answer.stdout)}
    assert set(said["near"]) == set(said["far"])
    for code, near in said["near"].items():
        far = said["far"][code]
        places = {axis: far[axis] - shift for axis, shift in zip("xyz", LAMBERT, strict=True)}
        assert far | places == pytest.approx(near, abs=NANOMETRES)


@pytest.mark.slow
def test_the_database_and_the_check_of_a_scene_are_the_same(tmp_path):
    # through `moma ingest` and `moma check`: joints, contacts, displacements of corners. Whether a sliver is a contact,
    # and how a stone is cut into tetrahedra, turns on nanometres, so contacts are counted to 1 %
    survey, reports = read_moma(SAMPLE), {}
    elastic = SAMPLE.with_name("window.toml")
    rigid = tmp_path / "rigid.toml"
    rigid.write_text(elastic.read_text().replace('default = "deformable"', 'default = "rigid"'))
    for name, shift in (("near", np.zeros(3)), ("far", LAMBERT)):
        write_moma(moved(survey, shift), tmp_path / f"{name}.moma")
        url = f"sqlite:///{tmp_path / name}.db"
        ingest([tmp_path / f"{name}.moma"], url)
        reports[name] = check_scene(rigid, url), check_scene(elastic, url)
    for near, far in zip(*reports.values(), strict=True):
        assert far.problems == near.problems == ()
        assert (far.bodies, far.kinds) == (near.bodies, near.kinds)
        assert far.joints is not None
        assert far.joints.max_displacement == pytest.approx(near.joints.max_displacement, abs=1e-7)
        assert far.joints.displacement == pytest.approx(near.joints.displacement, abs=1e-7)
        assert far.cost.pairs == near.cost.pairs
        assert far.cost.contacts == pytest.approx(near.cost.contacts, rel=0.01)
