"""Keys of a table from the settings that dataclasses declare: name, type, default, unit, bounds and meaning.

A new setting of a dataclass is a new key; `python -m tests.pipelines.scene.reference docs/scene.md` documents it.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from datetime import date
from enum import Enum
from types import NoneType
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

from ground.settings import Setting
from ground.toml.lines import Path
from ground.toml.schema import REQUIRED, Key, TomlDocument, ValueKind, check_table

Settings = TypeVar("Settings")

Texts = tuple[str, ...]
Numbers = tuple[float, ...]
Vector = tuple[float, float, float]
# types of which the values are read otherwise than Python's type says
Stones = Annotated[Texts, ValueKind.STONES]
Groups = Annotated[tuple[Texts, ...], ValueKind.GROUPS]
Series = Annotated[Any, ValueKind.HISTORY]
VectorSeries = Annotated[Any, ValueKind.VECTOR_HISTORY]
Year = Annotated[int | str, ValueKind.YEAR]
Table = Annotated[Mapping[str, Any], ValueKind.TABLE]

_KINDS: Mapping[Any, ValueKind] = {
    float: ValueKind.NUMBER,
    int: ValueKind.INTEGER,
    bool: ValueKind.BOOLEAN,
    str: ValueKind.TEXT,
    date: ValueKind.DATE,
    Texts: ValueKind.TEXTS,
    Vector: ValueKind.VECTOR,
    Numbers: ValueKind.NUMBERS,
    tuple[Vector, ...]: ValueKind.ROWS,
}


def keys_of(owner: type[Any], *required: str) -> tuple[Key, ...]:
    """Return the keys of a dataclass: its fields annotated with a `Setting`, in their order.

    Parameters
    ----------
    owner : dataclass
    required : names of keys that must be given, whatever their default in Python

    >>> from dataclasses import make_dataclass
    >>> from typing import Annotated
    >>> from ground.settings import Setting
    >>> step = Annotated[float, Setting("Time step.", "s", above=0)]
    >>> (key,) = keys_of(make_dataclass("Times", [("step", step, 0.001)]))
    >>> key.name, key.kind.value, key.unit, key.default, key.above
    ('step', 'a number', 's', 0.001, 0)
    """
    declared, keys = _declared(owner), []
    for field in fields(owner):
        if field.name not in declared:
            continue
        hint, setting = declared[field.name]
        default = field.default.value if isinstance(field.default, Enum) else field.default
        if field.default_factory is not MISSING:
            default = field.default_factory()
        keys.append(
            Key(
                field.name,
                ValueKind.TEXT if _is_enum(hint) else hint if isinstance(hint, ValueKind) else _KINDS[hint],
                setting.doc,
                setting.unit,
                REQUIRED if default is MISSING or field.name in required else default,
                setting.above,
                setting.at_least,
                setting.below,
                setting.at_most,
                tuple(choice.value for choice in hint) if _is_enum(hint) else getattr(setting, "choices", ()),
            )
        )
    return tuple(keys)


def read_table(
    document: TomlDocument, table: Path, given: Mapping[str, object], owner: type[Settings], title: str = ""
) -> Settings:
    """Make a settings value from a table of a file, as `check_table` checks it.

    Raises
    ------
    SceneError : at the first key that is unknown, missing or wrong
    """
    return build(owner, check_table(document, table, given, keys_of(owner), title))


def typed_values(owner: type[Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of the checked values that are settings of a dataclass, texts turned into its enumerations."""
    return {
        name: hint(values[name]) if _is_enum(hint) and values[name] is not None else values[name]
        for name, (hint, _) in _declared(owner).items()
        if name in values
    }


def build(owner: type[Settings], values: Mapping[str, Any]) -> Settings:
    """Make a settings value from a checked table, whose other keys are left alone."""
    return owner(**typed_values(owner, values))


def _declared(owner: type[Any]) -> Mapping[str, tuple[Any, Setting]]:
    """Return type, without None, or kind of value, and declaration of every setting of a dataclass."""
    return {
        name: (_kind_or_type(hint), setting)
        for name, hint in get_type_hints(owner, include_extras=True).items()
        for setting in getattr(hint, "__metadata__", ())
        if isinstance(setting, Setting)
    }


def _kind_or_type(hint: Any) -> Any:
    """Return the kind of value that an annotation names, or its type without None."""
    metadata, hint = hint.__metadata__, hint.__origin__
    others = [argument for argument in get_args(hint) if argument is not NoneType]
    if NoneType in get_args(hint):
        hint = others[0]
        metadata += getattr(hint, "__metadata__", ())
    return next((kind for kind in metadata if isinstance(kind, ValueKind)), hint)


def _is_enum(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, Enum)
