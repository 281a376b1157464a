"""Single contact points on meshed faces: the shape functions of the facet that holds them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.contact.contacts import gaps, material_points
from mechanics.contact.mortar_contacts import surface_weights
from mechanics.scene.scene import Fidelity
from mechanics.stones.meshing.elements import Element
from tests.mechanics.contact.box_faces import BOTTOM, KINDS, TOP, nodes_of, two_boxes
from tests.mechanics.shapes import brick, detected, ground, moved, scene

LOWER, UPPER = ((0.0, 0.0, -0.5), (1.0, 0.7, 0.0)), ((0.0, 0.0, 0.0), (1.0, 0.7, 0.4))


def weights_at(kind, place, uneven=0.25, face=TOP):
    """Weights (nn,) of the nodes under a point on top of the lower box, its nodes, and whether it lies outside."""
    shapes, placed, nodes = two_boxes(LOWER, UPPER, (kind, 4, 3, uneven), None)
    arm = np.array([[[0.0, 0.0, 0.0], [*place]]])
    weights, outside = surface_weights(
        shapes,
        placed,
        np.array([[1, 0]]),
        np.array([[6 + BOTTOM, face]]),
        np.array([[0.0, 0.0, 1.0]]),
        arm,
        len(nodes),
    )
    assert weights[[0]].nnz == 0
    return weights[[1]].toarray()[0], nodes, outside[0]


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(KINDS), st.floats(0.0, 1.0), st.floats(0.0, 0.7), st.sampled_from([TOP, -1]))
def test_the_weights_of_a_point_add_up_to_one_and_to_its_place(kind, x, y, face):
    found, nodes, outside = weights_at(kind, (x, y, 0.0), face=face)
    assert outside
    assert np.count_nonzero(found) <= kind
    assert found.sum() == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(found @ nodes, [x, y, 0.0], atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_point_on_a_node_is_that_node(kind):
    shapes, _, nodes = two_boxes(LOWER, UPPER, (kind, 4, 3, 0.25), None)
    for node in shapes.face_mesh[TOP].node:
        found, _, _ = weights_at(kind, nodes[node])
        assert found[node] == pytest.approx(1.0, abs=1e-9)
        assert np.abs(np.delete(found, node)).max() < 1e-9


@pytest.mark.parametrize("kind", [6, 8, 9])
def test_quadratic_facets_weigh_by_their_own_functions(kind):
    """In the middle of an edge, a quarter of it from a corner: 3/8, 3/4 and -1/8 of its two corners and its middle."""
    found, nodes, _ = weights_at(kind, (0.25 / 4, 0.0, 0.0), uneven=0.0)
    one, middle, other = (
        np.flatnonzero(np.abs(nodes - [x, 0, 0]).max(axis=1) < 1e-9)[0] for x in (0, 0.125, 0.25)
    )
    assert (found[one], found[middle], found[other]) == pytest.approx((3 / 8, 3 / 4, -1 / 8), abs=1e-9)
    assert nodes_of(kind).shape == (kind, 2)


def test_a_point_beside_all_facets_lies_not_outside():
    """Between the parts of a stone there are no facets; a point there touches nothing."""
    assert not weights_at(4, (0.5, 0.35, -0.25), face=-1)[2]


@pytest.mark.parametrize("element", list(Element))
@pytest.mark.parametrize("degrees", [6.0, 20.0])
def test_a_rocking_deformable_block_touches_in_points_of_its_lower_face(element, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    block = brick("a", (0, 0, 0), (0.5, 0.5, 1), Fidelity.DEFORMABLE, mesh_size=0.3, element=element)
    _, state, contacts = detected(scene(ground(), moved(block, turn)))
    points = material_points(contacts, state)
    np.testing.assert_allclose(contacts.weights.sum(axis=1).reshape(-1, 2).max(axis=1), 1.0, atol=1e-9)
    np.testing.assert_allclose(points[:, :, :2].max(axis=1), points[:, :, :2].min(axis=1), atol=1e-9)
    np.testing.assert_allclose(np.sort(gaps(contacts, state))[:2], 0.0, atol=1e-9)
