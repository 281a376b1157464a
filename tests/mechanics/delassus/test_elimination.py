"""Order of elimination of the stones of walls: no fill between halves, less fill than by least degree."""

import numpy as np
import pytest
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from mechanics.delassus.assembly import rigid_delassus
from mechanics.delassus.body_space import BodyForm
from mechanics.delassus.elimination import dissection, least_degree
from mechanics.delassus.rigid import schedule
from mechanics.dynamics.contact_search import detector
from mechanics.model.model import build_model
from mechanics.scene.shapes import bond, wall
from tests.mechanics.shapes import scene


def wall_graph(across, high):
    """Pairs of stones of a running bond that touch, and their places."""
    number = np.arange(across * high).reshape(high, across)
    pairs = [np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()])]
    pairs.append(np.column_stack([number[:-1].ravel(), number[1:].ravel()]))
    # stones of every second course stand half a length to the right
    for others in (number[:-1:2], number[2::2]):
        odd = number[1::2][: len(others)]
        pairs.append(np.column_stack([odd[:, :-1].ravel(), others[:, 1:].ravel()]))
    row, column = np.divmod(np.arange(across * high), across)
    place = np.column_stack([0.3 * (column + 0.5 * (row % 2)), 0.0 * row, 0.1 * row])
    return np.concatenate(pairs), place


def factor_entries(pairs, rank):
    count = len(rank)
    one, other = rank[pairs].T
    each = np.arange(count)
    values = np.concatenate([-np.ones(2 * len(pairs)), np.full(count, 20.0)])
    graph = csc_array((values, (np.concatenate([one, other, each]), np.concatenate([other, one, each]))))
    return splu(graph, permc_spec="NATURAL", options={"SymmetricMode": True}).L.nnz


@pytest.mark.parametrize("shape", [(90, 90), (200, 40)], ids=["square", "long"])
def test_dissection_fills_in_less_thanleast_degree(shape):
    pairs, place = wall_graph(*shape)
    rank = dissection(pairs, place)
    assert sorted(rank.tolist()) == list(range(len(place)))
    assert factor_entries(pairs, rank) < 0.95 * factor_entries(pairs, least_degree(pairs, len(place)))


def test_the_stones_eliminated_last_part_the_others_in_two():
    pairs, place = wall_graph(40, 40)
    rank = dissection(pairs, place)
    last = rank >= len(rank) - 40  # one of two courses of 40
    left = pairs[~last[pairs].any(axis=1)]
    label = np.arange(len(place))
    for _ in range(len(place)):
        before = label.copy()
        np.minimum.at(label, left[:, 0], label[left[:, 1]])
        np.minimum.at(label, left[:, 1], label[left[:, 0]])
        if np.array_equal(before, label):
            break
    sizes = np.unique(label[~last], return_counts=True)[1]
    assert len(sizes) == 2
    assert sizes.min() > 0.4 * len(place)


def test_a_wall_is_cut_where_it_is_narrowest():
    pairs, place = wall_graph(60, 40)
    # four courses alone lead over an opening, a third of the way along
    opening = (place[:, 0] > 6.0) & (place[:, 0] < 6.7) & (place[:, 2] < 3.55)
    number = np.cumsum(~opening) - 1
    pairs = number[pairs[~opening[pairs].any(axis=1)]]
    rank = dissection(pairs, place[~opening])
    last = place[~opening][np.argsort(rank)[-4:]]
    assert len(np.unique(last[:, 2])) == 4
    assert last[:, 2].min() > 3.55
    assert ((last[:, 0] > 5.6) & (last[:, 0] < 7.1)).all()


def test_stones_in_one_place_or_apart_get_an_order_too():
    none = np.zeros((0, 2), dtype=np.int64)
    for pairs in (none, np.column_stack([np.arange(29), np.arange(1, 30)])):
        assert sorted(dissection(pairs, np.zeros((30, 3))).tolist()) == list(range(30))


def test_the_order_changes_a_solution_by_rounding_alone(monkeypatch):
    model, state = build_model(scene(*wall(bond(12, 8), 0.3, 0.1, 0.15)))
    contacts = detector(model)(state, np.zeros(len(model.mass)))
    plan = schedule(contacts.bodies, model.inertia.moving)
    w = rigid_delassus(model, state, contacts, plan)
    b = np.random.default_rng(1).normal(size=3 * len(contacts))
    monkeypatch.setattr("mechanics.delassus.elimination._MANY", 50)
    unplaced = w.rigid._replace(centre=np.zeros((0, 3)))
    dissected, plain = BodyForm(w.rigid), BodyForm(unplaced)
    assert not np.array_equal(dissected._pattern.side, plain._pattern.side)
    theta = np.tile(0.02 * w.scale * np.eye(3), (len(contacts), 1, 1))
    one, other = (w.scale * form.shifted(theta)(b) for form in (dissected, plain))
    np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9)
