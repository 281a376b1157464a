from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from ground.errors import MomaError, SurveyError, UsageError
from survey.formats.native.reader import read_head
from survey.formats.options import ReadingOptions
from survey.formats.reading import open_survey
from survey.formats.solids.msh.sections import MshFile
from survey.formats.solids.reader import open_solids
from survey.geometry.solids import Solid
from survey.geometry.watertight import check_watertight, triangulate
from survey.records.survey import Reject, SolidRecord
from synthetic.buildings.ribs import RibVaultShape, rib_vault
from synthetic.formats import write_head, write_obj
from tests.survey.formats.survey_files import EXAMPLES, SQUARES, moved

SOLIDS = [name for name, one in EXAMPLES.items() if one.format == "solids"]
HEAD = "o A\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in moved(0.0))
FACES = "".join(f"f {' '.join(str(i + 1) for i in face)}\n" for face in SQUARES)


def read(path: Path, data: bytes | str, options: ReadingOptions | None = None) -> list[SolidRecord | Reject]:
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    found = list(open_solids(path, options).blocks)
    assert not any(one for one in found if not isinstance(one, SolidRecord | Reject))
    return [one for one in found if isinstance(one, SolidRecord | Reject)]


def solids(path: Path, data: bytes | str, options: ReadingOptions | None = None) -> list[SolidRecord]:
    found = read(path, data, options)
    for one in found:
        assert isinstance(one, SolidRecord), one.error
    return [one for one in found if isinstance(one, SolidRecord)]


def volume(one: SolidRecord) -> float:
    """Compute the volume of a polyhedron by the divergence theorem over its triangles."""
    a, b, c = np.moveaxis(one.vertices[triangulate(Solid(one.code, one.vertices, one.faces))], 1, 0)
    return float((a * np.cross(b, c)).sum()) / 6.0


@pytest.mark.parametrize("name", SOLIDS)
def test_a_brick_has_six_faces_in_every_format(tmp_path: Path, name: str) -> None:
    example = EXAMPLES[name]
    first, second = solids(tmp_path / f"m.{example.ending}", example.data)
    for one, length in ((first, 1.0), (second, 2.0 if "msh" in name else 1.0)):
        assert volume(one) == pytest.approx(length, rel=1e-12)
        assert one.vertices.shape == (8, 3)  # of two hexahedra, the corners between them are no corners
        assert [len(face) for face in one.faces] == [4] * 6
        centre = one.vertices.mean(axis=0)
        for face in one.faces:
            corners = one.vertices[list(face)]
            normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
            assert normal @ (corners.mean(axis=0) - centre) > 0.0  # counter-clockwise seen from outside
    if "obj" in name or "msh" in name:
        assert [(one.code, one.kind) for one in (first, second)] == [("W1", "header"), ("W2", "ashlar")]


def test_the_corners_and_polygons_of_obj_are_kept(tmp_path: Path) -> None:
    (one,) = solids(tmp_path / "a.obj", HEAD + FACES)
    assert one.vertices.tolist() == [list(map(float, place)) for place in moved(0.0)]
    assert {frozenset(face) for face in one.faces} == {frozenset(face) for face in SQUARES}
    assert (one.code, one.kind, one.line) == ("A", "ashlar", 1)


@pytest.mark.parametrize("turned", [[0], [1, 4], list(range(6))])
def test_faces_are_turned_outward(tmp_path: Path, turned: list[int]) -> None:
    faces = [face[::-1] if k in turned else face for k, face in enumerate(SQUARES)]
    text = HEAD + "".join(f"f {' '.join(str(i + 1) for i in face)}\n" for face in faces)
    (one,) = solids(tmp_path / "a.obj", text)
    assert volume(one) == pytest.approx(1.0, rel=1e-14)


