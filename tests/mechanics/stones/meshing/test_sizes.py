"""Sizes from place to place: fine at the faces that touch, coarse inside; and what the kernels lay and move."""

import numpy as np
import pytest

from mechanics.model.model import build_model
from mechanics.model.stone_meshes import touching_faces
from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import tet_mesh
from mechanics.stones.meshing.meshers._kernels.sampling import Polyhedron, Sizes, lay_points, size_at
from mechanics.stones.meshing.meshers._kernels.shaping import relax, shape
from mechanics.stones.meshing.meshers.delaunay import mesh_with_delaunay
from mechanics.stones.meshing.meshers.gmsh import mesh_with_gmsh
from mechanics.stones.meshing.meshers.hexahedral import mesh_with_hexahedra
from mechanics.stones.meshing.meshers.slivers import improved
from mechanics.stones.meshing.quality import cell_quality, mesh_quality
from mechanics.stones.meshing.sizes import as_field, graded
from mechanics.stones.polyhedra import face_plane
from tests.mechanics.shapes import TURN, brick, ground, moved, scene, transformed
from tests.mechanics.stones.meshing.wild_stones import wild_hexahedron
from tests.pipelines.results_by_hand import box

SOFT = Fidelity.DEFORMABLE
BED, TOP = 0, 1  # faces of a box at its low and high z
PAIRS = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])


def edges_of(mesh):
    """Middles (n, 3) and lengths (n,) of all distinct edges of linear tetrahedra."""
    ends = np.unique(np.sort(mesh.cells[:, PAIRS].reshape(-1, 2), axis=1), axis=0)
    a, b = mesh.nodes[ends[:, 0]], mesh.nodes[ends[:, 1]]
    return 0.5 * (a + b), np.linalg.norm(b - a, axis=1)


@pytest.mark.parametrize("mesher", [mesh_with_delaunay, mesh_with_gmsh])
@pytest.mark.parametrize("contact", [(BED,), (BED, TOP), (2,)], ids=str)
def test_edges_are_as_long_as_the_field_says(mesher, contact):
    corners = box((0, 0, 0), (0.4, 0.3, 0.8)) @ TURN.T + 3.0
    field = graded(0.16, 0.04, 0.5, corners, BOX_FACES, contact)
    middle, length = edges_of(mesher(corners, BOX_FACES, field, "A1"))
    # the field by its definition: distances to the planes of the faces
    distance = []
    for k in contact:
        normal, origin = face_plane(corners[list(BOX_FACES[k])])
        distance.append(np.abs((middle - origin) @ normal))
    wanted = np.minimum(0.16, 0.04 + 0.5 * np.min(distance, axis=0))
    np.testing.assert_allclose(field(middle), wanted, rtol=1e-12)
    ratio = length / wanted
    for low, high in ((0.04, 0.06), (0.06, 0.1), (0.1, 0.161)):
        here = (wanted >= low) & (wanted < high)
        if here.sum() >= 20:
            assert 0.8 < ratio[here].mean() < 1.25
    assert ratio.max() < 2.2


@pytest.mark.parametrize("mesher", [mesh_with_delaunay, mesh_with_gmsh])
def test_edges_of_one_size_are_about_that_long(mesher):
    corners = box((0, 0, 0), (0.8, 0.6, 0.4)) @ TURN.T
    _, length = edges_of(mesher(corners, BOX_FACES, 0.1, "A1"))
    assert 0.09 < length.mean() < 0.125


def test_a_grid_grows_away_from_the_joint():
    corners = box((0, 0, 0), (0.3, 0.3, 0.9))
    field = graded(0.3, 0.05, 0.4, corners, BOX_FACES, (BED,))
    mesh = mesh_with_hexahedra(corners, BOX_FACES, field, "A1")
    layers = np.diff(np.unique(np.round(mesh.nodes[:, 2], 9)))
    assert (np.diff(layers) > -1e-9).all()
    assert layers[0] < 0.075
    # number of layers: the integral of 1/h, ln(1 + g H / f) / g until the size is reached
    assert len(layers) == round(np.log(0.3 / 0.05) / 0.4 + (0.9 - 0.625) / 0.3)


