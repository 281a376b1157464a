"""Canonical proportions: stated of kinds of stones and structures, measured in tolerances, replaced and withdrawn."""

from datetime import date, timedelta

import pytest
from sqlalchemy.orm import Session

from archmodel.assertions.arrange import declare_members, declare_structure
from archmodel.assertions.canons import declare_canon, withdraw_canon
from archmodel.assertions.opinions import decide
from archmodel.assertions.statements import Remark
from archmodel.assertions.stratigraphy import say_stratigraphy
from archmodel.database.as_known import as_known
from archmodel.database.session import Database
from archmodel.describe.entity import describe
from archmodel.describe.history import history
from archmodel.describe.schema_tree import schema
from archmodel.query.api import find, find_rows
from archmodel.store.find_by_code import subjects
from archmodel.store.revisions import RowCounts
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.registered import TOLERANCE
from ground.errors import QueryError, UsageError


def entry_of(session: Session, author: str = "A. Mason") -> Entry:
    return new_entry(session, "declaration", "treatise", author=author)


def departures(session: Session, *codes: str) -> list[object]:
    rows = find_rows(session, "entity", columns=["code", "departs_from_canon"])
    known = {row["code"]: row["departs_from_canon"] for row in rows}
    return [known[code] for code in codes]


@pytest.mark.parametrize(
    ("canon", "expected"),
    [
        # W01-01: length .3, depth .5, height .25
        ("depth/length >= 2", (2.0 - 0.5 / 0.3) / 2.0 / 0.05),
        ("depth >= 2*length", (0.6 - 0.5) / 0.6 / 0.05),
        ("length <= 0.25", 0.05 / 0.25 / 0.05),
        ("length = 0.25", 0.05 / 0.25 / 0.05),
        ("not length > 0.25", 0.05 / 0.25 / 0.05),
        ("depth >= length", 0.0),
        ("depth >= 2*length and length <= 0.25", 4.0),
        ("depth >= 2*length or length <= 0.25", (0.6 - 0.5) / 0.6 / 0.05),
        ("not (depth < 2*length and length > 0.25)", (0.6 - 0.5) / 0.6 / 0.05),
        ("not (depth < 2*length or length > 0.25)", 4.0),
        ("depth >= length or tail_length > 1", 0.0),
        ("depth >= length and tail_length > 1", None),
        ("length <= 0.25 and tail_length > 1", 4.0),
        ("length <= 0.25 or tail_length > 1", None),
        ("zone = none", None),
    ],
)
def test_a_departure_is_the_missing_share_of_the_canonical_number(
    filled: Database, canon: str, expected: float | None
) -> None:
    with filled.session() as session:
        declare_canon(session, entry_of(session), "header", canon, 0.05)
        (found,) = departures(session, "W01-01")
        assert found == (None if expected is None else pytest.approx(expected, rel=1e-9, abs=1e-12))
        # whoever misses by more than one tolerance is not canonical, and nobody else
        codes = [one.code for one in find(session, "header", ["canonical()"])]
        assert codes == (["W01-01"] if expected is not None and expected <= 1.0 else [])
        unknown = [one.code for one in find(session, "header", ["canonical() is null"])]
        assert bool(unknown) == (expected is None)


def test_without_a_stated_tolerance_half_an_inch_in_a_foot_counts(filled: Database) -> None:
    with filled.session() as session:
        assert pytest.approx(0.5 / 12.0) == TOLERANCE
        declare_canon(session, entry_of(session), "header", "depth >= 2*length")
        (found,) = departures(session, "W01-01")
        assert found == pytest.approx((0.6 - 0.5) / 0.6 * 24.0, rel=1e-9)
        assert [one.code for one in find(session, "entity", ["departs_from_canon > 3.9"])] == ["W01-01"]
        # exact where no tolerance is stated, and by kind: a voussoir has no canon
        assert not find(session, "header", ["canonical()"])
        assert departures(session, "V2") == [None]