def test_triangles_in_one_plane_become_a_polygon_with_its_notch(tmp_path: Path) -> None:
    """An L-shaped prism from 20 triangles: two L of six corners and six rectangles."""
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    floor = trimesh.creation.extrude_triangulation(
        np.array(outline, dtype=float), np.array([(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]), 1.5
    )
    floor.export(tmp_path / "l.stl")
    (one,) = solids(tmp_path / "l.stl", (tmp_path / "l.stl").read_bytes())
    assert sorted(len(face) for face in one.faces) == [4] * 6 + [6] * 2
    assert volume(one) == pytest.approx(3.0 * 1.5, rel=1e-12)


def test_a_ring_keeps_the_triangles_of_faces_with_a_hole(tmp_path: Path) -> None:
    ring = trimesh.creation.annulus(0.5, 1.0, 1.0, sections=8)
    (one,) = solids(tmp_path / "r.ply", ring.export(file_type="ply"))
    assert volume(one) == pytest.approx(ring.volume, rel=1e-6)
    assert sorted(len(face) for face in one.faces) == [3] * 32 + [4] * 16
    check_watertight(Solid(one.code, one.vertices, one.faces))


def test_a_mesh_of_a_box_has_the_faces_of_the_box(tmp_path: Path) -> None:
    box = trimesh.creation.box(
        (1.0, 0.5, 0.3), transform=trimesh.transformations.rotation_matrix(0.7, (1, 2, 3))
    )
    fine = box.subdivide().subdivide().subdivide()
    assert len(fine.faces) == 768
    for ending in ("stl", "ply", "obj"):
        (one,) = solids(tmp_path / f"b.{ending}", fine.export(file_type=ending))
        assert (len(one.vertices), sorted(map(len, one.faces))) == (8, [4] * 6), ending
        assert volume(one) == pytest.approx(0.15, rel=1e-6)


def test_what_is_round_stays_round(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.4)
    (one,) = solids(tmp_path / "b.stl", ball.export(file_type="stl"))
    assert len(one.faces) == len(ball.faces) == 320
    assert volume(one) == pytest.approx(ball.volume, rel=1e-6)


def test_polygons_that_are_not_plane_are_cut_into_triangles(tmp_path: Path) -> None:
    bulged = HEAD.replace("v 1 1 1\n", "v 1.1 1.1 1.1\n").replace("v 1.0 1 1\n", "v 1.1 1.1 1.1\n") + FACES
    (one,) = solids(tmp_path / "a.obj", bulged)
    assert sorted(len(face) for face in one.faces) == [3] * 6 + [4] * 3
    rounded = HEAD.replace("v 1 1 1\n", "v 1.00001 1 1\n").replace("v 1.0 1 1\n", "v 1.00001 1 1\n") + FACES
    (one,) = solids(tmp_path / "a.obj", rounded)
    assert [len(face) for face in one.faces] == [4] * 6


def test_a_face_that_is_there_twice_counts_once(tmp_path: Path) -> None:
    (one,) = solids(tmp_path / "a.obj", HEAD + FACES + "f 2 1 4 3\nf 5 6 7 8\n")
    assert len(one.faces) == 6


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (HEAD + FACES.split("\n", 1)[1], 1, "not closed: 4 edges"),
        (HEAD, 1, "no solids"),
        (HEAD + FACES + "f 1 2 9\n", 16, "corner '9' of a face, after 8 vertices"),
        (HEAD + FACES + "f 1\n", 16, "a face of 1 corners"),
        (HEAD + FACES + "f 1 2 -9\n", 16, "corner '-9'"),
        (HEAD + FACES + "curv 1 2\n", 16, "unknown word 'curv'"),
        (HEAD + FACES + "f 1 2 7\n", 1, "not closed: 2 edges"),
        (HEAD.replace("v 0.0 0 0", "v 0 0 nan") + FACES, 2, "'nan'"),
        (HEAD.replace("v 0.0 0 0", "v 0 0") + FACES, 2, "2 numbers"),
        (HEAD.replace("v 0.0 0 0", "v 0 0 0 2") + FACES, 2, "weight 2"),
        (HEAD.replace("1\n", "0\n") + FACES, 1, "inside out or flat"),
        (HEAD.replace("o A", "o ?!") + FACES, 1, "not a code"),
    ],
)
def test_a_wrong_object_is_named_with_its_line(tmp_path: Path, text: str, line: int, words: str) -> None:
    try:
        (one,) = read(tmp_path / "a.obj", text)
    except SurveyError as raised:
        error: MomaError = raised
    else:
        assert isinstance(one, Reject)
        error = one.error
    where = f"a.obj:{line}: " if "no solids" not in words else "a.obj: "
    assert where in str(error)
    assert words in str(error)
    assert error.remedy


