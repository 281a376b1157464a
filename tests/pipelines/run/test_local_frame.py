"""Walls on a national grid, computed about a local origin: the same wall, to the nanometre.

Coordinates are first rounded to 2⁻²⁰ m, so that shifting them by whole metres is exact in 64 bits.
"""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from archmodel.database.session import open_database
from archmodel.query.api import find
from archmodel.store.stones import load_stones
from pipelines.ingest.ingest import ingest
from pipelines.run.assemble import local_origin, stone_about
from pipelines.run.run import run_scene
from tests.pipelines.scenes import THREE_STONES, assembled, survey_text

GRID = np.array([652_345.0, 6_862_789.0, 1_040.0])
ORIGIN = np.array([652_000.0, 6_863_000.0, 1_000.0])  # the nearest multiple of 1 km

SCENE = (
    THREE_STONES
    + """\
[output]
pictures = []
"""
)
LOADS = """
[[loads]]
type = "force"
stones = ["TOP"]
force = [0, 0, -2000]
point = [{x}, {y}, {z}]
[[loads]]
type = "motion"
stones = ["LEFT"]
spin = 1e-3
axis = [0, 1, 0]
pivot = [{x}, {y}, {z}]
"""


def stone(code, course, x, z, length):
    rng = np.random.default_rng(sum(map(ord, code)))
    corners = np.array([(x, 0, z), (x + length, 0, z), (x + length, 0, z + 0.29), (x, 0, z + 0.29)])
    points = np.column_stack([rng.uniform(x, x + length, 5), np.zeros(5), rng.uniform(z, z + 0.29, 5)])
    noisy = (part + rng.normal(0.0, 0.002, part.shape) for part in (corners, points))
    return course, *(np.round(part * 2.0**20) / 2.0**20 for part in noisy)


FACES = {"LEFT": (1, 0.0, 0.0, 0.5), "RIGHT": (1, 0.51, 0.0, 0.5), "TOP": (2, 0.2, 0.3, 0.6)}
STONES = {code: stone(code, *face) for code, face in FACES.items()}


@pytest.fixture(scope="module")
def walls(tmp_path_factory):
    """URLs of the databases of the wall near the origin and far from it."""
    folder, urls = tmp_path_factory.mktemp("walls"), []
    for name, shift in (("near", np.zeros(3)), ("far", GRID)):
        (folder / f"{name}.moma").write_text(survey_text(STONES, shift))
        urls.append(f"sqlite:///{folder / name}.db")
        ingest([folder / f"{name}.moma"], urls[-1])
    return urls


def text_for(shift, more=LOADS):
    x, y, z = (shift + np.array([0.5, 0.1, 0.4])).tolist()
    return SCENE + more.format(x=x, y=y, z=z)


@pytest.mark.parametrize("joints", ["", '[joints]\nmode = "as-surveyed"\n'])
def test_a_far_scene_is_the_near_one_about_its_own_origin(walls, joints):
    near = assembled(walls[0], text_for(np.zeros(3)) + joints)
    far = assembled(walls[1], text_for(GRID) + joints)
    np.testing.assert_array_equal(near.origin, np.zeros(3))
    np.testing.assert_array_equal(far.origin, ORIGIN)
    shift = GRID - ORIGIN
    for one, other in zip(near.scene.blocks, far.scene.blocks, strict=True):
        assert (one.code, one.faces) == (other.code, other.faces)
        np.testing.assert_allclose(other.vertices - shift, one.vertices, atol=1e-8)
    np.testing.assert_allclose(far.towards, near.towards, atol=1e-12)
    assert near.closing.mode == ("as-surveyed" if joints else "close")
    assert {one.stones for one in far.closing.joints} == {one.stones for one in near.closing.joints}


def test_points_of_loads_and_pivots_move_along(walls):
    near, far = (
        assembled(url, text_for(shift)).scene.loads
        for url, shift in zip(walls, (np.zeros(3), GRID), strict=True)
    )
    ((push,), (turn,)), ((far_push,), (far_turn,)) = ((one.forces, one.motions) for one in (near, far))
    # the point is kept from the centre of mass of its stone, the pivot in the frame of the scene
    np.testing.assert_allclose(far_push.arm, push.arm, atol=1e-8)
    assert np.abs(push.arm).max() < 1.0
    np.testing.assert_allclose(np.array(far_turn.pivot) - (GRID - ORIGIN), turn.pivot, atol=1e-8)
    np.testing.assert_allclose(turn.pivot, [0.5, 0.1, 0.4])


