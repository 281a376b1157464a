"""Solids that lie on their side: their file has the axes of another program."""

import itertools

import numpy as np
import pytest

from survey.quality.plausible import lies_on_its_side


def ring(half, stones=15, rows=1):
    """Boxes (n, 6) of the voussoirs of a barrel along y, up to an angle from its crown [rad]."""
    edges = np.linspace(-half, half, stones + 1)
    corner = np.array([[(r * np.sin(a), r * np.cos(a)) for r in (2.0, 2.3)] for a in edges])
    found = []
    for row in range(rows):
        for low, high in itertools.pairwise(corner):
            points = np.vstack([low, high])
            (x, z), (x_end, z_end) = points.min(axis=0), points.max(axis=0)
            found.append((x, 0.4 * row, z, x_end, 0.4 * (row + 1), z_end))
    return np.array(found)


def turned(boxes):
    """The same stones in a file whose y points upwards."""
    return np.column_stack([boxes[:, [0, 2]], -boxes[:, 4], boxes[:, [3, 5]], -boxes[:, 1]])


@pytest.mark.parametrize("half", [np.pi / 2, np.pi / 4, np.pi / 6])
@pytest.mark.parametrize("rows", [1, 3, 9])
def test_a_sound_barrel_vault_stands_however_flat_and_long(half, rows):
    assert not lies_on_its_side(ring(half, rows=rows))


@pytest.mark.parametrize("half", [np.pi / 2, np.pi / 4, np.pi / 6])
def test_an_arch_whose_file_has_y_upwards_lies_on_its_side(half):
    assert lies_on_its_side(turned(ring(half)))
