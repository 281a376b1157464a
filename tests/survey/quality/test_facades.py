"""Facades: the stones of each wall, and the frame in which it is drawn."""

import numpy as np
import pytest

from survey.quality.facades import WIDEST, find_facades


def looking(degrees, tilt=0.0):
    """Return unit normals towards azimuths, clockwise from y, turned up by `tilt`."""
    azimuth, rise = np.radians(np.atleast_1d(degrees)), np.radians(tilt)
    level = np.column_stack([np.sin(azimuth), np.cos(azimuth)]) * np.cos(rise)
    return np.column_stack([level, np.full(len(azimuth), np.sin(rise))])


def groups(normals, areas=None):
    areas = np.ones(len(normals)) if areas is None else areas
    return find_facades(normals, areas, np.zeros((len(normals), 3)))


def test_the_four_walls_and_the_floor_of_a_room_are_distinguished():
    rng = np.random.default_rng(3)
    walls = np.repeat([10.0, 100.0, 190.0, 280.0], [40, 30, 20, 10]) + rng.uniform(-5, 5, 100)
    found = groups(np.vstack([looking(walls), looking(0.0, 90.0), looking(0.0, -80.0)]))
    assert [one.name for one in found] == [
        "facade 1", "facade 2", "facade 3", "facade 4", "faces up", "faces down",
    ]  # fmt: skip
    assert [len(one.members) for one in found] == [40, 30, 20, 10, 1, 1]
    assert [one.azimuth for one in found[:4]] == pytest.approx([10.0, 100.0, 190.0, 280.0], abs=2.0)
    assert found[4].azimuth is None


def test_the_frame_is_level_along_the_wall_to_the_right_of_the_viewer_and_outward():
    (facade,) = find_facades(
        looking([350.0, 10.0], tilt=-6.0), np.ones(2), np.array([[7e6, 4, 1], [7e6, 6, 3.0]])
    )
    along, up, outward = facade.frame.axes
    assert along == pytest.approx([-1.0, 0.0, 0.0])  # west is on the right of a viewer who looks south
    assert outward @ looking(0.0, -6.0)[0] == pytest.approx(1.0, abs=1e-4)
    assert up[2] > 0.99
    assert facade.frame.origin == pytest.approx([7e6, 5.0, 2.0], abs=1e-8)
    assert facade.frame.axes @ facade.frame.axes.T == pytest.approx(np.eye(3), abs=1e-15)


def test_every_face_of_a_round_tower_has_one_facade_and_is_within_its_limit():
    normals = looking(np.arange(0.0, 360.0, 2.0))
    found = groups(normals, np.random.default_rng(1).uniform(0.5, 2.0, 180))
    members = np.concatenate([one.members for one in found])
    assert sorted(members) == list(range(180))
    for one in found:
        turned = np.degrees(np.arccos(np.clip(normals[one.members] @ one.frame.axes[2], -1, 1)))
        assert turned.max() <= WIDEST + 1.0
    assert (
        6 <= len(found) <= 11
    )  # six arcs of 60° at best; gaps narrower than 60° between up to five at worst


def test_the_mean_is_weighted_by_area():
    found = groups(looking([0.0, 20.0]), np.array([3.0, 1.0]))
    # tan of the mean of two unit vectors of weight 3 and 1: sin 20° / (3 + cos 20°)
    assert found[0].azimuth == pytest.approx(
        np.degrees(np.arctan2(np.sin(np.radians(20)), 3 + np.cos(np.radians(20))))
    )


def test_no_faces_make_no_facade():
    assert groups(np.empty((0, 3))) == ()
