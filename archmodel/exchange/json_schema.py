"""JSON Schema of a building document, derived from the tables, their attributes and docstrings.

``python -m archmodel.exchange.json_schema`` prints ``docs/exchange.schema.json``.
"""

import inspect
import json
import re
import sys
from typing import Any

from archmodel.exchange.head import HEAD, TABLES, head_schema
from archmodel.exchange.sections import Field, Section, sections
from archmodel.exchange.values import NUMBER, Schema
from archmodel.tables.base import declared_attribute
from archmodel.tables.hierarchy import Kind
from archmodel.tables.layout import SCHEMA_VERSION

_NULL: Schema = {"type": "null"}

_DESCRIPTION = (
    "All that a MOMA database holds of a building. Every section of `tables` is a table of the database; they come "
    "in this order, each row after what it refers to, and in the order of its key. What is null is left out."
)


def building_schema() -> Schema:
    """Return the JSON Schema, draft 2020-12, of the documents that this version writes and reads."""
    expected = sections()
    tables = {
        "type": "object",
        "description": "the sections, in their order",
        "properties": {
            section.name: {
                "type": "array",
                "description": _first_sentence(section.mapper.class_),
                "items": {"$ref": f"#/$defs/{section.name}"},
            }
            for section in expected
        },
        "required": [section.name for section in expected],
        "additionalProperties": False,
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:moma:building:{SCHEMA_VERSION}",
        "title": "A building, as MOMA exports and imports it",
        "description": _DESCRIPTION,
        "type": "object",
        "properties": {**head_schema(), TABLES: tables},
        "required": [*HEAD, TABLES],
        "additionalProperties": False,
        "$defs": {"number": {**NUMBER, "description": "of 64 bits"}}
        | {section.name: _row(section) for section in expected},
    }


def schema_text() -> str:
    """Return the schema as it is published."""
    return json.dumps(building_schema(), indent=1, ensure_ascii=False) + "\n"


def _row(section: Section) -> Schema:
    meanings = _meanings(section)
    properties: dict[str, Schema] = {}
    for field in section.fields:
        properties[field.name] = _column(section, field, meanings)
        if (label := field.label) is not None:
            what = f"{label.target.name} of the {label.target.table.name} {field.name}, for those who read"
            properties[label.name] = {"type": "string", "description": f"{what}; may be left out"}
    return {
        "type": "object",
        "description": f"{_first_sentence(section.mapper.class_)} Key: {', '.join(section.key)}.",
        "properties": properties,
        "required": [field.name for field in section.fields if field.required],
        "additionalProperties": False,
    }


def _column(section: Section, field: Field, meanings: dict[str, str]) -> Schema:
    schema = dict(field.value.schema)
    on = section.mapper.polymorphic_on
    if on is not None and on.key == field.name and not issubclass(section.mapper.class_, Kind):
        schema["enum"] = sorted(str(name) for name in section.mapper.polymorphic_map)
    if not field.required and _NULL not in schema.get("anyOf", ()):
        others = schema["anyOf"] if [*schema] == ["anyOf"] else [schema]
        schema = {"anyOf": [*others, _NULL]}
    parts = [meanings.get(field.name) or meanings.get(field.name.removesuffix("_id"))]
    parts += [f"refers to {key.target_fullname}" for key in field.column.foreign_keys]
    text = "; ".join(text_part for text_part in parts if text_part)
    return schema | {"description": text} if text else schema


def _meanings(section: Section) -> dict[str, str]:
    """Return what attributes and docstrings of a table's classes say of its columns."""
    documented: dict[str, str] = {}
    for mapper in section.mapper.self_and_descendants:
        if getattr(mapper.class_, "__users__", None) is not None:
            continue  # registered in an open database, not a part of MOMA
        for cls in (mapper.class_, *mapper.class_.__bases__):
            documented = _documented(cls) | documented
    for column in section.table.columns:
        if (attribute := declared_attribute(column)) is not None:
            documented[column.name] = (
                f"{attribute.definition} [{attribute.unit}]" if attribute.unit else attribute.definition
            )
    return {**_OF_ALL, **documented}


_OF_ALL = {
    "id": "number of the row, to which others refer",
    "kind": "name of its kind",
    "entry": "the act of recording that it came with",
    "superseded": "the act of recording that ended it; left out if it is held now",
    "supersedes": "the row that it replaces",
}


def _documented(cls: type[Any]) -> dict[str, str]:
    """Return what a class's docstring says of its attributes."""
    text = inspect.cleandoc(cls.__dict__.get("__doc__") or "")
    return {name: _plain(meaning, cls) for name, meaning in _entries(text).items()}


def _plain(meaning: str, cls: type[Any]) -> str:
    """Return a meaning in the words of JSON, with the values of constants that it names."""
    meaning = re.sub(r"\b(?:None|NaN)\b", "null", meaning)
    constants = vars(sys.modules[cls.__module__])
    return re.sub(r"\b[A-Z]{4,}\b", lambda word: ", ".join(constants.get(word[0], [word[0]])), meaning)


def _entries(text: str) -> dict[str, str]:
    """Return the entries of a numpydoc section "Attributes" by name."""
    match = re.search(r"^Attributes\n-+\n(.*?)(?:\n\n|\Z)", text, re.MULTILINE | re.DOTALL)
    entries: dict[str, str] = {}
    for entry in re.split(r"\n(?=\S)", match[1]) if match else ():
        names, colon, meaning = entry.partition(" : ")
        if colon:
            entries |= dict.fromkeys(re.split(r",\s*", names), " ".join(meaning.split()))
    return entries


def _first_sentence(cls: type[Any]) -> str:
    return inspect.cleandoc(cls.__doc__ or "").partition("\n")[0]


if __name__ == "__main__":
    sys.stdout.write(schema_text())
