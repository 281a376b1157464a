"""Stones of one shape get one mesh, however they are turned; mirror images get their own."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.model.model import build_model
from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.meshing.congruence import motion, translation
from mechanics.stones.meshing.elements import Element
from mechanics.stones.polyhedra import face_plane
from tests.mechanics.shapes import LIMESTONE, TURN, brick, moved, scene
from tests.mechanics.stones.meshing.wild_stones import wild_hexahedron, wild_polyhedron
from tests.pipelines.results_by_hand import box

SOFT = Fidelity.DEFORMABLE
SEEDS = st.integers(0, 2**32 - 1)


def relabelled(rng, corners, faces):
    """The same stone with its corners and faces numbered in another order; also the new number of each face."""
    order, turns = rng.permutation(len(corners)), rng.permutation(len(faces))
    number = np.argsort(order)
    rings = [tuple(number[list(faces[k])].tolist()) for k in turns]
    rings = [ring[k % len(ring) :] + ring[: k % len(ring)] for k, ring in enumerate(rings)]
    return corners[order], tuple(rings), np.argsort(turns)


def turned(rng, corners):
    return corners @ Rotation.random(random_state=rng).as_matrix().T + rng.uniform(-50, 50, 3)


@settings(max_examples=100, deadline=None)
@given(SEEDS)
def test_the_motion_between_copies_is_found_whatever_their_labels(seed):
    rng = np.random.default_rng(seed)
    corners, faces = wild_polyhedron(rng)
    there, rings, number = relabelled(rng, turned(rng, corners), faces)
    found = motion(corners, faces, there, rings)
    assert found is not None
    np.testing.assert_allclose(found.turn @ found.turn.T, np.eye(3), atol=1e-13)
    assert np.linalg.det(found.turn) == pytest.approx(1.0)
    moved_there = found(corners)
    distance = np.linalg.norm(moved_there[:, None] - there, axis=-1)
    assert sorted(distance.argmin(axis=1)) == list(range(len(there)))
    assert distance.min(axis=1).max() < 1e-11
    np.testing.assert_array_equal(found.face, number)


@settings(max_examples=100, deadline=None)
@given(SEEDS)
def test_mirror_images_and_stones_that_differ_a_little_are_not_copies(seed):
    rng = np.random.default_rng(seed)
    corners, faces = wild_polyhedron(rng)
    mirrored = turned(rng, corners * [-1.0, 1.0, 1.0])
    assert motion(corners, faces, mirrored, tuple(face[::-1] for face in faces)) is None
    assert motion(corners, faces, turned(rng, 1.000001 * corners), faces) is None
    assert not translation(corners, 1.000001 * corners)


def test_a_box_is_its_own_mirror_image():
    corners = box((0, 0, 0), (0.4, 0.3, 0.2))
    found = motion(corners, BOX_FACES, corners * [-1.0, 1.0, 1.0], tuple(face[::-1] for face in BOX_FACES))
    assert found is not None
    assert np.linalg.det(found.turn) == pytest.approx(1.0)


def test_of_the_motions_of_a_brick_the_one_without_a_turn_is_taken():
    corners = box((0, 0, 0), (0.4, 0.3, 0.2))
    found = motion(corners, BOX_FACES, corners + np.array([5.0, 1.0, -3.0]), BOX_FACES)
    np.testing.assert_array_equal(found.turn, np.eye(3))
    np.testing.assert_array_equal(found.face, np.arange(6))


def test_marked_faces_come_onto_marked_faces():
    corners = box((0, 0, 0), (0.4, 0.4, 0.4))
    for k in range(6):
        found = motion(corners, BOX_FACES, corners, BOX_FACES, (0,), (k,))
        assert found.face[0] == k
    assert (
        motion(box((0, 0, 0), (1, 2, 3)), BOX_FACES, box((0, 0, 0), (1, 2, 3)), BOX_FACES, (0,), (2,)) is None
    )


def copies(count, element=Element.TET4, seed=1):
    rng = np.random.default_rng(seed)
    corners = wild_hexahedron(rng, 0.3)
    blocks = []
    for k in range(count):
        there, faces, _ = relabelled(rng, turned(rng, corners), BOX_FACES)
        blocks.append(Block(f"c{k}", there, faces, LIMESTONE, SOFT, 0.25, element))
    return blocks


@pytest.mark.parametrize("element", list(Element))
def test_turned_copies_share_a_mesh_that_is_moved_with_them(element):
    blocks = copies(4, element)
    model, state = build_model(scene(*blocks))
    assert model.meshes.distinct == 1
    assert {one.like for one in model.meshes.stones} == {"c0"}
    first = model.stones[0].mesh
    for b, block in enumerate(blocks):
        mesh = model.stones[b].mesh
        np.testing.assert_array_equal(mesh.cells, first.cells)
        # one turn takes all nodes of the first to those of the copy
        u, _, vt = np.linalg.svd(mesh.nodes.T @ first.nodes)
        np.testing.assert_allclose(first.nodes @ (u @ vt).T, mesh.nodes, atol=1e-12)
        assert np.linalg.det(u @ vt) == pytest.approx(1.0)
        places = state.node[model.nodes_of(b)]
        for k, face in enumerate(block.faces):
            normal, origin = face_plane(block.vertices[list(face)])
            on = places[mesh.facets[mesh.facet_face == k]]
            assert len(on) > 0
            assert np.abs((on - origin) @ normal).max() < 1e-11
        distance = np.linalg.norm(places[:, None] - block.vertices, axis=-1).min(axis=0)
        assert distance.max() < 1e-11


def test_the_mesh_does_not_depend_on_the_order_of_the_blocks():
    blocks = [*copies(3, seed=2), brick("b", (70, 0, 0), (71, 1, 1), SOFT)]
    runs = []
    for order in (blocks, blocks[::-1], blocks[2:] + blocks[:2]):
        model, state = build_model(scene(*order))
        runs.append({block.code: state.node[model.nodes_of(b)].tobytes() for b, block in enumerate(order)})
    assert runs[0] == runs[1] == runs[2]


def test_voussoirs_of_an_arch_are_meshed_once_and_those_side_by_side_share_their_matrices():
    wedge = box((-0.2, 0, 2.0), (0.2, 0.5, 2.4))
    wedge[wedge[:, 2] > 2.2, 0] *= 1.2
    stone = Block("v", wedge, BOX_FACES, LIMESTONE, SOFT, 0.2)
    blocks = []
    for ring in range(2):
        for k in range(5):
            turn = Rotation.from_rotvec([0, 0.2 * k, 0]).as_matrix()
            blocks.append(replace(moved(stone, turn, (0, 0.5 * ring, 0)), code=f"{ring}{k}"))
    model, _ = build_model(scene(*blocks))
    assert model.meshes.distinct == 1
    assert len(model.elastic_stones.groups) == 5
    assert {len(group.bodies) for group in model.elastic_stones.groups} == {2}
    # stiffness turns with the stone: energies of the same stretch along the stone's own axes are the same
    energies = []
    for k in range(5):
        turn = Rotation.from_rotvec([0, 0.2 * k, 0]).as_matrix()
        stone = model.stones[k]
        own = stone.mesh.nodes @ turn
        d = np.column_stack([1e-3 * own[:, 0], 0 * own[:, 0], 2e-3 * own[:, 0]]) @ turn.T
        energies.append(d.ravel() @ (stone.operators.stiffness @ d.ravel()))
    np.testing.assert_allclose(energies, energies[0], rtol=1e-9)


def test_only_stones_with_the_same_sizes_share():
    first = copies(1)[0]
    others = [
        replace(moved(first, TURN, (5, 0, 0)), code="d0"),
        replace(moved(first, TURN, (9, 0, 0)), code="d1", mesh_size=0.2),
        replace(moved(first, TURN, (13, 0, 0)), code="d2", element=Element.TET10),
        replace(moved(first, TURN, (17, 0, 0)), code="d3", mesher="gmsh"),
    ]
    like = {one.code: one.like for one in build_model(scene(first, *others))[0].meshes.stones}
    assert like == {"c0": "c0", "d0": "c0", "d1": "d1", "d2": "d2", "d3": "d3"}
