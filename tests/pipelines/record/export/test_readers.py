"""Files for other programs, opened by readers that are not ours: counts, codes, volumes, centroids, the same bytes."""

import json
import os
import re
import sqlite3
import struct
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import trimesh

from pipelines.record.export.building import stable_uuid
from pipelines.record.export.compas import model_content
from pipelines.record.export.dxf import APPLICATION, dxf_content
from pipelines.record.export.glb import glb_content
from pipelines.record.export.gpkg import write_gpkg
from pipelines.record.export.ifc import global_id, ifc_content
from pipelines.record.export.step import real, text
from survey.formats.solids.compas import read_compas
from tests.paths import ROOT
from tests.pipelines.record.export.buildings import HOSTILE, made_building

CODES = [*HOSTILE, *(f"{HOSTILE[at % len(HOSTILE)]} {at}" for at in range(60))]


@pytest.fixture(scope="module")
def building():
    return made_building(CODES, origin=(100.0, 200.0, 50.0))


def volume_and_centroid(vertices, triangles):
    mesh = trimesh.Trimesh(np.asarray(vertices), np.asarray(triangles), process=False)
    return mesh.volume, mesh.center_mass


def agree(building, row, vertices, triangles, bound=1e-6):
    volume, centroid = volume_and_centroid(vertices, triangles)
    assert abs(volume / building.volumes[row] - 1) < bound
    assert np.abs(centroid - building.centroids[row]).max() < bound


def test_ifc_is_read_by_ifcopenshell(building, tmp_path):
    ifcopenshell = pytest.importorskip("ifcopenshell")
    path = tmp_path / "wall.ifc"
    path.write_bytes(ifc_content(building, "EPSG:25832"))
    model = ifcopenshell.open(str(path))
    elements = model.by_type("IfcElement")
    assert [one.Name for one in elements] == list(CODES)
    assert [one.ObjectType for one in elements] == building.kinds
    for row, one in enumerate(elements[:5]):
        assert one.GlobalId == global_id(stable_uuid("stone", CODES[row]))
        assert ifcopenshell.guid.expand(one.GlobalId) == stable_uuid("stone", CODES[row]).hex
        solid = one.Representation.Representations[0].Items[0]
        agree(building, row, solid.Coordinates.CoordList, np.array(solid.CoordIndex) - 1)
        sets = {
            each.RelatingPropertyDefinition.Name: each.RelatingPropertyDefinition for each in one.IsDefinedBy
        }
        values = {each.Name: each.NominalValue.wrappedValue for each in sets["MOMA_Depth"].HasProperties}
        assert values == {"depth": building.columns[1].values[row]}
        assert ("MOMA_Results" in sets) == (row % 2 == 0)
    course = next(one for one in model.by_type("IfcGroup") if one.Name == "course 1")
    assert len(course.IsGroupedBy[0].RelatedObjects) == len(CODES)
    assert [one.Name for one in model.by_type("IfcMaterial")] == ["limestone"]
    assert model.by_type("IfcProjectedCRS")[0].Name == "EPSG:25832"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # ifcopenshell leaves the file of its rules open
def test_ifc_breaks_no_rule_of_its_schema(tmp_path):
    pytest.importorskip("ifcopenshell")
    import ifcopenshell.validate

    (tmp_path / "wall.ifc").write_bytes(ifc_content(made_building(HOSTILE), "EPSG:25832"))
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(str(tmp_path / "wall.ifc"), log, express_rules=True)
    assert log.statements == []


def test_identifiers_and_text_of_step_are_those_of_the_standard():
    # the identifier of a known UUID, computed by hand: 2 bits, then 6 by 6
    number = stable_uuid("x").int
    assert len(global_id(stable_uuid("x"))) == 22
    assert global_id(stable_uuid("x"))[0] == "0123"[number >> 126]
    assert text("a'b\\c") == "'a''b\\\\c'"
    assert text("石𝔐") == "'\\X2\\77F3\\X0\\\\X4\\0001D510\\X0\\'"
    assert [float(real(value).replace(".E", ".0E")) for value in (1e22, 0.1, -3e-9)] == [1e22, 0.1, -3e-9]


