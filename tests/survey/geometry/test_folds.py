"""Folding of warped polygons where it leaves the least warp."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from survey.geometry.folds import fold, warp
from survey.geometry.solids import area_vector


def test_a_hexagon_is_folded_along_its_ridge() -> None:
    """A saddle roof of two planes; the corners of its ridge are 1 and 4."""
    roof = np.array([(0, 0, 0), (1, 0, 0.3), (2, 0, 0), (2, 2, 0), (1, 2, 0.3), (0, 2, 0)], dtype=float)
    assert warp(roof) == pytest.approx(0.2, abs=0.05)
    assert sorted(map(sorted, fold(roof, tuple(range(6)), 1e-3))) == [[0, 1, 4, 5], [1, 2, 3, 4]]
    shaken = roof + np.random.default_rng(0).uniform(-5e-4, 5e-4, roof.shape)
    assert sorted(map(sorted, fold(shaken, tuple(range(6)), 1e-3))) == [[0, 1, 4, 5], [1, 2, 3, 4]]


def test_two_stones_fold_the_side_that_they_share_along_the_same_diagonal() -> None:
    side = np.array([(0, 0, 0), (1, 0, 0.05), (1.2, 1, 0), (0, 1, 0.05)], dtype=float)
    one = fold(side, (0, 1, 2, 3), 1e-3)
    other = fold(side, (3, 2, 1, 0), 1e-3)
    assert {frozenset(piece) for piece in one} == {frozenset(piece) for piece in other}
    assert {frozenset(piece) for piece in one} == {frozenset((0, 1, 3)), frozenset((1, 2, 3))}  # √2 < √2.44


def test_no_fold_leaves_a_polygon_that_is_folded_in() -> None:
    """An arrow head whose shorter diagonal would run outside."""
    arrow = np.array([(0, 0, 0), (1, -1, 0.2), (0.3, 0, 0), (1, 1, 0.2)], dtype=float)
    assert {frozenset(piece) for piece in fold(arrow, (0, 1, 2, 3), 1e-3)} == {
        frozenset((0, 1, 2)),
        frozenset((0, 2, 3)),
    }


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.integers(4, 9))
def test_pieces_are_flat_and_share_their_sides_as_the_polygon_and_each_other(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    angles = 2.0 * np.pi * (np.arange(count) + random.uniform(0.0, 0.6, count)) / count
    radius = random.uniform(0.5, 1.0, count)
    corners = np.column_stack(
        [radius * np.cos(angles), radius * np.sin(angles), random.uniform(-0.1, 0.1, count)]
    )
    pieces = fold(corners, tuple(range(count)), 1e-3)
    edges = [edge for piece in pieces for edge in pairwise((*piece, piece[0]))]
    assert len(edges) == len(set(edges))
    alone = {edge for edge in edges if edge[::-1] not in edges}
    assert alone == set(pairwise((*range(count), 0)))
    total = sum(area_vector(corners[list(piece)]) for piece in pieces)
    np.testing.assert_allclose(total, area_vector(corners), atol=1e-12)
    assert len(pieces) > 1 or warp(corners) <= 1e-3
    if len(pieces) > 1:
        assert max(warp(corners[list(piece)]) for piece in pieces) <= 1e-3
