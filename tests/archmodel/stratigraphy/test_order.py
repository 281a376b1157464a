"""Order of units in time: equal ones merged, loops named, transitive reduction; dates, drawing and GraphML."""

import random
import time
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as etree

import pytest

from archmodel.stratigraphy.dates import Dated, contradictions, date_bounds
from archmodel.stratigraphy.draw_graphml import write_graphml
from archmodel.stratigraphy.graphml import DrawnUnit, read_graphml
from archmodel.stratigraphy.order import Link, check_order, find_loop, order_of
from archmodel.tables.stratigraphy import DEFINITIONS, LATER
from ground.errors import UsageError
from pipelines.draw.stratigraphy.drawing import matrix_svg
from pipelines.record.relation_lists import relation_of


def links(text: str) -> list[Link]:
    """Relations from lines such as "103 above 102"."""
    return [Link(*line.split()) for line in text.strip().splitlines()]


def random_links(units: int, count: int, seed: int) -> list[Link]:
    """Relations without a loop: a unit is later than some of the sixty before it."""
    source, pairs = random.Random(seed), set[tuple[int, int]]()
    while len(pairs) < count:
        later = source.randrange(1, units)
        pairs.add((later, source.randrange(max(0, later - 60), later)))
    return [Link(str(a), source.choice(LATER), str(b)) for a, b in sorted(pairs)]


@pytest.mark.parametrize(
    ("text", "loop"),
    [
        ("1 above 2\n2 cuts 3\n3 fills 1", "1 above 2, 2 cuts 3, 3 fills 1"),
        # 2 and 5 are one unit
        ("1 above 2\n2 equal_to 5\n5 above 1\n9 above 1", "1 above 2, 5 above 1"),
        # the short loop, not the walk through 4
        (
            "1 above 2\n2 abuts 4\n4 above 3\n3 above 1\n2 later_than 1\n7 above 8",
            "1 above 2, 2 later_than 1",
        ),
        ("1 above 2\n1 equal_to 2", "1 above 2"),
    ],
)
def test_a_loop_is_named_with_equal_units_taken_as_one(text: str, loop: str):
    found = [str(link) for link in find_loop(links(text))]
    first = loop.split(", ")
    assert sorted(found) == sorted(first)
    assert all(a.target == b.subject or "equal_to" in text for a, b in pairwise(find_loop(links(text))))
    with pytest.raises(UsageError, match="would be later than itself"):
        check_order(links(text))


def test_only_relations_that_no_chain_implies_stay():
    order = order_of(
        ["7"], links("1 above 2\n2 above 3\n1 above 3\n4 cuts 3\n1 cuts 2\n5 equal_to 2\n6 fills 5")
    )
    assert order.below == {"1": ("2",), "2": ("3",), "3": (), "4": ("3",), "6": ("2",), "7": ()}
    assert order.equal["2"] == ("2", "5")
    assert order.levels == {"3": 0, "7": 0, "2": 1, "4": 1, "1": 2, "6": 2}
    assert order.redundant == 1
    assert (order.chain("1", "3"), order.chain("4", "2")) == (("1", "2", "3"), ())


@pytest.mark.parametrize("seed", [1, 2])
def test_the_reduction_leads_as_far_as_all_relations(seed: int):
    given = random_links(60, 150, seed)
    order = order_of([], given)

    def reach(steps: dict[str, set[str]], unit: str) -> set[str]:
        found: set[str] = set()
        queue = [unit]
        while queue:
            for target in steps.get(queue.pop(), set()) - found:
                found.add(target)
                queue.append(target)
        return found

    full: dict[str, set[str]] = {}
    for link in given:
        full.setdefault(link.subject, set()).add(link.target)
    reduced = {unit: set(targets) for unit, targets in order.below.items()}
    for unit in order.units:
        assert reach(full, unit) == reach(reduced, unit)
        for target in reduced[unit]:
            fewer = {**reduced, unit: reduced[unit] - {target}}
            assert target not in reach(fewer, unit)


def test_years_follow_the_matrix_and_contradictions_name_the_chain():
    given = links("1 above 2\n2 above 3\n4 bonded_with 2\n3 equal_to 5\n4 above 5")
    dates = {"1": Dated("II", 1238, 1260), "3": Dated("III", 1490, 1510), "5": Dated("I", 1180, 1210)}
    order = order_of([], given)
    wrong = contradictions(order, given, dates)
    assert [(one.unit, one.target, one.chain) for one in wrong] == [
        ("1", "3", ("1", "2", "3")),
        ("3", "5", ()),
    ]
    bounds = date_bounds(order, {"3": Dated("I", 1180, 1210), "1": Dated("II", 1238, 1260)})
    assert (bounds["2"].begins, bounds["2"].begins_by, bounds["2"].ends, bounds["2"].ends_by) == (
        1180,
        "3",
        1260,
        "1",
    )
    assert (bounds["4"].begins, bounds["4"].ends) == (1180, None)


def test_bonded_units_of_which_one_is_later_are_a_contradiction():
    given = links("1 above 2\n2 above 3\n1 bonded_with 3")
    (wrong,) = contradictions(order_of([], given), given, {})
    assert (wrong.unit, wrong.target, wrong.chain) == ("1", "3", ("1", "2", "3"))


