"""Recording of files of knowledge in the database."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.validation import checked_text
from archmodel.database.session import open_database
from archmodel.store.revisions import NOTHING, RowCounts
from archmodel.store.stone_rows import storable
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import Correction
from moma.errors import UsageError
from pipelines.ingest.relate import relate
from pipelines.record.file import RecordFile, Table, read_record
from pipelines.record.tables import STATED, record_table

__all__ = ["FileRecorded", "RecordReport", "record"]

_CORRECTIONS = ("correction", "depth")


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
    """

    path: str
    tables: dict[str, RowCounts]
    entries: tuple[int, ...] = ()
    recorded_before: int | None = None

    @property
    def outcome(self) -> RowCounts:
        """Outcome of all its tables."""
        return sum(self.tables.values(), NOTHING)


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
    paths: Sequence[str | Path], url: str, *, author: str | None = None, dry_run: bool = False
) -> RecordReport:
    """Record files of knowledge: all of them or, if anything is wrong in any, none.

    Parameters
    ----------
    paths : files as in docs/knowledge.md
    url : of the database, created if it does not exist
    author : takes precedence over that of ``[record]``
    dry_run : report what would happen, and change nothing

    Raises
    ------
    UsageError : at the line of a file that is wrong; the database is unchanged
    SurveyError, GeometryError : a stone cannot be extruded to its recorded depth
    """
    files = [read_record(path) for path in paths]
    if not files:
        raise UsageError("no file", remedy="name at least one")
    with open_database(url, create=not dry_run) as database, database.session() as session:
        kept = session.begin_nested()
        reports = tuple(_record_file(session, file, author) for file in files)
        related = _relate_corrected(session, [number for one in reports for number in one.entries])
        if dry_run:
            kept.rollback()
        else:
            kept.commit()
        return RecordReport(database.url, dry_run, reports, related)


def _record_file(session: Session, file: RecordFile, author: str | None) -> FileRecorded:
    path = file.document.path
    same = select(Entry.id).where(Entry.settings["sha256"].as_string() == file.sha256).order_by(Entry.id)
    before = session.scalar(same.limit(1))
    entries, changes = _Entries(session, file, author), dict[int, int]()
    tables: dict[str, RowCounts] = {}
    for table in file.tables:
        if before is not None and not _stated_again(table):
            continue
        entry = entries.of(table)
        outcome = record_table(session, entry, file, table, before)
        tables[table.name] = tables.get(table.name, NOTHING) + outcome
        changes[entry.id] = changes.get(entry.id, 0) + outcome.changes
    entries.drop(number for number, count in changes.items() if not count)
    made = tuple(number for number, count in changes.items() if count)
    return FileRecorded(path, tables if before is None or made else {}, made, before)


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

    def __init__(self, session: Session, file: RecordFile, author: str | None) -> None:
        self.session, self.file, self.author = session, file, author
        self.made: dict[tuple[str, str | None, str], Entry] = {}

    def of(self, table: Table) -> Entry:
        """Return the entry of a table, and make it if necessary."""
        record, own = self.file.record, table.values
        with self.file.at(*table.path):
            author = checked_text("author", own["author"] or self.author or record["author"])
            source = checked_text("source", own.get("reason") or own["source"] or record["source"])
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
