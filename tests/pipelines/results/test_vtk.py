"""ParaView files of a result whose numbers are known."""

import base64
import struct
import xml.etree.ElementTree as ElementTree
import zlib
from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.mesher import mesh_block
from pipelines.draw.offscreen.surfaces import wall_surface
from pipelines.results.vtk import contact_grid, write_frames, write_joint_grid
from pipelines.results.vtu import CELL_TYPES
from tests.pipelines.results_by_hand import LIMESTONE, box, contacts_of, meshed_body, result_of


def read_array(node):
    """Values of a compressed DataArray, decoded from the format's description."""
    blocks, size, _, packed = struct.unpack("<4Q", base64.b64decode(node.text[:44]))
    content = zlib.decompress(base64.b64decode(node.text[44:]))
    assert blocks == 1
    assert len(content) == size
    assert len(base64.b64decode(node.text[44:])) == packed
    kind = {"Float64": "<f8", "Float32": "<f4", "Int64": "<i8", "UInt8": "<u1"}[node.get("type")]
    return np.frombuffer(content, kind).reshape(-1, int(node.get("NumberOfComponents", 1))).squeeze()


def test_paraview_files_hold_every_stone_and_each_frame_its_stress(mixed, tmp_path):
    write_frames(mixed, tmp_path)
    datasets = ElementTree.parse(tmp_path / "results.pvd").getroot().findall(".//DataSet")
    assert [float(one.get("timestep")) for one in datasets] == [0.0, 0.1]
    first, last = (
        {
            node.get("Name"): read_array(node)
            for node in ElementTree.parse(tmp_path / one.get("file")).iter("DataArray")
        }
        for one in datasets
    )
    elastic = mixed.bodies[1]
    assert last["Points"].shape == (8 + len(elastic.reference) + 8, 3)
    assert list(np.unique(last["types"])) == [10, 42]
    assert np.count_nonzero(last["types"] == 10) == len(elastic.cells)
    assert last["stone"].max() == 2
    assert set(first) == set(last)
    assert first["von_mises"][8:-8] == pytest.approx(0.0)  # not loaded yet
    assert last["von_mises"][8:-8] == pytest.approx(elastic.von_mises)
    assert last["principal"][8:-8, 2] == pytest.approx(-elastic.von_mises)
    assert last["mean_pressure"][8:-8] == pytest.approx(elastic.von_mises / 3)
    assert np.abs(last["principal_direction_3"][8:-8][elastic.von_mises > 0, 2]) == pytest.approx(1.0)
    assert np.isnan(last["von_mises"][:8]).all()
    assert np.isnan(last["utilisation"]).all()  # no strengths
    assert last["velocity"] == pytest.approx(0.5)
    assert last["displacement"][-1] == pytest.approx([0.0, 0.003, -0.004])
    assert np.isnan(last["stress_error"][[0, -1]]).all()
    assert last["stress_error"][1:-1] == pytest.approx(0.1)


