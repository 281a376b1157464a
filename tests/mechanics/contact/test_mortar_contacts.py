"""Weighted contacts between meshed faces, against a slow twin and what must hold of them."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.contact.contacts import NODE, material_points
from mechanics.contact.mortar_contacts import mortar_contacts
from mechanics.scene.scene import Fidelity
from mechanics.scene.state import State
from mechanics.stones.meshing.elements import Element
from tests.mechanics.contact.box_faces import BOTTOM, KINDS, TOP, nodes_of, two_boxes
from tests.mechanics.contact.polygons import moments, overlap
from tests.mechanics.shapes import brick, detected, scene

LOWER = ((0.0, 0.0, -0.5), (1.0, 0.7, 0.0))
PAIRS = [(9, 6), (8, 3), (4, 8), (6, 9), (3, 4), (6, None), (4, None), (9, None)]


def corners(kind):
    return 3 if kind in (3, 6) else 4


def contacts_of(shapes, placed, nodes):
    """Contacts between the lower box's top and the upper one's bottom."""
    pair, face = np.array([[0, 1]]), np.array([[TOP, 6 + BOTTOM]])
    return mortar_contacts(shapes, placed, pair, face, np.array([0]), np.array([1.0]), len(nodes), 1e-6)[0]


def places(contacts, placed, nodes):
    state = State(0.0, placed.centre, placed.rotation, np.zeros((2, 6)), nodes, np.zeros_like(nodes))
    return material_points(contacts, state)


def gauss():
    """Points and weights of a tensor rule squeezed on the unit triangle, exact to degree 10."""
    x, w = np.polynomial.legendre.leggauss(6)
    x, w = (x + 1) / 2, w / 2
    return [
        ((a, b * (1 - a)), 2 * u * v * (1 - a))
        for (a, u), (b, v) in itertools.product(zip(x, w, strict=True), repeat=2)
    ]


def functions(kind, x):
    """Shape functions as the polynomials that are one at their node: by inverting the matrix of monomials."""
    powers = {
        3: [(0, 0), (1, 0), (0, 1)],
        6: [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)],
        4: [(0, 0), (1, 0), (0, 1), (1, 1)],
        8: [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2)],
        9: list(itertools.product(range(3), repeat=2)),
    }[kind]

    def monomials(points):
        return np.array([[p[0] ** a * p[1] ** b for a, b in powers] for p in points])

    return np.linalg.solve(monomials(nodes_of(kind)).T, monomials([x])[0])


def inverse(corner, kind, point):
    """Reference coordinates in a triangle or parallelogram."""
    o, u, v = (corner[0], corner[1] - corner[0], corner[-1] - corner[0])
    if kind in (3, 6):
        return np.linalg.solve(np.column_stack([u, corner[2] - corner[0]]), point - o)
    return 2 * np.linalg.solve(np.column_stack([u, v]), point - o) - 1


def sharpened(hats, share, whole):
    """Rows that turn the hats of a facet into its test functions: themselves up to 80 % cover, dual from 98 % on."""
    dual = np.clip((share.sum() / whole - 0.8) / 0.18, 0.0, 1.0)
    return (1 - dual) * np.eye(len(share)) + dual * np.diag(share) @ np.linalg.inv(hats)


def twin(own, other, outline, x_own, x_other):
    """∫ψ_i, ∫ψ_i N_k and ∫ψ_i N_j by cutting each facet of `own` with each of `other`, or with an outline (n, 2)."""
    share = np.zeros(len(x_own))
    mass, cross = np.zeros((len(x_own),) * 2), np.zeros((len(x_own), len(x_other)))
    for facet in own.facet:
        kind, top = len(facet), facet[: corners(len(facet))]
        mine = x_own[top]
        hats, part = np.zeros((len(top),) * 2), np.zeros(len(top))
        near, far = np.zeros((len(top), len(x_own))), np.zeros((len(top), len(x_other)))
        for theirs in [None] if other is None else other.facet:
            cutter = outline if theirs is None else x_other[theirs[: corners(len(theirs))]]
            for x, weight in quadrature(mine, cutter):
                r = inverse(mine, kind, x)
                psi = functions(corners(kind), r)
                part += weight * psi
                hats += weight * np.outer(psi, psi)
                near[:, facet] += weight * np.outer(psi, functions(kind, r))
                if theirs is not None:
                    n = functions(len(theirs), inverse(cutter, len(theirs), x))
                    far[:, theirs] += weight * np.outer(psi, n)
        if part.sum() > 0:
            turn = sharpened(hats, part, sum(weight for _, weight in quadrature(mine, mine)))
            share[top] += part
            mass[top] += turn @ near
            cross[top] += turn @ far
    return share, mass, cross


def quadrature(polygon, cutter):
    """Points and weights over what two convex polygons (n, 2) have in common."""
    if np.linalg.det([cutter[1] - cutter[0], cutter[2] - cutter[0]]) < 0:
        cutter = cutter[::-1]
    flat = (np.column_stack([p, np.zeros(len(p))]) for p in (cutter, polygon))
    piece = overlap(*flat, np.array([0.0, 0.0, 1.0]))[:, :2]
    for k in range(1, len(piece) - 1):
        o, u, v = piece[0], piece[k] - piece[0], piece[k + 1] - piece[0]
        for (a, b), weight in gauss():
            yield o + a * u + b * v, 0.5 * abs(np.linalg.det([u, v])) * weight


@pytest.mark.parametrize(("kind", "far"), PAIRS)
@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_weights_are_the_integrals_of_their_twin(kind, far, angle):
    """The upper box is the finer, so it carries the contacts; facets are triangles and parallelograms."""
    uneven = 0.2 if kind in (3, 6) else 0.0
    upper = ((0.25, -0.1, 0.0), (0.85, 0.5, 0.4))
    shapes, placed, nodes = two_boxes(
        LOWER, upper, None if far is None else (far, 2, 2, 0.0), (kind, 4, 3, uneven), angle
    )
    contacts = contacts_of(shapes, placed, nodes)
    own, other = shapes.face_mesh[6 + BOTTOM], shapes.face_mesh[TOP]
    flat = nodes[:, :2]
    outline = np.array([(0, 0), (1, 0), (1, 0.7), (0, 0.7)])
    x_other = flat[other.node] if other is not None else np.zeros((0, 2))
    share, mass, cross = twin(own, other, outline, flat[own.node], x_other)
    assert (contacts.bodies == [1, 0]).all()
    weights = contacts.weights.toarray()
    # none of these overlaps leaves slivers
    found = np.searchsorted(own.node, contacts.key - NODE)
    np.testing.assert_array_equal(found, np.flatnonzero(share > 0))
    np.testing.assert_allclose(contacts.area, share[found], atol=1e-14)
    own_rows = weights[0::2][:, own.node] * contacts.area[:, None]
    np.testing.assert_allclose(own_rows, mass[found], atol=1e-14)
    if other is not None:
        far_rows = weights[1::2][:, other.node] * contacts.area[:, None]
        np.testing.assert_allclose(far_rows, cross[found], atol=1e-14)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(list(itertools.product(KINDS, [*KINDS, None]))),
    st.floats(-1.5, 1.5),
    st.tuples(st.floats(-0.4, 0.9), st.floats(-0.4, 0.6)),
    st.integers(1, 5),
)
def test_both_sides_reproduce_constants_and_places_and_share_out_the_overlap(kinds, angle, shift, count):
    """On uneven quadrilaterals too, where the integrals themselves are not exact."""
    kind, far = kinds
    low = np.array([*shift, 0.0])
    shapes, placed, nodes = two_boxes(
        LOWER,
        (low, low + np.array([0.8, 0.6, 0.4])),
        None if far is None else (far, 3, 2, 0.25),
        (kind, count, count, 0.25),
        angle,
    )
    contacts = contacts_of(shapes, placed, nodes)
    faces = [
        placed.shapes.vertex[placed.shapes.corner[placed.shapes.cptr[f] : placed.shapes.cptr[f + 1]]]
        for f in (TOP, 6 + BOTTOM)
    ]
    whole = moments(overlap(*faces, np.array([0.0, 0.0, 1.0]))[:, :2])[0]
    if whole < 1e-6 * 0.48:
        assert len(contacts) == 0
        return
    assert contacts.area.sum() == pytest.approx(whole, rel=1e-12)
    assert contacts.area.min() > 0
    sums = contacts.weights.sum(axis=1).reshape(-1, 2)
    elastic = [shapes.face_mesh[6 * b] is not None for b in contacts.bodies[0]]
    np.testing.assert_allclose(sums, np.broadcast_to(np.array(elastic, float), sums.shape), atol=1e-13)
    points = places(contacts, placed, nodes)
    np.testing.assert_allclose(points[:, 0], points[:, 1], atol=1e-12)
    assert len(set(contacts.key.tolist())) == len(contacts)


@pytest.mark.parametrize("kind", KINDS)
def test_quadratic_facets_have_contacts_at_corners_alone(kind):
    shapes, placed, nodes = two_boxes(LOWER, ((0, 0, 0), (1, 0.7, 1)), None, (kind, 4, 3, 0.0))
    assert len(contacts_of(shapes, placed, nodes)) == 5 * 4


@pytest.mark.parametrize("kind", [3, 4])
def test_on_linear_facets_that_are_covered_a_contact_is_a_node(kind):
    """The dual functions meet no other node's shape function, so a stone rocks about its very corners."""
    shapes, placed, nodes = two_boxes(LOWER, ((0, 0, 0), (1, 0.7, 1)), (4, 2, 2, 0.0), (kind, 4, 3, 0.0))
    contacts = contacts_of(shapes, placed, nodes)
    own = contacts.weights[0::2]
    assert (np.diff(own.indptr) == 1).all()
    np.testing.assert_allclose(own.data, 1.0, rtol=1e-14)
    np.testing.assert_allclose(np.ptp(places(contacts, placed, nodes)[:, :, :2], axis=0), [[1, 0.7]] * 2)


