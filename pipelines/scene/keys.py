"""Keys of a scene file from the settings that dataclasses declare: name, type, default, unit, bounds and meaning.

A new setting of a dataclass is a new key; `python -m tests.pipelines.scene.reference docs/scene.md` documents it.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from enum import Enum
from types import NoneType
from typing import Any, TypeVar, get_args, get_type_hints

from mechanics.stones.settings import Setting as MechanicsSetting
from pipelines.toml.schema import REQUIRED, Key, ValueKind
from survey.joints.settings import Setting as SurveySetting

__all__ = ["build", "keys_of", "typed_values"]

Settings = TypeVar("Settings")

_KINDS: Mapping[Any, ValueKind] = {
    float: ValueKind.NUMBER,
    int: ValueKind.INTEGER,
    bool: ValueKind.BOOLEAN,
    str: ValueKind.TEXT,
    tuple[str, ...]: ValueKind.TEXTS,
    tuple[float, float, float]: ValueKind.VECTOR,
    tuple[float, ...]: ValueKind.NUMBERS,
    tuple[tuple[float, float, float], ...]: ValueKind.ROWS,
}


def keys_of(owner: type[Any], *required: str) -> tuple[Key, ...]:
    """Return the keys of a dataclass: its fields annotated with a `Setting`, in their order.

    Parameters
    ----------
    owner : dataclass
    required : names of keys that must be given, whatever their default in Python

    >>> from mechanics.scene.scene import TimeSettings
    >>> step = keys_of(TimeSettings)[0]
    >>> step.name, step.kind.value, step.unit, step.default, step.above
    ('step', 'a number', 's', 0.001, 0)
    """
    declared, keys = _declared(owner), []
    for field in fields(owner):
        if field.name not in declared:
            continue
        hint, setting = declared[field.name]
        default = field.default.value if isinstance(field.default, Enum) else field.default
        choices = (
            tuple(choice.value for choice in hint) if _is_enum(hint) else getattr(setting, "choices", ())
        )
        keys.append(
            Key(
                field.name,
                ValueKind.TEXT if _is_enum(hint) else _KINDS[hint],
                setting.doc,
                setting.unit,
                REQUIRED if default is MISSING or field.name in required else default,
                setting.above,
                setting.at_least,
                setting.below,
                setting.at_most,
                choices,
            )
        )
    return tuple(keys)


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


def _declared(owner: type[Any]) -> Mapping[str, tuple[Any, MechanicsSetting | SurveySetting]]:
    """Return type, without None, and declaration of every setting of a dataclass."""
    return {
        name: (_without_none(hint.__origin__), one)
        for name, hint in get_type_hints(owner, include_extras=True).items()
        for one in getattr(hint, "__metadata__", ())
        if isinstance(one, MechanicsSetting | SurveySetting)
    }


def _without_none(hint: Any) -> Any:
    others = [arg for arg in get_args(hint) if arg is not NoneType]
    return others[0] if NoneType in get_args(hint) else hint


def _is_enum(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, Enum)
