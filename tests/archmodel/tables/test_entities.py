import subprocess
import sys

import pytest
from sqlalchemy import Connection, Select, event, select

from archmodel.database.session import Database
from archmodel.tables.entities import (
    Ashlar,
    Entity,
    Header,
    Keystone,
    RibSegment,
    Rubble,
    Springer,
    Stone,
    Voussoir,
    canon_of,
    kind_named,
    kinds,
    own_attributes,
)
from archmodel.tables.hierarchy import definition_of, kind_chain, kind_of
from ground.errors import UsageError


def test_a_keystone_is_a_voussoir_is_an_ashlar_is_an_entity() -> None:
    assert kind_chain(Keystone) == (Entity, Stone, Ashlar, Voussoir, Keystone)


def test_rubble_is_no_ashlar() -> None:
    assert kind_chain(Rubble) == (Entity, Stone, Rubble)


def test_every_kind_is_found_by_its_name_and_has_a_definition_of_its_own() -> None:
    definitions = [definition_of(cls) for cls in kinds().values()]
    assert all(text.startswith(("A", "The")) and text.endswith(".") for text in definitions)
    assert len(set(definitions)) == len(definitions)
    assert all(kind_named(name) is cls and kind_of(cls) == name for name, cls in kinds().items())


def test_every_attribute_of_a_kind_is_a_column_with_a_definition() -> None:
    for cls in kinds().values():
        for name, own in own_attributes(cls).items():
            assert name in cls.__mapper__.columns
            assert own.definition
            assert own.unit is None or set(own.unit.split("/")) <= {"-", "1", "m", "dm", "rad"}


def test_a_kind_inherits_attributes_and_proportions() -> None:
    own = {"ring", "rank", "intrados_angle"}
    assert own_attributes(Keystone).keys() - own_attributes(Ashlar).keys() == own
    assert own.isdisjoint(own_attributes(Rubble))
    assert canon_of(Header) == "depth >= length"
    assert canon_of(Keystone) is None


@pytest.mark.parametrize("typed", ["rib_segment", "rib segment", "Rib-Segment"])
def test_words_of_a_kind_are_joined_in_any_way(typed: str) -> None:
    assert kind_named(typed) is RibSegment


def test_kinds_of_the_sample_are_there() -> None:
    sample = {"header", "stretcher", "jamb", "sill", "voussoir", "keystone", "springer"}
    assert sample <= set(kinds())


def test_upper_case_is_understood() -> None:
    assert kind_named(" Springer ") is Springer


@pytest.mark.parametrize(
    ("typed", "meant"), [("headers", "header"), ("vousoir", "voussoir"), ("Kestone", "keystone")]
)
def test_an_unknown_kind_names_the_nearest(typed: str, meant: str) -> None:
    with pytest.raises(UsageError, match=f"did you mean .*{meant}"):
        kind_named(typed)


def test_a_kind_like_no_other_lists_them_all() -> None:
    with pytest.raises(UsageError, match="the kinds are entity, stone, ashlar, header"):
        kind_named("☃")


def test_a_new_kind_is_one_small_class() -> None:
    # In a process of its own, since a kind cannot be taken back.
    program = '''
from archmodel.tables.entities import Voussoir, kinds
from archmodel.database.session import open_database
from archmodel.store.stones import store_survey
from archmodel.query.api import find
from tests.archmodel.stones import SHA, box_stone

class Counterkey(Voussoir):
    """A voussoir beside the keystone."""

database = open_database("sqlite://")
with database.session() as session:
    stones = [box_stone("V2", "counterkey"), box_stone("V3", "keystone")]
    store_survey(session, "arch", "arch.moma", SHA, stones)
    assert [type(e) for e in find(session, "counterkey")] == [Counterkey]
    assert [e.code for e in find(session, "voussoir")] == ["V2", "V3"]
'''
    subprocess.run([sys.executable, "-W", "error", "-c", program], check=True)


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
