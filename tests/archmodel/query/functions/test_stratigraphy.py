"""Questions to the stratigraphy: earlier and later, above and below, contradictions, courses that differ."""

import pytest
from sqlalchemy.orm import Session

from archmodel.assertions.arrange import declare_members, declare_structure
from archmodel.assertions.declare import declare_phase
from archmodel.assertions.statements import say_of_phase
from archmodel.assertions.stratigraphy import say_stratigraphy, subjects_named
from archmodel.database.session import Database
from archmodel.query.api import find, find_rows
from archmodel.store.find_by_code import subjects
from archmodel.tables.entries import Entry, new_entry
from ground.errors import QueryError

UNITS = {"101": ["W01-01", "W01-02"], "102": [], "103": ["V1"], "104": ["V2", "V3"], "105": []}
LINKS = (
    ("102", "cuts", "101"),
    ("103", "above", "102"),
    ("104", "above", "103"),
    ("104", "later_than", "101"),
    ("105", "equal_to", "104"),
    ("R1", "above", "104"),
)


def entry_of(session: Session, author: str = "A. Mason") -> Entry:
    return new_entry(session, "declaration", "seen", author=author)


def say(session: Session, *links: tuple[str, str, str], author: str = "A. Mason") -> None:
    things = subjects_named(session, {code for one, _, other in links for code in (one, other)})
    relations = [(things[one], relation, things[other]) for one, relation, other in links]
    say_stratigraphy(session, entry_of(session, author), relations)


def date(session: Session, phase: str, *structures: str, author: str = "A. Mason") -> None:
    say_of_phase(session, entry_of(session, author), subjects(session, structures=structures), phase)


@pytest.fixture
def layered(filled: Database) -> Database:
    """Units in a wall: a cut, its filling, the arch on it."""
    with filled.session() as session:
        for code, stones in UNITS.items():
            title = "floor of lime" if code == "102" else None
            declare_structure(session, entry_of(session), "stratigraphic_unit", code, title=title)
            declare_members(session, entry_of(session), code, subjects(session, stones).entities)
        for name, begins, ends in (("I", 1180, 1210), ("II", 1238, 1260)):
            declare_phase(session, entry_of(session), name, begins, ends)
        say(session, *LINKS)
        date(session, "I", "102")
    return filled


def units(session: Session, expression: str) -> list[object]:
    return [row["code"] for row in find_rows(session, "structure", [expression], columns=["code"])]


def stones(session: Session, expression: str) -> list[str]:
    return [one.code for one in find(session, "entity", [expression])]


def test_units_are_asked_by_their_order(layered: Database) -> None:
    with layered.session(read_only=True) as session:
        assert units(session, "before('103')") == ["101", "102"]
        assert units(session, "after('101')") == ["102", "103", "104", "105"]
        assert units(session, "after('105')") == []
        # a cut does not lie on what it cuts
        assert units(session, "above('101')") == []
        assert units(session, "above('102')") == ["103", "104", "105"]
        assert units(session, "below(R1)") == ["102", "103", "104", "105"]
        assert units(session, "above(title like '%floor%' and phase = I)") == ["103", "104", "105"]
        assert units(session, "after(phase = II)") == []


def test_stones_are_asked_by_the_units_to_which_they_belong(layered: Database) -> None:
    with layered.session(read_only=True) as session:
        assert stones(session, "after('101')") == ["V1", "V2", "V3", "R1"]
        assert stones(session, "before(R1) and kind != rubble") == ["W01-01", "W01-02", "V1", "V2", "V3"]
        assert stones(session, "member_of(above('102'))") == ["V1", "V2", "V3"]
        # above() of a stone remains the load path
        with pytest.raises(QueryError, match="there is no stone"):
            stones(session, "above('102')")


def test_contradictions_of_matrix_and_dates_are_found(layered: Database) -> None:
    with layered.session() as session:
        assert units(session, "contradicted()") == []
        date(session, "II", "101")
        date(session, "I", "104")
        assert units(session, "contradicted()") == ["101", "102", "104"]
        assert stones(session, "contradicted()") == ["W01-01", "W01-02", "V2", "V3"]


def test_units_whose_phase_is_disputed_are_found(layered: Database) -> None:
    with layered.session() as session:
        date(session, "I", "104")
        assert units(session, "disputed(phase)") == []
        date(session, "II", "104", author="B. Builder")
        assert units(session, "disputed(phase)") == units(session, "disputed()") == ["104"]
        assert stones(session, "disputed(phase)") == ["V2", "V3"]


def test_a_loop_between_authors_is_named(layered: Database) -> None:
    with layered.session() as session:
        say(session, ("101", "above", "104"), author="B. Builder")
        with pytest.raises(
            QueryError, match=r"units have no order: 10\d would be later than itself.*--author"
        ):
            units(session, "after('101')")


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("after('109')", "'109' is in no stratigraphic relation; did you mean"),
        ("after()", "after cannot take these arguments"),
        ("contradicted(1)", "contradicted cannot take these arguments"),
        ("changes(bonds)", "unknown attribute 'bonds'; did you mean bond"),
        ("disputed(mark)", "there are no opinions on 'mark'"),
    ],
)
def test_wrong_questions_are_refused(layered: Database, expression: str, message: str) -> None:
    with layered.session(read_only=True) as session, pytest.raises(QueryError, match=message):
        units(session, expression)


def test_structures_are_asked_by_their_stones_and_by_the_course_below(filled: Database) -> None:
    with filled.session() as session:
        for number, members in enumerate((["W01-01"], ["W01-02"], ["W02-01"], ["R1"]), start=1):
            declare_structure(session, entry_of(session), "course", f"C{number}", number=number)
            declare_members(session, entry_of(session), f"C{number}", subjects(session, members).entities)
        declare_structure(session, entry_of(session), "wall", "N")
        declare_structure(session, entry_of(session), "course", "C1", parent="N")
        assert units(session, "has(is_a(header))") == ["C1", "N"]
        assert units(session, "has(W01-02)") == ["C2"]
        assert units(session, "has()") == ["C1", "C2", "C3", "C4", "N"]
        # C1 is in the wall now, and the others in none; C3 has neither headers nor stretchers
        assert units(session, "changes(bond)") == []
        declare_structure(session, entry_of(session), "course", "C2", parent="N")
        assert units(session, "changes(bond)") == ["C2"]
        assert [row["bond"] for row in find_rows(session, "course", columns=["bond"])] == [
            "header",
            "stretcher",
            None,
            None,
        ]
