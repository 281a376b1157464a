"""Summary, ParaView files, pictures and report of a result whose numbers are known."""

import base64
import json
import struct
import xml.etree.ElementTree as ElementTree
import zlib
from dataclasses import replace

import numpy as np
import pytest

from mechanics.results.result import Outcome
from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.mesher import mesh_block
from moma.errors import MissingLibraryError
from pipelines.draw import pictures
from pipelines.draw.offscreen.jobs import load_surface, save_surface
from pipelines.draw.offscreen.parts import nice_ceiling
from pipelines.draw.offscreen.result import colouring
from pipelines.draw.offscreen.surfaces import WallSurface, wall_surface
from pipelines.draw.pictures import draw_pictures, missing, package_of
from pipelines.reports.run import write_report
from pipelines.results.vtk import contact_grid, write_frames
from pipelines.results.vtu import CELL_TYPES
from pipelines.run.stone_values import stone_results, stress_statistics
from pipelines.run.summary import as_json, summarise
from pipelines.scene.table_keys import PICTURES
from tests.pipelines.reports.page import Page
from tests.pipelines.results_by_hand import (
    BOX_FACES,
    LIMESTONE,
    box,
    contacts_of,
    deformable_body,
    meshed_body,
    result_of,
    rigid_body,
)

TOWARDS = np.array([0.0, -1.0, 0.0])


def height(points):
    """A stress that is linear in height, from 0 at z = 1 to 2 MPa at z = 3."""
    return 1e6 * (points[:, 2] - 1.0)


@pytest.fixture(scope="module")
def mixed():
    """A fixed, a deformable and a rigid block on each other."""
    return result_of(
        [
            rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
            deformable_body("D1", (0, 0, 1), (1, 1, 3), height, size=0.5, shift=(0, 0, -0.002)),
            rigid_body("top", (0, 0, 3), (1, 1, 4), shift=(0, 0.003, -0.004)),
        ],
        pairs=((1, 0), (2, 1)),
        forces=((0.0, 0.0, 3000.0), (0.0, 600.0, 800.0)),
    )


@pytest.fixture(scope="module")
def rigid():
    return result_of(
        [rigid_body("a", (0, 0, 0), (1, 1, 1), Fidelity.FIXED), rigid_body("b", (0, 0, 1), (1, 1, 2))],
        outcome=Outcome.COLLAPSED,
    )


def test_the_volume_of_the_nodes_is_the_volume_of_the_stone(mixed):
    assert mixed.bodies[1].node_volume.sum() == pytest.approx(2.0)


def test_stress_statistics_are_weighted_by_volume(mixed):
    statistics = stress_statistics(mixed)
    assert statistics.max == pytest.approx(2e6)
    assert statistics.mean == pytest.approx(1e6)  # a linear field's volume mean is its middle value
    assert statistics.mean < statistics.p99 <= statistics.max


def test_every_stone_has_its_result(mixed):
    base, elastic, top = stone_results(mixed)
    assert (base.code, base.fidelity, base.von_mises_max) == ("base", "fixed", None)
    assert elastic.von_mises_max == pytest.approx(2e6)
    assert elastic.von_mises_mean == pytest.approx(1e6)
    assert elastic.contact_force_max == pytest.approx(3000.0)
    assert top.displacement_max == pytest.approx(0.005)
    assert top.contact_force_max == pytest.approx(1000.0)


def test_a_stone_without_contact_has_no_contact_force():
    alone = result_of([rigid_body("a", (0, 0, 0), (1, 1, 1))], pairs=(), forces=())
    assert stone_results(alone)[0].contact_force_max is None


