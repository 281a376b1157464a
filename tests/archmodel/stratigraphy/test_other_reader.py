"""GraphML as the reader of the Extended Matrix understands it: s3dgraphy 1.5, in an environment that has it."""

import pytest

from archmodel.stratigraphy.dates import Dated
from archmodel.stratigraphy.draw_graphml import write_graphml
from archmodel.stratigraphy.graphml import DrawnUnit
from archmodel.stratigraphy.order import order_of
from tests.archmodel.stratigraphy.test_order import links

STATED = "1 above 2\n2 cuts 3\n3 equal_to 4\n2 fills 5\n3 bonded_with 6"
DATES = {"1": Dated("II", 1238, 1260), "2": Dated("II", 1238, 1260), "3": Dated("I", 1100, 1150)}
WORDS = 'a wall <old> & "new"'
LATER, EQUAL = "is_after", "has_same_time"


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    pytest.importorskip("s3dgraphy")
    from s3dgraphy.graph import Graph
    from s3dgraphy.importer.import_graphml import GraphMLImporter

    given = links(STATED)
    path = tmp_path_factory.mktemp("other") / "matrix.graphml"
    drawn = {"1": DrawnUnit(title=WORDS)}
    path.write_text(write_graphml(order_of([], given), given, {}, DATES, drawn), encoding="utf-8")
    return GraphMLImporter(str(path), Graph("matrix")).parse()


def test_units_have_their_codes_and_descriptions(read):
    units = {node.name: node.description for node in read.nodes if node.node_type == "US"}
    assert units == dict.fromkeys("23456", "") | {"1": WORDS}


def test_relations_have_their_direction(read):
    names = {node.node_id: node.name for node in read.nodes}
    drawn = [
        (names[edge.edge_source], edge.edge_type, names[edge.edge_target])
        for edge in read.edges
        if edge.edge_type in (LATER, EQUAL)
    ]
    assert sorted(drawn) == [
        ("1", LATER, "2"),
        ("2", LATER, "3"),
        ("2", LATER, "5"),
        ("3", EQUAL, "4"),
        ("3", EQUAL, "6"),
    ]


def test_phases_have_their_years_and_units(read):
    epochs = {
        node.name: (node.start_time, node.end_time) for node in read.nodes if node.node_type == "EpochNode"
    }
    assert epochs == {"I": (1100, 1150), "II": (1238, 1260)}
    names = {node.node_id: node.name for node in read.nodes}
    begun = {
        names[e.edge_source]: names[e.edge_target] for e in read.edges if e.edge_type == "has_first_epoch"
    }
    assert begun == {"1": "II", "2": "II", "3": "I", "4": "I"}
