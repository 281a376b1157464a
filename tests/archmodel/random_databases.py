"""Buildings of random rows in every table, from the metadata alone, and what tables hold, bit for bit."""

import math
import struct
import types
from collections.abc import Callable
from datetime import UTC, date, datetime, timedelta
from random import Random
from typing import Any, Union, get_args, get_origin

import numpy as np
from sqlalchemy import JSON, Boolean, Date, Float, Integer, String, Table, insert, select, update
from sqlalchemy.orm import Mapper, Session

from archmodel.database.session import Database
from archmodel.tables.base import ArrayType, Base, UtcDateTime, annotation_of
from archmodel.tables.hierarchy import kinds_below
from archmodel.tables.layout import SchemaVersion

TEXTS = (
    *(
        *("", " ", "null", "NaN", "0", "façade · 2nd campaign", "日本の石", "🏰\u200d", "a\tb\nc\r\n"),
        '"quoted" \\ back\\"',
    ),
    *(
        *("</script>", "'; DROP TABLE entity; --", "\u2028\u2029\ufeff", "\x7f\x01", "e\u0301"),
        "\U0010ffff",
        "x" * 5000,
    ),
)
NUMBERS = (
    *(
        0.0,
        -0.0,
        5e-324,
        -5e-324,
        2.2250738585072014e-308,
        1e308,
        -1.7976931348623157e308,
        0.1,
        1 / 3,
        math.pi,
    ),
    *(1.0, -1.0, 1e16, 9007199254740993.0, 123456.789, 1e-5, 1e22, 1e23, math.inf, -math.inf),
)
INTEGERS = (0, 1, -1, 7, 2**31 - 1, -(2**31))

Values = dict[str, Any]


def tables() -> list[Table]:
    """Every table with contents of the building."""
    return [table for table in Base.metadata.sorted_tables if table is not SchemaVersion.__table__]


def fill(session: Session, random: Random, rows: int = 4) -> None:
    """Put rows into every table: the first without any null, the second with every null that there can be."""
    known: dict[str, list[Values]] = {}
    # entities and structures can be of registered kinds
    for table in sorted(tables(), key=lambda table: table.name not in ("entry", "kind")):
        made = [_row(table, number, rows, random, known) for number in range(rows)]
        if table.name == "kind":
            made = [row | _registered(number, random) for number, row in enumerate(made)]
        known[table.name] = made
        session.execute(insert(table), made)
        _refer_within(session, table, made, random)


def _row(table: Table, number: int, rows: int, random: Random, known: dict[str, list[Values]]) -> Values:
    """Row of this number; what must be unique is made so by the number."""
    row: Values = {}
    for column in table.columns:
        target = next((key.column for key in column.foreign_keys), None)
        null = column.nullable and (number == 1 or (number > 1 and random.random() < 0.3))
        if null or (target is not None and target.table is table):
            row[column.name] = None
        elif target is not None:
            one = known[target.table.name][number if column.primary_key else random.randrange(rows)]
            row[column.name] = one[target.name]
        elif column.primary_key and isinstance(column.type, Integer):
            row[column.name] = 1 + 3 * number
        elif table.name == "canon" and column.name in ("kind", "proportions"):
            row[column.name] = f"kind_{number}" if column.name == "kind" else "depth > 1"
        elif column.name == "kind":
            row[column.name] = _kind(table, random)
        elif column.name in ("code", "name", "sha256") or (
            column.key == "about" and table.name == "opinion_rule"
        ):
            row[column.name] = f"{random.choice(TEXTS[:-1])}{number}"
        else:
            row[column.name] = value(column.type, annotation_of(column, _mapper(table)), random)
    if table.name == "measurement":
        row["entity_id"] = known["entity"][number]["id"]
    return row


OWN_KINDS = {"entity": "own_kind_0", "structure": "own_kind_1"}
"""A registered kind of each hierarchy, by table."""


def _kind(table: Table, random: Random) -> str:
    """A kind that has a class, so that the row can be loaded."""
    if table.name in OWN_KINDS:
        known = kinds_below(_mapper(table).class_).items()
        kinds = [name for name, cls in known if cls.__users__ is None] + [OWN_KINDS[table.name]]
    else:
        kinds = sorted(_mapper(table).polymorphic_map)
    return random.choice(kinds) if kinds else "rests_on"


def _mapper(table: Table) -> Mapper[Any]:
    return next(one for one in Base.registry.mappers if one.local_table is table).base_mapper