@pytest.mark.parametrize("kind", KINDS)
def test_contacts_move_steadily_as_the_overlap_shrinks(kind):
    """Hats give way to dual functions little by little: no contact may jump by more than ten times its stone."""
    before = None
    for x in np.linspace(0.0, 0.1, 201):
        shapes, placed, nodes = two_boxes(LOWER, ((x, 0, 0), (1 + x, 0.7, 1)), None, (kind, 10, 7, 0.0))
        contacts = contacts_of(shapes, placed, nodes)
        after = dict(zip(contacts.key.tolist(), places(contacts, placed, nodes)[:, 0], strict=True))
        if before is not None:
            jumps = [np.abs(after[k] - before[k]).max() for k in after.keys() & before.keys()]
            assert max(jumps) < 10 * 0.0005
        before = after


@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-8, 1e-15])
@pytest.mark.parametrize("kind", KINDS)
def test_slivers_join_their_neighbours(kind, width):
    """The overlap ends `width` beyond a row of nodes: the next row would have next to nothing of it."""
    shapes, placed, nodes = two_boxes(
        LOWER, ((0.5 - width, 0.0, 0.0), (1.5 - width, 0.7, 1.0)), None, (kind, 10, 7, 0.0)
    )
    contacts = contacts_of(shapes, placed, nodes)
    assert contacts.area.sum() == pytest.approx((0.5 + width) * 0.7, rel=1e-12)
    assert contacts.area.min() > 1e-3 * contacts.area.max()
    points = places(contacts, placed, nodes)
    np.testing.assert_allclose(points[:, 0], points[:, 1], atol=1e-12)
    # a uniform pressure has its resultant in the middle of the overlap
    middle = contacts.area @ points[:, 0] / contacts.area.sum()
    np.testing.assert_allclose(middle, [0.75 - width / 2, 0.35, 0.0], atol=1e-12)


