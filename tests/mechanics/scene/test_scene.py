"""Scenes that cannot be."""

import numpy as np
import pytest

from ground.errors import GeometryError, SceneError
from mechanics.model.model import build_model
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.materials import Material
from tests.mechanics.shapes import LIMESTONE, TURN, brick, ellipse, ground, moved, prism, scene
from tests.pipelines.results_by_hand import box


def test_a_scene_needs_a_block():
    with pytest.raises(SceneError, match=r"no blocks.*select at least one stone"):
        Scene("empty", ())


def test_codes_used_twice_are_named():
    with pytest.raises(SceneError, match="used twice: a, b"):
        scene(*(brick(code, (0, 0, 0), (1, 1, 1)) for code in "abcab"))


@pytest.mark.parametrize("size", [None, 0.0, -1.0])
def test_a_deformable_stone_needs_a_mesh_size(size):
    with pytest.raises(SceneError, match=r"stone A1: mesh_size.* greater than 0"):
        build_model(scene(brick("A1", (0, 0, 0), (1, 1, 1), Fidelity.DEFORMABLE, mesh_size=size)))


def test_a_fixed_stone_has_no_velocity():
    with pytest.raises(SceneError, match=r"stone A1: a fixed stone has a velocity.*make it rigid"):
        build_model(scene(brick("A1", (0, 0, 0), (1, 1, 1), Fidelity.FIXED, velocity=(1, 0, 0, 0, 0, 0))))


@pytest.mark.parametrize("points", [0, 2, 5, 16, -4])
def test_other_numbers_of_contact_points_are_refused(points):
    with pytest.raises(SceneError, match=f"contact: points = {points}; give 1, 3, 4 or 8"):
        ContactSettings(points=points)


def test_a_stone_inside_out_is_refused_by_name():
    block = Block("A1", box((0, 0, 0), (1, 1, 1)), tuple(f[::-1] for f in BOX_FACES), LIMESTONE)
    with pytest.raises(GeometryError, match="stone A1"):
        build_model(scene(block))


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"density": 0.0}, "density"),
        ({"density": float("nan")}, "density"),
        ({"young": -1.0}, "young"),
        ({"poisson": 0.5}, "poisson"),
        ({"poisson": -0.1}, "poisson"),
    ],
)
def test_impossible_materials_are_refused_by_name(changed, named):
    values = {"density": 2000.0, "young": 1e9, "poisson": 0.2} | changed
    with pytest.raises(SceneError, match=f"material 'mud': {named}"):
        Material("mud", **values)


def test_the_model_knows_the_stones_and_where_they_begin():
    velocity = (1.0, 2.0, 3.0, 0.4, 0.5, 0.6)
    stones = (
        ground(),
        moved(brick("hard", (0, 0, 0), (1, 0.5, 0.4), velocity=velocity), TURN, (1, 2, 3)),
        brick("soft", (0, 0, 1), (1, 0.5, 1.4), Fidelity.DEFORMABLE, velocity=velocity),
    )
    seen = []
    model, state = build_model(scene(*stones), lambda done, total: seen.append((done, total)))
    assert seen == [(1, 3), (2, 3), (3, 3)]
    np.testing.assert_array_equal(model.fixed, [True, False, False])
    np.testing.assert_array_equal(model.elastic, [False, False, True])
    np.testing.assert_allclose(model.volume, [25.0, 0.2, 0.2], rtol=1e-12)
    np.testing.assert_allclose(model.mass, 2000 * model.volume, rtol=1e-14)
    np.testing.assert_allclose(model.surfaces.size, [1.0, 0.4, 0.4], rtol=1e-12)
    np.testing.assert_allclose(state.centre[1], TURN @ [0.5, 0.25, 0.2] + [1, 2, 3], atol=1e-13)
    np.testing.assert_allclose(state.velocity, [[0] * 6, velocity, [0] * 6])
    nodes = model.nodes_of(2)
    arm = state.node[nodes] - [0.5, 0.25, 1.2]
    np.testing.assert_allclose(
        state.node_velocity[nodes], np.array(velocity[:3]) + np.cross(velocity[3:], arm), atol=1e-12
    )
    corners = model.surfaces.shapes.vertex[model.surfaces.shapes.vptr[1] : model.surfaces.shapes.vptr[2]]
    np.testing.assert_allclose(state.centre[1] + corners, stones[1].vertices, atol=1e-13)
    assert model.inertia.inverse_mass.tolist() == [0.0, 1 / model.mass[1], 0.0]


def test_a_stone_with_more_corners_than_contacts_can_name_is_refused():
    """A drum has six corners of faces for each of its sides; 833 sides are the most that can be named."""
    rings = (ellipse(sides, (1.0, 1.0)) for sides in (833, 834))
    allowed, refused = (Block("D1", *prism(ring, 0.0, 1.0), LIMESTONE) for ring in rings)
    build_model(scene(allowed))
    with pytest.raises(GeometryError, match="stone D1: 836 faces with 5004 corners together; simplify"):
        build_model(scene(refused))