def test_the_summary_has_its_keys_and_says_nothing_that_json_cannot(mixed):
    summary = json.loads(as_json(summarise(mixed, version="1.2", seconds={"mesh": 0.5, "solve": 1.5})))
    assert summary["scene"] == "by hand"
    assert summary["outcome"] == "equilibrium"
    assert summary["bodies"] == {"rigid": 1, "deformable": 1, "fixed": 1}
    assert summary["contacts"] == 2
    assert summary["steps"] == 10
    stages = {"mesh": 0.5, "solve": 1.5}
    assert summary["time"] == {"simulated": 0.1, "rest": 0.06, "wall": 2.0, "by_stage": stages}
    assert summary["energies"] == {"external": 5.0, "contact": -4.0, "scheme": 1.0}
    assert summary["settlement"]["max"] == pytest.approx(1e-5)
    assert set(summary["errors"]) >= {"natural_map", "penetration", "balance", "reaction", "energy"}
    assert summary["errors"]["energy"] is None  # not a number
    assert summary["von_mises"]["max"] == pytest.approx(2e6)
    assert summary["displacement"]["max"] == pytest.approx(0.005)
    assert summary["reaction"] == {"total_vertical": 20010.0, "weight": 20000.0}


def test_without_deformable_stones_there_is_no_stress(rigid):
    assert summarise(rigid, version="1", seconds={})["von_mises"] is None


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


