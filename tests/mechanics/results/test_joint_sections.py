"""Joint polygons of shifted bricks, and kerns with closed forms.

A resultant is within the kern of a section where a linear pressure under it pulls nowhere. Closed forms (any textbook
of the strength of materials, e.g. Timoshenko, Strength of Materials I, §53): a rectangle b/6 along an axis, a circle
r/4, a triangle of height h: h/6 towards the corner and h/12 towards the side.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechanics.results._kernels import Faces
from mechanics.results.joint_sections import eccentricity, sections

TURN = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()


def faces_of(lower, upper, height=0.0, turn=None):
    """Two plane faces: one that looks up at z = 0, over it one that looks down; polygons (n, 2) counter-clockwise."""
    turn = np.eye(3) if turn is None else turn
    corners = [
        np.column_stack([lower, np.zeros(len(lower))]),
        np.column_stack([upper, np.full(len(upper), height)])[::-1],
    ]
    most = max(map(len, corners))
    padded = np.array([np.vstack([one, np.zeros((most - len(one), 3))]) for one in corners])
    return Faces(
        body=np.array([0, 1]),
        first=np.array([0, 1, 2]),
        normal=np.array([[0.0, 0, 1], [0, 0, -1]]) @ turn.T,
        centre=np.array([one.mean(axis=0) for one in corners]) @ turn.T,
        corner=padded @ turn.T,
        corners=np.array([len(one) for one in corners]),
        size=np.ones(2),
        flat=np.ones(2, dtype=bool),
    )


def rectangle(width, depth, away=(0.0, 0.0)):
    return np.array([[0, 0], [width, 0], [width, depth], [0, depth]], dtype=float) + away


def pressed_at(section, place, force=1000.0):
    """The position (kern, edge) found for a force normal to the section at a world place."""
    n = section.frame[:, 0]
    push = force * n
    moment = np.cross(place - section.centroid, push)
    _, kern, edge = eccentricity(section, push, moment, 1e-6)
    return float(kern[0]), float(edge[0])


@pytest.mark.parametrize("turn", [None, TURN])
def test_the_polygon_of_shifted_bricks_is_what_they_share(turn):
    axes = np.eye(3) if turn is None else turn
    faces = faces_of(rectangle(1.0, 0.5), rectangle(1.0, 0.5, (0.3, 0.1)), 0.002, turn)
    section = sections(faces, np.array([[0, 1]]))
    assert section.area[0] == pytest.approx(0.7 * 0.4)
    assert section.centroid[0] @ axes == pytest.approx([0.65, 0.3, 0.001])
    assert section.moment[0] == pytest.approx([0.4 * 0.7**3 / 12, 0.7 * 0.4**3 / 12])
    # n from the second body, the upper one, to the first
    assert section.frame[0, 0] @ axes == pytest.approx([0, 0, -1])
    assert abs(section.frame[0, 1] @ axes) == pytest.approx([1, 0, 0], abs=1e-12)
    assert np.linalg.det(section.frame[0]) == pytest.approx(1.0)
    assert section.gap[0, : section.count[0]] == pytest.approx(0.002)
    corners = section.polygons()[0] @ axes
    assert corners.min(axis=0) == pytest.approx([0.3, 0.1, 0.001])
    assert corners.max(axis=0) == pytest.approx([1.0, 0.5, 0.001])


@pytest.mark.parametrize("turn", [None, TURN])
def test_the_kern_of_a_rectangle_ends_at_a_sixth(turn):
    axes = np.eye(3) if turn is None else turn
    section = sections(faces_of(rectangle(0.6, 0.9), rectangle(0.6, 0.9), 0.0, turn), np.array([[0, 1]]))
    for away, kern, edge in (
        ((0, 0, 0), 0.0, 0.0),
        ((0.1, 0, 0), 1.0, 1 / 3),
        ((0, -0.15, 0), 1.0, 1 / 3),
        ((0.05, 0.075, 0), 1.0, 1 / 6),  # the kern is a rhombus
        ((0.3, 0, 0), 3.0, 1.0),
        ((0.45, 0, 0), 4.5, 1.5),
    ):
        assert pressed_at(section, axes @ (np.array([0.3, 0.45, 0.0]) + away)) == pytest.approx(
            (kern, edge), abs=1e-9
        )


def test_the_kern_of_a_circle_ends_at_a_quarter_of_its_radius():
    """A regular polygon of n corners has r/4 but for terms of (π/n)²."""
    angle = 2 * np.pi * np.arange(200) / 200
    ring = 0.4 * np.column_stack([np.cos(angle), np.sin(angle)])
    section = sections(faces_of(ring, ring), np.array([[0, 1]]))
    for direction in (0.0, 0.7, 2.0):
        place = 0.1 * np.array([np.cos(direction), np.sin(direction), 0.0])
        assert pressed_at(section, place) == pytest.approx((1.0, 0.25), rel=1e-3)


def test_the_kern_of_a_triangle_ends_at_a_sixth_and_at_a_twelfth():
    triangle = np.array([[0, 0], [0.8, 0], [0.5, 0.6]])
    section = sections(faces_of(triangle, triangle), np.array([[0, 1]]))
    centroid = np.array([*triangle.mean(axis=0), 0.0])
    # the median carries the resultants that a pressure constant along the base has
    to_corner = np.array([0.5, 0.6, 0.0]) - np.array([0.4, 0.0, 0.0])
    assert pressed_at(section, centroid + to_corner / 6)[0] == pytest.approx(1.0)
    assert pressed_at(section, centroid - to_corner / 12)[0] == pytest.approx(1.0)
    assert pressed_at(section, np.array([0.4, 0.0, 0.0]))[1] == pytest.approx(1.0)


def test_without_compression_there_is_no_eccentricity():
    section = sections(faces_of(rectangle(1, 1), rectangle(1, 1)), np.array([[0, 1]]))
    pull = -1000.0 * section.frame[:, 0]
    for force, least in ((pull, 0.0), (-pull, 2000.0)):
        place, kern, edge = eccentricity(section, force, np.zeros((1, 3)), least)
        assert np.isnan(place).all()
        assert np.isnan(kern[0])
        assert np.isnan(edge[0])


def test_the_gap_of_tilted_faces_is_that_at_their_corners():
    """A face that is turned by 2° about the edge x = 0 gapes by tan 2° at x = 1, seen along the mean normal."""
    faces = faces_of(rectangle(1.0, 1.0), rectangle(1.0, 1.0))
    turn = Rotation.from_euler("y", -2.0, degrees=True).as_matrix()
    corner, normal = faces.corner.copy(), faces.normal.copy()
    corner[1], normal[1] = corner[1] @ turn.T, turn @ normal[1]
    tilted = Faces(
        faces.body,
        faces.first,
        normal,
        np.array([corner[0].mean(axis=0), corner[1].mean(axis=0)]),
        corner,
        faces.corners,
        faces.size,
        faces.flat,
    )
    section = sections(tilted, np.array([[0, 1]]))
    gap = section.gap[0, : section.count[0]]
    assert gap.min() == pytest.approx(0.0, abs=1e-12)
    assert gap.max() == pytest.approx(2 * np.sin(np.radians(1.0)), rel=1e-9)


@pytest.mark.parametrize("width", [1e-5, 3e-6, 2e-6])
@pytest.mark.parametrize("away", [0.0, 1e3])
def test_a_splinter_is_measured_without_a_warning(width, away):
    """Its second moment can vanish, or turn negative, in rounding; then its kern is not known."""
    faces = faces_of(rectangle(1, 1, (away, 0)), rectangle(1, 1, (away + 1 - width, 0)))
    overlap = sections(faces, np.array([[0, 1]]))
    flat = replace(overlap, moment=overlap.moment * [1.0, 0.0])
    for section in (overlap, flat):
        kern, edge = pressed_at(section, section.centroid[0] + [0.0, 0.2, 0.0])
        assert np.isnan(kern) or kern >= 0.0
        assert edge >= 0.0
    assert np.isnan(pressed_at(flat, flat.centroid[0] + [width, 0.2, 0.0])[0])
