"""Block models, assemblies and meshes of COMPAS as plain JSON: places, names, supports, refusals."""

import json

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.formats.reading import format_of, open_survey
from survey.formats.solids.compas import read_compas
from survey.geometry.solids import Solid, volume_of
from survey.records.survey import Reject

CORNERS = [(x, y, z) for z in (0.0, 0.3) for x, y in ((0.0, 0.0), (0.6, 0.0), (0.6, 0.4), (0.0, 0.4))]
QUADS = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
TURN = [[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]


def mesh(shift=(0, 0, 0), kind="compas.datastructures/Mesh", **more):
    """A mesh whose keys are not consecutive, as meshes that were edited have them."""
    vertex = {
        str(10 * at): dict(zip("xyz", np.add(one, shift).tolist(), strict=True))
        for at, one in enumerate(CORNERS)
    }
    face = {str(3 * at): [10 * corner for corner in one] for at, one in enumerate(QUADS)}
    return {"dtype": kind, "data": {"vertex": vertex, "face": face, "attributes": {}}, **more}


def matrix(rows):
    return {"dtype": "compas.geometry/Transformation", "data": {"matrix": rows}}


def element(name, shift=(0, 0, 0), support=False, **more):
    data = {"transformation": None, "features": [], "name": name, "material": None, "is_support": support}
    data |= {"geometry": mesh(shift)} | more
    return {"dtype": "compas_dem.elements/Block", "data": data, "name": name}


def model(*elements, parents=(), edges=None, **more):
    """A block model; of the elements in `parents` each is within the one before."""
    guids = [f"g{at}" for at in range(len(elements))]
    tree = None
    for at in reversed(range(len(elements))):
        child = {"name": "n", "element": guids[at]}
        tree = [child | {"children": tree}] if at in parents and tree else [child, *(tree or [])]
    graph = {
        "node": {str(at): {"element": guid} for at, guid in enumerate(guids)},
        "edge": edges or {str(at): {} for at in range(len(guids))},
    }
    data = {
        "transformation": None,
        "elements": dict(zip(guids, elements, strict=True)),
        "materials": {"m": {"dtype": "compas_dem.material/Stone", "data": {"density": 2200}}},
        "tree": {"root": {"name": "root", "children": tree}},
        "graph": graph,
    }
    return {"dtype": "compas_dem.models/BlockModel", "data": data | more, "guid": "of the model"}


def assembly(words):
    """An assembly of two blocks in the words of COMPAS 1 or 2."""
    data, vertex, default = words
    one, two = mesh(kind="compas_assembly.datastructures/Block"), mesh((0, 0, 0.3))
    for block in (one, two):
        block[data] = block.pop("data")
        block[data][vertex] = {"x": 0.0, "y": 0.0, "z": 0.0}
    graph = {"node": {"4": {"block": one, "is_support": True}, "7": {"block": two}}, "edge": {"4": {"7": {}}}}
    graph[default] = {}
    if data == "data":
        graph = {"dtype": "compas.datastructures/Graph", "data": graph}
    return {"dtype": "compas_assembly.datastructures/Assembly", data: {"attributes": {}, "graph": graph}}


@pytest.fixture
def read(tmp_path):
    def read(document):
        path = tmp_path / "model.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        assert format_of(path) == "solids"
        return list(open_survey(path, "solids").blocks)

    return read


def test_blocks_come_with_names_supports_and_plane_faces(read):
    first, second = read(model(element("V1", support=True), element("V 2 ä", (0, 0, 0.3))))
    assert (first.code, first.kind) == ("V1", "support")
    assert (second.code, second.kind) == ("V_2_ä", "ashlar")
    assert volume_of(Solid("", second.vertices, second.faces)) == pytest.approx(0.6 * 0.4 * 0.3, rel=1e-12)
    assert second.vertices[:, 2].min() == pytest.approx(0.3)
    assert len(second.faces) == 6


def test_blocks_that_are_not_named_take_the_number_of_their_node(read):
    # COMPAS gives an object without a name that of its class
    codes = [
        one.code
        for one in read(model(element("Block"), element("Block"), element("twice"), element("twice")))
    ]
    assert codes == ["block-0", "block-1", "block-2", "block-3"]


def test_transformations_of_groups_and_of_the_model_are_followed():
    lifted = [[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2.0], [0, 0, 0, 1]]
    group = element("group", geometry=None, transformation=matrix(TURN))
    inner = element("inner", transformation=matrix(lifted))
    (block,) = read_compas(model(group, inner, parents=(0,), transformation=matrix(lifted)), "here").blocks
    wanted = np.array(CORNERS) @ np.array(TURN)[:3, :3].T + (5.0, 0.0, 4.0)
    assert np.abs(block.vertices - wanted).max() < 1e-12
    assert block.node == 1


@pytest.mark.parametrize(
    "words",
    [
        ("data", "default_vertex_attributes", "default_node_attributes"),
        ("value", "dva", "dna"),
    ],
    ids=["COMPAS 2", "COMPAS 1"],
)
def test_assemblies_of_both_versions_are_read(read, words):
    stones = read(assembly(words))
    assert [(one.code, one.kind) for one in stones] == [("block-4", "support"), ("block-7", "ashlar")]
    assert read_compas(assembly(words), "here").edges == {(4, 7)}


def test_lists_of_meshes_are_read(read):
    assert [one.code for one in read([mesh(), mesh((1, 0, 0), name="left")])] == ["block-0", "left"]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (element("brep", geometry={"dtype": "compas.geometry/Brep", "data": {}}), "Brep, not a mesh"),
        (
            element("notched", features=[{"dtype": "compas_model/Notch"}]),
            "features or modifiers cut its mesh",
        ),
    ],
)
def test_blocks_of_another_shape_are_refused_by_name_and_others_stay(read, wrong, said):
    reject, stone = read(model(wrong, element("good")))
    assert isinstance(reject, Reject)
    assert said in str(reject.error)
    assert stone.code == "good"


def test_blocks_cut_by_a_neighbour_are_refused(read):
    cut = model(element("a"), element("b"), edges={"0": {"1": {"modifiers": [{}]}}, "1": {}})
    stone, reject = read(cut)
    assert stone.code == "a"
    assert "modifiers cut its mesh" in str(reject.error)


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"dtype": "compas.geometry/Frame", "data": {}}, "of compas.geometry/Frame no blocks are read"),
        ({"dtype": "compas_dem.models/BlockModel", "data": {"elements": {}}}, "malformed: KeyError 'graph'"),
        (model(), "no blocks"),
    ],
)
def test_documents_without_blocks_are_refused_with_the_way_out(document, said):
    with pytest.raises(SurveyError, match=f"{said}.*compas.json_dump"):
        read_compas(document, "model.json")


def test_a_document_that_is_cut_short_names_its_line(tmp_path):
    path = tmp_path / "model.json"
    path.write_text(json.dumps(model(element("a")), indent=1)[:900], encoding="utf-8")
    with pytest.raises(SurveyError, match=r"model.json:\d+: this is not JSON"):
        list(open_survey(path, "solids").blocks)


def test_geojson_is_still_geojson(tmp_path):
    path = tmp_path / "stones.json"
    path.write_text('{"type": "FeatureCollection", "features": []}', encoding="utf-8")
    assert format_of(path) == "geojson"
