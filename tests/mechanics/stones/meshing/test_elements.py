"""Kinds of elements, and meshes of stones with each of them."""

import itertools

import numpy as np
import pytest
import vtk
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import MeshError, SceneError
from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import boundary_facets, solid_mesh, with_middle_nodes
from mechanics.stones.meshing.meshers.delaunay import mesh_with_delaunay
from mechanics.stones.meshing.meshers.mesher import mesh_block
from mechanics.stones.meshing.shape_functions import integration, jacobians, reference_points, tabulated
from mechanics.stones.polyhedra import face_plane, mass_properties
from tests.mechanics.shapes import LIMESTONE, TETRAHEDRON_FACES, TURN, hexahedra, prism, profile
from tests.pipelines.results_by_hand import box

EACH = pytest.mark.parametrize("element", list(Element))
HEXAHEDRA = pytest.mark.parametrize("element", [Element.HEX8, Element.HEX20, Element.HEX27])
VTK_CELLS = {
    Element.TET4: vtk.vtkTetra,
    Element.TET10: vtk.vtkQuadraticTetra,
    Element.HEX8: vtk.vtkHexahedron,
    Element.HEX20: vtk.vtkQuadraticHexahedron,
    Element.HEX27: vtk.vtkTriQuadraticHexahedron,
}
VTK_FACETS = {3: vtk.vtkTriangle, 6: vtk.vtkQuadraticTriangle, 4: vtk.vtkQuad, 8: vtk.vtkQuadraticQuad}
VTK_FACETS[9] = vtk.vtkBiQuadraticQuad


def stone(element, vertices, faces, size):
    return Block("S1", vertices, faces, LIMESTONE, Fidelity.DEFORMABLE, size, element)


def brick(element, size, sides=(0.6, 0.4, 0.3)):
    return stone(element, box((0, 0, 0), sides) @ TURN.T + 5.0, BOX_FACES, size)


def parametric(cell):
    coordinates = cell.GetParametricCoords()
    return np.array([coordinates[k] for k in range(3 * cell.GetNumberOfPoints())]).reshape(-1, 3)


@EACH
def test_nodes_of_a_cell_have_the_order_of_vtk(element):
    np.testing.assert_array_equal(reference_points(element), parametric(VTK_CELLS[element]()))


@EACH
def test_nodes_of_a_facet_have_the_order_of_vtk_and_look_outwards(element):
    points = reference_points(element)
    expected = parametric(VTK_FACETS[element.facet_nodes]())[:, :2]
    inside = points.mean(axis=0)
    for facet in element.cell_facets:
        corners = points[list(facet[: element.facet_corners])]
        normal, origin = face_plane(corners)
        assert normal @ (origin - inside) > 0
        # the facet's own coordinates: from corner 0 to corner 1 and to the last one
        along = np.array([corners[1] - corners[0], corners[-1] - corners[0]])
        local = (points[list(facet)] - corners[0]) @ np.linalg.pinv(along)
        np.testing.assert_allclose(local, expected, atol=1e-12)
    # each side of the cell once
    assert len({frozenset(facet) for facet in element.cell_facets}) == (4 if element.is_tetrahedron else 6)


@EACH
def test_shape_functions_belong_to_their_nodes(element):
    from mechanics.stones.meshing.shape_functions import _evaluate

    value, slope = _evaluate(element, reference_points(element).T)
    np.testing.assert_allclose(value, np.eye(element.cell_nodes), atol=1e-12)
    np.testing.assert_allclose(slope.sum(axis=1), 0.0, atol=1e-12)


# scikit-fem's rules of order 5 and more for tetrahedra are exact to one order less
@pytest.mark.parametrize(
    ("element", "order"),
    [(e, o) for e in Element for o in (1, 2, 3, 4, 5, 7) if o < 5 or not e.is_tetrahedron],
)
def test_rules_integrate_polynomials_of_their_order(element, order):
    table = tabulated(element, order)
    points = table.corner_value @ reference_points(element)[: element.corners]
    factorial = np.cumprod([1, *range(1, 12)])
    for powers in itertools.product(range(order + 1), repeat=3):
        if sum(powers) <= order:
            found = table.weight @ np.prod(points**powers, axis=1)
            if element.is_tetrahedron:
                exact = np.prod(factorial[list(powers)]) / factorial[sum(powers) + 3]
            else:
                exact = np.prod(1.0 / (1.0 + np.array(powers)))
            assert found == pytest.approx(exact, rel=1e-12)


