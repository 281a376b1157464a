"""Files of knowledge into the database: all of them, or, if anything is wrong in any, none."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.validation import checked_text
from archmodel.database.session import open_database
from archmodel.store.revisions import NOTHING, Outcome
from archmodel.store.stone_rows import storable
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import Correction
from moma.errors import UsageError
from pipelines.ingest.relate import relate
from pipelines.record.file import RecordFile, Table, read_record
from pipelines.record.tables import record_table

__all__ = ["FileRecorded", "RecordReport", "record"]

_CORRECTIONS = ("correction", "depth")


@dataclass(frozen=True)
class FileRecorded:
    """What became of one file.

    Attributes
    ----------
    path : the file
    tables : what became of its tables, by name of the array
    entries : numbers of the acts of recording that it made; none if nothing in it was new
    recorded_before : number of the first entry of a file with the same contents; None if there was none
    """

    path: str
    tables: dict[str, Outcome]
    entries: tuple[int, ...] = ()
    recorded_before: int | None = None

    @property
    def outcome(self) -> Outcome:
        """What became of all its tables."""
        return sum(self.tables.values(), NOTHING)


@dataclass(frozen=True)
class RecordReport:
    """What became of all files.

    Attributes
    ----------
    url : of the database
    dry_run : nothing was kept
    files : each of them
    related : number of the entry with which the relations of corrected stones were computed anew; None if they
        are as they were
    """

    url: str
    dry_run: bool
    files: tuple[FileRecorded, ...]
    related: int | None


def record(
    paths: Sequence[str | Path], url: str, *, author: str | None = None, dry_run: bool = False
) -> RecordReport:
    """Put files of knowledge into the database: all of them, or, if anything is wrong in any, none.

    Parameters
    ----------
    paths : files as in docs/knowledge.md
    url : of the database, made if it does not exist
    author : who says it; goes before what ``[record]`` says
    dry_run : say what would happen, and change nothing

    Raises
    ------
    UsageError : at the line of a file that is wrong; the database is unchanged
    SurveyError, GeometryError : a stone cannot be extruded to the depth that it is said to have
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
    if (before := session.scalar(same.limit(1))) is not None:
        return FileRecorded(path, {}, recorded_before=before)
    entries, changes = _Entries(session, file, author), dict[int, int]()
    tables: dict[str, Outcome] = {}
    for table in file.tables:
        entry = entries.of(table)
        outcome = record_table(session, entry, file, table)
        tables[table.name] = tables.get(table.name, NOTHING) + outcome
        changes[entry.id] = changes.get(entry.id, 0) + outcome.changes
    entries.drop(number for number, count in changes.items() if not count)
    return FileRecorded(path, tables, tuple(number for number, count in changes.items() if count))


def _relate_corrected(session: Session, entries: Sequence[int]) -> int | None:
    """What follows from kinds, courses and solids, for the stones that these entries corrected."""
    corrected = session.scalars(
        select(Correction.entity_id).where(Correction.entry_id.in_(entries)).distinct()
    ).all()
    return relate(session, only=corrected).entry if corrected else None


class _Entries:
    """The acts of recording of one file: one for each author and source, corrections apart."""

    def __init__(self, session: Session, file: RecordFile, author: str | None) -> None:
        self.session, self.file, self.author = session, file, author
        self.made: dict[tuple[str, str | None, str], Entry] = {}

    def of(self, table: Table) -> Entry:
        """The entry that a table belongs to."""
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
        """Forget entries that nothing came with."""
        unused = set(numbers)
        for entry in self.made.values():
            if entry.id in unused:
                self.session.delete(entry)
        self.session.flush()
