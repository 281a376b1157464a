"""Drawings in the palette of the Extended Matrix 1.5: kinds of units, groups, evidence, and what is no stratigraphy."""

from pathlib import Path

import pytest

from archmodel.stratigraphy.draw_graphml import write_graphml
from archmodel.stratigraphy.graphml import DrawnUnit, read_graphml
from archmodel.stratigraphy.order import Link, order_of
from archmodel.stratigraphy.palette import UNIT_KINDS
from tests.archmodel.stratigraphy.drawings import artifact, drawing, group, line, other, shape


@pytest.mark.parametrize("kind", UNIT_KINDS)
def test_each_kind_of_unit_is_known_by_its_box_and_comes_back(kind: str, tmp_path: Path) -> None:
    read = read_graphml(drawing(tmp_path / "one.graphml", shape("n0", kind, "U1", "# by hand\nwall of tuff")))
    assert read.units == {"U1": DrawnUnit(kind, "wall of tuff")}
    again = tmp_path / "again.graphml"
    again.write_text(write_graphml(order_of(["U1"], []), [], {}, {}, read.units), encoding="utf-8")
    assert read_graphml(again).units == read.units


def test_what_is_no_stratigraphy_is_counted_by_kind(tmp_path: Path) -> None:
    path = drawing(
        tmp_path / "all.graphml",
        shape("n0", "US", "US1"), shape("n1", "VSF", "VSF1"), shape("n2", "US", "US1"),
        other("n3", "ShapeNode", "to do", "<y:Fill color='#FFCC00'/><y:Shape type='rectangle'/>"),
        other("n4", "ShapeNode", "", "<y:Shape type='diamond'/>"), other("n5", "SVGNode", "D.1.2"),
        other("n6", "SVGNode", "C.1"), other("n7", "ImageNode", "A.1"),
        other("n8", "ShapeNode", "x", "<y:Shape type='star8'/>"),
        artifact("n9", "ARTIFACT_TYPE_DATA_OBJECT", "D.1"),
        group("n10", "#FFCC99", "US1_PD", artifact("n11", "ARTIFACT_TYPE_ANNOTATION", "absolute_time_start")),
        line("n0", "n1", "dotted"), line("n1", "n0", "dashed_dotted"), line("n0", "n10", "dashed"),
        line("n0", "n4", "line"), line("n0", "n2", "line"),
    )  # fmt: skip
    read = read_graphml(path)
    assert (set(read.units), read.links) == ({"US1", "VSF1"}, ())
    assert read.ignored == {
        "further boxes of units that are drawn twice": 1,
        "comments": 1,
        "nodes of continuity": 1,
        "extractors": 1,
        "combiners": 1,
        "pictures": 1,
        "shapes (star8)": 1,
        "documents": 1,
        "groups of paradata": 1,
        "properties (absolute_time_start)": 1,
        "lines of change (dotted)": 1,
        "lines of contrast (dashed and dotted)": 1,
        "lines of provenance (dashed)": 1,
        "lines to what is no unit": 1,
        "lines from a unit to itself": 1,
    }


def test_a_group_with_the_border_of_a_unit_is_a_unit_of_which_others_are_parts(tmp_path: Path) -> None:
    inside = shape("n1", "US", "US11") + group("n2", "#CCFFFF", "repair", shape("n3", "TSU", "TSU12"))
    path = drawing(
        tmp_path / "group.graphml",
        group("n0", "#9B3333", "US10", inside), shape("n4", "USD", "USD13"),
        line("n0", "n4", "line", "taglia"), line("n1", "n3", "double_line"),
    )  # fmt: skip
    read = read_graphml(path, {"taglia": "cuts"}.get)
    assert read.units == {
        "US10": DrawnUnit(),
        "US11": DrawnUnit(parent="US10"),
        "TSU12": DrawnUnit("TSU", parent="US10"),
        "USD13": DrawnUnit("USD"),
    }
    assert read.links == (Link("US10", "cuts", "USD13"), Link("US11", "contemporary_with", "TSU12"))
    assert read.ignored == {"activities": 1}


def test_absolute_dates_of_a_unit_are_properties_joined_to_it(tmp_path: Path) -> None:
    """Alone or in a group of paradata, to either side of the line, with a category before the name or not."""

    def dated(number: str, name: str, text: str) -> str:
        drawn = artifact(number, "ARTIFACT_TYPE_ANNOTATION", name)
        return drawn.replace("<data key='d6'>", f"<data key='d5'>{text}</data><data key='d6'>", 1)

    path = drawing(
        tmp_path / "dated.graphml",
        *(shape(f"u{k}", "US", f"US{k}") for k in range(4)),
        dated("p1", "absolute_time_start", "1180"), dated("p2", "Temporal.absolute_time_end", "circa 1210"),
        group("g3", "#FFCC99", "US2_PD", dated("p3", "absolute_time", "1238/1260")),
        dated("p4", "absolute_time_start", "the reign of Otto"), dated("p5", "absolute_time_end", "1300"),
        dated("p6", "material", "tuff"),
        line("u1", "p1", "dashed"), line("p2", "u1", "dashed"), line("u2", "g3", "dashed"), line("u3", "p4", "dashed"),
    )  # fmt: skip
    read = read_graphml(path)
    assert read.units == {
        "US0": DrawnUnit(),
        "US1": DrawnUnit(begins="1180", ends="circa 1210"),
        "US2": DrawnUnit(begins="1238", ends="1260"),
        "US3": DrawnUnit(),
    }
    # what dates nothing, or is no date, is counted
    assert read.ignored == {
        "groups of paradata": 1,
        "properties (absolute_time_start)": 1,
        "properties (absolute_time_end)": 1,
        "properties (material)": 1,
        "lines of provenance (dashed)": 1,
    }
