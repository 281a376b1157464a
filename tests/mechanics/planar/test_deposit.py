"""Deposited samples: at rest within their profile, dense, with directions of contacts that differ little."""

import numpy as np
import pytest

from mechanics.planar.deposit import Deposit, deposit
from mechanics.planar.measures.tessellation import tessellation
from moma.errors import SceneError


def asked(**changed):
    profile = {"length": 30.0, "top": lambda x: 10.0 - 0.1 * x, "highest": 10.0}
    rest = {"smallest": 0.4, "largest": 0.6, "density": 2500.0, "friction": 0.4, "falling_friction": 0.4}
    return Deposit(**profile | rest | changed)


@pytest.fixture(scope="module")
def sample():
    return deposit(asked())


def test_disks_fill_the_profile_and_do_not_overlap(sample):
    centre, radius = sample
    assert (centre[:, 0] > radius - 0.01).all()
    assert (centre[:, 0] < 30.0 - radius + 0.01).all()
    assert (centre[:, 1] > radius - 0.01).all()
    assert (centre[:, 1] + radius < 10.0 - 0.1 * centre[:, 0] + 0.2).all()
    away = np.linalg.norm(centre[:, None] - centre, axis=-1) - radius[:, None] - radius
    np.fill_diagonal(away, 1.0)
    assert away.min() > -0.01 * 0.4
    cells = tessellation(centre, radius)
    solid = np.pi * (radius[cells.inside] ** 2).sum() / cells.share[cells.inside].sum()
    # frictional disks: 0.80 to 0.85 (random close packing 0.84, hexagonal 0.907)
    assert 0.79 < solid < 0.86


def test_the_same_seed_gives_the_same_bits_and_another_another_sample(sample):
    again = deposit(asked())
    assert np.array_equal(again[0], sample[0])
    assert not np.array_equal(deposit(asked(seed=2))[1][:20], sample[1][:20])


def test_wrong_sizes_are_refused():
    with pytest.raises(SceneError, match="smallest radius"):
        asked(smallest=0.7)
    with pytest.raises(SceneError, match="length"):
        asked(length=1.0)
