"""Forms of column values in JSON, by the type of the column, for writing and reading.

A null of the database is not written at all, so no function here meets None.
"""

import math
import re
import types
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, date, datetime
from itertools import chain
from typing import Any, Union, get_args, get_origin

import numpy as np
from sqlalchemy import JSON, Boolean, Column, Date, Float, Integer, String

from archmodel.arrays import Array
from archmodel.tables.base import ArrayType, UtcDateTime

Schema = dict[str, Any]

INFINITIES = {"Infinity": math.inf, "-Infinity": -math.inf}
"""Infinite numbers, for which JSON has no word."""

INTEGERS = (-(2**63), 2**63 - 1)

DATE = r"^\d{4}-\d{2}-\d{2}$"
INSTANT = r"^\d{4}-\d{2}-\d{2}T\d{2}:\d{2}:\d{2}(\.\d{6})?Z$"

NUMBER: Schema = {"anyOf": [{"type": "number"}, {"enum": list(INFINITIES)}]}
_REFERENCE: Schema = {"$ref": "#/$defs/number"}


class Mismatch(ValueError):
    """A value that does not suit its column.

    Attributes
    ----------
    what : "is …, expected …"
    path : from the value to the place in it, as "[3][1]"
    """

    def __init__(self, what: str, path: str = "") -> None:
        super().__init__(path, what)
        self.what, self.path = what, path


@dataclass(frozen=True)
class Value:
    """Form of the values of one column.

    Attributes
    ----------
    encode : from the database's value to one that JSON can hold
    decode : back, bit for bit; raises Mismatch
    schema : JSON Schema of what is written
    """

    encode: Callable[[Any], Any]
    decode: Callable[[Any], Any]
    schema: Schema