def test_the_edges_drawn_are_those_of_the_stones_not_of_the_mesh(mixed):
    surface = wall_surface(mixed)
    segments = surface.points[surface.edges]
    assert np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum() == pytest.approx(12 + 16 + 12)
    corners = surface.points[surface.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.sum() == pytest.approx(6 + 10 + 6)
    assert areas[surface.deformable].sum() == pytest.approx(10)
    assert areas[surface.fixed].sum() == pytest.approx(6)


def test_a_surface_survives_its_file(mixed, tmp_path):
    surface = wall_surface(mixed)
    save_surface(tmp_path / "s.npz", surface)
    again = load_surface(tmp_path / "s.npz", WallSurface)
    assert np.array_equal(again.field("von_mises"), surface.field("von_mises"), equal_nan=True)
    assert np.array_equal(again.resultants, surface.resultants)
    assert np.array_equal(again.edges, surface.edges)


@pytest.mark.parametrize(
    ("value", "end"), [(1.0, 1.0), (1.01, 1.2), (0.083, 0.1), (7.9e5, 8e5), (8.1e5, 1e6), (2.2e-6, 2.5e-6)]
)
def test_the_scale_ends_at_a_round_number(value, end):
    top, intervals = nice_ceiling(value)
    assert top == pytest.approx(end)
    step = top / intervals
    assert float(f"{step:.1e}") == pytest.approx(step)  # two digits at most


def test_colours_are_in_the_unit_that_the_scale_names(mixed):
    surface = wall_surface(mixed)
    stress = colouring(surface, "von_mises", 1.4e6)
    assert stress.title == "Von Mises stress [MPa]"
    assert (stress.top, stress.saturated) == (pytest.approx(1.5), True)
    assert np.nanmax(stress.values) == pytest.approx(2.0)
    moved = colouring(surface, "displacement", None)
    assert moved.title == "Displacement [mm]"
    assert (moved.top, moved.saturated) == (pytest.approx(5.0), False)


@pytest.fixture(scope="module")
def strong():
    """As `mixed`, of a material with strengths."""
    material = replace(LIMESTONE, tensile_strength=1e6, compressive_strength=4e6)
    return result_of(
        [
            rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
            deformable_body("D1", (0, 0, 1), (1, 1, 3), height, size=0.5, material=material),
            rigid_body("top", (0, 0, 3), (1, 1, 4)),
        ],
        pairs=((1, 0), (2, 1)),
        forces=((0.0, 0.0, 3000.0), (0.0, 600.0, 800.0)),
        material=material,
    )


def test_the_surface_shows_tension_compression_and_what_joints_carry(strong):
    surface = wall_surface(strong)
    elastic = slice(8, -8)
    assert np.nanmax(surface.field("principal_compression")) == pytest.approx(2e6)
    assert surface.field("principal_tension")[elastic] == pytest.approx(0.0, abs=1e-6)
    assert np.nanmax(surface.field("utilisation")) == pytest.approx(0.5)
    assert surface.field("error")[elastic] == pytest.approx(0.1)
    assert surface.joint_pressure == pytest.approx([3000.0, 3000.0, 800.0, 800.0])  # two triangles each
    assert surface.joint_points[surface.joint_triangles][:, :, 2].mean(axis=1) == pytest.approx([1, 1, 3, 3])
    assert surface.in_kern.tolist() == [True, False]
    assert surface.resultant_points[1] == pytest.approx([0.7, 0.5, 3.0])


def test_pictures_show_the_wall_in_colour_on_white(strong, tmp_path):
    from PIL import Image

    names = draw_pictures(strong, tmp_path, PICTURES, TOWARDS)
    assert names == tuple(f"{name}.png" for name in PICTURES)
    for name in names:
        pixels = np.asarray(Image.open(tmp_path / name).convert("RGB")).astype(int)
        assert (pixels[[0, -1], :, :][:, [0, -1]] == 255).all()  # corners: background
        spread = np.ptp(pixels, axis=2)
        coloured, grey = (spread > 60).mean(), ((spread < 12) & (pixels.mean(axis=2) < 220)).mean()
        if name in ("resultants.png", "principal_tension.png"):
            continue  # two thin strokes; no tension
        assert coloured > 0.005, name
        assert grey > 0.01, name


def test_the_resultants_are_blue_within_the_kern_and_red_outside(strong, tmp_path):
    from PIL import Image

    draw_pictures(strong, tmp_path, ("resultants",), TOWARDS)
    pixels = np.asarray(Image.open(tmp_path / "resultants.png").convert("RGB")).astype(int)
    red, green, blue = np.moveaxis(pixels, 2, 0)
    rows = {
        "blue": np.flatnonzero(((blue - red) > 80).any(axis=1)),
        "red": np.flatnonzero(((red - green) > 80).any(axis=1)),
    }
    assert len(rows["blue"]) > len(rows["red"]) > 0  # the larger force has the longer stroke
    assert rows["red"].max() < rows["blue"].min()  # the upper joint is out of its kern


@pytest.mark.parametrize(
    ("which", "name", "reason"),
    [
        ("rigid", "von_mises", "no stone deforms"),
        ("rigid", "error", "no stone deforms"),
        ("mixed", "utilisation", "no material of a deformable stone has a strength"),
        ("mixed", "von_mises", None),
        ("mixed", "resultants", None),
        ("rigid", "displacement", None),
        ("strong", "utilisation", None),
    ],
)
def test_a_picture_that_would_show_nothing_has_a_reason(request, which, name, reason):
    assert missing(request.getfixturevalue(which), name) == reason


def test_without_pressed_joints_there_is_no_picture_of_them():
    alone = result_of([rigid_body("a", (0, 0, 0), (1, 1, 1))], pairs=(), forces=())
    assert missing(alone, "pressure") == missing(alone, "resultants") == "no joint is pressed"
    assert wall_surface(alone).joint_triangles.shape == (0, 3)


def test_without_deformable_stones_no_stress_is_drawn(rigid, tmp_path):
    assert draw_pictures(rigid, tmp_path, ("von_mises", "utilisation"), TOWARDS) == ()


@pytest.mark.parametrize(
    ("message", "package"),
    [
        ("libGL.so.1: cannot open shared object file: No such file or directory", "libgl1"),
        ("libXrender.so.1: cannot open shared object file", "libxrender1"),
        ("libEGL.so.1: cannot open", "libegl1"),
        ("No module named 'vtkmodules'", None),
    ],
)
def test_a_missing_library_is_named_by_its_package(message, package):
    assert package_of(message) == package


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("import sys; print('libGL.so.1: cannot open'); sys.exit(3)", "apt-get install libgl1"),
        ("import os; os.abort()", "cannot draw off screen"),
        ("import sys; sys.exit('no GLX')", "no GLX"),
    ],
)
def test_a_drawing_process_that_fails_is_reported_not_followed(mixed, tmp_path, monkeypatch, program, said):
    broken = tmp_path / "python"
    broken.write_text(f"#!/bin/sh\nexec '{pictures.sys.executable}' -c \"{program}\"\n", encoding="utf-8")
    broken.chmod(0o755)
    monkeypatch.setattr(pictures.sys, "executable", str(broken))
    with pytest.raises(MissingLibraryError, match=said):
        draw_pictures(mixed, tmp_path, ("von_mises",), TOWARDS)