def test_vtk_reads_the_files_as_closed_stones_contacts_and_joints(mixed, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    write_frames(mixed, tmp_path)
    write_joint_grid(mixed, tmp_path)
    grid = pyvista.read(tmp_path / "results_0001.vtu")
    sizes = grid.compute_cell_sizes()["Volume"]
    for index, body in enumerate(mixed.bodies):
        assert abs(sizes[grid["stone"] == index]).sum() == pytest.approx(body.volume)
    before, contacts = (pyvista.read(tmp_path / f"contacts_000{number}.vtu") for number in (0, 1))
    assert before.n_points == 0
    assert contacts["force"][1] == pytest.approx([0.0, 600.0, 800.0])
    assert contacts["pressure"] == pytest.approx([3e5, 8e4])
    joints = pyvista.read(tmp_path / "joints.vtu")
    assert joints.compute_cell_sizes()["Area"] == pytest.approx(joints["area"])
    assert joints["kern"] == pytest.approx([0.6, 1.2])
    assert joints["in_kern"].tolist() == [1, 0]
    assert joints.cell_centers().points[:, 2] == pytest.approx([1.0, 2.998])


def test_a_series_has_every_field_at_every_time(mixed, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    write_frames(mixed, tmp_path)
    for name, fields in (("results", {"stress", "velocity"}), ("contacts", {"force", "joint"})):
        reader = pyvista.get_reader(tmp_path / f"{name}.pvd")
        assert reader.time_values == [0.0, 0.1]
        for time in reader.time_values:
            reader.set_active_time_value(time)
            assert fields <= set(reader.read()[0].array_names)


def test_vtk_finds_the_units(mixed, tmp_path):
    vtk = pytest.importorskip("vtkmodules.all")
    write_frames(mixed, tmp_path)
    write_joint_grid(mixed, tmp_path)
    for name, fields in {
        "results_0001.vtu": {
            "stress": "Pa",
            "velocity": "m/s",
            "displacement": "m",
            "principal_direction_1": None,
        },
        "contacts_0001.vtu": {"force": "N", "area": "m²", "pressure": "Pa", "gap": "m", "normal": None},
        "joints.vtu": {"moment": "N m", "opening": "m", "kern": None, "area": "m²"},
    }.items():
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(tmp_path / name))
        reader.Update()
        grid = reader.GetOutput()
        for array, unit in fields.items():
            found = grid.GetPointData().GetArray(array) or grid.GetCellData().GetArray(array)
            label = vtk.vtkDataArray.UNITS_LABEL()
            assert (label.Get(found.GetInformation()) if found.HasInformation() else None) == unit, array


@pytest.mark.parametrize("element", Element)
def test_vtk_opens_every_kind_of_element(element, tmp_path):
    """The volume by VTK's own shape functions, and the middle of the gradient of a linear field, are exact."""
    pyvista = pytest.importorskip("pyvista")
    block = Block("a", box((0, 0, 0), (1, 0.5, 2)), BOX_FACES, LIMESTONE, Fidelity.DEFORMABLE, 0.5, element)
    mesh = mesh_block(block)
    stress = np.zeros((len(mesh.nodes), 6))
    stress[:, 2] = -1e6 * mesh.nodes[:, 2]
    result = result_of([meshed_body("a", mesh, stress, (0.0, 0.0, 1.0))], pairs=(), forces=())
    write_frames(result, tmp_path)
    grid = pyvista.read(tmp_path / "results_0001.vtu")
    assert set(grid.celltypes) == {CELL_TYPES[element]}
    assert grid.compute_cell_sizes()["Volume"].sum() == pytest.approx(1.0)
    gradient = grid.compute_derivative(scalars="von_mises")["gradient"]
    assert gradient == pytest.approx(np.tile([0.0, 0.0, 1e6], (grid.n_points, 1)), abs=1.0)
    skin = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=0)
    assert skin.area == pytest.approx(7.0)
    drawn = wall_surface(result)
    assert set(drawn.triangles.ravel()) == set(
        mesh.facets.ravel()
    )  # every node of the surface shows its value
    a, b, c = drawn.points[drawn.triangles].transpose(1, 0, 2)
    outward = np.cross(b - a, c - a) / 2
    assert np.linalg.norm(outward, axis=1).sum() == pytest.approx(7.0)
    assert np.einsum("ti,ti->", a, outward) / 3 == pytest.approx(1.0)  # the volume within, if all look out
    ends = drawn.points[drawn.edges]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(4 * 3.5)


def test_every_status_of_a_contact_has_its_number():
    many = np.array(["open", "stick", "slip", "bonded", "broken"])
    contacts = replace(contacts_of(((0, 0),) * 5, ((0, 0, 0),) * 5), status=many)
    assert contact_grid(contacts).point_data["status"].tolist() == [0, 1, 2, 3, 4]
