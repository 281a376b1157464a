"""Lists of structures, order, counts and shares, full text, and letters typed in two ways; on both databases."""

import csv
import io
from collections.abc import Callable

import pytest

from archmodel.database.session import open_database
from archmodel.query.api import attributes, find, find_rows
from archmodel.query.tally import count_by, sorted_rows
from ground.errors import QueryError, UsageError
from pipelines.record.record import record
from pipelines.results.table_csv import csv_text
from tests.archmodel.stones import box_stone, store

STONES = (
    box_stone("A1", "header", course=1, size=(0.3, 0.6, 0.5), at=(0.0, 0.0, 0.0)),
    box_stone("A2", "header", course=1, size=(0.3, 0.5, 0.5), at=(1.0, 0.0, 0.0)),
    box_stone("B1", "stretcher", course=2, size=(1.4, 0.4, 0.5), at=(0.0, 0.0, 1.0)),
    box_stone("B2", "stretcher", course=2, size=(1.0, 0.4, 0.5), at=(2.0, 0.0, 1.0)),
)
# the second sign has u with a combining accent
KNOWLEDGE = """
[record]
author = "A"
source = "by eye"
[[phase]]
name = "I"
[[phase]]
name = "II"
[[kind]]
name = "chimney"
parent = "structure"
definition = "A flue."
[[structure]]
kind = "tower"
code = "T"
title = "The Gothic tower"
[[structure]]
kind = "wall"
code = "W"
parent = "T"
stones = ["A1", "A2"]
[[structure]]
kind = "chimney"
code = "CH"
stones = ["B2"]
[[of_phase]]
phase = "I"
structures = ["T"]
[[of_phase]]
phase = "II"
stones = ["B1"]
[[mark]]
sign = "fish"
stones = ["A1", "B1"]
[[mark]]
sign = "Schl\N{LATIN SMALL LETTER U WITH DIAERESIS}ssel"
stones = ["B1"]
[[mark]]
sign = "Schlu\N{COMBINING DIAERESIS}ssel"
stones = ["B1"]
place = "left"
[[mark]]
sign = "moon"
stones = ["B1", "B2"]
[[note]]
key = "tool"
text = "gothic toothed axe"
stones = ["B2"]
"""


@pytest.fixture
def url(new_url: Callable[[], str], tmp_path) -> str:
    made = new_url()
    store(made, STONES)
    path = tmp_path / "k.toml"
    path.write_text(KNOWLEDGE, encoding="utf-8")
    record([path], made)
    return made


def test_structures_are_listed_with_what_holds_of_them(url: str) -> None:
    with open_database(url) as database, database.session(read_only=True) as session:
        rows = find_rows(session, "structure")
        assert [one.name for one in attributes(session, "wall")] == list(rows[0])
        by_code = {row["code"]: row for row in rows}
        assert list(by_code) == ["T", "W", "CH"]
        assert by_code["W"] == {
            "code": "W",
            "kind": "wall",
            "title": None,
            "number": None,
            "side": None,
            "parent": "T",
            "parts": 0,
            "bond": "header",
            "members": 2,
            "phase": "I",
            "material": None,
            **dict.fromkeys(("span", "rise", "departs_from_canon", "crack_width")),
        }
        assert (by_code["T"]["parts"], by_code["T"]["members"], by_code["CH"]["phase"]) == (1, 0, None)
        assert [row["code"] for row in find_rows(session, "chimney")] == ["CH"]
        assert [row["code"] for row in find_rows(session, "structure", ["phase = I", "members > 0"])] == ["W"]
        assert [one.code for one in find(session, "entity", ["member_of(phase = I)"])] == ["A1", "A2"]
        with pytest.raises(QueryError, match="unknown attribute 'depth'"):
            find_rows(session, "wall", ["depth > 1"])
        with pytest.raises(UsageError, match="kind of stone or structure 'context'") as refused:
            find_rows(session, "context")
        assert "did you mean" not in str(refused.value)


def test_counts_shares_and_groups_of_one_phase_only(url: str) -> None:
    with open_database(url) as database, database.session(read_only=True) as session:
        shares = count_by(session, "entity", (), ["phase"], share_of="area")
        assert [(row["phase"], row["count"]) for row in shares.rows] == [("I", 2), ("II", 1), (None, 1)]
        assert [row["share"] for row in shares.rows] == pytest.approx([0.2, 1.4 / 3, 1.0 / 3])
        marks = count_by(session, "entity", ["has_mark()"], ["mark"])
        assert {row["mark"]: row["count"] for row in marks.rows} == {"Schlüssel": 1, "fish": 2, "moon": 2}
        only = count_by(session, "entity", ["has_mark()"], ["mark"], only_in="phase = II")
        # fish is of I too, and of moon one stone has no phase
        assert [row["mark"] for row in only.rows] == ["Schlüssel"]
        assert only.notes == ("moon: not known of 1",)
        with pytest.raises(UsageError, match="zone is no number"):
            count_by(session, "entity", (), ["phase"], share_of="zone")


def test_rows_are_sorted_by_several_attributes(url: str) -> None:
    with open_database(url) as database, database.session(read_only=True) as session:
        rows = find_rows(session, "entity", (), None, ["code", "course", "depth", "phase"])
        assert [row["code"] for row in sorted_rows(rows, ["-course", "depth"])] == ["B1", "B2", "A2", "A1"]
        assert sorted_rows(rows, ["-phase"])[-1]["code"] == "B2"


def test_letters_typed_in_two_ways_are_one_letter(url: str) -> None:
    with open_database(url) as database, database.session(read_only=True) as session:
        for typed in ("Schlüssel", "Schlu\N{COMBINING DIAERESIS}ssel"):
            assert [one.code for one in find(session, "entity", [f"has_mark({typed})"])] == ["B1"]
            assert [one.code for one in find(session, "entity", [f"mark = {typed}"])] == ["B1"]


def test_words_are_found_in_notes_and_in_titles_of_structures(url: str) -> None:
    with open_database(url) as database, database.session(read_only=True) as session:
        assert [one.code for one in find(session, "entity", ["text(gothic)"])] == ["A1", "A2", "B2"]
        assert [one.code for one in find(session, "entity", ["text('toothed axe')"])] == ["B2"]
        assert find(session, "entity", ["text('100%')"]) == []


def test_a_spreadsheet_gets_its_mark_semicolons_and_decimal_commas() -> None:
    text = csv_text(["code", "depth"], [{"code": "=1", "depth": 0.5}], spreadsheet=True)
    assert text.startswith("\ufeff")
    assert list(csv.reader(io.StringIO(text[1:]), delimiter=";")) == [["code", "depth"], ["'=1", "0,5"]]
