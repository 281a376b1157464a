"""Storing and loading of surveyed stones."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.store.bulk import batches, first_free_id, insert_rows
from archmodel.store.lookalikes import Lookalikes, explained
from archmodel.store.remeasuring import supersede_measurements
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stone_rows import entity_rows, measurement_row, stone_record, storable
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from archmodel.tables.surveys import Measurement, Survey
from ground.errors import DatabaseError


@dataclass(frozen=True)
class StoredSurvey:
    """Outcome of storing a survey.

    Attributes
    ----------
    survey, entry : their numbers in the database
    new : primary keys of its new entities, in the order of the file
    again : of those that it measured again
    """

    survey: int
    entry: int
    new: range
    again: tuple[int, ...]


def store_survey(
    session: Session,
    name: str,
    source_path: str,
    sha256: str,
    stones: Iterable[StoneRecord],
    *,
    stations: Mapping[str, Sequence[float]] | None = None,
    frame: Mapping[str, object] | None = None,
    again: bool = False,
) -> StoredSurvey:
    """Store the stones of one survey file: all of them or, if anything is wrong, none.

    Parameters
    ----------
    session : a writing session; it stays usable after an error
    name : the survey's name
    source_path : the file, as the user wrote it
    sha256 : of the file's bytes, in hexadecimal
    stones : its stones, at least one; read once, never all in memory
    stations : where instruments and observers stood, by name, (x, y, z) [m]
    frame : how the survey was carried into the frame of the site, in values that JSON can hold
    again : stones whose code is there already were measured again; otherwise they are an error

    Raises
    ------
    DatabaseError
        if the file was taken in before and is not measured `again`; or a code is there already or twice in the file,
        or looks like another
    SurveyError, GeometryError
        if a stone cannot be stored, at its ``file:line``
    """
    with session.begin_nested():
        earlier = _earlier(session, sha256, source_path, again)
        entry = new_entry(session, "ingest", storable(source_path))
        survey = Survey(
            name=storable(name),
            path=storable(source_path),
            sha256=sha256 if earlier is None else _digest_again(sha256, entry.id),
            entry_id=entry.id,
            stations={name: [float(value) for value in place] for name, place in (stations or {}).items()},
            frame=None if frame is None else dict(frame),
        )
        session.add(survey)
        session.flush()
        lines: dict[str, int] = {}
        start, measured_again = first_free_id(session, Entity), list[int]()
        lookalikes = {"code": Lookalikes(session, Entity.code), "zone": Lookalikes(session, Entity.zone)}
        for batch in batches(stones):
            for name, similar in lookalikes.items():
                _refuse_lookalikes(similar, batch, source_path, name)
            stored = _known_codes(session, batch)
            _refuse_codes(batch, {} if again else stored, lines, source_path)
            insert_stones(session, [stone for stone in batch if stone.code not in stored], survey)
            measured_again += _measure_again(session, survey, batch, stored, source_path)
        _refuse_empty(lines, source_path)
        numbers = range(start, start + len(lines) - len(measured_again))
        _refuse_others(numbers, earlier, source_path)
        return StoredSurvey(survey.id, survey.entry_id, numbers, tuple(measured_again))


def _refuse_empty(lines: Mapping[str, int], source_path: str) -> None:
    """Refuse a survey without stones."""
    if not lines:
        remedy = "give it at least one stone record"
        raise DatabaseError("the survey has no stones", where=source_path, remedy=remedy)


def _measure_again(
    session: Session,
    survey: Survey,
    batch: Sequence[StoneRecord],
    stored: Mapping[str, tuple[int, str]],
    source_path: str,
) -> list[int]:
    """Replace the measurements of those stones of a batch that are stored; return their primary keys."""
    again = [stone for stone in batch if stone.code in stored]
    numbers = [stored[stone.code][0] for stone in again]
    places = _places(again, source_path)
    supersede_measurements(session, survey.entry_id, survey.id, numbers, again, places)
    return numbers


def survey_with_hash(session: Session, sha256: str) -> Survey | None:
    """Return the survey that was taken in from a file with these bytes, if any."""
    return session.scalar(select(Survey).where(Survey.sha256 == sha256))


def load_stones(session: Session, entities: Iterable[Entity]) -> list[StoneRecord]:
    """Return the records of these entities, in the same order, exactly as they were stored."""
    wanted = [entity.id for entity in entities]
    stone_records: dict[int, StoneRecord] = {}
    for batch in batches(dict.fromkeys(wanted)):
        rows = session.execute(
            select(Entity, Measurement).join(Entity.measurement).where(Entity.id.in_(batch))
        )
        stone_records.update((entity.id, stone_record(entity, measured)) for entity, measured in rows)
    missing = [number for number in wanted if number not in stone_records]
    if missing:
        raise DatabaseError(
            f"{len(missing)} entities are no longer in the database", where=f"entity {missing[0]}"
        )
    return [stone_records[number] for number in wanted]


def _earlier(session: Session, sha256: str, source_path: str, again: bool) -> Survey | None:
    """Return the survey that was taken in from the same bytes; refuse it unless it is read again."""
    survey = survey_with_hash(session, sha256)
    if survey is None or again:
        return survey
    what = f"this file is in the database already, as survey {survey.name!r} from {survey.path}"
    remedy = (
        "there is nothing to do; to read it with other options, give --again too, or another database (--db)"
    )
    raise DatabaseError(what, where=source_path, remedy=remedy)


def _digest_again(sha256: str, entry: int) -> str:
    """Return the digest of another reading of the same bytes, as digests are unique."""
    return hashlib.sha256(f"{entry}: {sha256}".encode()).hexdigest()


def _refuse_others(new: range, survey: Survey | None, source_path: str) -> None:
    """Refuse stones of the same file under other codes, which would be there twice."""
    if survey is not None and len(new):
        what = (
            f"{len(new)} stones have codes that the survey {survey.name!r} of the same file did not give them"
        )
        remedy = "give the options that made the codes then, or another database (--db)"
        raise DatabaseError(what, where=source_path, remedy=remedy)


def _known_codes(session: Session, batch: Sequence[StoneRecord]) -> dict[str, tuple[int, str]]:
    """Return the codes that were stored before this file: primary key, and place of measurement."""
    rows = session.execute(
        select(Entity.code, Entity.id, Survey.path, Measurement.line)
        .outerjoin(Entity.measurement)
        .outerjoin(Measurement.survey)
        .where(Entity.code.in_([stone.code for stone in batch]))
    )
    return {
        code: (number, "the database, not measured" if path is None else f"{path}:{line}")
        for code, number, path, line in rows
    }


def _refuse_codes(
    batch: Sequence[StoneRecord],
    stored: Mapping[str, tuple[int, str]],
    lines: dict[str, int],
    path: str,
) -> None:
    """Refuse codes that are taken; `lines` holds this file's codes so far, and is added to."""
    for stone in batch:
        remedy = "give each stone a code of its own"
        if stone.code in lines:
            first = f"{path}:{lines[stone.code]}"
        elif stone.code in stored:
            first = stored[stone.code][1]
            remedy += "; if it was measured again, give --again"
        else:
            lines[stone.code] = stone.line
            continue
        what = f"the code {stone.code} is taken by the stone at {first}"
        raise DatabaseError(what, where=f"{path}:{stone.line}", remedy=remedy)


