"""What the functions of expressions find in the wall that `tests.archmodel.known_wall` furnishes."""

import pytest
from sqlalchemy import select

from archmodel.database.session import Database
from archmodel.query.api import find, find_rows
from archmodel.query.compile import condition
from archmodel.tables.entities import Entity, Voussoir
from ground.errors import QueryError
from tests.archmodel.known_wall import furnish


@pytest.fixture
def furnished(filled: Database) -> Database:
    furnish(filled)
    return filled


def test_what_functions_and_attributes_find(furnished: Database) -> None:
    """One database for all: furnishing it takes longer than asking it."""
    wrong = {}
    with furnished.session(read_only=True) as session:
        for expression, expected in FOUND.items():
            found = " ".join(one.code for one in find(session, "entity", expression))
            if found != expected:
                wrong[expression] = f"{found!r}, not {expected!r}"
    assert not wrong


FOUND = {
    # relations
    "rests_on(W01-02)": "W02-01",
    "rests_on('W01-02')": "W02-01",
    "RESTS_ON ( W01-02 )": "W02-01",
    "rests_on(kind = jamb)": "V1",
    "rests_on(course = 1 and kind = header)": "W02-01",
    "rests_on()": "W02-01 V1 V2 V3",
    "not rests_on()": "W01-01 W01-02 R1",
    "supports(W02-01)": "W01-01 W01-02",
    "supports()": "W01-01 W01-02 W02-01 V1 V2",
    "supports(kind = keystone)": "V2",
    "beside(W01-01)": "W01-02",
    "beside(W01-02)": "W01-01",
    "beside()": "W01-01 W01-02",
    "beside(kind = header)": "W01-02",
    "bonded_with(W01-01) or bonded_with(W02-01)": "W01-01 W02-01",
    "across_the_wall(kind = rubble)": "W01-02",
    "across_the_wall()": "W01-02 R1",
    "rests_on(rests_on(rests_on(course = 1)))": "V2",
    "rests_on(not rests_on())": "W02-01",
    "rests_on((code = V1))": "V2",
    # the load path
    "above(W01-01)": "W02-01 V1 V2 V3",
    "above(V3)": "",
    "below(V3)": "W01-01 W01-02 W02-01 V1 V2",
    "below(kind = jamb)": "W01-01 W01-02",
    "above(W01-01) and below(V3)": "W02-01 V1 V2",
    "below(above(V2))": "W01-01 W01-02 W02-01 V1 V2",
    # structures
    "member_of(A1)": "V1 V2 V3",
    "member_of(F1)": "W01-01 W01-02 W02-01",
    "member_of(castle)": "W01-01 W01-02 W02-01 V1 V2 V3",
    "member_of()": "W01-01 W01-02 W02-01 V1 V2 V3",
    "member_of(kind = arch)": "V1 V2 V3",
    "member_of(kind = course and number = 1)": "W01-01 W01-02",
    "member_of(side = outer)": "W01-01 W01-02 W02-01",
    "member_of(title like '%west%')": "W01-01 W01-02 W02-01 V1 V2 V3",
    "member_of(kind = course and part_of(T1))": "W01-01 W01-02",
    "member_of(part_of(kind = wall_facing))": "W01-01 W01-02 W02-01",
    "member_of(not part_of())": "W01-01 W01-02 W02-01 V1 V2 V3",
    "structures = 1": "W01-01 W01-02 W02-01 V1 V2 V3",
    # places
    "within(V2, 0.25)": "V3",
    "within(V2, 0.0)": "",
    "within(1.5, 0.21, 1.25, 1e-9)": "V2",
    "within(0, 0, 0, 1e9)": "W01-01 W01-02 W02-01 V1 V2 V3 R1",
    "within_box(1, 0, 1, 2, 0.215, 2)": "V2 V3",
    # what is said of stones and structures
    "phase = 1": "W01-01 W01-02",
    "phase = '2'": "W02-01 V1 V2 V3",
    "phase is null": "R1",
    "phase_begins < 1300": "W01-01 W01-02",
    "phase_ends is null and phase is not null": "W02-01 V1 V2 V3",
    "material = tuff": "W01-01 W01-02 W02-01 V1 V2",
    "material = marble": "V3",
    "density > 2000": "V3",
    "tensile_strength = 8e5": "W01-01 W01-02 W02-01 V1 V2",
    "tensile_strength = -1": "",
    "has_mark()": "W01-01 V2",
    "has_mark(fish)": "W01-01 V2",
    "has_mark('A')": "W01-01",
    "has_mark(star)": "",
    "mark = A": "W01-01",
    "marks = 2": "W01-01",
    "marks = 0": "W01-02 W02-01 V1 V3 R1",
    "observed()": "W01-01 W01-02 W02-01 V1 V2 V3",
    "observed(erosion)": "W01-01 W01-02 W02-01 V1 V2 V3",
    "observed(erosion, 1)": "W01-02 W02-01 V1 V2 V3",
    "observed(crack)": "V1 V3",
    "observed(CRACK, 3)": "V1",
    "observed(crack, 0)": "V1",
    "observed(stain)": "",
    "observations = 2": "V1 V3",
    "severity = 0": "W01-01",
    "severity >= 2": "W01-02 W02-01 V1 V2 V3",
    "severity > 2": "V1",
    "documented()": "W01-01 V1 V2 V3",
    "documented(D1)": "V1 V2 V3",
    "documented(P7)": "W01-01 V2",
    "documented(P8)": "",
    "documents = 2": "V2",
    "corrected()": "W02-01 V1",
    "corrected(depth)": "V1",
    "corrected(x)": "",
    "corrections = 1": "W02-01 V1",
    # relations in numbers
    "bearers = 2": "W02-01",
    "borne = 1 and neighbours = 1": "W01-01 W01-02",
    "bearing_area > 0.11": "W02-01",
    "bearing_area is null": "W01-01 W01-02 R1",
    # kinds
    "ring = 1 and rank > 1": "V2 V3",
    "rank is null": "W01-01 W01-02 W02-01 R1",
    "intrados_angle >= 0.2": "V1 V2",
    "tail_length is null and span is null": "W01-01 W01-02 W02-01 V1 V2 V3 R1",
    "is_a(voussoir)": "V1 V2 V3",
    "is_a(stone) and not is_a(ashlar)": "R1",
    "supports(is_a(voussoir))": "W02-01 V1 V2",
    "canonical()": "W01-01 W01-02",
    "not canonical()": "",
    "canonical() is null": "W02-01 V1 V2 V3 R1",
    "canonical() is not null": "W01-01 W01-02",
    # runs
    "von_mises_max@1 > 7.5e5": "V1 V2",
    "von_mises_max@2 < von_mises_max@1": "V1 V2",
    "von_mises_max@2 is null and fidelity@2 = rigid": "V3",
    "fidelity@1 != fidelity@2": "V3",
    "utilisation@2 > 0.5": "V2",
    "run = 2": "V1 V2 V3",
    "runs = 2": "V1 V2 V3",
    "scene@1 = first and scene = second": "V1 V2 V3",
    "outcome = equilibrium": "V1 V2 V3",
    "simplified_by is null": "W01-01 W01-02 W02-01 V1 V2 V3 R1",
    # together
    "is_a(voussoir) and phase = 2 and has_mark() and von_mises_max@1 > 5e5": "V2",
    "above(material = tuff and observed(crack, 2)) and not has_mark()": "V3",
    "rests_on(von_mises_max@1 > von_mises_max)": "V2 V3",
}


