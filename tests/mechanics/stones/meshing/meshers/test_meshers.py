"""Both meshers, on stones whose volume and boundary are known."""

import builtins
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import MeshError, MissingLibraryError
from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import boundary_facets, tet_mesh
from mechanics.stones.meshing.meshers.choice import Mesher
from mechanics.stones.meshing.meshers.delaunay import mesh_with_delaunay
from mechanics.stones.meshing.meshers.gmsh import mesh_with_gmsh
from mechanics.stones.meshing.meshers.mesher import meshed_block
from mechanics.stones.polyhedra import face_plane, mass_properties
from tests.mechanics.shapes import TETRAHEDRON_FACES, TURN, brick, hexahedra
from tests.pipelines.results_by_hand import box

MESHERS = pytest.mark.parametrize("mesher", [mesh_with_gmsh, mesh_with_delaunay])
STONE = box((0, 0, 0), (0.6, 0.4, 0.3)) @ TURN.T + 5.0


def tetrahedron_volumes(mesh):
    return np.linalg.det(mesh.nodes[mesh.cells[:, 1:]] - mesh.nodes[mesh.cells[:, :1]]) / 6


def assert_fills(mesh, corners, faces):
    """The mesh is the stone: volume, positive tetrahedra, a closed boundary whose parts tile each face."""
    whole = mass_properties(corners, faces)
    volumes = tetrahedron_volumes(mesh)
    assert volumes.sum() == pytest.approx(whole.volume, rel=1e-10)
    assert volumes.min() > 1e-9 * volumes.max()
    assert set(mesh.cells.ravel()) == set(range(len(mesh.nodes)))
    edges = [(t[k], t[(k + 1) % 3]) for t in mesh.facets.tolist() for k in range(3)]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    surface = mass_properties(mesh.nodes, mesh.facets)
    assert surface.volume == pytest.approx(whole.volume, rel=1e-10)
    for k, face in enumerate(faces):
        polygon = corners[list(face)]
        normal, origin = face_plane(polygon)
        tri = mesh.nodes[mesh.facets[mesh.facet_face == k]]
        np.testing.assert_allclose((tri - origin) @ normal, 0, atol=1e-9)
        local = polygon - origin
        area = 0.5 * np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0) @ normal
        parts = 0.5 * np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0]) @ normal
        assert parts.min() > 0  # counter-clockwise seen from outside
        assert parts.sum() == pytest.approx(area, rel=1e-10)


@MESHERS
@pytest.mark.parametrize("size", [2.0, 0.3, 0.12])
def test_box_is_filled_exactly(mesher, size):
    assert_fills(mesher(STONE, BOX_FACES, size, "A1"), STONE, BOX_FACES)


@MESHERS
@pytest.mark.parametrize("sides", [(1, 0.5, 0.1), (1.5, 0.2, 0.2), (1, 1, 0.05)], ids=str)
@pytest.mark.parametrize("size", [3.0, 0.2])
def test_slender_stone_keeps_its_shape(mesher, sides, size):
    corners = box((0, 0, 0), sides) @ TURN.T
    assert_fills(mesher(corners, BOX_FACES, size, "A1"), corners, BOX_FACES)


@MESHERS
def test_tetrahedron_is_filled_exactly(mesher):
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert_fills(mesher(corners, TETRAHEDRON_FACES, 0.4, "A1"), corners, TETRAHEDRON_FACES)


@MESHERS
@settings(max_examples=8, deadline=None)
@given(corners=hexahedra(), size=st.sampled_from([0.35, 0.6]))
def test_any_hexahedron_is_filled_exactly(mesher, corners, size):
    assert_fills(mesher(corners, BOX_FACES, size, "A1"), corners, BOX_FACES)