def test_a_wrong_object_is_left_out_and_the_others_are_read(tmp_path: Path) -> None:
    later = "".join(f"f {' '.join(str(i - 8) for i in face)}\n" for face in SQUARES)
    text = HEAD + FACES + HEAD.replace("o A", "o A") + later + "o B\n" + HEAD[4:] + later[:-10]
    text += HEAD.replace("o A", "g C\no C 1") + later
    found = read(tmp_path / "a.obj", text)
    assert [(type(one), one.code) for one in found] == [
        *((SolidRecord, "A-1"), (SolidRecord, "A-2"), (Reject, "B")),
        (SolidRecord, "C_1"),
    ]
    assert isinstance(found[2], Reject)
    assert "corner '-5g'" in str(found[2].error)
    # the broken face is its last line
    assert found[2].spans == (range(31, 46),)


def test_groups_are_stones_where_there_are_no_objects(tmp_path: Path) -> None:
    later = "".join(f"f {' '.join(str(i - 8) for i in face)}\n" for face in SQUARES)
    text = (HEAD + FACES + HEAD.replace("o A", "o B") + later).replace("o ", "g ")
    assert [one.code for one in solids(tmp_path / "a.obj", text)] == ["A", "B"]
    assert [one.code for one in solids(tmp_path / "a.obj", (HEAD + FACES).replace("o A\n", ""))] == ["a"]


def test_names_are_taken_apart_by_the_template(tmp_path: Path) -> None:
    text = (HEAD + FACES).replace("o A", "o A header 3")
    (one,) = solids(tmp_path / "a.obj", text, ReadingOptions(codes="{block} {kind} {course}"))
    assert (one.code, one.kind, one.course) == ("A", "header", 3)
    (one,) = solids(tmp_path / "a.obj", text, ReadingOptions(kind="voussoir"))
    assert (one.code, one.kind, one.course) == ("A_header_3", "voussoir", None)
    with pytest.raises(UsageError, match="has a role"):
        open_solids(tmp_path / "a.obj", ReadingOptions(codes="{block}:{role}"))
    with pytest.raises(UsageError, match="ending"):
        open_solids(tmp_path / "a.txt")


def test_bodies_that_do_not_touch_are_stones_of_their_own(tmp_path: Path) -> None:
    row = trimesh.util.concatenate([trimesh.creation.box(transform=shift(2.0 * k)) for k in range(3)])
    found = solids(tmp_path / "row.stl", row.export(file_type="stl_ascii").replace("solid ", "solid N:sill"))
    assert [(one.code, one.kind) for one in found] == [("N-1", "sill"), ("N-2", "sill"), ("N-3", "sill")]
    assert sorted(round(float(one.vertices[:, 0].mean())) for one in found) == [0, 2, 4]


def shift(x: float) -> np.ndarray:
    return np.array(trimesh.transformations.translation_matrix((x, 0, 0)))


def test_a_cavity_is_refused(tmp_path: Path) -> None:
    outer, inner = trimesh.creation.box((3, 3, 3)), trimesh.creation.box()
    inner.invert()
    both = trimesh.util.concatenate([outer, inner])
    (one,) = read(tmp_path / "c.ply", both.export(file_type="ply"))
    assert isinstance(one, Reject)
    assert "inside out" in str(one.error)


WALL = [(x, y, z) for z in range(3) for y in range(2) for x in range(3)]


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("ending", ["stl", "ply"])
def test_bodies_that_touch_are_told_apart_by_their_insides(
    tmp_path: Path, ending: str, inverted: bool
) -> None:
    """A wall of 18 bricks without gaps in one mesh: faces on faces, up to eight bricks around a corner."""
    bricks = [
        trimesh.creation.box((1.0, 0.5, 0.25), trimesh.transformations.translation_matrix((x, y / 2, z / 4)))
        for x, y, z in WALL
    ]
    wall = trimesh.util.concatenate(bricks)
    if inverted:
        wall.invert()
    turn = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3))
    wall.vertices = np.round(trimesh.transform_points(wall.vertices, turn), 9)
    found = solids(tmp_path / f"w.{ending}", wall.export(file_type=ending))
    assert len(found) == len(WALL)
    for one in found:
        assert volume(one) == pytest.approx(0.125, rel=1e-6)
        assert (len(one.vertices), len(one.faces)) == (8, 6)
    centres = {tuple(np.round(turn[:3, :3].T @ one.vertices.mean(axis=0), 4) + 0.0) for one in found}
    assert centres == {(float(x), y / 2, z / 4) for x, y, z in WALL}


