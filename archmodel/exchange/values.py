"""How the value of a column is written in JSON and read again, for each type of column.

A null of the database is not written at all, so what is here never sees None.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, date, datetime
from itertools import chain
from typing import Any

import numpy as np
from sqlalchemy import JSON, Boolean, Column, Date, Float, Integer, String

from archmodel.arrays import Array
from archmodel.exchange.json_types import JsonShape, Mismatch
from archmodel.tables.base import ArrayType, UtcDateTime

__all__ = ["INSTANT", "NUMBER", "Schema", "Value", "said", "value_of"]

Schema = dict[str, Any]

INFINITIES = {"Infinity": math.inf, "-Infinity": -math.inf}
"""JSON has no word for them."""

INTEGERS = (-(2**63), 2**63 - 1)

DATE = r"^\d{4}-\d{2}-\d{2}$"
INSTANT = r"^\d{4}-\d{2}-\d{2}T\d{2}:\d{2}:\d{2}(\.\d{6})?Z$"

NUMBER: Schema = {"anyOf": [{"type": "number"}, {"enum": list(INFINITIES)}]}
_REFERENCE: Schema = {"$ref": "#/$defs/number"}


@dataclass(frozen=True)
class Value:
    """How the values of one column are written.

    Attributes
    ----------
    encode : from the database's value to one that JSON can say
    decode : back, bit for bit; raises Mismatch
    schema : JSON Schema of what is written
    """

    encode: Callable[[Any], Any]
    decode: Callable[[Any], Any]
    schema: Schema


def value_of(column: Column[Any], annotation: object = object) -> Value:
    """How a column is written.

    Parameters
    ----------
    column : of a table
    annotation : the Python type of a JSON column, e.g. ``list[int]``

    Raises
    ------
    TypeError
        if the column's type has no form in JSON yet
    """
    kind = column.type
    if isinstance(kind, ArrayType):
        return _array(kind.shape)
    if isinstance(kind, JSON):
        shape = JsonShape.of(annotation)
        return Value(shape.checked, shape.checked, shape.schema)
    for types, value in _SIMPLE:
        if isinstance(kind, types):
            return value
    raise TypeError(f"{column}: there is no JSON form for {kind!r}; declare one in {__name__}")


def _same(value: Any) -> Any:
    return value


def _text(given: Any) -> str:
    if type(given) is not str:
        raise Mismatch(f"is {said(given)}, expected a text")
    if not given.isascii() and any("\ud800" <= letter <= "\udfff" for letter in given):
        raise Mismatch("has half of a surrogate pair, which no database can keep")
    return given


def _integer(given: Any) -> int:
    if type(given) is not int or not INTEGERS[0] <= given <= INTEGERS[1]:
        raise Mismatch(f"is {said(given)}, expected a whole number of 64 bits")
    return given


def _boolean(given: Any) -> bool:
    if type(given) is not bool:
        raise Mismatch(f"is {said(given)}, expected true or false")
    return given


def _written_number(value: float) -> float | str:
    if math.isfinite(value):
        return value
    if math.isnan(value):
        raise Mismatch("is not a number (NaN), which has no form here")
    return "Infinity" if value > 0 else "-Infinity"


def _number(given: Any) -> float:
    if type(given) is float and math.isfinite(given):
        return given
    if type(given) is int:
        try:
            return float(given)
        except OverflowError:
            pass
    elif type(given) is str and given in INFINITIES:
        return INFINITIES[given]
    raise Mismatch(f"is {said(given)}, expected a number of 64 bits")


def _date(given: Any) -> date:
    if type(given) is str and re.match(DATE, given, re.ASCII):
        try:
            return date.fromisoformat(given)
        except ValueError:
            pass
    raise Mismatch(f'is {said(given)}, expected a date, as "2024-05-31"')


def _written_instant(value: datetime) -> str:
    return value.astimezone(UTC).replace(tzinfo=None).isoformat() + "Z"


def _instant(given: Any) -> datetime:
    if type(given) is str and re.match(INSTANT, given, re.ASCII):
        try:
            return datetime.fromisoformat(given)
        except ValueError:
            pass
    raise Mismatch(f'is {said(given)}, expected an instant in UTC, as "2024-05-31T14:05:00Z"')


_SIMPLE: tuple[tuple[type[Any], Value], ...] = (
    (Boolean, Value(_same, _boolean, {"type": "boolean"})),
    (Integer, Value(_same, _integer, {"type": "integer", "minimum": INTEGERS[0], "maximum": INTEGERS[1]})),
    (Float, Value(_written_number, _number, _REFERENCE)),
    (String, Value(_same, _text, {"type": "string"})),
    (UtcDateTime, Value(_written_instant, _instant, {"type": "string", "pattern": INSTANT})),
    (Date, Value(date.isoformat, _date, {"type": "string", "pattern": DATE})),
)


def _array(shape: tuple[int, ...]) -> Value:
    """An array as nested lists; null for NaN."""

    def encode(array: Array) -> list[Any]:
        nested: list[Any] = array.tolist()
        return nested if np.isfinite(array).all() else _sayable(nested)

    def decode(given: Any) -> Array:
        flat = _flattened(given, shape, "")
        if {*map(type, flat)} <= {float}:
            array = np.array(flat, dtype=np.float64)
            if np.isfinite(array).all():
                return array.reshape(shape)
        return _read_one_by_one(given, flat, shape)

    return Value(encode, decode, _array_schema(shape))


def _sayable(nested: Any) -> Any:
    if isinstance(nested, list):
        return [_sayable(item) for item in nested]
    return None if math.isnan(nested) else _written_number(nested)


def _flattened(given: Any, shape: tuple[int, ...], path: str) -> list[Any]:
    """All numbers of nested lists of this shape, whatever they are."""
    size = shape[0]
    if type(given) is not list or size not in (-1, len(given)):
        wanted = "a list of numbers" if len(shape) == 1 else f"a list of {_wording(shape[1:])}"
        count = "" if size == -1 else f", {size} of them"
        raise Mismatch(f"is {said(given)}, expected {wanted}{count}", path)
    if len(shape) == 1:
        return given
    inner = shape[1]
    if len(shape) == 2 and all(type(row) is list and len(row) == inner for row in given):
        return list(chain.from_iterable(given))
    rows = (_flattened(row, shape[1:], f"{path}[{index}]") for index, row in enumerate(given))
    return list(chain.from_iterable(rows))


def _wording(shape: tuple[int, ...]) -> str:
    return f"lists of {' × '.join(str(size) for size in shape)} numbers"


def _read_one_by_one(given: Any, flat: list[Any], shape: tuple[int, ...]) -> Array:
    """The slow way, for arrays with NaN, infinities, whole numbers, and mistakes, which it locates."""
    array = np.empty(len(flat))
    for index, item in enumerate(flat):
        try:
            array[index] = math.nan if item is None else _number(item)
        except Mismatch as wrong:
            sizes = (len(given), *shape[1:])
            path = "".join(f"[{at}]" for at in np.unravel_index(index, sizes))
            raise Mismatch(f"{wrong.what}, or null for one that is not known", path) from None
    return array.reshape(shape)


def _array_schema(shape: tuple[int, ...]) -> Schema:
    if not shape:
        return {"anyOf": [_REFERENCE, {"type": "null"}]}
    schema: Schema = {"type": "array", "items": _array_schema(shape[1:])}
    return schema if shape[0] == -1 else schema | {"minItems": shape[0], "maxItems": shape[0]}


def said(given: Any) -> str:
    """A value as an error quotes it: short, whatever it is."""
    if isinstance(given, list):
        return f"a list of {len(given)}"
    if isinstance(given, dict):
        return f"an object of {len(given)}"
    if given is None or isinstance(given, bool):
        return {None: "null", True: "true", False: "false"}[given]
    if isinstance(given, str):
        return ascii(given[:40]) + ("…" if len(given) > 40 else "")
    if isinstance(given, int) and abs(given) >= 10**40:
        return "a whole number of more than 40 digits"
    return repr(given)
