import json
import re

import pytest

from archmodel.database.session import Database
from archmodel.describe.entity import describe
from archmodel.query.api import attributes, find, find_rows, row_of, rows_of
from archmodel.query.attributes import ATTRIBUTES
from archmodel.store.runs import store_run
from archmodel.tables.entities import Header, Keystone, Voussoir
from ground.errors import DatabaseError, QueryError, UsageError
from tests.archmodel.stones import run_record


def codes(database: Database, kind: str, *where: str) -> list[str]:
    with database.session(read_only=True) as session:
        return [entity.code for entity in find(session, kind, where)]


def test_a_kind_includes_its_subkinds_and_nothing_else(filled: Database) -> None:
    assert codes(filled, "voussoir") == ["V1", "V2", "V3"]
    assert codes(filled, "keystone") == ["V3"]
    assert codes(filled, "ashlar") == ["W01-01", "W01-02", "W02-01", "V1", "V2", "V3"]
    assert len(codes(filled, "entity")) == 7
    assert codes(filled, "lintel") == []


def test_a_kind_means_the_same_in_an_expression_as_by_itself(filled: Database) -> None:
    for kind in ("voussoir", "keystone", "ashlar", "entity", "lintel"):
        assert codes(filled, "entity", f"kind = {kind}") == codes(filled, kind)
        assert codes(filled, "entity", f"kind in ({kind})") == codes(filled, kind)
        others = set(codes(filled, "entity")) - set(codes(filled, kind))
        assert set(codes(filled, "entity", f"kind != {kind}")) == others
        assert set(codes(filled, "entity", f"not kind = {kind}")) == others
    assert codes(filled, "entity", "kind in (keystone, header)") == ["W01-01", "V3"]
    assert codes(filled, "entity", "kind like voussoir") == ["V2"]


