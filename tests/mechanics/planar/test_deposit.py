"""Deposited samples: at rest within their profile, dense, with directions of contacts that differ little."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.planar.deposit import Deposit, deposit
from mechanics.planar.measures.tessellation import tessellation


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
    # frictional disks: 0.80 to 0.85 (random close packing 0.84, hexagonal 0.907)
    assert 0.79 < solid(centre, radius) < 0.86


def solid(centre, radius):
    """Share that disks fill away from the rim."""
    cells = tessellation(centre, radius)
    inner = cells.inside & (centre[:, 1] < 6.0)
    return np.pi * (radius[inner] ** 2).sum() / cells.share[inner].sum()


def test_disks_that_fall_with_less_friction_come_to_rest_with_it_and_denser():
    loose, dense = (
        deposit(asked(top=lambda x: np.full(len(x), 10.0), falling_friction=mu)) for mu in (0.4, 0.05)
    )
    # with the friction of the fall in the fall alone it is 0.014
    assert solid(*dense) > solid(*loose) + 0.02


def test_the_same_seed_gives_the_same_bits_and_another_another_sample(sample):
    again = deposit(asked())
    assert np.array_equal(again[0], sample[0])
    assert not np.array_equal(deposit(asked(seed=2))[1][:20], sample[1][:20])


def test_wrong_sizes_are_refused():
    with pytest.raises(SceneError, match="smallest radius"):
        asked(smallest=0.7)
    with pytest.raises(SceneError, match="length"):
        asked(length=1.0)
