"""Values that make no sense are refused where a scene is made; what is unusual but possible is not."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.validation import check_corners, finite

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_corner_that_is_nowhere_is_named(value):
    corners = CUBE.copy()
    corners[5, 1] = value
    with pytest.raises(SceneError, match="stone K: corner 5 is at"):
        check_corners("stone K", corners)


@pytest.mark.parametrize("width", [0.0, 1e-200, 1e-30, 1e30, 1e200])
def test_widths_that_cannot_be_computed_with_are_refused(width):
    with pytest.raises(SceneError, match="m wide"):
        check_corners("stone", width * CUBE)


def test_a_stone_whose_corners_rounding_would_move_is_refused():
    """Doubles at 10⁷ m are 2·10⁻⁹ m apart: a millionth of a stone of 2 mm."""
    check_corners("stone", 0.01 * CUBE + 1e7)
    with pytest.raises(SceneError, match="rounding would move its corners; shift the scene to the origin"):
        check_corners("stone", 0.001 * CUBE + 1e7)


def test_sizes_from_a_micrometre_to_a_planet_are_taken():
    for width in (1e-6, 1e7):
        check_corners("stone", width * CUBE)


def test_numbers_that_can_be_computed_with():
    assert finite((1.0, 0.0, -3.0), 3)
    assert not finite((1.0, 0.0), 3)
    assert not any(finite((value, 0.0, 0.0), 3) for value in (np.nan, np.inf, 1e200))


@pytest.mark.parametrize(
    "bad", [{"velocity": (np.nan,) * 6}, {"velocity": (0.0,) * 3}, {"growth": -1.0}, {"radius": 0.0}]
)
def test_a_block_names_itself_and_the_value(bad):
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    with pytest.raises(SceneError, match=f"stone K: {next(iter(bad))} = "):
        Block("K", CUBE, faces, None, Fidelity.RIGID, **bad)
