"""Stones that are not convex: unions of convex parts."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import GeometryError
from mechanics.contact.contacts import gaps, material_points
from mechanics.dynamics.outcome import Outcome
from mechanics.model.model import build_model
from mechanics.scene.scene import Fidelity, Part
from mechanics.simulate import simulate
from mechanics.stones.meshing.elements import Element
from mechanics.stones.polyhedra import mass_properties
from tests.mechanics.shapes import (
    TURN,
    brick,
    detected,
    ground,
    moved,
    profile,
    rectangle,
    scene,
    transformed,
)

# a lintel 3 m wide on two feet of 0.5 m
PORTAL = [(0, 0), (0.5, 0), (0.5, 1), (2.5, 1), (2.5, 0), (3, 0), (3, 1.5), (0, 1.5)]
PORTAL_PARTS = [rectangle(0, 0, 0.5, 1), rectangle(2.5, 0, 3, 1), rectangle(0, 1, 3, 1.5)]


def portal(**more):
    return profile("portal", PORTAL, PORTAL_PARTS, **more)


def gallows(reach, **more):
    """An L on its head: a foot 1 m wide and 2 m high, an arm 0.5 m thick that reaches over its side."""
    outline = [(0, 0), (1, 0), (1, 2), (1 + reach, 2), (1 + reach, 2.5), (0, 2.5)]
    parts = [rectangle(0, 0, 1, 2), rectangle(0, 2, 1 + reach, 2.5)]
    return profile("gallows", outline, parts, **more)


# --- mass and surfaces ---


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
def test_mass_and_inertia_of_the_parts_are_those_of_the_outline(turn):
    stone = moved(portal(), turn, (3, 4, 5))
    model, state = build_model(scene(stone))
    whole = mass_properties(stone.vertices, stone.faces)
    assert model.mass[0] == pytest.approx(2000 * (3 * 1.5 - 2 * 1), rel=1e-13)
    np.testing.assert_allclose(state.centre[0], whole.centroid, atol=1e-13)
    np.testing.assert_allclose(model.inertia.inertia[0], 2000 * whole.inertia, rtol=1e-12, atol=1e-9)


def test_each_part_is_a_shape_and_the_size_of_the_stone_is_the_width_of_all_together():
    model, _ = build_model(scene(ground(), portal(), brick("a", (9, 0, 0), (10, 1, 1))))
    np.testing.assert_array_equal(model.surfaces.body, [0, 1, 1, 1, 2])
    np.testing.assert_array_equal(model.surfaces.sptr, [0, 1, 4, 5])
    np.testing.assert_allclose(model.surfaces.shapes.size, [1, 0.5, 0.5, 0.5, 1], rtol=1e-13)
    np.testing.assert_allclose(model.surfaces.size, [1, 1, 1], rtol=1e-13)


def folded(sliver, **more):
    """A cube of 1 m of which rounding has cut a sliver off the top, this thin at one side and flat at the other."""
    top = [(0, 1 - sliver), (1, 1 - 2 * sliver), (1, 1), (0, 1)]
    return profile("folded", rectangle(0, 0, 1, 1), [[(0, 0), (1, 0), *top[1::-1]], top], **more)


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
def test_a_sliver_among_its_parts_makes_no_stone_small(turn):
    model, _ = build_model(scene(moved(folded(1e-5), turn)))
    assert model.surfaces.shapes.size.min() < 3e-5
    assert model.surfaces.size[0] == pytest.approx(1.0, rel=1e-9)


def test_a_stone_with_a_sliver_that_lands_after_microns_has_not_collapsed():
    """It falls 6 µm: less than any stone, more than half the sliver, and faster than it would cross it."""
    stone = moved(folded(1e-5), shift=(0.0, 0.0, 6e-6))
    result = simulate(scene(ground(), stone, step=1e-4, duration=0.05))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.penetration < 1e-9


def test_a_sliver_is_watched_from_as_far_as_the_stone():
    """Its contacts are there before it arrives, at the alert distance of the whole."""
    above = brick("a", (0, 0, 1.04), (1, 1, 2), Fidelity.FIXED)
    _, state, contacts = detected(scene(folded(1e-5), above))
    assert (gaps(contacts, state) < 0.04 + 5e-6).sum() == 4


def test_parts_that_do_not_fill_the_outline_are_refused():
    missing = replace(portal(), parts=portal().parts[:2])
    with pytest.raises(GeometryError, match=r"stone portal: its parts have 1 m³, its outline 2.5 m³"):
        build_model(scene(missing))


def soft(block, size, element=Element.TET4):
    """The same stone, made of finite elements."""
    return replace(block, fidelity=Fidelity.DEFORMABLE, mesh_size=size, element=element)


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
def test_the_facets_of_a_deformable_stone_lie_on_the_faces_of_its_parts(turn):
    """Faces between parts have no facets; the outer walls are cut along the seam, and facets reach across it."""
    model, state = build_model(scene(moved(soft(portal(), 0.4), turn)))
    own = model.surfaces
    area = []
    for mesh in own.face_mesh:
        x = mesh.reference[mesh.facet]
        area.append(0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum())
    middle = np.array(
        [own.shapes.vertex[c].mean(axis=0) for c in np.split(own.shapes.corner, own.shapes.cptr[1:-1])]
    )
    middle = (middle + state.centre[0]) @ turn
    normal = own.shapes.normal @ turn
    # the tops of both feet, and of the lintel's underside what does not lie on them
    seam = (np.abs(normal[:, 2]) > 0.9) & (np.abs(middle[:, 2] - 1.0) < 1e-9)
    assert sorted(np.array(area)[seam]) == pytest.approx([0.0, 0.0, 2.0], abs=1e-9)
    inner = (np.abs(normal[:, 0]) > 0.9) & (np.abs(middle[:, 0] - 1.5) < 1.4)
    flat = np.abs(normal[:, 2]) > 0.9
    for face in np.flatnonzero(~seam):
        if inner[face] or flat[face]:
            assert area[face] == pytest.approx(own.shapes.face_area[face], rel=1e-9)
            assert not own.face_mesh[face].cut
        else:
            assert own.face_mesh[face].cut
            assert area[face] > own.shapes.face_area[face] * 1.001


@pytest.mark.parametrize("element", [Element.HEX8, Element.HEX20, Element.TET10])
def test_a_brick_cut_through_its_elements_stands_as_the_whole(element):
    """The cut lies at 0.37 of its length, beside all nodes: forces, areas and places add up to the same."""
    whole = soft(brick("a", (0, 0, 0), (1, 0.5, 0.4)), 0.25, element)
    pieces = [brick("b", (low, 0, 0), (high, 0.5, 0.4)) for low, high in ((0, 0.37), (0.37, 1))]
    cut = replace(whole, parts=tuple(Part(piece.vertices, piece.faces) for piece in pieces))
    ends = []
    for block in (whole, cut):
        result = simulate(scene(ground(), block, step=5e-3, duration=1.0, relaxation=True))
        assert result.outcome is Outcome.EQUILIBRIUM
        assert result.reaction == pytest.approx(result.weight, rel=1e-4)
        assert result.contacts.area.sum() == pytest.approx(0.5, rel=1e-9)
        ends.append(result.bodies[1].displacement[:, 2])
    assert len(ends[0]) == len(ends[1])
    sunk = 2000 * 9.81 * 0.4**2 / (2 * 1e9)
    np.testing.assert_allclose(ends[1], ends[0], atol=0.02 * sunk)


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
def test_infill_with_the_shape_of_a_t_carries_its_weight_between_two_leaves(turn):
    """Its stem stands on the ground between two rigid leaves, its arms lie on their tops."""
    outline = [(1, 0), (2, 0), (2, 1), (3, 1), (3, 1.5), (0, 1.5), (0, 1), (1, 1)]
    parts = [rectangle(1, 0, 2, 1), rectangle(0, 1, 3, 1.5)]
    infill = soft(profile("infill", outline, parts), 0.3)
    leaves = brick("left", (0, 0, 0), (1, 1, 1)), brick("right", (2, 0, 0), (3, 1, 1))
    one = scene(ground((-1, -1, -1), (4, 2, 0)), *leaves, infill, step=5e-3, duration=2.0, relaxation=True)
    gravity = tuple(float(g) for g in turn @ [0.0, 0.0, -9.81])
    result = simulate(replace(transformed(one, turn), gravity=gravity))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.penetration < 1e-6
    contacts = result.contacts
    sign = (contacts.bodies[:, 0] == 3).astype(float) - (contacts.bodies[:, 1] == 3)
    on = [sign * (contacts.bodies == other).any(axis=1) @ contacts.force @ turn for other in range(3)]
    weight = 2000 * 9.81 * 2.5
    np.testing.assert_allclose(sum(on), [0, 0, weight], atol=1e-4 * weight)
    # the same on the left and on the right, and something under the stem
    assert on[1][2] == pytest.approx(on[2][2], rel=0.05)
    assert min(force[2] for force in on) > 0.1 * weight


def test_a_convex_stone_cut_in_parts_moves_as_the_whole():
    """A brick, and the same cut in two, both thrown and turning."""
    velocity = (0.5, 0, 1.0, 1.0, 2.0, 0.5)
    whole = brick("a", (0, 0, 0), (1, 0.5, 0.4), velocity=velocity)
    halves = [brick("b", (x, 0, 0), (x + 0.5, 0.5, 0.4)) for x in (0, 0.5)]
    cut = replace(whole, parts=tuple(Part(half.vertices, half.faces) for half in halves))
    ends = []
    for block in (whole, cut):
        one = scene(ground(), block, step=2e-3, duration=0.5, stop_at_equilibrium=False)
        ends.append(simulate(one).bodies[1].position)
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-6)
    assert np.abs(ends[0] - whole.vertices).max() > 0.05


# --- contacts ---


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
def test_a_portal_stands_on_both_feet_and_touches_itself_nowhere(turn):
    one = transformed(scene(ground((-1, -1, -1), (4, 2, 0)), portal()), turn)
    _, state, contacts = detected(one)
    assert len(contacts) == 8
    assert len(set(contacts.key.tolist())) == 8
    assert (np.sort(contacts.bodies, axis=1) == [0, 1]).all()
    np.testing.assert_allclose(gaps(contacts, state), 0.0, atol=1e-13)
    assert contacts.area.sum() == pytest.approx(1.0, rel=1e-12)
    x = np.sort((material_points(contacts, state)[:, 0] @ turn)[:, 0])
    np.testing.assert_allclose(x, [0, 0, 0.5, 0.5, 2.5, 2.5, 3, 3], atol=1e-12)


def test_a_stone_under_a_portal_meets_its_parts_alone():
    """Pillars beside it and the lintel above: three interfaces of one pair of stones."""
    filling = brick("filling", (0.51, 0, 0), (2.49, 1, 0.99))
    _, state, contacts = detected(scene(portal(), filling))
    assert len(contacts) == 12
    assert len(set(contacts.key.tolist())) == 12
    np.testing.assert_allclose(gaps(contacts, state), 0.01, atol=1e-13)
    normal = np.where(contacts.bodies[:, :1] == 1, 1.0, -1.0) * contacts.frame[:, 0]  # on the filling
    for direction in ([1, 0, 0], [-1, 0, 0], [0, 0, -1]):
        assert (np.abs(normal - direction).max(axis=1) < 1e-12).sum() == 4


def test_two_stones_of_parts_interlock():
    """Two angles, one turned over: each one's wall stands on the other's foot, and the walls are 2 cm apart."""
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 3), (0, 3)]
    parts = [rectangle(0, 0, 2, 1), rectangle(0, 1, 1, 3)]
    lower = profile("lower", outline, parts, fidelity=Fidelity.FIXED)
    half_turn = np.diag([-1.0, 1.0, -1.0])
    upper = moved(profile("upper", outline, parts), half_turn, (2.02, 0, 4.0))
    _, state, contacts = detected(scene(lower, upper))
    flat = np.abs(contacts.frame[:, 0, 2]) > 0.99
    points = material_points(contacts, state)[flat].mean(axis=1)
    assert set(np.round(points[:, 2], 9)) == {1.0, 3.0}
    assert contacts.area[flat].sum() == pytest.approx(2 * 0.98, rel=1e-9)
    np.testing.assert_allclose(gaps(contacts, state)[flat], 0.0, atol=1e-13)
    np.testing.assert_allclose(gaps(contacts, state)[~flat], 0.02, atol=1e-13)
    assert contacts.area[~flat].sum() == pytest.approx(2.0, rel=1e-9)


# --- standing and falling ---


def test_a_portal_that_falls_on_its_feet_rests_on_them_in_balance():
    stones = ground((-1, -1, -1), (4, 2, 0)), moved(portal(), shift=(0, 0, 0.02))
    result = simulate(scene(*stones, step=2e-3, duration=1.0))
    assert result.outcome is Outcome.SETTLED
    assert result.reaction == pytest.approx(result.weight, rel=1e-5)
    # how much each foot carries is not unique, but that the middle of all is below the centre of mass is
    lever = result.contacts.point[:, 0] @ np.abs(result.contacts.force[:, 2])
    assert lever == pytest.approx(1.5 * result.weight, rel=1e-4)
    left = result.contacts.point[:, 0] < 1.5
    assert 0.4 < np.abs(result.contacts.force[left, 2].sum()) / result.weight < 0.6
    np.testing.assert_allclose(result.bodies[1].position[:, 2], portal().vertices[:, 2], atol=1e-6)


@pytest.mark.parametrize(("reach", "stands"), [(2.1, True), (2.37, False)])
def test_a_gallows_falls_when_its_centre_of_mass_leaves_its_foot(reach, stands):
    """Moments about the foot's edge: -2·1/2 of the foot and (1 + a)/2·(a - 1)/2 of the arm vanish at a = √5."""
    result = simulate(scene(ground((-5, -5, -1), (9, 5, 0)), gallows(reach), step=2e-3, duration=4.0))
    assert result.outcome is (Outcome.EQUILIBRIUM if stands else Outcome.COLLAPSED)


