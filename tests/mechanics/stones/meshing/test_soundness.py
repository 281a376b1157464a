"""What cannot be meshed is refused with its reason; meshers that fail are followed by others."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import MeshError
from mechanics.model.model import build_model
from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers import mesher as mesher_module
from mechanics.stones.meshing.meshers.choice import Mesher
from mechanics.stones.meshing.meshers.mesher import meshed_block
from mechanics.stones.meshing.soundness import check_meshable, is_convex
from tests.mechanics.shapes import LIMESTONE, brick, profile, scene
from tests.mechanics.stones.meshing.wild_stones import wild_hexahedron
from tests.pipelines.results_by_hand import box

SOFT = Fidelity.DEFORMABLE
CUBE = box((0, 0, 0), (1, 1, 1))


def changed(corner, place):
    vertices = CUBE.copy()
    vertices[corner] = place
    return vertices


BOW = profile("B1", [(0, 0), (1, 1), (1, 0), (0, 1)], ())
REFUSED = {
    "one place": (changed(6, CUBE[5]), BOX_FACES, "corners 5 and 6 lie in one place"),
    "bent": (changed(6, (1.2, 1.1, 1.3)), BOX_FACES, r"face \d is not planar: its corner \d lies 0.* m off"),
    "bent by 10 µm": (changed(6, (1, 1, 1.00001)), BOX_FACES, "face 1 is not planar"),
    "flat": (CUBE * [1, 1, 1e-6], BOX_FACES, "it is flat: 1e-06 m thick and 1 m long.*its true depth"),
    "needle": (CUBE * [1, 1e-6, 1e-6], BOX_FACES, "it is a needle: 1e-06 m thick and 1 m long"),
    "inside out": (
        CUBE,
        tuple(face[::-1] for face in BOX_FACES),
        "the faces enclose -1 m³.*counter-clockwise",
    ),
    "open": (CUBE, BOX_FACES[:-1], "the faces do not close"),
    "bow tie": (BOW.vertices, BOW.faces, "the faces enclose|crosses itself"),
}


@pytest.mark.parametrize("mesher", list(Mesher))
@pytest.mark.parametrize(("vertices", "faces", "message"), REFUSED.values(), ids=REFUSED)
def test_a_stone_is_refused_with_its_name_the_reason_and_a_remedy(mesher, vertices, faces, message):
    block = Block("A7", vertices, faces, LIMESTONE, SOFT, 0.4, mesher=mesher)
    with pytest.raises(MeshError, match=f"^stone A7: .*({message})") as caught:
        meshed_block(block)
    assert caught.value.remedy


def test_a_corner_that_is_no_number_is_refused():
    """A block with such a corner cannot even be made."""
    with pytest.raises(MeshError, match=r"stone A7: a corner is no number.*measure it again"):
        check_meshable(changed(6, (1, 1, np.nan)), BOX_FACES, "A7")


def test_a_stone_that_passes_through_itself_is_refused():
    """An L whose upper leg is bent back through its lower one."""
    block = profile("L", [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)], ())
    vertices = block.vertices.copy()
    ends = np.flatnonzero(vertices[:, 2] > 2.5)
    vertices[ends] = vertices[ends] * [1, 1, -1] + [0, 0, 2.5]
    with pytest.raises(MeshError, match=r"stone L: .*(crosses itself|passes through|enclose)"):
        check_meshable(vertices, block.faces, "L")


def test_a_spike_through_a_far_face_is_refused():
    """A pyramid stands in a pit of a block, and its top comes out at the bottom."""
    inner = np.array([(0.3, 0.3, 1), (0.7, 0.3, 1), (0.7, 0.7, 1), (0.3, 0.7, 1)])
    vertices = np.vstack([CUBE, inner, [(0.5, 0.5, -0.2)]])
    top = tuple((4 + k, 4 + (k + 1) % 4, 8 + (k + 1) % 4, 8 + k) for k in range(4))
    pit = tuple((8 + k, 8 + (k + 1) % 4, 12) for k in range(4))
    faces = (*(face for face in BOX_FACES if set(face) != {4, 5, 6, 7}), *top, *pit)
    with pytest.raises(MeshError, match="stone P: the edge from corner 8 to 12 passes through face 0"):
        check_meshable(vertices, faces, "P")
    shallow = np.vstack([vertices[:-1], [(0.5, 0.5, 0.4)]])
    check_meshable(shallow, faces, "P")
    assert not is_convex(shallow, faces)
    made = meshed_block(Block("P", shallow, faces, LIMESTONE, SOFT, 0.4))
    cells = made.mesh.nodes[made.mesh.cells]
    volume = np.linalg.det(cells[:, 1:] - cells[:, :1]).sum() / 6
    assert volume == pytest.approx(1 - 0.16 * 0.6 / 3, rel=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_wild_hexahedra_are_convex_and_meshable(seed):
    corners = wild_hexahedron(np.random.default_rng(seed))
    assert is_convex(corners, BOX_FACES)
    check_meshable(corners, BOX_FACES, "S1")


def broken(*_, **__):
    raise MeshError("it slipped", where="stone A1", remedy="hold it")


def soft(**more):
    return brick("A1", (0, 0, 0), (0.6, 0.4, 0.3), SOFT, mesh_size=0.3, **more)


def test_where_delaunay_fails_gmsh_follows_and_the_report_says_so(monkeypatch):
    monkeypatch.setattr(mesher_module, "mesh_with_delaunay", broken)
    made = meshed_block(soft())
    assert (made.how, made.failures) == ("gmsh", ("delaunay: it slipped",))
    (stone,) = build_model(scene(soft()))[0].meshes.retried
    assert (stone.code, stone.how, stone.failures) == ("A1", "gmsh", ("delaunay: it slipped",))


def test_where_gmsh_fails_delaunay_follows(monkeypatch):
    monkeypatch.setattr(mesher_module, "mesh_with_gmsh", broken)
    made = meshed_block(soft(mesher=Mesher.GMSH))
    assert made.how == "delaunay"
    assert made.failures == ("gmsh: it slipped", "gmsh, finer and by HXT: it slipped")


def test_a_stone_at_which_all_fail_is_named_with_all_reasons(monkeypatch):
    monkeypatch.setattr(mesher_module, "mesh_with_gmsh", broken)
    monkeypatch.setattr(mesher_module, "mesh_with_delaunay", broken)
    message = "stone A1: delaunay: it slipped; gmsh: it slipped; gmsh, finer and by HXT: it slipped; delaunay, finer"
    with pytest.raises(MeshError, match=message):
        meshed_block(soft())


def test_delaunay_alone_refuses_what_is_not_convex():
    block = profile("L", [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], (), fidelity=SOFT, mesh_size=0.5)
    assert meshed_block(block).how == "gmsh"
    with pytest.raises(MeshError, match=r"stone L: it is not convex; mesh it with gmsh"):
        meshed_block(replace(block, mesher=Mesher.DELAUNAY))


def test_slivers_are_meshed_again(monkeypatch):
    """A mesher that returns a sliver is followed by another, and the better mesh is kept."""
    true = mesher_module.mesh_with_delaunay

    def poor(*arguments, **options):
        mesh = true(*arguments, **options)
        return replace(mesh, nodes=mesh.nodes * [1.0, 1.0, 1e-5])

    monkeypatch.setattr(mesher_module, "mesh_with_delaunay", poor)
    made = meshed_block(soft())
    assert made.how == "gmsh"
    assert made.failures[0].startswith("delaunay: slivers, scaled Jacobian")


@pytest.mark.parametrize("element", [Element.HEX8, Element.HEX20])
def test_boxes_get_a_grid_and_other_stones_hexahedra_at_their_corners(element):
    assert meshed_block(soft(element=element)).how == "grid"
    wedge = profile("W", [(0, 0), (1, 0), (0.2, 0.7)], (), fidelity=SOFT, mesh_size=0.3, element=element)
    assert meshed_block(wedge).how == "hexahedra at corners"
