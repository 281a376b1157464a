"""Files of knowledge: from TOML text to a checked RecordFile, without a database."""

import hashlib
import unicodedata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from ground.errors import (
    DatabaseError,
    GeometryError,
    MomaError,
    QueryError,
    SceneError,
    SurveyError,
    UsageError,
)
from ground.toml.lines import Path, key_lines, parse_toml, read_text
from ground.toml.schema import Key, TomlDocument, check_table, nearest, tables_of
from pipelines.record.keys import ARRAYS, ATTRIBUTE, PROPERTY, RECORD


@dataclass(frozen=True)
class Table:
    """One table of an array.

    Attributes
    ----------
    path : its position in the file, for messages: ("mark", "0")
    values : of all its keys; missing ones as None, () or {}
    """

    path: Path
    values: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Name of the array."""
        return self.path[0]


@dataclass(frozen=True)
class RecordFile:
    """Checked file of knowledge.

    Attributes
    ----------
    document : file and lines, for error messages
    sha256 : of its text, in hexadecimal
    record : the table [record]
    tables : all others, in the order of recording
    """

    document: TomlDocument
    sha256: str
    record: Mapping[str, Any]
    tables: tuple[Table, ...]

    @contextmanager
    def at(self, *path: str) -> Iterator[None]:
        """Add the line of a key to errors raised in a with-block that name no line of this file."""
        try:
            yield
        except (UsageError, DatabaseError, SurveyError, GeometryError) as error:
            if (error.where or "").startswith(f"{self.document.path}:"):
                raise
            what = f"{error.where}: {error.what}" if isinstance(error, QueryError) else error.what
            cls: type[MomaError] = UsageError if isinstance(error, UsageError) else type(error)
            raise cls(what, where=self.document.where(*path), remedy=error.remedy) from None


def read_record(path: str | FilePath) -> RecordFile:
    """Read and check a file of knowledge.

    Raises
    ------
    UsageError : naming file and line of the first mistake
    """
    return parse_record(read_text(path, UsageError), str(path))


def parse_record(text: str, path: str) -> RecordFile:
    """Check the text of a file of knowledge; `path` appears in messages."""
    # one form of each letter, however it was typed; no line changes its number
    plain = unicodedata.normalize("NFC", text)
    content_of_file = parse_toml(plain, path, UsageError, "see docs/knowledge.md for a file to start from")
    document = TomlDocument(path, key_lines(text))
    try:
        record, tables = _checked(document, content_of_file)
    except SceneError as error:
        raise UsageError(error.what, where=error.where, remedy=error.remedy) from None
    return RecordFile(document, hashlib.sha256(text.encode()).hexdigest(), record, tables)


def _checked(
    document: TomlDocument, content_of_file: Mapping[str, Any]
) -> tuple[dict[str, Any], tuple[Table, ...]]:
    allowed = ["record", *ARRAYS]
    for name, content in content_of_file.items():
        if name not in allowed:
            what = f"unknown table [{name}]" if isinstance(content, dict | list) else f"unknown key {name!r}"
            document.fail(what, name, remedy=nearest(name, allowed))
    record = content_of_file.get("record", {})
    if not isinstance(record, dict):
        document.fail("'record' is not a table", "record", remedy="write [record] on a line of its own")
    tables = [
        table for name, keys in ARRAYS.items() for table in _array(document, content_of_file, name, keys)
    ]
    if not tables:
        document.fail("nothing is recorded", remedy="add a table such as [[material]]; see docs/knowledge.md")
    return check_table(document, ("record",), record, RECORD), tuple(tables)


def _array(
    document: TomlDocument, content_of_file: Mapping[str, Any], name: str, keys: tuple[Key, ...]
) -> Iterator[Table]:
    """Check all tables [[name]]."""
    for path, table in tables_of(document, content_of_file, name):
        values = check_table(document, path, table, keys, f"[[{name}]]")
        for inner, inner_keys in (("properties", PROPERTY), ("attributes", ATTRIBUTE)):
            if inner in values:
                values[inner] = _inner(document, (*path, inner), values[inner], inner_keys)
        yield Table(path, values)


def _inner(
    document: TomlDocument, path: Path, given: Any, keys: tuple[Key, ...]
) -> dict[str, dict[str, object]]:
    """Check the tables in a table; a plain value stands for its first key."""
    return {
        name: check_table(
            document,
            (*path, name),
            content if isinstance(content, dict) else {keys[0].name: content},
            keys,
            f"{name} = {{ … }}",
        )
        for name, content in given.items()
    }
