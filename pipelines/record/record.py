"""Recording of files of knowledge in the database."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.validation import checked_text
from archmodel.database.session import open_database
from archmodel.store.revisions import NOTHING, RowCounts
from archmodel.store.stone_rows import storable
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import Correction
from ground.errors import UsageError
from pipelines.ingest.relate import relate
from pipelines.record.attachments import Attachment, attachment_of
from pipelines.record.file import RecordFile, Table, read_record
from pipelines.record.lists import LISTS, FileRecorded, ListFile, read_list, record_list, recorded_before
from pipelines.record.tables import STATED, record_table

_CORRECTIONS = ("correction", "depth")


@dataclass(frozen=True)
class RecordReport:
    """Report on all files.

    Attributes
    ----------
    url : of the database
    dry_run : whether nothing was kept
    files : reports on each
    related : number of the entry with which the relations of corrected stones were recomputed; None if they
        did not change
    """

    url: str
    dry_run: bool
    files: tuple[FileRecorded, ...]
    related: int | None


def record(
    paths: Sequence[str | Path],
    url: str,
    *,
    author: str | None = None,
    source: str | None = None,
    columns: str | None = None,
    sheet: str | None = None,
    vocabulary: str | None = None,
    dry_run: bool = False,
) -> RecordReport:
    """Record files of knowledge: all of them or, if anything is wrong in any, none.

    Parameters
    ----------
    paths : files as in docs/knowledge.md: TOML, tables, layers, GraphML, SKOS
    url : of the database, created if it does not exist
    author, source : take precedence over those of ``[record]``; tables and layers need them
    columns : map of columns of tables and layers with other names, e.g. "phase=Zeitstellung"
    sheet : of workbooks
    vocabulary : which terms of SKOS files extend, where these do not say so
    dry_run : report what would happen, and change nothing

    Raises
    ------
    UsageError : at the line of a file that is wrong, or for a table without author or source; the database is
        unchanged
    SurveyError, GeometryError : a stone cannot be extruded to its recorded depth
    """
    files = [_read(Path(path), author, source, columns, sheet, vocabulary) for path in paths]
    if not files:
        raise UsageError("no file", remedy="name at least one")
    with open_database(url, create=not dry_run) as database, database.session() as session:
        savepoint = session.begin_nested()
        reports = tuple(
            _record_file(session, file, author, source)
            if isinstance(file, RecordFile)
            else record_list(session, file)
            for file in files
        )
        related = _relate_corrected(session, [number for report in reports for number in report.entries])
        if dry_run:
            savepoint.rollback()
        else:
            savepoint.commit()
        return RecordReport(database.url, dry_run, reports, related)


def _read(
    path: Path,
    author: str | None,
    source: str | None,
    columns: str | None,
    sheet: str | None,
    vocabulary: str | None,
) -> RecordFile | ListFile:
    """Read a file: a table, layer, drawing or vocabulary by its ending, any other as TOML."""
    if path.suffix.lower() not in LISTS:
        return read_record(path)
    return read_list(path, author, source, columns, sheet, vocabulary)


def _record_file(session: Session, file: RecordFile, author: str | None, source: str | None) -> FileRecorded:
    path = file.document.path
    before = recorded_before(session, file.sha256)
    entries, changes = _Entries(session, file, author, source), dict[int, int]()
    tables: dict[str, RowCounts] = {}
    attachments: list[Attachment] = []
    for table in file.tables:
        if before is not None and not _stated_again(table):
            continue
        entry = entries.of(table)
        outcome = record_table(session, entry, file, table, before)
        tables[table.name] = tables.get(table.name, NOTHING) + outcome
        changes[entry.id] = changes.get(entry.id, 0) + outcome.changes
        if (attached := attachment_of(table, Path(path).parent)) is not None:
            attachments.append(attached)
            settings: dict[str, Any] = dict(entry.settings or {})
            settings["attachments"] = {
                **settings.get("attachments", {}),
                attached.document: attached.values(),
            }
            entry.settings = settings
    entries.drop(number for number, count in changes.items() if not count)
    made = tuple(number for number, count in changes.items() if count)
    return FileRecorded(
        path, tables if before is None or made else {}, made, before, attachments=tuple(attachments)
    )


def _stated_again(table: Table) -> bool:
    """Return whether a file that was recorded before states this again where it is held no longer."""
    if table.name == "withdraw":
        return table.values["what"] in STATED
    return table.name in STATED and table.name != "decision"


def _relate_corrected(session: Session, entries: Sequence[int]) -> int | None:
    """Recompute the relations of the stones that these entries corrected; return the number of the entry."""
    corrected = session.scalars(
        select(Correction.entity_id).where(Correction.entry_id.in_(entries)).distinct()
    ).all()
    return relate(session, only=corrected).entry if corrected else None


class _Entries:
    """Acts of recording of one file: one for each author and source, corrections apart."""

    def __init__(self, session: Session, file: RecordFile, author: str | None, source: str | None) -> None:
        self.session, self.file, self.author, self.source = session, file, author, source
        self.made: dict[tuple[str, str | None, str], Entry] = {}

    def of(self, table: Table) -> Entry:
        """Return the entry of a table, and make it if necessary."""
        record, values = self.file.record, table.values
        with self.file.at(*table.path):
            author = checked_text("author", values["author"] or self.author or record["author"])
            source = checked_text(
                "source", values.get("reason") or values["source"] or self.source or record["source"]
            )
        source = source or self.file.document.path
        action = "correction" if table.name in _CORRECTIONS else "declaration"
        key = (action, author, source)
        if key not in self.made:
            settings = {"file": storable(self.file.document.path), "sha256": self.file.sha256}
            self.made[key] = new_entry(
                self.session, action, storable(source), author=author, settings=settings
            )
        return self.made[key]

    def drop(self, numbers: Iterable[int]) -> None:
        """Delete entries that changed nothing."""
        unused = set(numbers)
        for entry in self.made.values():
            if entry.id in unused:
                self.session.delete(entry)
        self.session.flush()