def test_the_matrix_is_drawn_with_later_units_on_top():
    order = order_of([], links("1 above 2\n2 above <3>\n1 above <3>"))
    root = etree.fromstring(matrix_svg(order, {"2": Dated("I", 1180, None)}, doubtful=["1"]))
    texts = {node.text: float(node.get("y", "nan")) for node in root.iter("{http://www.w3.org/2000/svg}text")}
    assert texts["1"] < texts["2"] < texts["<3>"]
    red = [node for node in root.iter() if node.get("stroke") == "#c00000"]
    assert len(red) == 1


@pytest.mark.parametrize(
    "text", ["1 above 2\n2 cuts 3", "\n".join(f"a {name} b{k}" for k, name in enumerate(DEFINITIONS))]
)
def test_graphml_comes_back_as_it_was(text: str, tmp_path):
    given = links(text)
    path = tmp_path / "m.graphml"
    path.write_text(write_graphml(order_of(["alone"], given), given, {}), encoding="utf-8")
    read = read_graphml(path)
    assert (set(read.links), read.ignored) == (set(given), {})
    assert "alone" in read.units


def test_graphml_of_the_palette_is_read_by_shapes_and_styles(tmp_path):
    def node(number: str, kind: str, label: str) -> str:
        inner = f"<y:NodeLabel>{label}</y:NodeLabel><y:Shape type='{kind}'/>"
        return f"<node id='{number}'><data key='d6'><y:ShapeNode>{inner}</y:ShapeNode></data></node>"

    def edge(source: str, target: str, style: str) -> str:
        line = f"<y:PolyLineEdge><y:LineStyle type='{style}'/></y:PolyLineEdge>"
        return f"<edge source='{source}' target='{target}'><data key='d10'>{line}</data></edge>"

    parts = [
        node("n0", "rectangle", "USM01"), node("n1", "rectangle", "USM02"), node("n2", "parallelogram", "USV1"),
        "<node id='n3'><data key='d6'><y:GenericNode><y:NodeLabel>D.01</y:NodeLabel></y:GenericNode></data></node>",
        edge("n0", "n1", "line"), edge("n1", "n2", "double_line"), edge("n1", "n3", "dashed"),
    ]  # fmt: skip
    path = tmp_path / "em.graphml"
    space = "xmlns='http://graphml.graphdrawing.org/xmlns' xmlns:y='http://www.yworks.com/xml/graphml'"
    path.write_text(f"<graphml {space}><graph edgedefault='directed'>{''.join(parts)}</graph></graphml>")
    read = read_graphml(path)
    assert read.units == {"USM01": DrawnUnit(), "USM02": DrawnUnit(), "USV1": DrawnUnit("USVs")}
    assert read.links == (Link("USM01", "later_than", "USM02"), Link("USM02", "contemporary_with", "USV1"))
    assert read.ignored == {"other nodes": 1, "lines of provenance (dashed)": 1}


def test_a_drawing_with_swimlanes_is_read_as_yed_writes_it() -> None:
    """Groups within the table, names of the palette as data, labels in Italian, continuity nodes, dashed paradata."""
    path = Path(__file__).with_name("swimlanes.graphml")
    drawn = read_graphml(path, relation_of)
    assert drawn.units == {
        "USM03": DrawnUnit(epoch="II"),
        "USM01": DrawnUnit(epoch="I"),
        "USD10": DrawnUnit("USD", epoch="I"),
        "SF01": DrawnUnit("SF"),
    }
    assert drawn.epochs == (Dated("II", 1238, 1260), Dated("I", None, None))
    assert drawn.links == (
        Link("USM03", "later_than", "USM01"),
        Link("USM01", "bonded_with", "USD10"),
        Link("USM03", "above", "USD10"),
    )
    assert drawn.ignored == {"groups": 1, "shapes without a name": 1, "lines of provenance (dashed)": 1}


def test_phases_come_back_as_swimlanes(tmp_path: Path) -> None:
    relations = links("1 above 2\n2 cuts 3\n4 equal_to 3\n5 above 1")
    order = order_of(["6"], relations)
    dates = {"1": Dated("II", 1238, 1260), "2": Dated("I", 1180, None), "3": Dated("I", 1180, None)}
    path = tmp_path / "m.graphml"
    path.write_text(write_graphml(order, relations, {}, dates), encoding="utf-8")
    drawn = read_graphml(path)
    assert set(drawn.links) == set(relations)
    assert drawn.epochs == (Dated("II", 1238, 1260), Dated("I", 1180, None))
    epochs = {name: unit.epoch for name, unit in drawn.units.items()}
    assert epochs == {"1": "II", "2": "I", "3": "I", "4": "I", "5": None, "6": None}


@pytest.mark.slow
def test_two_thousand_units_are_ordered_and_drawn_in_five_seconds_of_processor_time():
    given = random_links(2000, 5000, 1)
    start = time.process_time()
    order = order_of([], given)
    matrix_svg(order, {})
    assert time.process_time() - start < 5.0
    loop = [*given, Link(order.units[-1], "above", order.units[0])]
    with pytest.raises(UsageError, match=f"{order.units[-1]} above {order.units[0]}"):
        check_order(loop)