def test_a_function_need_not_be_true_or_false(furnished: Database) -> None:
    """A header whose depth is not known has no proportions."""
    with furnished.session() as session:
        session.query(Entity).filter_by(code="W01-01").update({"depth": None})
        for expression in ("canonical()", "not canonical()"):
            assert "W01-01" not in [one.code for one in find(session, "entity", expression)]
        assert "W01-01" in [one.code for one in find(session, "entity", "canonical() is null")]


def test_a_run_can_be_chosen_for_all_plain_names(furnished: Database) -> None:
    with furnished.session(read_only=True) as session:
        assert [one.code for one in find(session, "entity", "von_mises_max > 7.5e5", run=1)] == ["V1", "V2"]
        assert find(session, "entity", "von_mises_max > 7.5e5", run=2) == []
        rows = find_rows(
            session, "keystone", run=1, columns=["code", "von_mises_max", "von_mises_max@2", "run"]
        )
    assert rows == [{"code": "V3", "von_mises_max": 7e5, "von_mises_max@2": None, "run": 1}]


def test_a_condition_is_part_of_a_plain_select(furnished: Database) -> None:
    with furnished.session(read_only=True) as session:
        for expression in ("rank > 1", "von_mises_max@1 > 1", "phase = 2 and kind != springer", "above(V1)"):
            statement = select(Voussoir.code).where(condition(session, expression), Voussoir.depth > 0.4)
            assert session.scalars(statement.order_by(Voussoir.code.desc())).all()[:2] == ["V3", "V2"]
        both = condition(session, "von_mises_max > 1e5"), condition(session, "von_mises_max > 5e5", run=1)
        assert session.scalars(select(Entity.code).where(*both).order_by(Entity.id)).all() == ["V1", "V2"]


