"""docs/scene.md shows the keys of a scene file as they are declared."""

import pytest

from tests.paths import ROOT
from tests.pipelines.scene.reference import with_tables

PAGE = (ROOT / "docs/scene.md").read_text(encoding="utf-8")


def test_the_tables_of_the_page_are_those_of_the_keys():
    assert with_tables(PAGE) == PAGE


def test_an_old_table_is_renewed():
    old = PAGE.replace("| `step` | s | `0.001` | Time step h. |\n", "| `stride` | m | | Old. |\n")
    assert old != PAGE
    assert with_tables(old) == PAGE


def test_a_table_that_is_missing_is_named():
    with pytest.raises(LookupError, match=r"sections \[\[throw\]\]"):
        with_tables(PAGE[: PAGE.index("## `[[throw]]`")])