def test_entities_are_of_their_own_class(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        assert [type(entity) for entity in find(session, "voussoir")][1:] == [Voussoir, Keystone]
        assert type(find(session, "header")[0]) is Header


def test_and_binds_more_tightly_than_or(filled: Database) -> None:
    assert codes(filled, "entity", "kind = rubble or kind = header and course = 2") == ["R1"]
    assert codes(filled, "entity", "(kind = rubble or kind = header) and course = 2") == []


def test_several_expressions_are_joined_by_and(filled: Database) -> None:
    assert codes(filled, "entity", "course = 1", "depth > 0.4") == ["W01-01"]


def test_one_expression_need_not_be_in_a_list(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        assert [e.code for e in find(session, "entity", "depth = 0.3")] == ["R1"]


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("course == 12", []),
        ("DEPTH >= 0.45 AND Course IS NULL", ["V1"]),
        ("x>2.9", ["R1"]),
        ("x>-1e-3and", None),
        ("code = 'V1' or code = \"V2\"", ["V1", "V2"]),
        ("code != V1 and code in (V1, 'V2',V3)", ["V2", "V3"]),
        ("code not in (V1, V2, V3, R1)", ["W01-01", "W01-02", "W02-01"]),
        ("code like v_", ["V1", "V2", "V3"]),
        ("not not code = V1", ["V1"]),
        ("kind = KEYSTONE", ["V3"]),
        ("course != 1", ["W02-01"]),
        ("not course = 1", ["W02-01"]),
        ("length = length and x < z", ["W02-01"]),
        ("code < V2", ["V1", "R1"]),
        ("points = 9 and rejected != 0", ["V3"]),
        ("depth > .4\n and\tdepth < 4.4e-1", ["V2", "V3"]),
        ("hypothesis = true or hypothesis = FALSE and code = V1", ["V1"]),
        ("hypothesis in (true) or within_tolerance = true", []),
        ("hypothesis != true and code = V1 and within_tolerance is null", ["V1"]),
    ],
)
def test_what_an_expression_finds(filled: Database, expression: str, expected: list[str] | None) -> None:
    if expected is None:
        with pytest.raises(QueryError, match="x is a number"):
            codes(filled, "entity", expression)
    else:
        assert codes(filled, "entity", expression) == expected


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("", "the end is not an attribute; begin a test with an attribute, e.g. depth > 0.4"),
        ("von_mises > 2e5", "unknown attribute 'von_mises'; did you mean von_mises_"),
        ("depth > 0.4m", "'0.4m' is neither a number nor an attribute, and depth is a number"),
        ("depth > '0.4'", "depth is a number, '0.4' is not; write a number without quotes"),
        ("depth in (0.4, deep)", "at character 16: depth is a number, 'deep' is not"),
        ("depth > 1e999", "depth is a number, '1e999' is not"),
        ("depth > nan", "'nan' is neither"),
        ("depth > code", "depth is a number, code is a text"),
        ("depth like 0.4", "depth is a number, like is for texts; use < and >"),
        ("hypothesis = yes", "hypothesis is true or false, 'yes' is not; write hypothesis = true or"),
        ("hypothesis = 1", "hypothesis is true or false, '1' is not"),
        ("hypothesis like 't%'", "hypothesis is true or false, like is for texts; write hypothesis = true"),
        ("depth > hypothesis", "depth is a number, hypothesis is true or false"),
        ("within_tolerance = within_tolerances@1", "neither true or false nor an attribute"),
        ("kind = hedaer", "unknown kind 'hedaer'; did you mean header"),
        ("fidelity = soft", "unknown fidelity 'soft'; they are fixed, rigid, deformable"),
        ("depth", "the end after depth; write one of = !="),
        ("depth <> 1", "'<>' after depth; write one of = !="),
        ("depth not 1", "'1' after depth"),
        ("depth = = 1", "'=' is not a value"),
        ("depth = and", "'and' is not a value"),
        ("depth is 0.4", "'0.4' after is; write is null or is not null"),
        ("code in V1", "'V1' after in; write in"),
        ("code in ()", r"'\)' is not a value"),
        ("code in (V1", r"the end instead of \)"),
        ("(depth > 1", r"the end instead of \)"),
        ("depth > 1)", r"'\)' is not expected here; join tests by and, or"),
        (
            "material = white limestone",
            "'limestone' is not expected here; .* put a text with blanks in quotes",
        ),
        ("depth > 1 course = 2", "'course' is not expected here"),
        ("code = 'V1", "at character 8: the quote is not closed"),
        ("code = 'V1' '", "at character 13: the quote is not closed"),
        ("code = 'V\x001'", r"the character '\\x00' cannot be used"),
        ("1 = 1", "'1' is not an attribute"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(filled: Database, expression: str, message: str) -> None:
    with pytest.raises(QueryError, match=message) as caught:
        codes(filled, "entity", expression)
    assert caught.value.exit_code == 2
    assert "at character" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unknown_kind_is_wrong_use(filled: Database) -> None:
    with pytest.raises(UsageError, match="unknown kind 'headers'; did you mean header"):
        codes(filled, "headers")


def test_results_are_those_of_the_latest_run_that_holds_the_stone(filled: Database) -> None:
    assert codes(filled, "voussoir", "von_mises_max > 2e5") == []
    with filled.session() as session:
        store_run(session, run_record({"V1": 3e5, "V2": 3e5, "V3": 3e5}))
    assert codes(filled, "voussoir", "von_mises_max > 2e5") == ["V1", "V2", "V3"]
    with filled.session() as session:
        store_run(session, run_record({"V1": 1e5, "V3": None}))
    # V1 has a new value; V2 was not in the second run; V3 was rigid in it, so that its stress is not known.
    assert codes(filled, "voussoir", "von_mises_max > 2e5") == ["V2"]
    assert codes(filled, "voussoir", "von_mises_max is null") == ["V3"]
    assert codes(filled, "entity", "fidelity = rigid") == ["V3"]


def test_a_row_has_every_attribute(filled: Database) -> None:
    with filled.session() as session:
        store_run(session, run_record({"V3": 4e5}))
        (keystone,) = find(session, "keystone")
        row = row_of(keystone)
    assert list(row) == list(ATTRIBUTES) == [attribute.name for attribute in attributes()]
    numbers = {
        "course": None,
        "depth": 0.42,
        "length": 0.2,
        "height": 0.32,
        "area": 0.064,
        "volume": 0.02688,
        "x": 1.7,
        "y": 0.21,
        "z": 1.36,
        "rms": 0.0025,
        "redundancy": 4,
        "points": 9,
        "rejected": 2,
        "von_mises_max": 4e5,
        "von_mises_mean": 1e5,
        "displacement_max": 1e-5,
        "contact_force_max": 1250.0,
    }
    assert {name: row[name] for name in numbers} == pytest.approx(numbers)
    texts = {"code": "V3", "kind": "keystone", "fidelity": "deformable", "survey": "window"}
    assert {name: row[name] for name in texts} == texts


def test_the_ways_to_rows_agree(filled: Database) -> None:
    with filled.session() as session:
        store_run(session, run_record({"V1": 4e5, "W01-01": None}))
        for kind in ("entity", "voussoir"):
            found = find(session, kind, ["depth > 0.3"])
            assert find_rows(session, kind, ["depth > 0.3"]) == rows_of(found) == [row_of(e) for e in found]


def test_a_row_needs_an_open_session(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        (stone,) = find(session, "keystone")
    with pytest.raises(DatabaseError, match="V3: the entity's session is closed"):
        row_of(stone)


def test_all_that_is_known_of_a_stone(filled: Database) -> None:
    with filled.session() as session:
        store_run(session, run_record({"V3": 4e5}, scene="first"))
        store_run(session, run_record({"V3": None}, scene="second"))
        known = describe(session, "V3")
    assert json.loads(json.dumps(known, allow_nan=False)) == known
    assert known["kind"] == "keystone"
    assert known["definition"] == "The voussoir at the crown of an arch, set last."
    assert [level["kind"] for level in known["kinds"]] == [
        "entity",
        "stone",
        "ashlar",
        "voussoir",
        "keystone",
    ]  # type: ignore[attr-defined]
    source = "measured in the breach of the tower"
    assert known["depth"] == {"value": 0.42, "sigma": 0.03, "source": source, "origin": "stone"}
    assert known["survey"]["file"] == "window.moma"  # type: ignore[index]
    assert known["measured"] == {
        "evidence": [],
        "vertices": 4,
        "points": 9,
        "rejected": [3, 6],
        "rejected_corners": [],
        "sigma": 0.003,
        "plane": {
            "normal": [0.0, -1.0, 0.0],
            "offset": 0.0,
            "centroid": pytest.approx([1.7, 0.0, 1.36]),
            "tilt_sigma": pytest.approx([2e-3, 3e-3]),
            "height_sigma": pytest.approx(1e-3),
        },
        "shape": "",
        "provenance": "",
        "station": None,
        "remarks": [],
        "rms": 0.0025,
        "redundancy": 4,
    }
    assert known["notes"] == {"edge": "eroded", "remark": "façade · 2nd campaign"}
    runs = [(r["scene"], r["fidelity"], r["von_mises_max"], r["values"]) for r in known["runs"]]  # type: ignore[attr-defined]
    assert runs == [
        ("second", "rigid", None, {"weight": 900.5}),
        ("first", "deformable", 4e5, {"weight": 900.5}),
    ]


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("W01-1", "no stone 'W01-1' in the database; did you mean W01-0"),
        ("zz", "no stone 'zz' in the database; list the codes by"),
        ("", "no stone ''"),
        ("V1' OR '1'='1", "no stone"),
        ("%", "no stone '%'"),
        ("V1\0", "is not a stone's code"),
        ("\udcff", "is not a stone's code"),
        ("V" * 100_000, "no stone 'V+'"),
    ],
)
def test_an_unknown_code_is_wrong_use(filled: Database, code: str, message: str) -> None:
    with filled.session(read_only=True) as session, pytest.raises(UsageError, match=message):
        describe(session, code)


