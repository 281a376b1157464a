"""Meshes survive their files: nodes, cells, orientation and the stone of each cell, whatever the format and element."""

import re
from contextlib import contextmanager
from dataclasses import replace

import gmsh
import meshio
import numpy as np
import pytest

from ground.errors import MeshError, UsageError
from mechanics.scene.scene import Fidelity
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.files import check_mesh_file, read_meshes, write_meshes
from mechanics.stones.meshing.meshers.mesher import mesh_block
from mechanics.stones.meshing.shape_functions import integration, jacobians
from tests.mechanics.shapes import brick

USUAL = (Element.TET4, Element.TET10, Element.HEX8, Element.HEX20)
HELD = {
    **dict.fromkeys((".msh", ".vtu", ".vtk"), tuple(Element)),
    **dict.fromkeys((".inp", ".med"), USUAL),
    ".mesh": [Element.TET4, Element.HEX8],
}
EACH = pytest.mark.parametrize(
    ("ending", "element"), [(ending, element) for ending, held in HELD.items() for element in held]
)
# what a code may be everywhere
CODES = ("W01-01", "w01-02a", "K")


def stones(element, codes=CODES):
    """Stones side by side, no two of one size."""
    return {
        code: mesh_block(
            brick(
                code,
                (k, 0, 0),
                (k + 0.7 + 0.1 * k, 1, 0.5),
                Fidelity.DEFORMABLE,
                element=element,
                mesh_size=0.5,
            )
        )
        for k, code in enumerate(codes)
    }


@contextmanager
def opened_in_gmsh(path):
    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        yield
    finally:
        gmsh.finalize()


def volume(mesh):
    return integration(mesh.element, mesh.nodes, mesh.cells, 3).volume.sum()


@EACH
def test_a_file_gives_back_the_meshes_that_were_written(tmp_path, ending, element):
    path, written = tmp_path / f"stones{ending}", stones(element)
    write_meshes(path, written)
    back = read_meshes(path)
    assert list(back) == list(written)
    for code, mesh in written.items():
        assert back[code].element is element
        np.testing.assert_allclose(back[code].nodes, mesh.nodes, rtol=1e-14, atol=0)
        np.testing.assert_array_equal(back[code].cells, mesh.cells)
        assert jacobians(element, back[code].nodes, back[code].cells).min() > 0
        assert volume(back[code]) == pytest.approx(volume(mesh), rel=1e-10)


@pytest.mark.parametrize("ending", HELD)
def test_many_stones_of_any_coordinates_keep_their_order(tmp_path, ending):
    # numbers of two digits, and coordinates with as many digits and as small as they come
    path, (mesh,) = tmp_path / f"stones{ending}", stones(Element.TET4, ("A",)).values()
    rng = np.random.default_rng(0)
    shifts = rng.normal(size=(12, 3)) * 10.0 ** rng.integers(-7, 4, (12, 3))
    written = {f"S{12 - k}": replace(mesh, nodes=mesh.nodes + shift) for k, shift in enumerate(shifts)}
    write_meshes(path, written)
    back = read_meshes(path)
    assert list(back) == list(written)
    for code, one in written.items():
        np.testing.assert_allclose(back[code].nodes, one.nodes, rtol=1e-14, atol=0)


@pytest.mark.parametrize("ending", HELD)
def test_stones_of_two_elements_share_a_file(tmp_path, ending):
    path = tmp_path / f"stones{ending}"
    written = stones(Element.TET4, ("A", "B")) | stones(Element.HEX8, ("C",)) | stones(Element.TET4, ("D",))
    write_meshes(path, written)
    back = read_meshes(path)
    assert {code: mesh.element for code, mesh in back.items()} == {
        c: mesh.element for c, mesh in written.items()
    }
    for code, mesh in written.items():
        np.testing.assert_array_equal(back[code].cells, mesh.cells)


@pytest.mark.parametrize(("ending", "element"), [(end, one) for end in (".msh", ".med") for one in HELD[end]])
def test_gmsh_finds_the_stones_as_physical_volumes_of_sound_cells(tmp_path, ending, element):
    # its reader of MED files is the library that Code_Aster and Salome read with
    path, written = tmp_path / f"stones{ending}", stones(element)
    write_meshes(path, written)
    found = {}
    with opened_in_gmsh(path):
        for dimension, tag in gmsh.model.getPhysicalGroups():
            volumes = gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)
            cells = np.concatenate([gmsh.model.mesh.getElements(3, one)[1][0] for one in volumes])
            found[gmsh.model.getPhysicalName(dimension, tag)] = (
                gmsh.model.mesh.getElementQualities(cells, "volume").sum(),
                gmsh.model.mesh.getElementQualities(cells, "minDetJac").min(),
            )
    assert list(found) == list(written)
    for code, mesh in written.items():
        assert found[code][0] == pytest.approx(volume(mesh), rel=1e-10)
        assert found[code][1] > 0