@pytest.mark.parametrize("swap", [False, True])
def test_two_faces_just_as_fine_have_one_candidate_whatever_their_order(swap):
    """The one that looks down; and of two meshes the finer."""
    lower, upper = LOWER, ((0.0, 0.0, 0.0), (1.0, 0.7, 0.5))
    mesh = (4, 3, 2, 0.0)
    shapes, placed, nodes = two_boxes(lower, upper, mesh, mesh)
    pair, face = np.array([[0, 1]]), np.array([[TOP, 6 + BOTTOM]])
    if swap:
        pair, face = pair[:, ::-1], face[:, ::-1]
    found, _ = mortar_contacts(shapes, placed, pair, face, np.array([0]), np.array([1.0]), len(nodes), 1e-6)
    assert (found.bodies == [1, 0]).all()
    finer, placed, nodes = two_boxes(lower, upper, (4, 3, 3, 0.0), mesh)
    found, _ = mortar_contacts(finer, placed, pair, face, np.array([0]), np.array([1.0]), len(nodes), 1e-6)
    assert (found.bodies == [0, 1]).all()


SOFT = Fidelity.DEFORMABLE


@pytest.mark.parametrize("element", [Element.HEX8, Element.TET4, Element.TET10])
@pytest.mark.parametrize("off", [0.0, 1.4e-17, -1.4e-17, 4.2e-17, 1e-15, -1e-15, 1e-13, -1e-13])
def test_rounding_makes_no_points_without_area(element, off):
    """Each point carries a part of the bed that is a part of a facet, and all of them the whole bed."""
    seam = -0.1 + off
    lower = [
        brick("left", (-0.3, -0.25, 0.0), (seam, 0.25, 0.3), SOFT, mesh_size=0.3, element=element),
        brick("right", (seam, -0.25, 0.0), (0.3, 0.25, 0.3), SOFT, mesh_size=0.21, element=element),
    ]
    upper = brick("upper", (-0.3, -0.25, 0.3), (0.3, 0.25, 0.6), SOFT, mesh_size=0.2, element=element)
    _, _, contacts = detected(scene(*lower, upper))
    pairs = np.sort(contacts.bodies, axis=1)
    for first, width in ((0, 0.2), (1, 0.4)):
        area = contacts.area[(pairs == (first, 2)).all(axis=1)]
        assert area.sum() == pytest.approx(width * 0.5, rel=1e-9)
        assert area.min() > 1e-4
