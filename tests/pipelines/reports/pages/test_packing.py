"""What is packed comes back: places to their step, poses to a part in 32,767, texts as they are; pages stay small."""

import base64
import gzip
import json
import re
import struct
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechanics.scene.shapes import BOX_FACES, box_corners
from pipelines.reports.page.inline import MODULES, module_text, script
from pipelines.reports.page.model import Column
from pipelines.reports.page.packing import pack
from pipelines.reports.page.surfaces import rigid_motion, stones_of
from tests.pipelines.reports.pages.models import wall_model


def unpack(text):
    """Return the head and the arrays of a packed model."""
    data = gzip.decompress(base64.b64decode(text))
    (length,) = struct.unpack("<I", data[:4])
    head, begin = json.loads(data[4 : 4 + length]), 4 + length
    arrays = []
    for entry in head["arrays"]:
        kind = np.dtype(entry["type"]).newbyteorder("<")
        count = int(np.prod(entry["shape"], dtype=int))
        values = np.frombuffer(data, kind, count, begin + entry["at"]).reshape(entry["shape"])
        arrays.append(np.cumsum(values, axis=0, dtype=kind) if entry.get("delta") else values)
    return head, arrays


def series(head, arrays, one):
    return arrays[one["values"]["array"]].astype(float) * arrays[one["scale"]["array"]][:, None]


def test_a_model_comes_back_as_it_went_in():
    model = wall_model(12, instants=5)
    head, arrays = unpack(pack(model))
    assert head["codes"] == list(model.stones.codes)
    places = arrays[head["vertices"]["values"]["array"]] * head["vertices"]["step"]
    np.testing.assert_allclose(places, model.stones.vertices, atol=0.5e-5)
    for name, rows in (
        ("triangles", model.stones.triangles),
        ("owner", model.stones.owner),
        ("edges", model.stones.edges),
    ):
        np.testing.assert_array_equal(arrays[head[name]["array"]], rows)
    for name in ("shift", "turn"):
        values = getattr(model.motion, name)
        atol = 0.51 * np.abs(values).max() / 32767
        np.testing.assert_allclose(series(head, arrays, head["motion"][name]), values, atol=atol)
    kinds = head["columns"][0]
    assert [kinds["words"][k] for k in arrays[kinds["values"]["array"]]] == list(model.columns[0].values)


def test_a_stone_that_falls_far_does_not_coarsen_the_others():
    model = wall_model(4, instants=3)
    shift = model.motion.shift.copy()
    shift[2, 3] = (0.0, 0.0, -20.0)
    head, arrays = unpack(pack(replace(model, motion=replace(model.motion, shift=shift))))
    found = series(head, arrays, head["motion"]["shift"])
    np.testing.assert_allclose(found[:, :3], shift[:, :3], atol=1e-8)
    assert found[2, 3, 2] == pytest.approx(-20.0, abs=1e-3)


def test_unknown_values_and_texts_of_any_kind_are_kept():
    texts = ["</script><script>alert(1)</script>", None, '"onload=', "=1+1"]
    columns = [
        Column("note", "note", None, texts),
        Column("depth", "depth", "m", np.array([np.nan, 1, 2, 3])),
    ]
    packed = pack(replace(wall_model(4), columns=columns))
    assert re.fullmatch(r"[A-Za-z0-9+/=]+", packed)
    head, arrays = unpack(packed)
    rows = arrays[head["columns"][0]["values"]["array"]]
    assert [None if k < 0 else head["columns"][0]["words"][k] for k in rows] == texts
    assert np.isnan(arrays[head["columns"][1]["values"]["array"]]).tolist() == [True, False, False, False]


def test_a_thousand_stones_in_a_hundred_instants_take_no_more_than_stated():
    """Random walks are the worst case: real motions are smooth, and most stones of a building rest."""
    assert len(pack(wall_model(1000, instants=100))) <= 2.5e6


def test_rigid_motions_are_found_exactly_and_elastic_ones_best():
    random = np.random.default_rng(3)
    start = [random.normal(size=(8, 3)) for _ in range(20)]
    vectors = random.normal(size=(20, 3))
    vectors[:2] *= (np.pi - np.array([[1e-9], [1e-3]])) / np.linalg.norm(vectors[:2], axis=1)[:, None]
    turns = Rotation.from_rotvec(vectors)
    moves = random.normal(size=(20, 3))
    end = [points @ turn.as_matrix().T + move for points, turn, move in zip(start, turns, moves, strict=True)]
    for soft in (False, True):
        centres, shift, turn = rigid_motion(start, [start, end], np.full(20, soft))
        np.testing.assert_allclose(shift[0], 0.0, atol=1e-12)
        for k in range(20):
            matrix = Rotation.from_rotvec(turn[1, k]).as_matrix()
            found = (start[k] - centres[k]) @ matrix.T + centres[k] + shift[1, k]
            np.testing.assert_allclose(found, end[k], atol=1e-9)


def test_polygons_that_are_not_convex_are_filled_once():
    """An L-shaped prism: its surface of triangles has its area."""
    outline = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
    points = np.concatenate([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 1.0)])
    faces = [tuple(range(6, 12)), tuple(range(5, -1, -1))]
    faces += [(i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i) for i in range(6)]
    mesh, rows = stones_of(["L"], [(points, faces)])
    corners = mesh.vertices[mesh.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.sum() == pytest.approx(2 * 3.0 + 8.0)
    assert len(mesh.edges) == 18
    np.testing.assert_array_equal(rows, np.arange(12))


def test_facets_of_a_mesh_are_drawn_without_the_lines_between_them():
    points = box_corners((0, 0, 0), (1, 1, 1))
    facets = [triangle for a, b, c, d in BOX_FACES for triangle in ((a, b, c), (a, c, d))]
    mesh, _ = stones_of(["box"], [(points, facets)], [True])
    assert (len(mesh.triangles), len(mesh.edges)) == (12, 12)


def test_modules_share_no_name_and_follow_those_that_they_import():
    names = []
    for number, module in enumerate(MODULES):
        text = module_text(f"{module}.js")
        names += re.findall(r"^(?:export )?(?:async )?(?:const|let|function|class) (\w+)", text, re.MULTILINE)
        imported = re.findall(r'^import .* from "\./(\w+)\.js";$', text, re.MULTILINE)
        assert set(imported) <= set(MODULES[:number]), module
    assert len(names) == len(set(names))
    assert "import " not in str(script())
    assert "</script" not in str(script())
