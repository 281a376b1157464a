"""Rows of voussoirs: arches of every shape whose order is known from how they were made."""

import time
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from archmodel.relations.arch_rings import ArchJoint, arches_among
from archmodel.store.stone_arrays import StoneColumns

FRONT = np.array([0.0, -1.0, 0.0])


class Site:
    """Voussoirs and springers of arches in upright planes; numbers of entities begin at 1."""

    def __init__(self):
        self.centres, self.feet, self.joints, self.normals = [], [], [], []

    def add(self, place, foot=False, looks=FRONT):
        self.centres.append(np.asarray(place, dtype=float))
        self.feet.append(foot)
        self.normals.append(looks)
        return len(self.centres) - 1

    def touch(self, first, second, normal):
        self.joints.append(ArchJoint(first, second, np.asarray(normal, dtype=float)))

    def ring(self, angles, radius, centre=(0.0, 0.0, 0.0), closed=False):
        """Stones between angles from the x axis, from right to left, touching in their order."""
        middles = (angles[:-1] + angles[1:]) / 2
        stones = [self.add(np.asarray(centre) + radius * ray(angle)) for angle in middles]
        for k, (one, other) in enumerate(pairwise(stones)):
            self.touch(one, other, tangent(angles[k + 1]))
        if closed:
            self.touch(stones[-1], stones[0], tangent(angles[0]))
        return stones

    def springer(self, stone, angle, side):
        """A springer beside a stone, across the joint at an angle; side: -1 to the right, 1 to the left."""
        foot = self.add(self.centres[stone] + side * 0.5 * -tangent(angle), foot=True)
        self.touch(stone, foot, side * tangent(angle))
        return foot

    def found(self):
        """[{entity: (ring, rank)}] of the arches; the order of the joints must not matter."""
        stones = StoneColumns(
            ids=np.arange(1, len(self.centres) + 1),
            kinds=["voussoir"] * len(self.centres),
            zones=[None] * len(self.centres),
            courses=[None] * len(self.centres),
            centres=np.array(self.centres),
            normals=np.array(self.normals),
        )
        arches = arches_among(stones, self.feet, self.joints)
        again = arches_among(stones, self.feet, self.joints[::-1])
        places = [{stone.entity - 1: (stone.ring, stone.rank) for stone in arch.stones} for arch in arches]
        assert places == [
            {stone.entity - 1: (stone.ring, stone.rank) for stone in arch.stones} for arch in again
        ]
        return places


def ray(angle):
    return np.array([np.cos(angle), 0.0, np.sin(angle)])


def tangent(angle):
    """The normal of a joint on a ray, from the stone on its left to the one on its right."""
    return np.array([np.sin(angle), 0.0, -np.cos(angle)])


def ranks(stones, ring=1, first=1):
    """{stone: (ring, rank)} of stones given from right to left."""
    return {stone: (ring, first + k) for k, stone in enumerate(reversed(stones))}


@pytest.mark.parametrize(("low", "high"), [(0.0, np.pi), (1.2, np.pi - 1.2), (-0.4, np.pi + 0.4)])
def test_a_ring_is_counted_from_left_to_right(low, high):
    site = Site()
    assert site.found() == []
    stones = site.ring(np.linspace(low, high, 10), 2.0)
    assert site.found() == [ranks(stones)]


def test_springers_of_one_side_share_their_rank():
    site, angles = Site(), np.linspace(0.9, np.pi - 0.9, 8)
    stones = site.ring(angles, 2.0)
    right = [site.springer(stones[0], angles[0], -1) for _ in range(2)]
    left = site.springer(stones[-1], angles[-1], 1)
    expected = ranks(stones, first=2) | {left: (1, 1)} | dict.fromkeys(right, (1, 9))
    assert site.found() == [expected]


def test_arches_of_an_arcade_share_a_springer_and_are_two():
    site, angles = Site(), np.linspace(0.0, np.pi, 8)
    one, other = site.ring(angles, 1.0), site.ring(angles, 1.0, (3.0, 0.0, 0.0))
    shared = site.springer(one[0], 0.0, -1)
    site.touch(other[-1], shared, tangent(np.pi))
    assert site.found() == [
        ranks(one) | {shared: (1, 8)},
        ranks(other, first=2) | {shared: (1, 1)},
    ]