def test_dxf_is_read_by_ezdxf(building, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    path = tmp_path / "wall.dxf"
    path.write_bytes(dxf_content(building))
    drawing = ezdxf.readfile(path)
    assert not drawing.audit().errors
    meshes = drawing.modelspace().query("MESH")
    codes = ["".join(tag.value for tag in one.get_xdata(APPLICATION)) for one in meshes]
    assert codes == list(CODES)
    for row, one in enumerate(list(meshes)[:4]):
        faces = [(face[0], face[at], face[at + 1]) for face in one.faces for at in (1, 2)]
        agree(building, row, [tuple(vertex) for vertex in one.vertices], faces)
    outlines = drawing.modelspace().query("LWPOLYLINE")
    assert len(outlines) == sum(one is not None for one in building.outlines)
    corners = np.array([tuple(point) for point in outlines[0].vertices_in_wcs()])
    assert np.abs(corners - building.outlines[1]).max() < 1e-9
    assert {one.dxf.layer for one in outlines} == {"ELEVATION-header", "ELEVATION-stretcher"}


def test_a_drawing_has_each_handle_once_and_its_classes_in_an_order_of_their_own(building):
    pytest.importorskip("ezdxf")
    drawing = dxf_content(building).decode("utf-8")
    entities = drawing.partition("ENTITIES")[2]
    handles = [int(one, 16) for one in re.findall(r"^  5\n([0-9A-F]+)$", drawing, re.MULTILINE)]
    seed, *others = handles  # the first is the one that comes next
    assert len(set(others)) == len(others) > 2 * len(CODES)
    assert seed > max(others)
    assert entities.count("AcDbSubDMesh") == len(CODES)
    # ezdxf adds those of what is in use in the order of a set, which differs from process to process
    classes = re.findall(r"^CLASS\n  1\n(\S+)$", drawing, re.MULTILINE)
    used = [one for one in classes if f"\n  0\n{one}\n" in drawing]
    assert classes[: len(used)] == sorted(used)
    layers = set(re.findall(r"^AcDbLayerTableRecord\n  2\n(\S+)$", drawing, re.MULTILINE))
    assert layers >= set(re.findall(r"^AcDbEntity\n  8\n(\S+)$", entities, re.MULTILINE))


def test_a_code_with_a_line_break_breaks_no_drawing(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    (tmp_path / "wall.dxf").write_bytes(dxf_content(made_building(["a\nb\t1", "c"])))
    drawing = ezdxf.readfile(tmp_path / "wall.dxf")
    assert not drawing.audit().errors
    first, second = drawing.modelspace().query("MESH")
    assert [tag.value for tag in first.get_xdata(APPLICATION)] == ["a^Jb^I1"]
    assert [tag.value for tag in second.get_xdata(APPLICATION)] == ["c"]


def test_long_codes_come_back_from_dxf_whole(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    code = "石 " * 150
    (tmp_path / "wall.dxf").write_bytes(dxf_content(made_building([code])))
    (mesh,) = ezdxf.readfile(tmp_path / "wall.dxf").modelspace().query("MESH")
    assert "".join(tag.value for tag in mesh.get_xdata(APPLICATION)) == code


def test_glb_is_read_by_trimesh(building, tmp_path):
    path = tmp_path / "wall.glb"
    path.write_bytes(glb_content(building))
    scene = trimesh.load(path, process=False)
    (mesh,) = scene.geometry.values()
    feature = np.asarray(mesh.vertex_attributes["_FEATURE_ID_0"]).ravel().astype(int)
    turn = scene.graph[scene.graph.nodes_geometry[0]][0]
    places = mesh.vertices @ turn[:3, :3].T + turn[:3, 3]
    upwards = np.column_stack([places[:, 0], -places[:, 2], places[:, 1]])
    for row in (0, 7, len(CODES) - 1):
        triangles = mesh.faces[feature[mesh.faces[:, 0]] == row]
        agree(building, row, upwards, triangles, bound=1e-5)  # float32
    table, columns = property_table(path)
    assert table["count"] == len(CODES)
    assert columns["code"] == list(CODES)
    assert columns["solid_volume"] == building.volumes.tolist()
    assert columns["material"][0] == ""
    assert columns["von_mises_max"][1] < -1e300


def property_table(path):
    """The property table of a GLB and its columns, read as the specification says."""
    raw = path.read_bytes()
    size = struct.unpack_from("<I", raw, 12)[0]
    document, data = json.loads(raw[20 : 20 + size]), raw[28 + size :]
    assert struct.unpack_from("<I", raw, 8)[0] == len(raw)
    extension = document["extensions"]["EXT_structural_metadata"]
    (table,) = extension["propertyTables"]

    def view(number):
        place = document["bufferViews"][number]
        assert place["byteOffset"] % 8 == 0
        return data[place["byteOffset"] : place["byteOffset"] + place["byteLength"]]

    columns = {}
    for name, kind in extension["schema"]["classes"]["stone"]["properties"].items():
        values = view(table["properties"][name]["values"])
        if kind["type"] == "STRING":
            ends = np.frombuffer(view(table["properties"][name]["stringOffsets"]), "<u4").tolist()
            pairs = pairwise(ends)
            columns[name] = [values[start:end].decode() for start, end in pairs]
        else:
            columns[name] = np.frombuffer(values, "<f8").tolist()
    return table, columns


def test_geopackage_is_read_by_pyogrio_with_its_style(building, tmp_path):
    pyogrio = pytest.importorskip("pyogrio")
    shapely = pytest.importorskip("shapely")
    path = tmp_path / "wall.gpkg"
    write_gpkg(building, path, "EPSG:25832")
    assert [name for name, _ in pyogrio.list_layers(path)] == ["stones", "elevation", "layer_styles"]
    meta, _, geometry, fields = pyogrio.raw.read(path, layer="elevation")
    values = dict(zip(meta["fields"], fields, strict=True))
    assert values["code"].tolist() == list(CODES)
    areas = [shapely.from_wkb(one).area for one in geometry[1:4]]
    sides = [np.ptp(one, axis=0) for one in building.outlines[1:4]]
    assert np.abs(np.array(areas) - [side[0] * side[2] for side in sides]).max() < 1e-6
    assert pyogrio.read_info(path, layer="stones")["crs"] is not None
    with sqlite3.connect(path) as db:
        layers = dict(db.execute("SELECT f_table_name, styleQML FROM layer_styles WHERE useAsDefault"))
    db.close()
    assert set(layers) == {"stones", "elevation"}
    style = ET.fromstring(layers["stones"].split("\n", 1)[1])
    assert [one.get("value") for one in style.iter("category")] == ["header", "stretcher"]


def test_compas_blocks_have_the_corners_and_names_of_the_stones(building):
    document = json.loads(model_content(building, None))
    assert document["dtype"] == "compas_dem.models/BlockModel"
    blocks = list(document["data"]["elements"].values())
    assert [one["name"] for one in blocks] == list(CODES)
    mesh = blocks[3]["data"]["geometry"]["data"]
    vertices = [[one[axis] for axis in "xyz"] for one in mesh["vertex"].values()]
    agree(building, 3, vertices, [(f[0], f[at], f[at + 1]) for f in mesh["face"].values() for at in (1, 2)])
    nodes = [one["element"] for one in document["data"]["graph"]["node"].values()]
    assert nodes == list(document["data"]["elements"])


def test_compas_blocks_come_back_with_their_corners_codes_and_supports(tmp_path):
    walled = made_building(["A 1", "B-2", "Ü3"], origin=(100.0, 200.0, 50.0))
    walled = replace(walled, kinds=["support", "header", "header"])
    back = read_compas(json.loads(model_content(walled, None)), "here").blocks
    assert [(one.name, one.support) for one in back] == [("A 1", True), ("B-2", False), ("Ü3", False)]
    for one, (corners, faces) in zip(back, walled.shapes, strict=True):
        assert np.array_equal(one.vertices, corners)
        assert tuple(one.faces.values()) == faces


def test_the_same_building_gives_the_same_bytes(building, tmp_path):
    again = made_building(CODES, origin=(100.0, 200.0, 50.0))
    for content in (ifc_content, dxf_content, glb_content, lambda one: model_content(one, None)):
        assert content(building) == content(again)
    for name, one in (("a", building), ("b", again)):
        write_gpkg(one, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


SUMS = """
import hashlib, sys
from pathlib import Path
from tests.pipelines.record.export.test_readers import (
    CODES, dxf_content, glb_content, ifc_content, made_building, model_content, write_gpkg
)
building = made_building(CODES)
write_gpkg(building, Path(sys.argv[1]))
contents = [Path(sys.argv[1]).read_bytes(), model_content(building, None)]
contents += [content(building) for content in (ifc_content, dxf_content, glb_content)]
print([hashlib.sha256(one).hexdigest() for one in contents])
"""


@pytest.mark.slow
def test_another_process_gives_the_same_bytes(tmp_path):
    pytest.importorskip("ezdxf")
    said = [
        subprocess.run(
            [sys.executable, "-c", SUMS, str(tmp_path / f"{seed}.gpkg")],
            cwd=ROOT,
            env=os.environ | {"PYTHONHASHSEED": str(seed), "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in (1, 2, 3)
    ]
    assert len(set(said)) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("content", "seconds", "size"), [(ifc_content, 10, 30e6), (dxf_content, 5, 15e6)])
def test_ten_thousand_stones_are_written_in_seconds(content, seconds, size):
    pytest.importorskip("ezdxf")
    many = made_building([f"W{row}" for row in range(10_000)])
    began = time.process_time()
    assert len(content(many)) < size
    assert time.process_time() - began < seconds


def test_identifiers_stay_where_stones_are_added(building):
    more = replace(made_building([*CODES, "new"]), title=building.title)
    fewer = json.loads(model_content(building, None))["data"]["elements"]
    assert set(fewer) < set(json.loads(model_content(more, None))["data"]["elements"])