def test_stones_that_rest_on_one_another_in_a_circle_are_found_once(furnished: Database) -> None:
    from archmodel.tables.entries import new_entry
    from archmodel.tables.relations import Relation

    with furnished.session() as session:
        entry = new_entry(session, "declaration", "a mistake")
        numbers = {one.code: one.id for one in session.query(Entity)}
        session.add(
            Relation(
                kind="rests_on",
                subject_id=numbers["W01-01"],
                object_id=numbers["V3"],
                declared=True,
                entry_id=entry.id,
            )
        )
        session.flush()
        assert [one.code for one in find(session, "entity", "above(V3)")] == [
            "W01-01",
            "W02-01",
            "V1",
            "V2",
            "V3",
        ]


def test_structures_that_contain_one_another_end(furnished: Database) -> None:
    from archmodel.tables.structures import Structure

    with furnished.session() as session:
        structures = {one.code: one for one in session.query(Structure)}
        structures["castle"].parent_id = structures["A1"].id
        session.flush()
        assert len(find(session, "entity", "member_of(A1)")) == 6
        assert [one.code for one in find(session, "entity", "phase = 1")] == ["W01-01", "W01-02"]
        assert len(find(session, "entity", "observed() and documented()")) == 6


WRONG = {
    "rests_on(W01-2)": "at character 10: there is no stone 'W01-2' in the database; did you mean W01-0",
    "beside(rests_on(W1))": "at character 17: there is no stone 'W1'",
    "rests_on(detph > 1)": "at character 10: unknown attribute 'detph'; did you mean depth",
    "rests_on(kind = jam)": "at character 17: unknown kind 'jam'; did you mean jamb",
    "rests_onn(V1)": "at character 1: unknown function 'rests_onn'; did you mean rests_on",
    "observd(crack)": "unknown function 'observd'; did you mean observed",
    "xyz(crack)": "unknown function 'xyz'; the functions are within, within_box",
    "depth(1)": "depth is an attribute, not a function",
    "canonical = 1": "canonical is a function; write canonical",
    "rests_on(V1, V2)": "rests_on cannot take these arguments; write rests_on.CODE. or rests_on.expression",
    "above()": "above cannot take these arguments; write above",
    "within(V1)": "within cannot take these arguments; write within.CODE, r. or within.x, y, z, r",
    "within(V1, V2)": "at character 12: 'V2' is not a length; write metres",
    "within(V1, '1')": "'1' is not a length",
    "within(V1, 1e10)": "'1e10' is not a length",
    "within(V1, -1)": "the radius -1 is negative",
    "within(V9, 1)": "there is no stone 'V9' in the database; did you mean V",
    "within(kind = jamb, 1)": "within cannot take these arguments",
    "within_box(0, 0, 1, 1, 1, 0)": "the box has a corner above the other",
    "member_of(A2)": "there is no structure 'A2' in the database; did you mean A1",
    "member_of(old)": "there is no structure 'old' in the database",
    "member_of(kind = arc)": "unknown kind of structure 'arc'; did you mean arch",
    "member_of(depth > 1)": "at character 11: unknown attribute 'depth'; the attributes are code, kind, title",
    "member_of(rests_on(V1))": "unknown function 'rests_on'; did you mean part_of",
    "member_of(side = upper)": "unknown side 'upper'; they are outer, inner",
    "has_mark(fisch)": "there is no mason mark 'fisch' in the database; did you mean fish",
    "has_mark(gone)": "there is no mason mark 'gone' in the database; the marks are A, fish, star",
    "observed(crak)": "unknown type of observation 'crak'; did you mean crack",
    "observed(crack, 5)": "'5' is not a severity; write a number from 0",
    "observed(crack, high)": "'high' is not a severity",
    "documented(D2)": "there is no document 'D2' in the database; did you mean D1",
    "corrected(dept)": "unknown attribute 'dept'; did you mean depth",
    "is_a(vousoir)": "unknown kind 'vousoir'; did you mean voussoir",
    "von_mises_max@3 > 1": "there is no run '3' in the database; the runs are 1, 2",
    "von_mises_max@ > 1": "there is no run ''",
    "von_mises_max@1@2 > 1": "there is no run '1@2'",
    "von_mises_max@99999999999999999999 > 1": "there is no run '9999",
    "von_mises_max@٣ > 1": "there is no run",
    "von_mises_max > von_mises_max@7": "at character 17: there is no run '7'",
    "depth@1 > 1": "depth does not depend on a run; write depth without",
    "run@1 = 1": "run does not depend on a run",
    "fidelity@1 = fidelty@2": "'fidelty@2' is neither a text nor an attribute",
    "rests_on(depth > 1": r"the end instead of \)",
    "rests_on(V1": r"the end instead of \)",
    "rests_on(,)": "',' is not an attribute",
    "rests_on(V1,)": "is not an attribute",
    "rests_on() = 1": "'=' is not expected here",
    "rests_on(" * 9 + "V1" + ")" * 9: "functions are nested more than 8 deep",
    " or ".join(["rests_on()"] * 41): "more than 40 functions",
}


def test_what_is_wrong_in_a_function_is_said_with_its_place(furnished: Database) -> None:
    import re

    wrong = {}
    with furnished.session(read_only=True) as session:
        for expression, message in WRONG.items():
            try:
                find(session, "entity", expression)
                said = "nothing"
            except QueryError as error:
                said = str(error)
            if not (re.search(message, said) and "at character" in said and said.isprintable()):
                wrong[expression] = said
    assert not wrong


def test_an_unknown_run_is_refused_with_those_that_there_are(furnished: Database, empty: Database) -> None:
    with (
        furnished.session(read_only=True) as session,
        pytest.raises(QueryError, match=r"run 7: .*the runs are 1, 2"),
    ):
        find(session, "entity", run=7)


def test_without_runs_that_is_said(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        with pytest.raises(QueryError, match="there are no runs yet"):
            find(session, "entity", "von_mises_max@1 > 0")
        with pytest.raises(
            QueryError, match="there is no mason mark 'A' in the database; there are no marks yet"
        ):
            find(session, "entity", "has_mark(A)")