def _registered(number: int, random: Random) -> Values:
    """A kind of a user's own; few different ones, since each is a class of the process."""
    if (name := f"own_kind_{number}") == OWN_KINDS["structure"]:
        parent = random.choice(("structure", "rib"))
        return {"name": name, "parent": parent, "definition": TEXTS[0], "canon": None, "attributes": {}}
    attributes = {"batter": ["m/m", "façade"], "mason": [None, ""], "holes": ["-", "x"]}
    return {
        "name": name,
        "parent": f"own_kind_{number - 1}" if number > 2 else random.choice(("entity", "ashlar")),
        "definition": random.choice(TEXTS[:3]),
        "canon": None if number == 1 else "depth > 0.1 and not code = 'x'",
        "attributes": {} if number == 1 else attributes,
    }


def _refer_within(session: Session, table: Table, made: list[Values], random: Random) -> None:
    """References within the table, all to rows behind or all to rows before, so that none goes round in a ring."""
    for column in table.columns:
        if any(key.column.table is table for key in column.foreign_keys):
            rows = made if random.random() < 0.5 else made[::-1]
            for place, row in enumerate(rows[1:], 1):
                target = {column.name: random.choice(rows[:place])["id"]}
                session.execute(update(table).where(table.c.id == row["id"]).values(target))


def value(kind: Any, annotation: object, random: Random) -> Any:
    """A value of a column type, often one that is easily spoilt."""
    if isinstance(kind, ArrayType):
        return _array(kind.shape, random)
    makers: tuple[tuple[type[Any], Callable[[], Any]], ...] = (
        (JSON, lambda: json_value(_not_null(annotation), random)),
        (UtcDateTime, lambda: _instant(random)),
        (Boolean, lambda: random.random() < 0.5),
        (Integer, lambda: random.choice(INTEGERS)),
        (Float, lambda: _number(random)),
        (Date, lambda: date(1, 1, 1) + timedelta(days=random.randrange(3_652_058))),
        (String, lambda: random.choice(TEXTS)),
    )
    return next(make() for known, make in makers if isinstance(kind, known))


def _number(random: Random) -> float:
    if random.random() < 0.6:
        return random.choice(NUMBERS)
    (any_bits,) = struct.unpack("<d", struct.pack("<Q", random.getrandbits(64)))
    return any_bits if any_bits == any_bits else 0.25


def _array(shape: tuple[int, ...], random: Random) -> np.ndarray:
    sizes = [random.choice((0, 1, 5)) if size == -1 else size for size in shape]
    array = np.array([_number(random) for _ in range(math.prod(sizes))], dtype=float).reshape(sizes)
    if array.size and random.random() < 0.3:
        array.flat[random.randrange(array.size)] = math.nan
    return array


def _instant(random: Random) -> datetime:
    return datetime(1, 1, 1, tzinfo=UTC) + timedelta(
        days=random.randrange(3_652_058),
        seconds=random.randrange(86400),
        microseconds=random.choice((0, 1, 999_999)),
    )


def _not_null(annotation: object) -> object:
    """One of the types of a union that is not None."""
    if get_origin(annotation) in (Union, types.UnionType):
        return next(one for one in get_args(annotation) if one is not types.NoneType)
    return annotation


def json_value(annotation: object, random: Random, depth: int = 0) -> Any:
    """A JSON value of a Python type."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    count = random.randrange(3)
    if annotation is object:
        options: tuple[object, ...] = (str, int, float, bool, types.NoneType)
        if depth < 4:
            options += (list[object], dict[str, object])
        return json_value(random.choice(options), random, depth + 1)
    if origin is list:
        return [json_value(arguments[0], random, depth + 1) for _ in range(count)]
    if origin is dict:
        return {random.choice(TEXTS): json_value(arguments[1], random, depth + 1) for _ in range(count)}
    if origin is tuple:
        return [json_value(one, random, depth + 1) for one in arguments]
    if origin in (Union, types.UnionType):
        return json_value(random.choice(arguments), random, depth + 1)
    if annotation is float:
        number = _number(random)
        return number if math.isfinite(number) else 0.5
    if annotation is int:
        return random.choice((*INTEGERS, 10**30))
    return {
        str: lambda: random.choice(TEXTS),
        bool: lambda: random.random() < 0.5,
        types.NoneType: lambda: None,
    }[
        annotation  # type: ignore[index]
    ]()


def everything(database: Database) -> dict[str, list[tuple[Any, ...]]]:
    """All rows of all tables, each value with its type and its bits."""
    with database.session(read_only=True) as session:
        return {
            table.name: [
                tuple(exact(value) for value in row)
                for row in session.execute(select(table).order_by(*table.primary_key))
            ]
            for table in tables()
        }


def exact(value: Any) -> Any:
    """A value that equals another only if it is the same to the last bit."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if isinstance(value, dict):
        return "dict", tuple((key, exact(item)) for key, item in value.items())
    if isinstance(value, list):
        return "list", tuple(exact(item) for item in value)
    return type(value).__name__, value