def test_a_canon_is_replaced_and_withdrawn_and_its_history_is_kept(filled: Database) -> None:
    with filled.session() as session:
        first = entry_of(session)
        assert declare_canon(session, first, "ashlar", "depth >= 0.4") == RowCounts(new=1)
        assert declare_canon(session, entry_of(session), "ashlar", "depth >= 0.4") == RowCounts(unchanged=1)
        second = entry_of(session, "B. Builder")
        assert declare_canon(session, second, "ashlar", "depth >= 0.43", 0.1) == RowCounts(replaced=1)
        # jambs have none of their own, headers do
        canon = describe(session, "W02-01")["canon"]
        assert (canon["proportions"], canon["of"], canon["author"]) == (
            "depth >= 0.43",
            "ashlar",
            "B. Builder",
        )
        assert describe(session, "W01-01")["canon"]["of"] == "header"
        assert withdraw_canon(session, entry_of(session), "ashlar") == RowCounts(withdrawn=1)
        assert describe(session, "W02-01")["canon"]["proportions"] == "depth >= 0.4"
        assert withdraw_canon(session, entry_of(session), "ashlar") == RowCounts(withdrawn=1)
        assert describe(session, "W02-01")["canon"] is None
        assert withdraw_canon(session, entry_of(session), "ashlar") == RowCounts(unchanged=1)
        told = [
            (one.event, one.says.get("proportions"))
            for one in history(session, "W02-01")
            if one.what == "canon"
        ]
        assert told == [
            ("said", "depth >= 0.4"),
            ("replaced", "depth >= 0.43"),
            ("withdrawn", "depth >= 0.43"),
            ("said", "depth >= 0.4"),
            ("withdrawn", "depth >= 0.4"),
        ]
        with as_known(session, second.id) as then:
            assert describe(then, "W02-01")["canon"]["proportions"] == "depth >= 0.43"


def test_the_canon_of_the_program_can_be_withdrawn(filled: Database) -> None:
    with filled.session() as session:
        assert withdraw_canon(session, entry_of(session), "header") == RowCounts(withdrawn=1)
        assert withdraw_canon(session, entry_of(session), "header") == RowCounts(unchanged=1)
        assert departures(session, "W01-01") == [None]
        declare_canon(session, entry_of(session), "ashlar", "depth >= 0.1")
        assert describe(session, "W01-01")["canon"]["of"] == "ashlar"
        (header,) = schema(session, "header")["kinds"]  # type: ignore[misc]
        assert header["canonical"] == "depth >= 0.1"
        with pytest.raises(UsageError, match="the kind voussoir has no canonical proportions of its own"):
            withdraw_canon(session, entry_of(session), "voussoir")


def test_structures_have_canonical_proportions(filled: Database) -> None:
    with filled.session() as session:
        declare_structure(session, entry_of(session), "arch", "A1")
        declare_structure(session, entry_of(session), "wall", "N")
        declare_members(session, entry_of(session), "A1", subjects(session, ["V1", "V2", "V3"]).entities)
        declare_canon(session, entry_of(session), "structure", "members >= 6", 0.25)
        rows = find_rows(
            session, "structure", ["departs_from_canon > 1"], columns=["code", "departs_from_canon"]
        )
        assert rows == [
            {"code": "A1", "departs_from_canon": pytest.approx(2.0)},
            {"code": "N", "departs_from_canon": 4},
        ]
        assert [row["code"] for row in find_rows(session, "arch", ["not canonical()"], columns=["code"])] == [
            "A1"
        ]
        assert describe(session, "A1")["canon"]["verdict"] == "missed"
        for canon, message in (
            ("depth > 1", "unknown attribute 'depth'"),
            ("rise/span = 0.5", "give a tolerance"),
        ):
            with pytest.raises(QueryError, match=message):
                declare_canon(session, entry_of(session), "arch", canon)


@pytest.mark.parametrize(
    ("canon", "message"),
    [
        ("departs_from_canon > 1", "cannot ask for the departure from themselves"),
        ("depth = 2*length", "no measured number equals another exactly"),
        ("supports()", "cannot ask functions"),
        ("von_mises_max@1 > 1", "cannot ask a run"),
    ],
)
def test_what_no_canon_can_be_is_refused(filled: Database, canon: str, message: str) -> None:
    with filled.session() as session, pytest.raises(QueryError, match=message):
        declare_canon(session, entry_of(session), "header", canon)


def test_no_opinion_is_of_a_day_to_come(filled: Database) -> None:
    """Decisions and stratigraphic relations are opinions as phases are."""
    later = Remark(stated_on=date.today() + timedelta(days=3))
    with filled.session() as session:
        about = subjects(session, ["W01-01"])
        for state in (
            lambda: say_stratigraphy(session, entry_of(session), [((1, None), "above", (2, None))], later),
            lambda: decide(session, entry_of(session), "of_phase", about, {}, later),
        ):
            with pytest.raises(UsageError, match=r"is in the future|no opinions"):
                state()
        with pytest.raises(UsageError, match="is in the future"):
            say_stratigraphy(session, entry_of(session), [((1, None), "above", (2, None))], later)