def assert_fills(mesh, vertices, faces):
    """Volume, positive Jacobians, middle nodes in the middle, a boundary that tiles each face."""
    element = mesh.element
    assert jacobians(element, mesh.nodes, mesh.cells).min() > 0
    volume = integration(element, mesh.nodes, mesh.cells, 3).volume.sum()
    assert volume == pytest.approx(mass_properties(vertices, faces).volume, rel=1e-10)
    assert mesh.cells.shape[1] == element.cell_nodes
    assert set(mesh.cells.ravel()) == set(range(len(mesh.nodes)))
    for node, corners in enumerate(element.node_corners):
        middle = mesh.nodes[mesh.cells[:, list(corners)]].mean(axis=1)
        np.testing.assert_allclose(mesh.nodes[mesh.cells[:, node]], middle, atol=1e-12)
    # no two nodes in one place
    distinct = np.unique(np.round(mesh.nodes, 9), axis=0)
    assert len(distinct) == len(mesh.nodes)
    np.testing.assert_array_equal(mesh.facets, boundary_facets(element, mesh.cells))
    for k, face in enumerate(faces):
        normal, origin = face_plane(vertices[list(face)])
        on = mesh.facets[mesh.facet_face == k]
        np.testing.assert_allclose((mesh.nodes[on] - origin) @ normal, 0.0, atol=1e-9)
        assert areas(mesh.nodes, on[:, : element.facet_corners], normal) == pytest.approx(
            areas(vertices, np.array([face]), normal), rel=1e-9
        )


def areas(nodes, polygons, normal):
    """Sum of the areas of planar polygons, each of which must look along the normal."""
    rings = nodes[polygons] - nodes[polygons[:, :1]]
    signed = 0.5 * np.cross(rings, np.roll(rings, -1, axis=1)).sum(axis=1) @ normal
    assert signed.min() > 0
    return signed.sum()


@EACH
@pytest.mark.parametrize("size", [1.0, 0.21])
def test_every_element_fills_a_brick(element, size):
    block = brick(element, size)
    assert_fills(mesh_block(block), block.vertices, block.faces)


@EACH
@settings(max_examples=8, deadline=None)
@given(corners=hexahedra(), size=st.sampled_from([0.35, 0.6]))
def test_every_element_fills_any_hexahedron(element, corners, size):
    assert_fills(mesh_block(stone(element, corners, BOX_FACES, size)), corners, BOX_FACES)


@pytest.mark.parametrize("element", [Element.TET4, Element.TET10])
def test_tetrahedra_fill_a_stone_that_is_not_convex_and_know_its_faces(element):
    # the two feet of a bridge stand on one plane, and so do the two faces beside the notch in its top
    outline = [
        (0, 0),
        (1, 0),
        (1, 1),
        (2, 1),
        (2, 0),
        (3, 0),
        (3, 2),
        (2, 2),
        (2, 1.5),
        (1, 1.5),
        (1, 2),
        (0, 2),
    ]
    block = profile("bridge", outline, ())
    mesh = mesh_block(stone(element, block.vertices, block.faces, 0.5))
    assert_fills(mesh, block.vertices, block.faces)


def test_delaunay_refuses_a_stone_that_is_not_convex():
    block = profile("L", [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], ())
    with pytest.raises(MeshError, match="stone L"):
        mesh_with_delaunay(block.vertices, block.faces, 0.5, "L")


def test_middle_nodes_of_delaunay_tetrahedra_are_shared():
    block = brick(Element.TET10, 0.3)
    linear = mesh_with_delaunay(block.vertices, block.faces, 0.3, "S1")
    mesh = with_middle_nodes(linear, Element.TET10)
    assert_fills(mesh, block.vertices, block.faces)
    np.testing.assert_array_equal(mesh.facet_face, linear.facet_face)
    # Euler's formula for a ball: corners - edges + sides - cells = 1
    sides = (4 * len(mesh.cells) + len(mesh.facets)) // 2
    assert len(linear.nodes) - (len(mesh.nodes) - len(linear.nodes)) + sides - len(mesh.cells) == 1