def test_results_show_the_outline_of_a_stone_of_parts():
    block = moved(portal(velocity=(1.0, 0, 0, 0, 0, 0)), TURN, (1, 2, 3))
    one = scene(block, gravity=(0, 0, 0), step=1e-2, duration=0.5, stop_at_equilibrium=False)
    body = simulate(one).bodies[0]
    np.testing.assert_allclose(body.reference, block.vertices, atol=1e-13)
    np.testing.assert_allclose(body.position, block.vertices + np.array([0.5, 0, 0]), atol=1e-12)
    assert body.faces == block.faces


def test_a_stone_that_is_not_convex_and_has_no_parts_is_refused_with_its_face():
    """Contacts are found by the planes of faces: of a warped or dented stone they would be found in the air."""
    warped = brick("warped", (0, 0, 0), (1, 1, 1))
    corners = warped.vertices.copy()
    corners[corners.sum(axis=1) == 3.0] += [0.0, 0.0, 0.02]
    with pytest.raises(GeometryError, match=r"face \d is not plane.*0\.0\d+ m ahead") as caught:
        build_model(scene(replace(warped, vertices=corners)))
    assert caught.value.where == "stone warped"
    middle = [0.5, 0.5, 1.0 - 5e-6]
    top = next(face for face in warped.faces if (warped.vertices[list(face), 2] == 1.0).all())
    fan = tuple((a, b, 8) for a, b in zip(top, (*top[1:], top[0]), strict=True))
    dented = replace(
        warped,
        vertices=np.vstack([warped.vertices, middle]),
        faces=(*(face for face in warped.faces if face is not top), *fan),
    )
    with pytest.raises(GeometryError, match="not convex there"):
        build_model(scene(dented))