def test_bodies_that_touch_along_an_edge_are_two(tmp_path: Path) -> None:
    """Two cubes, corner to corner across an edge; and two wedges that stand on one edge, one within the other's bay."""
    shifted = trimesh.creation.box(transform=trimesh.transformations.translation_matrix((1, 1, 0)))
    both = trimesh.util.concatenate([trimesh.creation.box(), shifted])
    found = solids(tmp_path / "e.stl", both.export(file_type="stl"))
    assert [volume(one) for one in found] == pytest.approx([1.0, 1.0], rel=1e-6)
    outline = np.array([(0, 0), (3, -2), (4, 0), (3, 2)], dtype=float)  # about the edge at the origin
    inner = np.array([(0, 0), (-1, 0.5), (-2, 0), (-1, -0.5)])
    parts = [
        trimesh.creation.extrude_triangulation(one, np.array([(0, 1, 2), (0, 2, 3)]), 1.0)
        for one in (outline, inner)
    ]
    found = solids(tmp_path / "w.ply", trimesh.util.concatenate(parts).export(file_type="ply"))
    assert sorted(volume(one) for one in found) == pytest.approx([1.0, 8.0], rel=1e-6)


def test_touching_faces_that_do_not_agree_on_outside_are_refused(tmp_path: Path) -> None:
    cube, other = trimesh.creation.box(), trimesh.creation.box(transform=shift(1.0))
    other.faces[0] = other.faces[0][::-1]
    both = trimesh.util.concatenate([cube, other])
    (one,) = read(tmp_path / "t.stl", both.export(file_type="stl"))
    assert isinstance(one, Reject)
    assert "an object of their own" in str(one.error)


def elements_of(gmsh: Any, volume: int) -> np.ndarray:
    """Return the nodes of each element, (elements, nodes, 3), as Gmsh reads them."""
    tags, places, _ = gmsh.model.mesh.getNodes()
    place = dict(zip(tags.tolist(), places.reshape(-1, 3), strict=True))
    (_,), (elements,), (nodes,) = gmsh.model.mesh.getElements(3, volume)
    return np.array([place[tag] for tag in nodes.tolist()]).reshape(len(elements), -1, 3)


@pytest.mark.parametrize("version", ["2.2", "4.1"])
@pytest.mark.parametrize("binary", [False, True])
def test_a_mesh_is_read_as_another_program_reads_it(tmp_path: Path, version: str, binary: bool) -> None:
    """Against Gmsh itself: tetrahedra and prisms of the first and second order."""
    gmsh = pytest.importorskip("gmsh")
    path = tmp_path / "g.msh"
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        first = gmsh.model.occ.addBox(0, 0, 0, 1, 0.5, 0.3)
        second = gmsh.model.occ.addCylinder(1, 0.25, 0.1, 0.7, 0, 0, 0.1)
        third = gmsh.model.occ.extrude(
            [(2, gmsh.model.occ.addRectangle(3, 0, 0, 1, 1))], 0, 0, 1, [3], recombine=True
        )
        gmsh.model.occ.fragment([(3, first)], [(3, second)])
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [first], name="W1:header")
        gmsh.model.addPhysicalGroup(3, [next(tag for dim, tag in third if dim == 3)], name="W 3")
        if version == "2.2":  # which has either groups or what is in none
            gmsh.model.addPhysicalGroup(3, [second], name=f"volume-{second}")
        gmsh.option.setNumber("Mesh.SaveAll", int(version == "4.1"))
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(1 if binary else 2)
        gmsh.option.setNumber("Mesh.MshFileVersion", float(version))
        gmsh.option.setNumber("Mesh.Binary", int(binary))
        gmsh.write(str(path))
        expected = {tag: elements_of(gmsh, tag) for _, tag in gmsh.model.getEntities(3)}
    finally:
        gmsh.finalize()
    own = MshFile(path)
    assert len(expected) == 3
    for entity, wanted in expected.items():
        ours = [
            own.points[one.nodes[one.entity == entity]]
            for one in own.elements
            if one.type in (4, 6, 11, 13) and (one.entity == entity).any()
        ]
        np.testing.assert_allclose(np.vstack(ours), wanted, rtol=1e-14, atol=1e-15)
    found = {one.code: one for one in solids(path, path.read_bytes())}
    assert {"W1", "W_3", f"volume-{second}"} <= set(found)
    assert volume(found["W1"]) == pytest.approx(0.15, rel=1e-12)
    assert volume(found["W_3"]) == pytest.approx(1.0, rel=1e-12)
    assert len(found["W_3"].faces) == 6