@HEXAHEDRA
@pytest.mark.parametrize(
    ("size", "counts"), [(0.6, (1, 1, 1)), (0.19, (3, 2, 2)), (0.11, (5, 4, 3))], ids=str
)
def test_edges_are_cut_into_as_many_parts_as_the_size_fits(element, size, counts):
    mesh = mesh_block(brick(element, size))
    # 0.6 × 0.4 × 0.3, rounded: the nodes of the corner grid tell
    assert len(mesh.cells) == np.prod(counts)
    local = (mesh.nodes - 5.0) @ TURN
    for k, (side, count) in enumerate(zip((0.6, 0.4, 0.3), counts, strict=True)):
        places = np.unique(np.round(local[:, k] / side * count * 2))
        assert len(places) == (count + 1 if element is Element.HEX8 else 2 * count + 1)


@EACH
def test_a_stone_always_gets_the_same_mesh(element):
    first, _, second = (mesh_block(brick(element, size)) for size in (0.2, 0.15, 0.2))
    for name in ("nodes", "cells", "facets", "facet_face"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


SIX_SIDED = prism(np.array([(0, 0), (1, 0), (1.4, 0.6), (1, 1.2), (0, 1.2), (-0.4, 0.6)]), 0.0, 0.5)
WEDGE = prism(np.array([(0, 0), (1, 0), (0.2, 0.7)]), 0.0, 0.5)
TETRAHEDRON = np.vstack([np.zeros(3), np.eye(3)]), TETRAHEDRON_FACES
PYRAMID = (
    np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1.0)]),
    ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
)


@HEXAHEDRA
@pytest.mark.parametrize("size", [2.0, 0.2])
@pytest.mark.parametrize(
    ("vertices", "faces"),
    [TETRAHEDRON, SIX_SIDED, WEDGE],
    ids=["tetrahedron", "six-sided prism", "wedge"],
)
def test_hexahedra_fill_stones_whose_corners_join_three_faces(element, vertices, faces, size):
    mesh = mesh_block(stone(element, vertices @ TURN.T, faces, size))
    assert_fills(mesh, vertices @ TURN.T, faces)
    # one hexahedron at each corner, cut into n × n × n
    n = round((len(mesh.cells) / len(vertices)) ** (1 / 3))
    assert len(mesh.cells) == len(vertices) * n**3
    assert (n > 1) == (size < 1.0)


@HEXAHEDRA
def test_other_stones_are_refused_with_the_element_that_suits_them(element):
    with pytest.raises(
        MeshError, match=r"stone S1: hexahedra need three faces.*4 at corner 4.*use element = tet10"
    ):
        mesh_block(stone(element, *PYRAMID, 0.5))


@HEXAHEDRA
def test_a_dart_turns_cells_inside_out_and_is_refused(element):
    vertices, faces = prism(np.array([(0, 0), (1, -1), (0.3, 0), (1, 1)]), 0.0, 1.0)
    with pytest.raises(MeshError, match=r"stone S1: cell \d+ is flat or turned inside out.*tet10"):
        mesh_block(stone(element, vertices, faces, 0.4))


def test_a_mesh_that_leaves_out_a_cell_is_refused_by_its_volume():
    # two of the three cubes of an L: where the third is missing, what is left still lies on planes of its faces
    block = profile("L", [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], ())
    cubes = [box((x, 0, z), (x + 1, 1, z + 1)) for x, z in ((1, 0), (0, 1))]
    nodes, number = np.unique(np.vstack(cubes), axis=0, return_inverse=True)
    with pytest.raises(MeshError, match="stone L: the mesh fills 2 m³ of the stone's 3 m³"):
        solid_mesh(Element.HEX8, nodes, number.reshape(2, 8), block.vertices, block.faces, "L")


@pytest.mark.parametrize("size", [0.0, -1.0])
def test_a_mesh_size_that_is_not_positive_is_refused(size):
    with pytest.raises(SceneError, match="stone S1: mesh_size"):
        mesh_block(brick(Element.HEX8, size))