def test_growth_is_scaled_with_the_sizes_and_fields_move_with_coordinates():
    corners = box((0, 0, 0), (0.4, 0.3, 0.8)) @ TURN.T + 3.0
    field = graded(0.16, 0.04, 0.5, corners, BOX_FACES, (BED, TOP))
    points = np.random.default_rng(0).uniform(2.0, 4.0, (50, 3))
    np.testing.assert_allclose(field.scaled(0.5)(points), 0.5 * field(points))
    origin = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(field.local(origin, 4.0)((points - origin) / 4.0), field(points) / 4.0)
    sizes = Sizes(field.size, field.fine, field.growth, field.normals, field.offsets)
    twin = [size_at(*x, sizes) for x in points]
    np.testing.assert_allclose(twin, field(points), rtol=1e-13)


@pytest.mark.parametrize("seed", range(10))
def test_points_lie_where_they_belong_and_not_too_near(seed):
    corners = wild_hexahedron(np.random.default_rng(seed), 0.4)
    corners = corners - corners.mean(axis=0)
    rows = [face_plane(corners[list(face)]) for face in BOX_FACES]
    planes = np.array([(*normal, normal @ origin) for normal, origin in rows])
    edges = np.array(
        sorted({tuple(sorted(e)) for f in BOX_FACES for e in zip(f, f[1:] + f[:1], strict=True)})
    )
    loops, start = np.concatenate(BOX_FACES).astype(np.int64), np.arange(0, 25, 4)
    field = as_field(0.15) if seed % 2 else graded(0.2, 0.08, 0.5, corners, BOX_FACES, (BED,))
    points, ends, owner = lay_points(
        Polyhedron(corners, edges, loops, start, planes, np.eye(3)),
        Sizes(field.size, field.fine, field.growth, field.normals, field.offsets),
    )
    depth = planes[:, 3] - points @ planes[:, :3].T
    on = np.abs(depth) < 1e-9
    assert depth.min() > -1e-12
    assert ends[0] == 8
    assert ends[3] == len(points)
    assert (on[: ends[0]].sum(axis=1) == 3).all()
    assert (on[ends[0] : ends[1]].sum(axis=1) == 2).all()
    assert (on[ends[1] : ends[2]].sum(axis=1) == 1).all()
    assert on[np.arange(ends[1], ends[2]), owner[ends[1] : ends[2]]].all()
    assert not on[ends[2] :].any()
    inside = points[ends[2] :]
    apart = np.linalg.norm(inside[:, None] - points, axis=-1)
    apart[np.arange(len(inside)), np.arange(ends[2], ends[3])] = np.inf
    finer = np.minimum(field(inside)[:, None], field(points))
    assert (apart / finer).min() > 0.6
    assert (depth[ends[2] :].min(axis=1) > 0.39 * field(inside)).all()


def test_relaxed_nodes_are_means_of_the_centres_around_them():
    """One pass beside the same written out with numpy, for nodes that are free, on a face, on an edge and fixed."""
    mesh = mesh_with_delaunay(box((0, 0, 0), (1, 1, 1)), BOX_FACES, 0.4, "A1")
    nodes = mesh.nodes + 0.02 * np.random.default_rng(1).normal(size=mesh.nodes.shape)
    normals = np.random.default_rng(2).normal(size=(len(nodes), 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    free = np.eye(3) - normals[:, :, None] * normals[:, None]
    free[::3], free[1::5] = 0.0, np.eye(3)
    weight = np.random.default_rng(3).uniform(1.0, 2.0, len(nodes))
    corners = nodes[mesh.cells]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / weight[mesh.cells].sum(axis=1)
    expected = nodes.copy()
    for n in range(len(nodes)):
        around = (mesh.cells == n).any(axis=1)
        mean = np.average(corners[around].mean(axis=1), axis=0, weights=volume[around])
        expected[n] += free[n] @ (mean - nodes[n])
    far = np.array([(0.0, 0.0, 1.0, 100.0)])
    relax(nodes, mesh.cells, free, far, np.zeros((len(nodes), 1), dtype=bool), weight)
    np.testing.assert_allclose(nodes, expected, atol=1e-12)


def test_relaxed_nodes_keep_half_their_distance_from_a_plane():
    nodes = np.array([(0, 0, -1.0), (1, 0, 0.5), (0, 1, 0.5), (1, 1, 0.5)])
    cells = np.array([(0, 1, 2, 3)])
    plane = np.array([(0.0, 0.0, 1.0, -0.9)])  # z ≤ -0.9, of which the first node is 0.1 below
    free = np.zeros((4, 3, 3))
    free[0] = np.eye(3)
    on_plane = np.array([[False], [True], [True], [True]])
    relax(nodes, cells, free, plane, on_plane, np.ones(4))
    assert nodes[0, 2] == pytest.approx(-0.95)


def test_shape_is_one_in_a_regular_tetrahedron_and_falls_to_zero():
    regular = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1.0)])[[0, 2, 1, 3]]
    assert shape(regular, 0, 1, 2, 3) == pytest.approx(1.0)
    assert shape(regular, 0, 2, 1, 3) == pytest.approx(-1.0)
    for flat in (1e-3, 1e-6):
        assert 0 < shape(regular * [1, 1, flat], 0, 1, 2, 3) < 10 * flat


