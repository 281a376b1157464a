"""Weighted contacts of balls on meshed faces: places, gaps and areas in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.contact.contacts import gaps, material_points
from mechanics.contact.detection import Detector
from mechanics.model.balls import ball
from mechanics.scene.scene import Fidelity
from mechanics.stones.meshing.elements import Element
from tests.mechanics.shapes import LIMESTONE, TURN, brick, detected, moved, scene

SOFT = Fidelity.DEFORMABLE


def pressed(element=Element.HEX8, size=0.05, sink=0.002, radius=2.0, turn=None, at=(0.0, 0.0), **more):
    """A ball that overlaps the top of a block by `sink`, in the middle or elsewhere."""
    block = brick("block", (-0.25, -0.2, -0.2), (0.25, 0.2, 0), SOFT, mesh_size=size, element=element)
    stone = ball("ball", (*at, radius - sink), radius, LIMESTONE)
    stones = [moved(s, turn) for s in (block, stone)]
    return detected(scene(*stones, alert=more.pop("alert", 0.05)))


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
@pytest.mark.parametrize("element", [Element.HEX8, Element.HEX27, Element.TET4, Element.TET10])
def test_every_node_in_reach_has_the_mean_gap_of_its_test_function(element, turn):
    """A test function dual to the hat over squares of side s has ∫ψ r²/∫ψ = r_α² - s²/3, as -s²/6 along each side."""
    _, state, contacts = pressed(element, turn=turn, alert=0.2)
    assert (contacts.bodies == [0, 1]).all()
    assert len(set(contacts.key.tolist())) == len(contacts)
    points = material_points(contacts, state) @ turn
    # all of the top is in reach
    assert contacts.area.sum() == pytest.approx(0.5 * 0.4, rel=1e-12)
    np.testing.assert_allclose(points[:, 0, 2], 0, atol=1e-12)
    frame = contacts.frame @ turn
    away = points[:, 0] - [0, 0, 2.0 - 0.002]
    far = np.linalg.norm(away, axis=1)
    np.testing.assert_allclose(frame[:, 0], away / far[:, None], atol=1e-12)
    np.testing.assert_allclose(frame @ frame.transpose(0, 2, 1), np.eye(3) + 0 * frame, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0, rtol=1e-12)
    # the foot lies on the normal through the node's place
    np.testing.assert_allclose(np.cross(points[:, 0] - points[:, 1], frame[:, 0]), 0, atol=1e-12)
    if element in (Element.HEX8, Element.HEX27):
        inner = (np.abs(points[:, 0, 0]) < 0.22) & (np.abs(points[:, 0, 1]) < 0.17)
        assert inner.sum() == 9 * 7
        exact = far - 2.0 - (0.05**2 / 3) / (2 * far)
        np.testing.assert_allclose(gaps(contacts, state)[inner], exact[inner], atol=1e-10)
    weights = contacts.weights.sum(axis=1).reshape(-1, 2)
    np.testing.assert_allclose(weights, np.broadcast_to([1.0, 0.0], weights.shape), atol=1e-12)


def test_only_nodes_in_reach_make_contacts():
    """Gap r²/2R - s²/6R - sink; in reach up to a hundredth of the block's width."""
    _, state, contacts = pressed(size=0.025, alert=0.01)
    points = material_points(contacts, state)[:, 0]
    r2 = (points[:, :2] ** 2).sum(axis=1)
    reach = 2 * 2.0 * (0.01 * 0.2 + 0.002)
    assert 20 < len(contacts) < 17 * 21
    assert r2.max() == pytest.approx(reach, rel=0.1)


@pytest.mark.parametrize("at", [(0.0, 0.0), (0.02, 0.0), (0.125, 0.1)], ids=["on", "beside", "between"])
def test_a_ball_on_a_mesh_too_coarse_for_it_touches_in_one_point(at):
    _, state, contacts = pressed(size=0.2, radius=0.1, sink=0.001, at=at)
    assert len(contacts) == 1
    assert contacts.bodies.tolist() == [[1, 0]]
    np.testing.assert_allclose(gaps(contacts, state), -0.001, atol=1e-12)
    np.testing.assert_allclose(material_points(contacts, state)[0, 1], [*at, 0.0], atol=1e-12)


def test_contacts_follow_the_deformed_face():
    """Where all nodes of the block have sunk by d against its axes, all gaps are wider by d (over cos, near 1)."""
    model, state, contacts = pressed()
    find = Detector(model.surfaces, model.fixed, 0.05)
    sunk = state.node - [0, 0, 0.0005]
    there = replace(state, node=sunk)
    after = find(there, np.zeros(2))
    np.testing.assert_array_equal(after.key, contacts.key)
    np.testing.assert_allclose(gaps(after, there) - gaps(contacts, state), 0.0005, rtol=2e-2)
