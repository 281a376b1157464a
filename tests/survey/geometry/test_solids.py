"""Planes, volumes and soundness of solids, one by one and of many with the same faces."""

import numpy as np
import pytest

from ground.errors import GeometryError
from survey.geometry.solids import (
    Solid,
    area_vector,
    area_vectors,
    highest_corner,
    highest_corners,
    planes_alike,
    planes_of_solid,
    volume_of,
    volumes_alike,
)
from survey.geometry.watertight import check_watertight, doubtful_solids

BOX = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
CORNERS = np.array([(x, y, z) for z in (0, 1) for x, y in [(0, 0), (1, 0), (1, 1), (0, 1)]], dtype=float)
# a prism over a polygon of eleven corners
ROUND = np.array([(np.cos(a), np.sin(a), z) for z in (0, 1) for a in np.arange(11) * 2 * np.pi / 11])
SIDES = tuple((k, (k + 1) % 11, 11 + (k + 1) % 11, 11 + k) for k in range(11))
PRISM = (tuple(range(10, -1, -1)), tuple(range(11, 22)), *SIDES)


@pytest.mark.parametrize(("corners", "faces"), [(CORNERS, BOX), (ROUND, PRISM)], ids=["box", "prism"])
def test_solids_with_the_same_faces_are_measured_together_as_each_by_itself(corners, faces):
    rng = np.random.default_rng(2)
    stones = np.array([corners * rng.uniform(0.2, 2, 3) + rng.uniform(-50, 50, 3) for _ in range(7)])
    planes, volumes, heights = (
        measure(stones, faces) for measure in (planes_alike, volumes_alike, highest_corners)
    )
    for n, vertices in enumerate(stones):
        one = Solid(str(n), vertices, faces)
        np.testing.assert_array_equal(planes[n], planes_of_solid(one))
        assert (volumes[n], heights[n]) == (volume_of(one), highest_corner(one))
        for plane, vector, face in zip(planes[n], area_vectors(vertices, faces), faces, strict=True):
            polygon = vertices[list(face)]
            np.testing.assert_allclose(vector, area_vector(polygon), rtol=1e-14)
            np.testing.assert_allclose(polygon @ plane[:3], plane[3], atol=1e-12)
    assert planes_of_solid(Solid("box", CORNERS, BOX)).tolist()[1] == [0.0, 0.0, 1.0, 1.0]
    assert volume_of(Solid("box", CORNERS, BOX)) == 1.0


def refused(solid, convex):
    try:
        check_watertight(solid, convex=convex)
    except GeometryError:
        return True
    return False


def test_the_stones_of_a_wall_that_are_not_sound_are_found_at_once():
    dented = CORNERS.copy()
    dented[6] = (0.4, 0.4, 0.4)
    unknown = CORNERS.copy()
    unknown[2, 1] = np.nan
    kinds = {
        "sound": (CORNERS, BOX),
        "round": (ROUND, PRISM),
        "inside out": (CORNERS, tuple(face[::-1] for face in BOX)),
        "dented": (dented, BOX),
        "flat": (CORNERS * (1, 1, 0), BOX),
        "open": (CORNERS, BOX[:-1]),
        "unknown": (unknown, BOX),
    }
    solids = [Solid(name, *kind) for name, kind in kinds.items()] * 2
    convex = [True] * len(kinds) + [False] * len(kinds)
    expected = [n for n, (solid, also) in enumerate(zip(solids, convex, strict=True)) if refused(solid, also)]
    assert doubtful_solids(solids, convex) == expected
    assert {solids[n].code for n in expected} == set(kinds) - {"sound", "round"}
