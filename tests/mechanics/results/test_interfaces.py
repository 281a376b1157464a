"""Faces on which contact points lie, against a slow twin, and bookkeeping whose cost does not grow with the stones."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechanics.model.model import build_model
from mechanics.results._kernels import facing
from mechanics.results.interfaces import placed_faces
from mechanics.results.postprocess import positions, velocities
from mechanics.scene.shapes import bond, wall, wedge
from tests.mechanics.shapes import brick, ground, scene


def distance(faces, face, point):
    """From the plane of a face, plus that beyond its edges."""
    normal, corners = faces.normal[face], faces.corner[face][: faces.corners[face]]
    beyond = 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        out = np.cross(b - a, normal)
        beyond = max(beyond, (point - a) @ out / np.linalg.norm(out))
    return abs((point - faces.centre[face]) @ normal) + beyond


def slowly(faces, body, point, direction):
    found = []
    for b, p, d in zip(body, point, direction, strict=True):
        own = range(faces.first[b], faces.first[b + 1])
        looks = {face: faces.normal[face] @ d for face in own}
        fits = {f: one - distance(faces, f, p) / faces.size[f] for f, one in looks.items() if one > 0}
        found.append(max(fits, key=fits.get) if fits else own[0])
    return found


def test_a_point_lies_on_the_nearest_face_that_looks_its_way():
    stones = (ground(), brick("a", (0, 0, 0), (1, 1, 0.5)), wedge("w", 0.5, 0.3, 0.4))
    model, state = build_model(scene(*stones))
    rng = np.random.default_rng(3)
    turn = Rotation.from_rotvec(rng.normal(size=(3, 3))).as_matrix()
    faces = placed_faces(model, replace(state, rotation=turn))
    body = rng.integers(0, 3, 300)
    point = state.centre[body] + rng.normal(scale=0.4, size=(300, 3))
    direction = rng.normal(size=(300, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    assert facing(faces, body, point, direction).tolist() == slowly(faces, body, point, direction)


def test_points_of_stones_of_any_shape_move_with_them():
    stones = (ground(), brick("a", (0, 0, 0), (1, 1, 0.5)), wedge("w", 0.5, 0.3, 0.4))
    model, state = build_model(scene(*stones))
    rng = np.random.default_rng(4)
    turn = Rotation.from_rotvec(rng.normal(size=(3, 3))).as_matrix()
    velocity = rng.normal(size=(3, 6))
    moved = replace(state, rotation=turn, velocity=velocity)
    for b, stone in enumerate(stones):
        arm = (stone.vertices - state.centre[b]) @ turn[b].T
        np.testing.assert_allclose(positions(model, moved)[b], state.centre[b] + arm, atol=1e-14)
        expected = velocity[b, :3] + np.cross(velocity[b, 3:], arm)
        np.testing.assert_allclose(velocities(model, moved)[b], expected, atol=1e-14)


def calls(run):
    """Number of functions that a run calls."""
    count = 0

    def called(frame, event, argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(called)
    try:
        run()
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize("what", ["the model", "the points"])
def test_what_is_done_for_each_stone_of_a_wall_is_done_in_arrays(what):
    def work(across):
        built = scene(*wall(bond(across, 6), 0.5, 0.25, 0.3))
        model, state = build_model(built)
        runs = {"the model": lambda: build_model(built), "the points": lambda: positions(model, state)}
        return calls(runs[what]), len(built.blocks)

    (few, small), (many, large) = work(6), work(24)
    assert (many - few) / (large - small) < 50  # one by one: thousands
