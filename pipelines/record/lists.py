"""Tables, layers and drawings as files of knowledge: all of one author, on one ground, in one entry."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.validation import checked_text
from archmodel.skos.concepts import ENDINGS
from archmodel.store.revisions import NOTHING, RowCounts
from archmodel.store.stone_rows import storable
from archmodel.tables.entries import Entry, new_entry
from ground.errors import UsageError
from pipelines.record.attachments import Attachment
from pipelines.record.attribute_lists import AttributeList, read_attribute_list, record_attribute_list
from pipelines.record.relation_lists import RelationList, read_relation_list, record_relation_list
from pipelines.record.term_lists import TermList, read_term_list, record_term_list
from survey.conventions import LISTED

LISTS = (
    *(".csv", ".tsv", ".txt", ".xlsx", ".xls", ".xlsb", ".ods"),
    *(".geojson", ".json", ".gpkg", ".graphml"),
    *ENDINGS,
)
"""Endings of files that are not TOML."""


@dataclass(frozen=True)
class FileRecorded:
    """Report on one file.

    Attributes
    ----------
    path : the file
    tables : outcome of its tables, by name of the array
    entries : numbers of its acts of recording; empty if nothing in it was new
    recorded_before : number of the first entry of a file with the same contents; None if there was none. Such a file
        states again what was withdrawn since, and nothing else
    notes : what of a table or layer was left out, or is new, in words
    attachments : files that its documents name, which their entries keep with their hashes
    """

    path: str
    tables: dict[str, RowCounts]
    entries: tuple[int, ...] = ()
    recorded_before: int | None = None
    notes: tuple[str, ...] = ()
    attachments: tuple[Attachment, ...] = ()

    @property
    def outcome(self) -> RowCounts:
        """Outcome of all its tables."""
        return sum(self.tables.values(), NOTHING)


@dataclass(frozen=True)
class ListFile:
    """A table, layer or drawing that was read.

    Attributes
    ----------
    path : of the file
    sha256 : of its content, in hexadecimal
    author, source : of all that it states
    content : what it states
    """

    path: str
    sha256: str
    author: str
    source: str
    content: RelationList | AttributeList | TermList


def read_list(
    path: Path,
    author: str | None,
    source: str | None,
    columns: str | None = None,
    sheet: str | None = None,
    vocabulary: str | None = None,
) -> ListFile:
    """Read a table of relations or of attributes, a layer, GraphML, or a vocabulary of SKOS.

    Raises
    ------
    UsageError
        without author or source, which such files do not name; or at the line of a mistake
    """
    checked = {"author": checked_text("author", author), "source": checked_text("source", source)}
    for name, value in checked.items():
        if not value:
            what = f"a table does not say the {name} of its statements"
            remedy = 'give --author NAME and --source "survey of 2024", for example'
            raise UsageError(what, where=str(path), remedy=remedy)
    content: RelationList | AttributeList | TermList | None = None
    if path.suffix.lower() in ENDINGS:
        content = read_term_list(path, vocabulary)
    elif path.suffix.lower() not in (".geojson", ".json", ".gpkg"):
        content = read_relation_list(path, sheet)
    return ListFile(
        str(path),
        hashlib.sha256(path.read_bytes()).hexdigest(),
        str(author),
        str(source),
        content or read_attribute_list(path, columns, sheet),
    )


def recorded_before(session: Session, sha256: str) -> int | None:
    """Return the number of the first entry of a file with this content."""
    same = select(Entry.id).where(Entry.settings["sha256"].as_string() == sha256).order_by(Entry.id)
    return session.scalar(same.limit(1))


def record_list(session: Session, file: ListFile) -> FileRecorded:
    """Record what a file states, in one entry; without changes there is none."""
    before = recorded_before(session, file.sha256)
    settings = {"file": storable(file.path), "sha256": file.sha256}
    entry = new_entry(session, "declaration", storable(file.source), author=file.author, settings=settings)
    content = file.content
    notes: tuple[str, ...]
    if isinstance(content, TermList):
        tables, notes = record_term_list(session, entry, content)
    elif isinstance(content, RelationList):
        tables = record_relation_list(session, entry, content)
        notes = tuple(_notes(content, tables))
    else:
        tables = record_attribute_list(session, entry, content, again=before is not None)
        notes = tuple(_notes(content, tables))
    number = entry.id
    changed = sum(tables.values(), NOTHING).changes
    if not changed:
        session.delete(entry)
        session.flush()
    made = (number,) if changed else ()
    return FileRecorded(file.path, tables if before is None or made else {}, made, before, notes)


def _notes(content: RelationList | AttributeList, tables: dict[str, RowCounts]) -> Iterator[str]:
    """Yield what was left out, and what is new and may be misspelt."""
    if isinstance(content, AttributeList):
        if content.left_out:
            rest = ", …" if len(content.left_out) > LISTED else ""
            yield f"columns that are not recorded: {', '.join(content.left_out[:LISTED])}{rest}"
        for what in ("phase", "material"):
            if count := tables.get(f"new {what}", NOTHING).new:
                yield f"{count} names of the column {what} were not declared before; see: moma query, moma show"
        return
    if content.ignored:
        counts = ", ".join(f"{count} {kind}" for kind, count in content.ignored.items())
        yield f"left out, as it is no stratigraphy: {counts}"
    if count := tables.get("unit", NOTHING).new:
        yield f"{count} units are new, as structures of the kind stratigraphic_unit"