@pytest.mark.parametrize(
    ("low", "count"),
    [(0.0, (9, 12)), (0.0, (7, 7)), (0.9, (7, 9)), (1.1, (11, 6)), (1.3, (6, 8)), (-0.5, (15, 18))],
)
def test_two_rings_are_told_apart_by_where_their_joints_look(low, count):
    site = Site()
    rings = []
    for k, number in enumerate(count):
        angles = np.linspace(low, np.pi - low, number + 1)
        rings.append((angles, site.ring(angles, 2.0 + 0.4 * k)))
    (inner, first), (outer, second) = rings
    for i, stone in enumerate(first):
        for j, above in enumerate(second):
            a, b = max(inner[i], outer[j]), min(inner[i + 1], outer[j + 1])
            if b - a > 1e-9:
                site.touch(above, stone, ray((a + b) / 2))
    assert site.found() == [ranks(first) | ranks(second, ring=2)]


def test_a_flat_arch_and_a_pointed_one_are_rows():
    site = Site()
    flat = [site.add((-0.3 * k, 0.0, 5.0)) for k in range(7)]
    for k in range(6):
        site.touch(flat[k], flat[k + 1], tangent(np.pi / 2 + 0.1 * (k - 2.5)))
    half = np.linspace(0.0, np.pi / 3, 6)
    right = site.ring(half, 2.0, (-1.0, 0.0, 0.0))
    left = site.ring(np.pi - half[::-1], 2.0, (1.0, 0.0, 0.0))
    site.touch(right[-1], left[0], (1.0, 0.0, 0.0))
    assert site.found() == [ranks(flat), ranks([*right, *left])]


def test_a_round_window_is_a_ring_that_begins_below():
    site = Site()
    stones = site.ring(np.linspace(-np.pi / 2 - 0.1, 1.5 * np.pi - 0.1, 13), 1.0, closed=True)
    (found,) = site.found()
    assert sorted(rank for _, rank in found.values()) == list(range(1, 13))
    assert found[stones[0]] == (1, 1)
    assert abs(found[stones[1]][1] - found[stones[11]][1]) == 10


def test_the_web_of_a_vault_is_no_arch():
    site = Site()
    angles = np.linspace(0.2, np.pi - 0.2, 9)
    rows = [site.ring(angles, 2.0, (0.0, 0.5 * k, 0.0)) for k in range(3)]
    for one, other in pairwise(rows):
        for a, b in zip(one, other, strict=True):
            site.touch(a, b, FRONT)
    # faces are the soffit: they look to the axis
    site.normals = [-place * [1, 0, 1] / np.linalg.norm(place * [1, 0, 1]) for place in site.centres]
    assert site.found() == []


def test_two_stones_are_no_arch():
    site = Site()
    site.ring(np.linspace(1.2, 1.8, 3), 2.0)
    assert site.found() == []


@settings(max_examples=40, deadline=None)
@given(
    turn=st.floats(0.0, 2 * np.pi),
    shift=st.tuples(*[st.floats(-7e6, 7e6)] * 3),
    count=st.integers(3, 25),
    seed=st.integers(0, 2**32 - 1),
)
def test_it_does_not_matter_where_an_arch_stands_and_how_its_stones_are_numbered(turn, shift, count, seed):
    site, order = Site(), np.random.default_rng(seed).permutation(count)
    angles = np.linspace(0.3, np.pi - 0.3, count + 1)
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    middles = (angles[:-1] + angles[1:]) / 2
    for k in order:
        site.add(about @ (2.0 * ray(middles[k])) + shift, looks=about @ FRONT)
    place = np.argsort(order)
    for k in range(count - 1):
        site.touch(int(place[k]), int(place[k + 1]), about @ tangent(angles[k + 1]))
    assert site.found() == [ranks([int(i) for i in place])]


@pytest.mark.slow
def test_time_grows_with_the_stones_and_no_faster():
    spent = []
    for many in (100, 400):
        site = Site()
        for k in range(many):
            site.ring(np.linspace(0.0, np.pi, 12), 1.0, (5.0 * k, 0.0, 0.0))
        start = time.process_time()
        assert len(site.found()) == many
        spent.append(time.process_time() - start)
    assert spent[1] < 10 * spent[0]