@pytest.mark.parametrize("element", HELD[".inp"])
def test_abaqus_files_have_plain_elements_and_lines_as_long_as_abaqus_reads(tmp_path, element):
    write_meshes(tmp_path / "stones.inp", stones(element))
    text = (tmp_path / "stones.inp").read_text(encoding="utf-8")
    assert f"*ELEMENT, TYPE=C3D{element.cell_nodes}\n" in text
    assert max(len(line.rstrip(",").split(",")) for line in text.splitlines()) <= 16
    assert re.findall(r"\*ELSET, ELSET=(.*)", text) == list(CODES)


def test_a_mesh_replaces_an_earlier_one_and_leaves_nothing_beside_it(tmp_path):
    path = tmp_path / "new" / "stones.vtu"
    write_meshes(path, stones(Element.TET10))
    write_meshes(path, stones(Element.TET4, ("Läufer 1",)))
    assert list(read_meshes(path)) == ["Läufer 1"]
    assert sorted(file.name for file in path.parent.iterdir()) == ["stones.vtu", "stones.vtu.stones.json"]


def test_a_failed_write_leaves_the_earlier_file(tmp_path, monkeypatch):
    path, written = tmp_path / "stones.msh", stones(Element.TET4)
    write_meshes(path, written)
    before = path.read_bytes()

    def fails(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("meshio.write", fails)
    with pytest.raises(KeyboardInterrupt):
        write_meshes(path, written)
    assert [file.name for file in tmp_path.iterdir()] == ["stones.msh"]
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("name", "held", "what", "remedy"),
    [
        (
            "a.stl",
            None,
            "no format of meshes has the ending '.stl'",
            ".msh, .inp, .med, .vtu, .vtk or .mesh",
        ),
        ("a", None, "has the ending ''", ".msh, .inp"),
        ("a.msh", {}, "no stone is deformable", "[bodies]"),
        ("a.inp", {"A": Element.HEX27}, "hold no hex27 cells, which stone A has", ".msh, .vtu or .vtk"),
        ("a.mesh", {"A": Element.TET10}, "hold no tet10 cells", ".msh, .inp, .med"),
        ("a.med", {"A/1": Element.TET4}, "cannot hold the name of stone 'A/1'", ".vtu"),
        ("a.inp", {"1": Element.TET4}, "cannot hold the name of stone '1'", ".vtu"),
        ("a.inp", {"A": Element.TET4, "a": Element.TET4}, "upper and lower case", ".msh"),
    ],
)
def test_what_a_file_cannot_hold_is_refused(tmp_path, name, held, what, remedy):
    with pytest.raises(UsageError) as refused:
        check_mesh_file(tmp_path / name, held)
    assert what in refused.value.what
    assert remedy in refused.value.remedy
    assert refused.value.where == str(tmp_path / name)


def test_a_folder_is_no_file(tmp_path):
    (tmp_path / "a.msh").mkdir()
    with pytest.raises(UsageError, match="is a folder"):
        check_mesh_file(tmp_path / "a.msh")


def test_files_without_stones_are_refused(tmp_path):
    path = tmp_path / "stones.vtu"
    write_meshes(path, stones(Element.TET4))
    (tmp_path / "stones.vtu.stones.json").unlink()
    with pytest.raises(UsageError, match="codes of the stones cannot be read"):
        read_meshes(path)
    (tmp_path / "empty.inp").write_text("*NODE\n1, 0, 0, 0\n", encoding="utf-8")
    with pytest.raises(MeshError, match="no named set"):
        read_meshes(tmp_path / "empty.inp")
    with pytest.raises(UsageError, match="cannot be read"):
        read_meshes(tmp_path / "absent.msh")


def test_a_file_that_gmsh_gave_out_again_is_read(tmp_path):
    path, written = tmp_path / "stones.msh", stones(Element.TET10)
    write_meshes(path, written)
    with opened_in_gmsh(path):
        gmsh.write(str(path))
    assert path.read_text("utf-8", "replace").startswith("$MeshFormat\n4.1")
    back = read_meshes(path)
    assert {code: volume(mesh) for code, mesh in back.items()} == pytest.approx(
        {code: volume(mesh) for code, mesh in written.items()}
    )


def test_cells_that_are_no_volumes_are_left_out(tmp_path):
    path, corners = tmp_path / "stones.msh", np.vstack([np.zeros(3), np.eye(3)])
    cells = [("triangle", np.array([[0, 1, 2]])), ("tetra", np.array([[0, 1, 2, 3]]))]
    tags = [np.array([1], dtype=np.int32)] * 2
    meshio.Mesh(
        corners,
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"A": np.array([1, 3]), "bed": np.array([1, 2])},
    ).write(path, file_format="gmsh22")
    (back,) = read_meshes(path).items()
    assert back[0] == "A"
    assert volume(back[1]) == pytest.approx(1 / 6)
