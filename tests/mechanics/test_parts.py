"""Stones that are not convex: unions of convex parts."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.contact.contacts import gaps, material_points
from mechanics.model import build_model
from mechanics.polyhedra import mass_properties
from mechanics.result import Outcome
from mechanics.scene import Fidelity, Part
from mechanics.simulate import simulate
from moma.errors import GeometryError, SceneError
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


def test_each_part_is_a_shape_and_the_thinnest_one_is_the_size_of_the_stone():
    model, _ = build_model(scene(ground(), portal(), brick("a", (9, 0, 0), (10, 1, 1))))
    np.testing.assert_array_equal(model.surfaces.body, [0, 1, 1, 1, 2])
    np.testing.assert_array_equal(model.surfaces.sptr, [0, 1, 4, 5])
    np.testing.assert_allclose(model.surfaces.shape_size, [1, 0.5, 0.5, 0.5, 1], rtol=1e-13)
    np.testing.assert_allclose(model.surfaces.size, [1, 0.5, 1], rtol=1e-13)


def test_parts_that_do_not_fill_the_outline_are_refused():
    missing = replace(portal(), parts=portal().parts[:2])
    with pytest.raises(GeometryError, match=r"stone portal: its parts have 1 m³, its outline 2.5 m³"):
        build_model(scene(missing))


def test_a_deformable_stone_of_parts_is_refused():
    soft = replace(portal(), fidelity=Fidelity.DEFORMABLE, mesh_size=0.5)
    with pytest.raises(
        SceneError, match=r"stone portal: a deformable stone has several parts.*make it rigid"
    ):
        build_model(scene(soft))


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
    assert result.outcome is Outcome.EQUILIBRIUM
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