def test_a_kind_that_this_program_does_not_declare_is_named(filled: Database) -> None:
    with filled.session() as session:
        session.connection().exec_driver_sql("UPDATE entity SET kind = 'gargoyle' WHERE code = 'R1'")
    for ask in (find, find_rows):
        with filled.session(read_only=True) as session, pytest.raises(DatabaseError, match="kind 'gargoyle'"):
            ask(session, "entity")
    with filled.session(read_only=True) as session, pytest.raises(DatabaseError, match="kind 'gargoyle'"):
        describe(session, "R1")


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("depth - 0.1 > 0.3", lambda e: e.depth - 0.1 > 0.3),
        ("abs(depth - 0.45) < 0.06", lambda e: abs(e.depth - 0.45) < 0.06),
        ("depth + x > 2*depth - 1.5*z", lambda e: e.depth + e.x > 2 * e.depth - 1.5 * e.z),
        ("3*x > y + 1 and not z - 0.5*y > 100", lambda e: 3 * e.x > e.y + 1 and not e.z - 0.5 * e.y > 100),
        ("abs(x - 2*y) > 0.4", lambda e: abs(e.x - 2 * e.y) > 0.4),
    ],
)
def test_numbers_are_computed(filled: Database, expression: str, expected) -> None:
    with filled.session(read_only=True) as session:
        stones = find(session, "stone")
        known = [one.code for one in stones if None not in (one.depth, one.x) and expected(one)]
        assert 0 < len(known) < len(stones)
        assert [one.code for one in find(session, "stone", expression)] == known


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("depth - kind > 0", "kind is a text, and cannot be computed with"),
        ("abs(depth > 0", "'>' instead of )"),
        ("depth - 0.1 like 3", "'like' is not a comparison"),
        ("2*deppth > 1", "unknown attribute 'deppth'"),
        ("depth + > 1", "'>' is no number"),
    ],
)
def test_what_cannot_be_computed_is_refused_at_its_place(
    filled: Database, expression: str, words: str
) -> None:
    with filled.session(read_only=True) as session, pytest.raises(QueryError, match=re.escape(words)):
        find(session, "stone", expression)
