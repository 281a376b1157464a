"""Tables of pages: headings from the catalogue, cells under the name that they belong to."""

import re

import pytest

from archmodel.quantities import quantities_of
from pipelines.reports.html import table_of
from tests.paths import ROOT

TEMPLATES = sorted((ROOT / "pipelines/reports/templates").glob("*.html"))


def test_a_cell_stands_under_the_heading_of_its_name():
    rows = [{"stone": "A", "kern": "1", "edge": "0.3"}, {"edge": "0.5", "kern": "2", "stone": "B"}]
    table = table_of("joint", rows, dict)
    kern, edge = (quantities_of("joint")[name].label for name in ("kern", "edge"))
    assert [heading.lower() for heading in table.head] == ["stone", kern, edge]
    assert table.rows == [("A", "1", "0.3"), ("B", "2", "0.5")]


def test_rows_beyond_those_shown_are_counted_and_not_made():
    made = []
    table = table_of("row", "abcd", lambda letter: made.append(letter) or {"stone": letter}, 2)
    assert (table.rows, table.count, made) == ([("a",), ("b",)], 4, ["a", "b"])


def test_a_table_without_rows_is_empty():
    table = table_of("joint", [], dict)
    assert (table.head, table.rows, table.count) == ((), [], 0)


def test_a_column_that_is_not_in_the_catalogue_is_refused():
    with pytest.raises(KeyError, match="krn"):
        table_of("joint", [{"krn": "1"}], dict)


def test_rows_of_one_table_have_the_same_names():
    with pytest.raises(AssertionError, match="same names"):
        table_of("joint", [{"kern": "1"}, {"kern": "2", "edge": "1"}], dict)


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.stem)
def test_no_template_has_headings_of_its_own(path):
    assert not re.search(r"""table\([^)]*, \(["']""", path.read_text(encoding="utf-8"))
