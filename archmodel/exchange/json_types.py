"""What a JSON column may hold, read off the Python type that it is declared with."""

import types
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Union, get_args, get_origin

__all__ = ["JsonShape", "Mismatch"]


class Mismatch(ValueError):
    """A value is not what its column holds.

    Attributes
    ----------
    what : "is …, expected …"
    path : from the value to the place in it, as "[3][1]"
    """

    def __init__(self, what: str, path: str = "") -> None:
        super().__init__(path, what)
        self.what, self.path = what, path

    def within(self, step: str) -> "Mismatch":
        """The same, seen from the value that holds this one."""
        return Mismatch(self.what, step + self.path)


@dataclass(frozen=True)
class JsonShape:
    """A condition on a JSON value.

    Attributes
    ----------
    name : in words
    fits : whether a value is of this kind, without its items
    descend : check the items; raises Mismatch
    schema : JSON Schema that says the same
    """

    name: str
    fits: Callable[[Any], bool]
    descend: Callable[[Any], None]
    schema: dict[str, Any]

    def checked(self, value: Any) -> Any:
        """The value itself, if it is of this shape."""
        if not self.fits(value):
            found = "null" if value is None else type(value).__name__
            raise Mismatch(f"is {_JSON_NAMES.get(found, found)}, expected {self.name}")
        self.descend(value)
        return value

    @classmethod
    def of(cls, annotation: object) -> "JsonShape":
        """The shape that a type annotation says: of numbers, texts, lists, tuples, dicts, unions, object."""
        if annotation in (object, Any):
            return cls("any value", lambda value: True, _nothing, {})
        if annotation in _PLAIN:
            name, kinds, schema = _PLAIN[annotation]
            return cls(name, lambda value: type(value) in kinds, _nothing, schema)
        origin, arguments = get_origin(annotation), get_args(annotation)
        if origin in (types.UnionType, Union):
            return _union([cls.of(one) for one in arguments])
        if origin is list:
            return _list(cls.of(arguments[0]))
        if origin is dict and arguments[0] is str:
            return _dict(cls.of(arguments[1]))
        if origin is tuple:
            return _tuple([cls.of(one) for one in arguments])
        raise TypeError(f"there is no JSON form for {annotation!r}")


_JSON_NAMES = {
    "dict": "an object",
    "list": "a list",
    "str": "a text",
    "bool": "true or false",
    "int": "a number",
    "float": "a number",
}

_PLAIN: dict[object, tuple[str, frozenset[type[Any]], dict[str, Any]]] = {
    float: ("a number", frozenset({float, int}), {"type": "number"}),
    int: ("a whole number", frozenset({int}), {"type": "integer"}),
    str: ("a text", frozenset({str}), {"type": "string"}),
    bool: ("true or false", frozenset({bool}), {"type": "boolean"}),
    types.NoneType: ("null", frozenset({types.NoneType}), {"type": "null"}),
}


def _nothing(value: Any) -> None:
    pass


def _list(item: JsonShape) -> JsonShape:
    def descend(values: list[Any]) -> None:
        for index, value in enumerate(values):
            try:
                item.checked(value)
            except Mismatch as wrong:
                raise wrong.within(f"[{index}]") from None

    schema = {"type": "array", "items": item.schema}
    return JsonShape("a list", lambda value: type(value) is list, descend, schema)


def _dict(item: JsonShape) -> JsonShape:
    def descend(values: dict[str, Any]) -> None:
        for key, value in values.items():
            try:
                item.checked(value)
            except Mismatch as wrong:
                raise wrong.within(f".{ascii(key[:40])[1:-1]}") from None

    schema = {"type": "object", "additionalProperties": item.schema} if item.schema else {"type": "object"}
    return JsonShape("an object", lambda value: type(value) is dict, descend, schema)


def _tuple(items: list[JsonShape]) -> JsonShape:
    def descend(values: list[Any]) -> None:
        for index, (item, value) in enumerate(zip(items, values, strict=True)):
            try:
                item.checked(value)
            except Mismatch as wrong:
                raise wrong.within(f"[{index}]") from None

    size = len(items)
    schema = {
        "type": "array",
        "prefixItems": [item.schema for item in items],
        "minItems": size,
        "maxItems": size,
    }
    fits: Callable[[Any], bool] = lambda value: type(value) is list and len(value) == size  # noqa: E731
    return JsonShape(f"a list of {size}", fits, descend, schema)


def _union(options: list[JsonShape]) -> JsonShape:
    def descend(value: Any) -> None:
        next(option for option in options if option.fits(value)).checked(value)

    name = " or ".join(option.name for option in options)
    schema = {"anyOf": [option.schema for option in options]}
    return JsonShape(name, lambda value: any(option.fits(value) for option in options), descend, schema)
