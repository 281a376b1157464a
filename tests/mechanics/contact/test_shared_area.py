"""Stones that touch without a common area bear nothing as they are drawn, whatever rounding says of them."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.contact.contacts import gaps
from mechanics.contact.shared_area import SLACK, recess_at
from mechanics.dynamics.contact_search import contacts_as_drawn, detector
from mechanics.limit.assembly import assembly
from mechanics.limit.limit_load import limit_load
from mechanics.limit.live_loads import Acceleration
from mechanics.model.model import build_model
from mechanics.results.forecast.plan import loose_blocks
from mechanics.scene.scene import Fidelity
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, ground, scene, transformed
from tests.validation.wild.limits import dome_with_an_oculus


def grid(noise=0.0, seed=0):
    """Four stones in stack bond, all moved a little; their middle edge is common to all four."""
    rng = np.random.default_rng(seed)
    stones = [
        brick(f"{i}{k}", (0.4 * i, 0, 0.3 * k), (0.4 * i + 0.4, 0.3, 0.3 * k + 0.3))
        for k in (0, 1)
        for i in (0, 1)
    ]
    stones = [replace(one, vertices=one.vertices + rng.uniform(-noise, noise, 3)) for one in stones]
    return scene(ground(), *stones, duration=0.5)


def touching(one):
    """Codes of the pairs of stones with contact points at the start."""
    model, state = build_model(one)
    codes = [block.code for block in one.blocks]
    return {frozenset((codes[a], codes[b])) for a, b in contacts_as_drawn(model, state).bodies}


@pytest.mark.parametrize("noise", [0.0, 1e-10, 1e-6, 3e-5])
def test_diagonal_stones_have_no_contact_points(noise):
    pairs = touching(grid(noise))
    assert not {frozenset(("00", "11")), frozenset(("10", "01"))} & pairs
    assert {frozenset(("00", "01")), frozenset(("00", "10")), frozenset(("ground", "00"))} <= pairs


def test_a_stone_on_an_edge_within_a_face_and_an_opened_joint_touch():
    turned = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
    stone = transformed(scene(brick("stone", (0, 0, 0), (0.4, 0.4, 1.0))), turned).blocks[0]
    sunk = replace(stone, vertices=stone.vertices - [0, 0, stone.vertices[:, 2].min()])
    assert frozenset(("ground", "stone")) in touching(scene(ground(), sunk))
    # a joint that has opened by 10° about an edge that both stones share
    angle = np.radians(10.0)
    turned = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    upper = transformed(scene(brick("upper", (-0.4, 0, 0), (0, 0.4, 0.4))), turned).blocks[0]
    lower = brick("lower", (-0.4, 0, -0.4), (0, 0.4, 0), Fidelity.FIXED)
    assert frozenset(("lower", "upper")) in touching(scene(lower, upper))


@pytest.mark.parametrize("longer", [-1e-10, 1e-6])
def test_a_slab_as_long_as_its_span_bears_on_nothing(longer):
    walls = [
        brick("left", (-0.4, 0, 0), (0, 0.3, 1), Fidelity.FIXED),
        brick("right", (1, 0, 0), (1.4, 0.3, 1), Fidelity.FIXED),
    ]
    one = scene(*walls, brick("slab", (-longer, 0, 1), (1 + longer, 0.3, 1.2)), step=2e-2, duration=1.0)
    assert loose_blocks(*build_model(one)) == ("slab",)
    assert simulate(one).outcome.value == "collapsed"


def test_a_slab_with_bearings_of_two_millimetres_rests():
    walls = [
        brick("left", (-0.4, 0, 0), (0, 0.3, 1), Fidelity.FIXED),
        brick("right", (1, 0, 0), (1.4, 0.3, 1), Fidelity.FIXED),
    ]
    one = scene(*walls, brick("slab", (-0.002, 0, 1), (1.002, 0.3, 1.2)), step=2e-2, duration=1.0)
    assert simulate(one).outcome.value == "equilibrium"


def test_limits_of_a_dome_do_not_depend_on_rounding_or_order():
    one = dome_with_an_oculus()
    turn = 2 * np.pi / 8
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    rng = np.random.default_rng(3)
    order = rng.permutation(len(one.blocks))
    rounded = [
        replace(block, vertices=block.vertices + rng.uniform(-3e-10, 3e-10, block.vertices.shape))
        for block in one.blocks
    ]
    forms = [
        one,
        transformed(one, about),
        replace(one, blocks=tuple(one.blocks[i] for i in order)),
        replace(one, blocks=tuple(rounded)),
    ]
    bounds = [limit_load(assembly(form), Acceleration((1.0, 0.0, 0.0))).multiplier for form in forms]
    assert np.ptp(bounds) < 1e-5 * bounds[0]
    assert {len(assembly(form).contacts) for form in forms} == {len(assembly(one).contacts)}


def shifted_over(way, sunk=0.0):
    """The grid at its start, and with its upper right stone `way` over the lower left one."""
    one = grid()
    model, start = build_model(one)
    centre = start.centre.copy()
    body = [block.code for block in one.blocks].index("11")
    centre[body] += [-way, 0, -sunk]
    return model, start, replace(start, centre=centre)


def test_a_stone_that_slides_over_its_diagonal_neighbour_bears_there_from_where_it_lies():
    model, start, now = shifted_over(0.05)
    find = detector(model)
    before = recess_at(find, start)
    contacts = find(now, np.zeros(len(model.mass)))
    size = model.surfaces.size
    after = before.after(contacts, now, size)
    gained = before.of(contacts) > 0
    assert gained.any()
    assert not after.of(contacts)[gained].any()
    # by less than the error of a survey nothing changes, and no point acts
    model, start, now = shifted_over(0.5 * SLACK * 0.3)
    contacts = find(now, np.zeros(len(model.mass)))
    same = before.after(contacts, now, size)
    assert np.array_equal(same.depth, before.depth)
    acting = same.acting(contacts, now, np.zeros(len(model.mass)))
    assert not same.of(contacts)[acting].any()


def test_a_pair_without_an_area_acts_once_its_stones_lie_in_each_other_by_the_slack():
    model, start, now = shifted_over(0.002, sunk=0.9 * SLACK * 0.3)
    find = detector(model)
    recess = recess_at(find, start)
    contacts = find(now, np.zeros(len(model.mass)))
    depth = recess.of(contacts)
    acting = recess.acting(contacts, now, np.zeros(len(model.mass)))
    deep = (depth > 0) & (gaps(contacts, now) < -0.6 * depth)
    assert deep.any()
    assert set(np.flatnonzero(deep)) <= set(acting.tolist())
    assert depth[deep] == pytest.approx(SLACK * 0.3)


@pytest.mark.parametrize(("way", "sunk", "left"), [(0.05, 1e-4, 1e-4), (0.001, 2.5e-4, SLACK * 0.3)])
def test_a_pair_bears_from_where_flat_faces_lie_and_keeps_its_recess_where_they_lean(way, sunk, left):
    """What lies deeper over the width of the overlap than faces that lie flat is an edge, not a face."""
    model, start, now = shifted_over(way, sunk)
    find = detector(model)
    before = recess_at(find, start)
    contacts = find(now, np.zeros(len(model.mass)))
    depth = before.after(contacts, now, model.surfaces.size).of(contacts)
    pair = [[model.scene.blocks[body].code for body in bodies] for bodies in contacts.bodies]
    diagonal = np.array([set(one) == {"00", "11"} for one in pair])
    assert diagonal.any()
    assert depth[diagonal] == pytest.approx(left, rel=1e-6)