def test_a_run_far_away_is_the_run_nearby_in_site_coordinates(walls, tmp_path):
    done = {}
    for name, url, shift in zip(("near", "far"), walls, (np.zeros(3), GRID), strict=True):
        (tmp_path / f"{name}.toml").write_text(text_for(shift, LOADS.split('[[loads]]\ntype = "motion"')[0]))
        done[name] = run_scene(tmp_path / f"{name}.toml", url, tmp_path / name).summary
    near, far = done["near"], done["far"]
    assert near["outcome"] == far["outcome"] == "equilibrium"
    assert (near["origin"], far["origin"]) == ([0.0, 0.0, 0.0], ORIGIN.tolist())
    assert json.loads((tmp_path / "far/summary.json").read_text())["origin"] == ORIGIN.tolist()
    assert far["contacts"] == near["contacts"]
    assert far["reaction"]["weight"] == pytest.approx(near["reaction"]["weight"], rel=1e-7)
    assert far["reaction"]["total_vertical"] == pytest.approx(near["reaction"]["total_vertical"], rel=1e-5)
    assert far["displacement"]["max"] == pytest.approx(near["displacement"]["max"], rel=1e-3, abs=1e-8)
    rows = {}
    for name in done:
        with (tmp_path / name / "joints.csv").open(newline="") as file:
            rows[name] = {(row["first"], row["second"]): row for row in csv.DictReader(file)}
    assert set(rows["near"]) == set(rows["far"])
    assert len(rows["near"]) >= 2
    for pair, row in rows["near"].items():
        here, there = ([float(one[axis]) for axis in "xyz"] for one in (row, rows["far"][pair]))
        # 12 digits are written, 10 µm at 6.9·10⁶ m
        np.testing.assert_allclose(np.array(there) - GRID, here, atol=2e-5)
        assert float(rows["far"][pair]["area"]) == pytest.approx(float(row["area"]), rel=1e-6)
        force, far_force = float(row["force_normal"]), float(rows["far"][pair]["force_normal"])
        # where several forces are admissible, rounding of far coordinates may choose others
        assert far_force == pytest.approx(force, rel=5e-3, abs=1.0)


def test_results_of_a_far_run_are_kept_with_the_stones(walls, tmp_path):
    (tmp_path / "far.toml").write_text(text_for(GRID, ""))
    run_scene(tmp_path / "far.toml", walls[1], tmp_path / "out")
    with open_database(walls[1]) as database, database.session(read_only=True) as session:
        found = find(session, "entity", ["displacement_max < 1e-3", "x > 652000", "y < 6862790"])
        assert {one.code for one in found} == {"LEFT", "RIGHT", "TOP"}


@pytest.fixture(scope="module")
def far_stones(walls):
    with open_database(walls[1]) as database, database.session(read_only=True) as session:
        return load_stones(session, find(session, "entity", []))


def test_near_scenes_stay_where_they_are_and_far_ones_have_a_round_origin(far_stones):
    np.testing.assert_array_equal(local_origin(far_stones), ORIGIN)
    np.testing.assert_array_equal(local_origin([]), np.zeros(3))
    ten = [replace(one, centroid=one.centroid - GRID + [9_990.0, 0.0, 0.0]) for one in far_stones]
    np.testing.assert_array_equal(local_origin(ten), np.zeros(3))
    assert stone_about(ten[0], np.zeros(3)) is ten[0]


def test_shifting_a_stone_loses_nothing(far_stones):
    for stone in far_stones:
        about = stone_about(stone, ORIGIN)
        for name in ("vertices", "points", "outline", "solid_vertices", "centroid"):
            np.testing.assert_array_equal(getattr(about, name) + ORIGIN, getattr(stone, name), err_msg=name)
        assert about.offset == pytest.approx(stone.offset - stone.normal @ ORIGIN, abs=1e-8)
        np.testing.assert_allclose(about.outline @ about.normal, about.offset, atol=1e-8)
