"""A query joins no more tables than it needs, and takes the index that is there for it."""

import pytest
from sqlalchemy import event, text

from archmodel.database.session import Database, open_database
from archmodel.query.api import find, find_rows
from tests.archmodel.conftest import WALL
from tests.archmodel.known_wall import furnish
from tests.archmodel.stones import store


@pytest.fixture(scope="module")
def database():
    with open_database("sqlite://") as database:
        store(database, WALL, "window")
        furnish(database)
        yield database


def last_statement(
    database: Database, *arguments: object, **options: object
) -> tuple[str, tuple[object, ...]]:
    told: list[tuple[str, tuple[object, ...]]] = []

    def note(
        connection: object, cursor: object, statement: str, parameters: tuple[object, ...], *rest: object
    ) -> None:
        told.append((statement, parameters))

    event.listen(database.engine, "before_cursor_execute", note)
    try:
        with database.session(read_only=True) as session:
            find_rows(session, *arguments, **options)  # type: ignore[arg-type]
    finally:
        event.remove(database.engine, "before_cursor_execute", note)
    return told[-1]


@pytest.mark.parametrize(
    ("where", "joined"),
    [
        ("depth > 0.4", ""),
        ("rms > 0", "measurement"),
        ("survey = window", "measurement survey"),
        ("von_mises_max > 1 and fidelity = rigid", "entity_result"),
        ("von_mises_max@1 > von_mises_max@2", "entity_result entity_result"),
        ("von_mises_max@1 > 1 or von_mises_mean@1 > 1 or utilisation@1 > 1", "entity_result"),
        ("outcome = moving", "entity_result run"),
        ("phase = 1 or phase_begins > 1300", "phase"),
        ("density > 1 or material = tuff", "material material_property"),
        ("rests_on(rms > 0)", ""),
    ],
)
def test_only_what_is_asked_for_is_joined(database: Database, where: str, joined: str) -> None:
    statement, _ = last_statement(database, "entity", where, columns=["code"])
    outer = statement.rsplit("\n SELECT entity.code", 1)[-1]
    assert [words.split()[0] for words in outer.split("LEFT OUTER JOIN ")[1:]] == joined.split()


def test_a_nested_expression_joins_in_its_own_select(database: Database) -> None:
    statement, _ = last_statement(database, "entity", "rests_on(rms > 0)", columns=["code"])
    assert statement.count("LEFT OUTER JOIN measurement") == 1


def test_the_same_question_is_asked_in_the_same_words(database: Database) -> None:
    """So that it is compiled once."""
    questions = [f"rests_on(depth > {value}) and within(V{n}, {value})" for n, value in ((1, 0.2), (2, 0.3))]
    first, second = (last_statement(database, "header", one, columns=["code"])[0] for one in questions)
    assert first == second


@pytest.mark.parametrize(
    ("kind", "where", "index"),
    [
        ("header", "depth > 0.4", "ix_entity_kind_depth"),
        ("header", "course = 2", "ix_entity_kind_course"),
        ("entity", "zone = west and course = 2", "ix_entity_zone_course"),
        ("entity", "within(V1, 1.0)", "ix_entity_place"),
        ("entity", "within_box(0, 0, 0, 1, 1, 1)", "ix_entity_place"),
        ("entity", "code = V1", "sqlite_autoindex_entity"),
        ("entity", "rests_on(V1)", "ix_relation_object"),
        ("entity", "supports(V1)", "ix_relation_subject"),
        ("entity", "above(V1)", "ix_relation_object"),
        ("entity", "below(V1)", "ix_relation_subject"),
        ("entity", "member_of(A1)", "ix_membership_structure_id"),
    ],
)
def test_an_index_leads_to_the_stones(database: Database, kind: str, where: str, index: str) -> None:
    statement, parameters = last_statement(database, kind, where, columns=["code"])
    with database.engine.connect() as connection:
        plan = [row[-1] for row in connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", parameters)]
    assert any(index in step for step in plan), plan
    assert not any(step.startswith("SCAN entity") for step in plan), plan


def test_what_finds_nothing_asks_for_few_statements(database: Database) -> None:
    told: list[str] = []

    def note(connection: object, cursor: object, statement: str, *rest: object) -> None:
        told.append(statement)

    event.listen(database.engine, "before_cursor_execute", note)
    try:
        with database.session(read_only=True) as session:
            session.execute(text("SELECT 1"))
            begun = len(told)
            find(session, "header", "depth > 9")
    finally:
        event.remove(database.engine, "before_cursor_execute", note)
    assert len(told) - begun == 2  # the kinds that there are, and the question
