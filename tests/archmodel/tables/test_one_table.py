"""Attributes of single kinds come with a query of a general kind, whatever the kinds it finds."""

import pytest
from sqlalchemy import Connection, Select, event, select

from archmodel.database.session import Database
from archmodel.tables.entities import Ashlar, Entity, Header, Keystone, kinds

ASHLARS = [name for name, cls in kinds().items() if issubclass(cls, Ashlar)]


@pytest.mark.parametrize("query", [select(Entity), select(Entity).where(Entity.kind.in_(ASHLARS))])
def test_a_query_of_many_kinds_is_one_statement(filled: Database, query: Select[Entity]) -> None:
    with filled.session() as session:
        session.scalars(select(Header)).one().tail_length = 0.25
        session.scalars(select(Keystone)).one().rank = 3
    statements: list[str] = []

    def listen(
        connection: Connection,
        cursor: object,
        statement: str,
        parameters: object,
        context: object,
        many: bool,
    ) -> None:
        statements.append(statement)

    event.listen(filled.engine, "before_cursor_execute", listen)
    try:
        with filled.session(read_only=True) as session:
            begun = len(statements)
            found = {stone.code: stone for stone in session.scalars(query)}
            header, keystone = found["W01-01"], found["V3"]
            assert isinstance(header, Header)
            assert isinstance(keystone, Keystone)
            assert (header.tail_length, keystone.rank, keystone.ring) == (0.25, 3, None)
            asked = [one for one in statements[begun:] if one.lstrip().startswith("SELECT")]
    finally:
        event.remove(filled.engine, "before_cursor_execute", listen)
    assert len(asked) == 1
