"""Outlines beside a cloud by hand: which unit or shift would bring both together, margins, and the side they face."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.clouds import cloud
from survey.clouds.points.chunks import Chunk, PointCloud
from survey.clouds.settings import CloudOptions
from survey.clouds.wall import Wall
from survey.records.survey import OBSERVER, Station

WALL = Wall(np.array([100.0, 200.0, 0.0]), np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]))


def outline(origin, ring=((-0.5, -0.2), (0.5, -0.2), (0.5, 0.2), (-0.5, 0.2)), turned=False):
    flat = np.array(ring)
    corners = np.array(origin) + flat @ WALL.axes[:2]
    said = SimpleNamespace(sigma=None)
    return SimpleNamespace(
        ring=flat, origin=np.array(origin, float), axes=WALL.axes,
        outline=SimpleNamespace(corners=flat, said=said), corners=corners[::-1] if turned else corners,
    )  # fmt: skip


def points(*places):
    made = np.array(places, float)

    def chunks(origin, colours):
        yield Chunk(made - origin, None)

    return PointCloud("a.las", len(made), made[0], chunks, ())


def apart(near, places, wall=None):
    """The error of outlines at places and a cloud near another."""
    options = CloudOptions(outlines=Path("o.dxf"), wall=wall)
    placed = [outline(place) for place in places]
    return cloud._apart([points(near)], placed, SimpleNamespace(read=7), options)


def test_outlines_and_cloud_are_told_with_their_places():
    error = apart((5.0, 6.0, 7.0), [(100.0, 200.0, 1.0), (102.0, 200.0, 3.0)])
    assert error.what == (
        "none of its 7 points lies in an outline: outlines lie about (101.00, 200.00, 2.00), the cloud about "
        "(5.00, 6.00, 7.00)"
    )
    assert "shift" not in error.remedy


@pytest.mark.parametrize(("unit", "length"), [("mm", 1e-3), ("cm", 1e-2), ("ft", 0.3048)])
def test_a_cloud_that_lies_there_in_another_unit_is_told_so(unit, length):
    middle = np.array([101.0, 200.0, 2.0])
    error = apart(middle / length, [(100.0, 200.0, 1.0), (102.0, 200.0, 3.0)])
    assert f"in {unit} it would lie there" in error.remedy
    assert f"x[{unit}]" in error.remedy


@pytest.mark.parametrize("near", [(5.0, 6.0, 1.0), (-431000.0, -5411000.0, 1.0)])
def test_a_cloud_that_was_shifted_is_told_by_how_far_it_is_away(near):
    error = apart(near, [(431000.0, 5411000.0, 1.0)])
    assert "global shift" in error.remedy
    assert "shift" not in apart((431005.0, 5411030.0, 90.0), [(431000.0, 5411000.0, 1.0)]).remedy


def test_in_the_frame_of_a_wall_both_spans_are_told():
    error = apart((103.0, 190.0, 5.0), [(100.5, 200.0, 1.0)], WALL)
    # outlines are drawn from the wall's origin; the cloud lies 3 m along it, 5 m up and 10 m before it
    assert "the cloud 3.00 to 3.00 m along and 5.00 to 5.00 m up, 10.00 to 10.00 m before it" in error.what


def test_margins_are_as_wide_as_outlines_are_unsure_and_a_quarter_of_a_stone_at_most():
    placed = [outline((0, 0, 0)), outline((0, 0, 0), ((0, 0), (0.02, 0), (0.02, 1), (0, 1)))]
    sigmas = np.array([0.005, 0.005])
    found = cloud._margins(placed, sigmas, None)
    assert found == pytest.approx([cloud._WIDE * 0.005, min(cloud._WIDE * 0.005, cloud._ROOM * 0.02)])
    assert cloud._margins(placed, sigmas, 0.03) == pytest.approx([0.03, cloud._ROOM * 0.02])
    assert [cloud._size(one) for one in placed] == [1.0, 1.0]


@pytest.mark.parametrize(("turned", "refused"), [(0, False), (2, False), (3, True)])
def test_stations_that_see_most_outlines_from_behind_are_refused(turned, refused):
    placed = [outline((k, 0.0, 0.0), turned=k < turned) for k in range(4)]
    stations = [Station("scan1", np.array([2.0, -10.0, 0.0]))]
    if refused:
        with pytest.raises(SurveyError, match="3 of 4 outlines run clockwise"):
            cloud._check_sides(placed, stations, True, Path("o.dxf"))
    else:
        cloud._check_sides(placed, stations, True, Path("o.dxf"))
    # the word of a person counts more
    cloud._check_sides(placed, [Station(OBSERVER, np.array([2.0, -10.0, 0.0]))], True, Path("o.dxf"))