def test_slivers_get_better_and_the_stone_keeps_its_shape():
    """A node inside is moved until it nearly lies on a side of its neighbours."""
    corners = box((0, 0, 0), (1, 1, 1))
    mesh = mesh_with_delaunay(corners, BOX_FACES, 0.4, "A1")
    nodes = mesh.nodes.copy()
    inside = np.setdiff1d(mesh.cells, mesh.facets)[0]
    cell = mesh.cells[(mesh.cells == inside).any(axis=1)][0]
    nodes[inside] += 0.99 * (nodes[cell[cell != inside]].mean(axis=0) - nodes[inside])
    poor = tet_mesh(nodes, mesh.cells, corners, BOX_FACES, "A1")
    better = improved(poor, corners, BOX_FACES)
    before, after = (mesh_quality([one])[0] for one in (poor, better))
    assert before.min_dihedral < 2.0
    assert after.min_dihedral > 10.0
    np.testing.assert_array_equal(better.cells, poor.cells)
    for corner in corners:
        assert np.abs(better.nodes - corner).max(axis=1).min() == 0.0
    volumes = np.linalg.det(better.nodes[better.cells[:, 1:]] - better.nodes[better.cells[:, :1]]) / 6
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(1.0, rel=1e-12)


def slow_quality(corners):
    """Of one tetrahedron: angles between the outward normals of its sides, and Verdict's scaled Jacobian."""
    angles = []
    for a, b in PAIRS:
        c, d = (k for k in range(4) if k not in (a, b))
        along = corners[b] - corners[a]
        across = [corners[k] - corners[a] for k in (c, d)]
        across = [x - along * (x @ along) / (along @ along) for x in across]
        cosine = across[0] @ across[1] / np.linalg.norm(across[0]) / np.linalg.norm(across[1])
        angles.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    length = {(a, b): np.linalg.norm(corners[a] - corners[b]) for a in range(4) for b in range(4)}
    products = [np.prod([length[a, b] for b in range(4) if b != a]) for a in range(4)]
    jacobian = np.linalg.det(corners[1:] - corners[0])
    return min(angles), np.sqrt(2) * jacobian / max(products)


def test_quality_of_tetrahedra_is_that_of_its_definition():
    corners = np.random.default_rng(0).normal(size=(40, 4, 3))
    angle, jacobian = cell_quality(Element.TET4, corners)
    slow = np.array([slow_quality(one) for one in corners])
    # Verdict divides by the largest product; the smallest quotient is the same where the Jacobian is positive
    right = jacobian > 0
    assert right.sum() > 10
    np.testing.assert_allclose(angle, slow[:, 0], atol=1e-6)
    np.testing.assert_allclose(jacobian[right], slow[right, 1], rtol=1e-12)


