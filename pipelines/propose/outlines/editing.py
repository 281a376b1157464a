"""Outlines that a person corrects in a browser: each save is a file beside the proposal, and goes into the database."""

import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from sqlalchemy import select

from archmodel.database.session import open_database
from archmodel.store.hypotheses import withdraw_hypotheses
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from ground.errors import UsageError
from pipelines.ingest.ingest import ingest
from pipelines.ingest.relate import relate
from pipelines.propose.outlines.draw import INDEX, PAGE
from pipelines.propose.outlines.features import CORRECTED, corrected_features
from pipelines.propose.outlines.write import NAMES
from pipelines.results.checkpoints import write_shared
from survey.clouds.outlines.reading import read_outlines
from survey.clouds.settings import CloudOptions
from survey.formats.options import ReadingOptions

SAVED = "corrected.geojson"
"""Name of the file of the corrected outlines."""


@dataclass(frozen=True)
class IngestChoice:
    """A way of ingesting outlines: format, its files (of a cloud), and options, as `ingest` takes them."""

    format: str
    files: tuple[Path, ...]
    options: ReadingOptions

    def of(self, outlines: Path) -> tuple[list[Path], ReadingOptions]:
        """Return the files and options with which a file of outlines is ingested."""
        if isinstance(self.options, CloudOptions):
            return list(self.files), replace(self.options, outlines=outlines)
        return [outlines], self.options


@dataclass(frozen=True)
class OutlineEditor:
    """A folder of `moma outlines` whose page saves through a server.

    Attributes
    ----------
    folder : of the outlines
    url : of the database
    choice : the way into the database; None: corrections are kept in the folder alone
    """

    folder: Path
    url: str
    choice: IngestChoice | None = None
    _busy: threading.Lock = field(default_factory=threading.Lock, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in (INDEX, PAGE, NAMES[0]):
            if not (self.folder / name).is_file():
                remedy = "name a folder that moma outlines has written"
                raise UsageError(f"there is no {name}", where=str(self.folder), remedy=remedy)

    def page(self) -> str:
        """Return the page, which saves through the server."""
        text = (self.folder / PAGE).read_text(encoding="utf-8")
        local = "default-src 'none'; connect-src 'self';"
        return text.replace("<body>", '<body data-save="outlines">', 1).replace(
            "default-src 'none';", local, 1
        )

    def save(self, content: bytes) -> Mapping[str, Any]:
        """Take corrected outlines in: first the file, whole, then the database; what was there stays if it fails.

        Parameters
        ----------
        content : GeoJSON

        Returns
        -------
        What was done, with its words under "text"

        Raises
        ------
        UsageError, SurveyError, GeometryError, DatabaseError
            if the outlines cannot be read or taken in; those of the last save stay in the database
        """
        with self._busy:
            with tempfile.TemporaryDirectory() as scratch:
                fresh = Path(scratch) / SAVED
                fresh.write_bytes(content)
                features = corrected_features(fresh)
            by_hand = sum(feature.said.get("evidence") == CORRECTED for feature in features)
            codes = {feature.code for feature in features}
            gone = sorted(
                outline.code
                for outline in read_outlines(self.folder / NAMES[0]).outlines
                if outline.code not in codes
            )
            write_shared(self.folder / SAVED, content)
            text = f"Saved: {len(features)} stones, {by_hand} by hand, {len(gone)} proposals superseded."
            done: dict[str, Any] = {"stones": len(features), "corrected": by_hand, "superseded": gone}
            if self.choice is not None:
                refused = self._taken_in(self.choice, gone)
                text += " The database has them."
                if refused:
                    text = f"{text} Refused: {'; '.join(refused)}"
            return done | {"text": text}

    def _taken_in(self, choice: IngestChoice, gone: list[str]) -> list[str]:
        """Ingest the saved outlines, withdraw the proposals that a person deleted, and return what was refused."""
        files, options = choice.of(self.folder / SAVED)
        rejects = self.folder / "corrected.rejects.geojson"
        report = ingest(files, self.url, choice.format, options=options, again=True, keep_going=rejects)
        with open_database(self.url, create=False) as database, database.session() as session:
            chosen = select(Entity.id).where(Entity.code.in_(gone), Entity.hypothesis, Entity.x.is_not(None))
            deleted = list(session.scalars(chosen))
            if deleted:
                entry = new_entry(session, "declaration", f"deleted in the page of {self.folder.name}")
                withdraw_hypotheses(session, entry, deleted)
                relate(session)
        return [f"{stone.code}: {stone.reason}" for file in report.files for stone in file.refused]