def value_of(column: Column[Any], annotation: object = object) -> Value:
    """Return the form of a column's values.

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
        shape = _shape_of(annotation)
        return Value(shape.checked, shape.checked, shape.schema)
    for column_types, value in _SIMPLE:
        if isinstance(kind, column_types):
            return value
    raise TypeError(f"{column}: there is no JSON form for {kind!r}; declare one in {__name__}")


def _same(value: Any) -> Any:
    return value


def _text(value: Any) -> str:
    if type(value) is not str:
        raise Mismatch(f"is {quoted(value)}, expected a text")
    if not value.isascii() and any("\ud800" <= letter <= "\udfff" for letter in value):
        raise Mismatch("has half of a surrogate pair, which no database can keep")
    return value


def _integer(value: Any) -> int:
    if type(value) is not int or not INTEGERS[0] <= value <= INTEGERS[1]:
        raise Mismatch(f"is {quoted(value)}, expected a whole number of 64 bits")
    return value


def _boolean(value: Any) -> bool:
    if type(value) is not bool:
        raise Mismatch(f"is {quoted(value)}, expected true or false")
    return value


def _written_number(value: float) -> float | str:
    if math.isfinite(value):
        return value
    if math.isnan(value):
        raise Mismatch("is not a number (NaN), which has no form here")
    return "Infinity" if value > 0 else "-Infinity"


def _number(value: Any) -> float:
    if type(value) is float and math.isfinite(value):
        return value
    if type(value) is int:
        try:
            return float(value)
        except OverflowError:
            pass
    elif type(value) is str and value in INFINITIES:
        return INFINITIES[value]
    raise Mismatch(f"is {quoted(value)}, expected a number of 64 bits")


def _date(value: Any) -> date:
    if type(value) is str and re.match(DATE, value, re.ASCII):
        try:
            return date.fromisoformat(value)
        except ValueError:
            pass
    raise Mismatch(f'is {quoted(value)}, expected a date, as "2024-05-31"')


def _written_instant(value: datetime) -> str:
    return value.astimezone(UTC).replace(tzinfo=None).isoformat() + "Z"


def _instant(value: Any) -> datetime:
    if type(value) is str and re.match(INSTANT, value, re.ASCII):
        try:
            return datetime.fromisoformat(value)
        except ValueError:
            pass
    raise Mismatch(f'is {quoted(value)}, expected an instant in UTC, as "2024-05-31T14:05:00Z"')


_SIMPLE: tuple[tuple[type[Any], Value], ...] = (
    (Boolean, Value(_same, _boolean, {"type": "boolean"})),
    (Integer, Value(_same, _integer, {"type": "integer", "minimum": INTEGERS[0], "maximum": INTEGERS[1]})),
    (Float, Value(_written_number, _number, _REFERENCE)),
    (String, Value(_same, _text, {"type": "string"})),
    (UtcDateTime, Value(_written_instant, _instant, {"type": "string", "pattern": INSTANT})),
    (Date, Value(date.isoformat, _date, {"type": "string", "pattern": DATE})),
)


def _array(shape: tuple[int, ...]) -> Value:
    """Return the form of an array: nested lists, with null for NaN."""

    def encode(array: Array) -> list[Any]:
        """Return an array as nested lists."""
        nested: list[Any] = array.tolist()
        return nested if np.isfinite(array).all() else _sayable(nested)

    def decode(value: Any) -> Array:
        """Return the array of nested lists."""
        flat = _flattened(value, shape, "")
        if {*map(type, flat)} <= {float}:
            array = np.array(flat, dtype=np.float64)
            if np.isfinite(array).all():
                return array.reshape(shape)
        return _read_one_by_one(value, flat, shape)

    return Value(encode, decode, _array_schema(shape))


def _sayable(nested: Any) -> Any:
    if isinstance(nested, list):
        return [_sayable(item) for item in nested]
    return None if math.isnan(nested) else _written_number(nested)


def _flattened(value: Any, shape: tuple[int, ...], path: str) -> list[Any]:
    """Return the innermost values of nested lists of this shape, unchecked."""
    size = shape[0]
    if type(value) is not list or size not in (-1, len(value)):
        wanted = "a list of numbers" if len(shape) == 1 else f"a list of {_wording(shape[1:])}"
        count = "" if size == -1 else f", {size} of them"
        raise Mismatch(f"is {quoted(value)}, expected {wanted}{count}", path)
    if len(shape) == 1:
        return value
    inner = shape[1]
    if len(shape) == 2 and all(type(row) is list and len(row) == inner for row in value):
        return list(chain.from_iterable(value))
    rows = (_flattened(row, shape[1:], f"{path}[{index}]") for index, row in enumerate(value))
    return list(chain.from_iterable(rows))


def _wording(shape: tuple[int, ...]) -> str:
    return f"lists of {' × '.join(str(size) for size in shape)} numbers"


def _read_one_by_one(value: Any, flat: list[Any], shape: tuple[int, ...]) -> Array:
    """Read the slow way arrays with NaN, infinities, whole numbers, and mistakes, which it locates."""
    array = np.empty(len(flat))
    for index, item in enumerate(flat):
        try:
            array[index] = math.nan if item is None else _number(item)
        except Mismatch as wrong:
            sizes = (len(value), *shape[1:])
            path = "".join(f"[{at}]" for at in np.unravel_index(index, sizes))
            raise Mismatch(f"{wrong.what}, or null for one that is not known", path) from None
    return array.reshape(shape)


def _array_schema(shape: tuple[int, ...]) -> Schema:
    if not shape:
        return {"anyOf": [_REFERENCE, {"type": "null"}]}
    schema: Schema = {"type": "array", "items": _array_schema(shape[1:])}
    return schema if shape[0] == -1 else schema | {"minItems": shape[0], "maxItems": shape[0]}


@dataclass(frozen=True)
class _Shape:
    """Condition on a JSON value.

    Attributes
    ----------
    name : in words
    fits : whether a value is of this kind, without its items
    items : the items of a value, each with its step in the path and its shape
    schema : the same condition as JSON Schema
    """

    name: str
    fits: Callable[[Any], bool]
    items: Callable[[Any], Iterable[tuple[str, Any, "_Shape"]]]
    schema: Schema

    def checked(self, value: Any) -> Any:
        """Return the value itself; raise Mismatch unless it is of this shape."""
        if not self.fits(value):
            kind = "null" if value is None else type(value).__name__
            raise Mismatch(f"is {_JSON_NAMES.get(kind, kind)}, expected {self.name}")
        for step, item, shape in self.items(value):
            try:
                shape.checked(item)
            except Mismatch as wrong:
                raise Mismatch(wrong.what, step + wrong.path) from None
        return value


_JSON_NAMES = {
    "dict": "an object",
    "list": "a list",
    "str": "a text",
    "bool": "true or false",
    "int": "a number",
    "float": "a number",
}

_PLAIN: dict[object, tuple[str, frozenset[type[Any]], Schema]] = {
    float: ("a number", frozenset({float, int}), {"type": "number"}),
    int: ("a whole number", frozenset({int}), {"type": "integer"}),
    str: ("a text", frozenset({str}), {"type": "string"}),
    bool: ("true or false", frozenset({bool}), {"type": "boolean"}),
    types.NoneType: ("null", frozenset({types.NoneType}), {"type": "null"}),
}


def _shape_of(annotation: object) -> _Shape:
    """Return the shape that a type annotation describes: numbers, texts, lists, tuples, dicts, unions, object."""
    if annotation in (object, Any):
        return _Shape("any value", lambda value: True, _no_items, {})
    if annotation in _PLAIN:
        name, kinds, schema = _PLAIN[annotation]
        return _Shape(name, lambda value: type(value) in kinds, _no_items, schema)
    origin, arguments = get_origin(annotation), get_args(annotation)
    shapes = [_shape_of(argument) for argument in arguments]
    if origin in (types.UnionType, Union):
        return _union(shapes)
    if origin is list:
        (item,) = shapes
        return _Shape(
            "a list",
            lambda value: type(value) is list,
            lambda value: ((f"[{index}]", entry, item) for index, entry in enumerate(value)),
            {"type": "array", "items": item.schema},
        )
    if origin is dict and arguments[0] is str:
        item = shapes[1]
        return _Shape(
            "an object",
            lambda value: type(value) is dict,
            lambda value: ((f".{ascii(key[:40])[1:-1]}", entry, item) for key, entry in value.items()),
            {"type": "object"} | ({"additionalProperties": item.schema} if item.schema else {}),
        )
    if origin is tuple:
        return _tuple(shapes)
    raise TypeError(f"there is no JSON form for {annotation!r}")


def _no_items(value: Any) -> tuple[()]:
    return ()


def _tuple(shapes: list[_Shape]) -> _Shape:
    size = len(shapes)
    schema = {"prefixItems": [shape.schema for shape in shapes], "minItems": size, "maxItems": size}
    return _Shape(
        f"a list of {size}",
        lambda value: type(value) is list and len(value) == size,
        lambda value: (
            (f"[{i}]", entry, shape) for i, (entry, shape) in enumerate(zip(value, shapes, strict=True))
        ),
        {"type": "array", **schema},
    )


def _union(options: list[_Shape]) -> _Shape:
    return _Shape(
        " or ".join(option.name for option in options),
        lambda value: any(option.fits(value) for option in options),
        lambda value: [("", value, next(option for option in options if option.fits(value)))],
        {"anyOf": [option.schema for option in options]},
    )


def quoted(value: Any) -> str:
    """Return a value as an error quotes it, always short."""
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return f"an object of {len(value)}"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, str):
        return ascii(value[:40]) + ("…" if len(value) > 40 else "")
    if isinstance(value, int) and abs(value) >= 10**40:
        return "a whole number of more than 40 digits"
    return repr(value)