def _refuse_lookalikes(stored_codes: Lookalikes, batch: Sequence[StoneRecord], path: str, name: str) -> None:
    """Refuse codes or zones that look like others, at their place in the file."""
    lines: dict[str, int] = {}
    for stone in batch:
        if (text := getattr(stone, name)) is not None:
            lines.setdefault(text, stone.line)
    if (like := stored_codes.like(list(lines))) is not None:
        remedy = "write both with the same characters"
        place = f"{path}:{lines[like[0]]}"
        raise DatabaseError(f"the {name} {explained(*like)}", where=place, remedy=remedy)


def _places(batch: Sequence[StoneRecord], path: str) -> list[str]:
    """Return the places of stones, for errors."""
    return [f"{path}:{stone.line} stone {stone.code}" for stone in batch]


def insert_stones(session: Session, batch: Sequence[StoneRecord], survey: Survey) -> range:
    """Check and insert one batch of new stones; return the primary keys of the entities, in their order."""
    places = _places(batch, survey.path)
    first = first_free_id(session, Entity)
    entities = [
        {"id": number, "entry_id": survey.entry_id, **row}
        for number, row in enumerate(entity_rows(batch, places), start=first)
    ]
    shared = {"survey_id": survey.id, "entry_id": survey.entry_id, "superseded_id": None}
    measured = first_free_id(session, Measurement) - first
    measurements = [
        {"id": number + measured, "entity_id": number, **shared, **measurement_row(stone, place)}
        for number, (stone, place) in enumerate(zip(batch, places, strict=True), start=first)
    ]
    insert_rows(session, Entity, entities)
    insert_rows(session, Measurement, measurements)
    return range(first, first + len(entities))