def test_the_report_explains_the_run_and_needs_no_other_file(mixed, tmp_path):
    pixel = base64.b64decode(
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
    )
    (tmp_path / "von_mises.png").write_bytes(pixel)
    summary = summarise(mixed, version="1.2", seconds={"solve": 1.0})
    write_report(tmp_path / "report.html", mixed, summary, stone_results(mixed), ["a <warning>"])
    page = Page(tmp_path / "report.html")
    text = " ".join(page.text)
    for words in ("It stands", "D1", "2.0000 MPa", "20.01 kN", "a <warning>", "not known", "4.0e-04"):
        assert words in text
    assert page.sources
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)


def test_the_report_names_the_worst_stones_and_joints(strong, tmp_path):
    summary = summarise(strong, version="1.2", seconds={})
    write_report(tmp_path / "report.html", strong, summary, stone_results(strong), [])
    words = Page(tmp_path / "report.html").text
    place = words.index("Stones nearest to their strength")
    assert words[place + 7 : place + 10] == ["D1", "0.5", words[place + 9]]
    place = words.index("Joints with the most eccentric resultants")
    assert words[place + 9 : place + 12] == ["D1 – top", "1.2", "0.4"]
    assert "10.0 %" in words  # error
    assert words[words.index("Joints that slid most") + 8] == "D1 – top"
    assert words[words.index("Joints that opened most") + 8] == "D1 – top"


def test_the_report_of_a_rigid_collapse_says_so(rigid, tmp_path):
    summary = summarise(rigid, version="1.2", seconds={})
    write_report(tmp_path / "report.html", rigid, summary, stone_results(rigid), [])
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "It falls" in text
    assert "Most stressed" not in text


def test_no_text_of_a_run_becomes_markup(tmp_path):
    """Codes, material, scene, warnings, profile and stages, all named like a script."""
    name = "<script>alert('1')</script>"
    bodies = [
        rigid_body(f"{name} base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
        deformable_body(
            name,
            (0, 0, 1),
            (1, 1, 3),
            height,
            size=0.5,
            material=replace(LIMESTONE, name=name, tensile_strength=1e6),
        ),
    ]
    result = result_of(bodies, name=name)
    profile = {"name": name, "about": name, "settings": {name: name}, "expected": {"p99": {"of": name}}}
    profile["expected"]["p99"] |= {"bound": True, "value": 0.1}
    summary = {**summarise(result, version=name, seconds={name: 1.0}), "profile": profile}
    write_report(tmp_path / "report.html", result, summary, stone_results(result), [name])
    page = Page(tmp_path / "report.html")
    assert "script" not in page.tags
    assert sum("<script>" in text.lower() for text in page.text) >= 12
    assert "<script" not in (tmp_path / "report.html").read_text(encoding="utf-8").lower()


def test_every_status_of_a_contact_has_its_number():
    many = np.array(["open", "stick", "slip", "bonded", "broken"])
    contacts = replace(contacts_of(((0, 0),) * 5, ((0, 0, 0),) * 5), status=many)
    assert contact_grid(contacts).point_data["status"].tolist() == [0, 1, 2, 3, 4]