def test_coordinates_that_single_precision_has_spoilt_are_refused(tmp_path: Path) -> None:
    """At 10 km single precision rounds to a millimetre, at a northing of 6,860 km to half a metre."""
    for x, rounded in ((8.0e3, False), (9.0e3, True), (6.86e6, True)):
        box = trimesh.creation.box((3.0, 2.0, 2.0), transform=shift(x))
        (one,) = read(tmp_path / "far.stl", box.export(file_type="stl"))
        assert isinstance(one, Reject) == rounded, x
        (one,) = read(tmp_path / "far.obj", box.export(file_type="obj"))
        assert isinstance(one, SolidRecord), x


@pytest.mark.parametrize("ending", ["obj", "ply", "stl", "msh"])
def test_a_missing_file_is_named(tmp_path: Path, ending: str) -> None:
    with pytest.raises(SurveyError, match="cannot be read"):
        open_solids(tmp_path / f"none.{ending}")
    (tmp_path / f"empty.{ending}").write_bytes(b"")
    with pytest.raises(SurveyError, match=rf"empty\.{ending}"):
        open_solids(tmp_path / f"empty.{ending}")


def test_a_mesh_that_names_what_is_not_there_is_refused(tmp_path: Path) -> None:
    text = EXAMPLES["msh 4"].data.decode()
    nodes = text.split("$Nodes\n")[1].split("\n")
    for wrong, words in (
        (text.replace("$Nodes\n" + nodes[0], "$Nodes\n2 99999999999 1 99999999999"), "nodes for 99999999999"),
        (text.replace("$EndNodes", "$EndNode"), "has no end"),
        (text[: text.index("$Elements") + 30], "has no end"),
        (text.replace("$MeshFormat\n4.1 0 8", "$MeshFormat\n4.0 0 8"), "format '4.0 0 8'"),
    ):
        with pytest.raises(SurveyError) as error:
            read(tmp_path / "a.msh", wrong)
        assert words in str(error.value), error.value


def test_solids_are_read_back_to_the_last_bit(tmp_path):
    vault = rib_vault(RibVaultShape(segments=4))
    head = replace(vault.building.survey.head, name="ribs (synthetic)")
    write_obj(vault.building.modelled, tmp_path / "ribs.obj")
    write_head(head, tmp_path / "head.moma")
    read = read_head(tmp_path / "head.moma")
    assert read.name == "ribs (synthetic)"
    np.testing.assert_array_equal(read.stations[0].position, head.stations[0].position)
    assert [(rule.kind, rule.depth, rule.source) for rule in read.depth_rules] == [
        (rule.kind, rule.depth, rule.source) for rule in head.depth_rules
    ]
    stream = open_survey(tmp_path / "ribs.obj", "solids", ReadingOptions(head=read))
    back = [one for one in stream.blocks if isinstance(one, SolidRecord)]
    assert len(back) == len(vault.building.modelled)
    for one, solid in zip(back, vault.building.modelled, strict=True):
        assert (one.code, one.kind) == (solid.code, solid.kind)
        assert {tuple(row) for row in one.vertices.tolist()} == {
            tuple(row) for row in solid.vertices.tolist()
        }
        assert sorted(map(len, one.faces)) == sorted(map(len, solid.faces))