def test_quality_of_known_cells():
    lean = box((0, 0, 0), (1, 2, 3)).copy()
    lean[4:, 0] += 3.0  # leans by 45 degrees
    angle, jacobian = cell_quality(Element.HEX8, np.array([box((0, 0, 0), (1, 2, 3)), lean]))
    np.testing.assert_allclose(angle, [90, 45], atol=1e-9)
    np.testing.assert_allclose(jacobian, [1, np.sqrt(0.5)], atol=1e-12)
    corner = np.vstack([np.zeros(3), np.eye(3)])
    angle, jacobian = cell_quality(Element.TET4, corner[None])
    assert angle[0] == pytest.approx(np.degrees(np.arctan(np.sqrt(2))))
    assert jacobian[0] == pytest.approx(np.sqrt(0.5))


@pytest.mark.parametrize("batch", [1, 100, 100_000])
def test_qualities_of_many_meshes_are_those_of_each(monkeypatch, batch):
    monkeypatch.setattr("mechanics.stones.meshing.quality._BATCH", batch)
    corners = box((0, 0, 0), (0.6, 0.4, 0.3))
    meshes = [mesh_with_delaunay(corners, BOX_FACES, size, "A1") for size in (0.3, 0.1, 0.2)]
    meshes.insert(1, mesh_with_hexahedra(corners, BOX_FACES, 0.1, "A1"))
    together = mesh_quality(meshes)
    assert together == tuple(mesh_quality([one])[0] for one in meshes)
    assert [one.nodes for one in together] == [len(mesh.nodes) for mesh in meshes]
    assert mesh_quality([]) == ()


def stack(**more):
    """A stone on the ground and one on it, side by side with a third; a fourth hangs free."""
    return [
        ground(),
        brick("low", (0, 0, 0), (0.6, 0.4, 0.3), SOFT, mesh_size=0.15, **more),
        brick("high", (0.3, 0, 0.3), (0.9, 0.4, 0.6), SOFT, mesh_size=0.15, **more),
        brick("beside", (0.6, 0, 0), (1.0, 0.4, 0.3), SOFT, mesh_size=0.15, **more),
        brick("free", (0, 0, 1), (0.6, 0.4, 1.3), SOFT, mesh_size=0.15, **more),
    ]


# of a box: z low, z high, y low, x high, y high, x low
TOUCHING = {1: (0, 1, 3), 2: (0,), 3: (0, 1, 5), 4: ()}


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
def test_faces_that_touch_are_found(turn):
    blocks = [moved(block, turn, (1, 2, 3)) for block in stack()]
    assert touching_faces(blocks, [1, 2, 3, 4], 0.05) == TOUCHING


def test_only_faces_that_lie_over_each_other_touch():
    apart = [
        brick("a", (0, 0, 0), (1, 1, 1)),
        brick("b", (1, 1.0, 0), (2, 2, 1)),
        brick("c", (0, 0, 1.1), (1, 1, 2)),
    ]
    assert touching_faces(apart, [0, 1, 2], 0.05) == {0: (), 1: (), 2: ()}
    assert touching_faces(apart, [0, 2], 0.2)[0] == (1,)


def test_a_scene_is_finer_at_its_joints():
    coarse, fine = (build_model(scene(*stack(contact_size=size)))[0].meshes for size in (None, 0.06))
    nodes = [{one.code: one.quality.nodes for one in report.stones} for report in (coarse, fine)]
    assert nodes[1]["free"] == nodes[0]["free"]
    for code in ("low", "high", "beside"):
        assert nodes[1][code] > 1.5 * nodes[0][code]
    # `low` and `beside` are of different length; `high` and `free` are alike but touch otherwise
    assert coarse.distinct == 2
    assert fine.distinct == 4
    assert coarse.worst.quality.min_scaled_jacobian > 0.1
    assert coarse.nodes == sum(nodes[0].values())
    assert coarse.how == {"delaunay": 4}
    turned = build_model(transformed(scene(*stack(contact_size=0.06)), TURN, (1, 2, 3)))[0].meshes
    assert [one.quality.cells for one in turned.stones] == pytest.approx(
        [one.quality.cells for one in fine.stones], rel=0.05
    )


def test_a_size_at_contact_that_is_no_finer_changes_nothing():
    assert graded(0.1, 0.1, 0.5, np.zeros((0, 3)), (), (0,)).uniform
    plain, same = (build_model(scene(*stack(contact_size=size)))[0].meshes for size in (None, 0.15))
    assert plain == same