@MESHERS
def test_a_stone_always_gets_the_same_mesh(mesher):
    first = mesher(STONE, BOX_FACES, 0.15, "A1")
    mesher(box((0, 0, 0), (1, 1, 1)), BOX_FACES, 0.4, "another in between")
    second = mesher(STONE, BOX_FACES, 0.15, "A1")
    for name in ("nodes", "cells", "facets", "facet_face"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


@MESHERS
def test_smaller_size_gives_more_tetrahedra(mesher):
    counts = [len(mesher(STONE, BOX_FACES, size, "A1").cells) for size in (0.4, 0.2, 0.1)]
    assert counts == sorted(set(counts))


@MESHERS
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_mesh_does_not_depend_on_the_unit_of_length(mesher, scale):
    one = mesher(STONE, BOX_FACES, 0.2, "A1")
    other = mesher(scale * STONE, BOX_FACES, scale * 0.2, "A1")
    # rounding may flip a diagonal, no more
    assert len(other.cells) == pytest.approx(len(one.cells), rel=0.1)
    assert tetrahedron_volumes(other).sum() == pytest.approx(0.6 * 0.4 * 0.3 * scale**3, rel=1e-10)


def test_boundary_of_one_tetrahedron_is_its_four_faces_outwards():
    triangles = boundary_facets(Element.TET4, np.array([[0, 1, 2, 3]]))
    assert {frozenset(t) for t in triangles.tolist()} == {frozenset(t) for t in TETRAHEDRON_FACES}
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert mass_properties(corners, triangles).volume == pytest.approx(1 / 6)


def test_mirrored_tetrahedra_are_turned_round_and_loose_nodes_dropped():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [9, 9, 9], [0, 1, 0], [0, 0, 1]])
    stone = corners[[0, 1, 3, 4]]
    mesh = tet_mesh(corners, np.array([[1, 0, 3, 4]]), stone, TETRAHEDRON_FACES, "A1")
    assert len(mesh.nodes) == 4
    assert tetrahedron_volumes(mesh) == pytest.approx([1 / 6])


def test_a_mesh_that_leaves_a_hole_is_refused_with_the_stone_named():
    corners = box((0, 0, 0), (1, 1, 1))
    with pytest.raises(MeshError, match="stone A7: a boundary facet lies"):
        tet_mesh(corners, np.array([[0, 1, 3, 4], [1, 2, 3, 6]]), corners, BOX_FACES, "A7")


@MESHERS
def test_a_stone_with_a_bent_face_is_refused_by_name(mesher):
    corners = box((0, 0, 0), (1, 1, 1))
    corners[6] += (0.2, 0.1, 0.3)
    with pytest.raises(MeshError, match="stone A7"):
        mesher(corners, BOX_FACES, 0.4, "A7")
    # and the mesher is none the worse for it
    assert_fills(mesher(STONE, BOX_FACES, 0.3, "A1"), STONE, BOX_FACES)


@pytest.fixture
def without_gmsh(monkeypatch):
    """As on a machine that lacks a shared library which gmsh links to."""
    load = builtins.__import__

    def fail(name, *arguments, **keywords):
        if name == "gmsh":
            raise OSError("libGLU.so.1: cannot open shared object file")
        return load(name, *arguments, **keywords)

    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.setattr(builtins, "__import__", fail)


def test_missing_library_names_the_package_to_install(without_gmsh):
    with pytest.raises(MissingLibraryError, match=r"libGLU.*install the system packages libglu1-mesa"):
        mesh_with_gmsh(STONE, BOX_FACES, 0.3, "A1")


def soft(**more):
    return brick("A1", (0, 0, 0), (0.6, 0.4, 0.3), Fidelity.DEFORMABLE, mesh_size=0.3, **more)


def test_convex_stones_need_no_gmsh(without_gmsh):
    made = meshed_block(soft())
    assert (made.how, made.failures) == ("delaunay", ())
    assert_fills(made.mesh, soft().vertices, BOX_FACES)


def test_without_gmsh_delaunay_meshes_the_stone_and_says_so(without_gmsh):
    with pytest.warns(UserWarning, match=r"without gmsh.*libglu1-mesa"):
        made = meshed_block(soft(mesher=Mesher.GMSH))
    assert made.how == "delaunay"
    assert all("libGLU" in failure for failure in made.failures)
    assert_fills(made.mesh, soft().vertices, BOX_FACES)
