"""`moma view`: one page with the stones of a database, and pages of runs side by side."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.database.as_known import as_known, entry_named
from archmodel.database.session import open_database
from archmodel.query.api import FoundFace, find_faces, find_rows
from archmodel.store.stone_arrays import ENTITY, id_conditions, stone_shapes
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from archmodel.tables.surveys import Survey
from ground.errors import UsageError
from mechanics.arrays import Array
from pipelines.reports.html import MAX_ROWS, Table, page_text, table_of
from pipelines.reports.page.elevation import elevation
from pipelines.reports.page.inline import again, packed_models
from pipelines.reports.page.known import known_stones
from pipelines.reports.page.model import Model
from pipelines.reports.page.scenes import with_known
from pipelines.reports.page.surfaces import stones_of
from survey.conventions import SOME

_FACING = SOME  # length of the mean normal from which stones have one direction [-]
_TABLE = ("code", "kind", "course", "zone", "phase", "depth", "depth_origin", "rms")


@dataclass(frozen=True)
class View:
    """A written page: its path, the number of its stones, and 1 : `scale` of the elevation drawn beside it."""

    path: Path
    stones: int
    scale: int | None = None


def database_model(
    session: Session, title: str, kind: str = "entity", where: Sequence[str] = (), run: int | None = None
) -> Model:
    """Return the model of the stones of a database that satisfy a query.

    Parameters
    ----------
    title : of the building
    kind, where, run : as of `archmodel.query.api.find_faces`

    Raises
    ------
    UsageError, QueryError : the query is wrong, or finds no stone with a solid
    """
    faces = find_faces(session, kind, where, run, ("code", "area"))
    numbers = {str(code): number for code, number in session.execute(select(Entity.code, Entity.id))}
    wanted = [numbers[str(face.row["code"])] for face in faces]
    shapes = {
        number: (vertices, polygons)
        for condition in id_conditions(ENTITY.id, wanted)
        for number, vertices, polygons in stone_shapes(session, condition)
    }
    there = [face for face, number in zip(faces, wanted, strict=True) if number in shapes]
    if not there:
        raise UsageError(
            "no stone with a solid is found",
            where=f"{kind} {' and '.join(where)}".strip(),
            remedy="ask for more",
        )
    codes = [str(face.row["code"]) for face in there]
    solids = [shapes[numbers[code]] for code in codes]
    origin = np.floor(np.concatenate([vertices for vertices, _ in solids]).mean(axis=0))
    towards = _towards(there)
    mesh, _ = stones_of(codes, [(vertices - origin, polygons) for vertices, polygons in solids])
    model = Model(title=title, stones=mesh, colour="kind", towards=towards, origin=origin)
    return with_known(model, known_stones(session, codes, results=True, run=run))


def _towards(faces: Sequence[FoundFace]) -> Array:
    """Return the mean direction of faces; of walls all around, that of the largest face; without any, to the south."""
    sized = [
        float(face.row["area"] or 0.0) * face.normal  # type: ignore[arg-type]
        for face in faces
        if face.normal is not None
    ]
    if not sized:
        return np.array([0.0, -1.0, 0.0])
    normals = np.array(sized)
    lengths = np.linalg.norm(normals, axis=1)
    mean = normals.sum(axis=0)
    chosen = mean if np.linalg.norm(mean) >= _FACING * lengths.sum() else normals[np.argmax(lengths)]
    return np.asarray(chosen / max(float(np.linalg.norm(chosen)), 1e-300))


def view_page(
    session: Session, title: str, kind: str = "entity", where: Sequence[str] = (), run: int | None = None
) -> tuple[str, int]:
    """Return the page of the stones that a query finds, and their number; arguments as of `database_model`."""
    model = database_model(session, title, kind, where, run)
    shown = set(model.stones.codes)
    rows = [row for row in find_rows(session, kind, where, run, _TABLE) if row["code"] in shown]
    counts = Counter(str(row["kind"]) for row in rows)
    text = page_text(
        "view.html",
        model,
        name=title,
        lead=f"{len(rows)} stones.",
        warnings=(),
        version=version("moma-masonry"),
        kinds=table_of("row", sorted(counts.items()), lambda kind: {"kind": kind[0], "stones": str(kind[1])}),
        stones=Table(
            tuple(name.replace("_", " ").capitalize() for name in _TABLE),
            [tuple(_cell(row[name]) for name in _TABLE) for row in rows[:MAX_ROWS]],
            len(rows),
        ),
    )
    return text, len(rows)


def write_view(
    url: str,
    path: Path,
    kind: str = "entity",
    where: Sequence[str] = (),
    run: int | None = None,
    title: str | None = None,
    drawing: Path | None = None,
    scale: int | None = None,
    at: str | None = None,
) -> View:
    """Write the page of the stones of a database that a query finds.

    Parameters
    ----------
    url : of the database
    path : of the page
    kind, where, run : as of `archmodel.query.api.find_faces`
    title : of the building; None: the name of the first survey
    drawing : SVG of the main elevation; None: none
    scale : 1 : scale of it; None: so that it fits a sheet of A4
    at : number of an entry, or a date: as it was known then; None: now

    Raises
    ------
    UsageError, QueryError : the query is wrong, or finds no stone with a solid
    DatabaseError : the database cannot be read
    """
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        entry = None if at is None else entry_named(session, at)
        with as_known(session, entry) as then:
            name = title or then.scalar(select(Survey.name).order_by(Survey.id)) or "MOMA"
            if entry is not None:
                name = f"{name}, {as_known_text(then, entry)}"
            text, stones = view_page(then, name, kind, where, run)
            model = None if drawing is None else database_model(then, name, kind, where, run)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    if model is None or drawing is None:
        return View(path, stones)
    return View(path, stones, write_elevation(model, drawing, scale))


def as_known_text(session: Session, entry: int) -> str:
    """Return which knowledge the page shows, for its title."""
    recorded = session.scalar(select(Entry.recorded_at).where(Entry.id == entry))
    day = "" if recorded is None else f" of {recorded.date().isoformat()}"
    return f"as known at entry {entry}{day}"


def write_comparison_view(pages: Sequence[Path], path: Path) -> View:
    """Write a page with the viewers of other pages side by side, with one camera and one share of the time.

    Raises
    ------
    UsageError : a page cannot be read, or has no viewer
    """
    packed: list[str] = []
    for page in pages:
        place = page / "report.html" if page.is_dir() else page
        try:
            found = packed_models(place.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError) as error:
            raise UsageError(
                f"cannot be read: {error}", where=str(place), remedy="name pages that MOMA wrote"
            ) from error
        if not found:
            raise UsageError("has no viewer", where=str(place), remedy="name pages that MOMA wrote")
        packed.append(found[0])
    text = page_text(
        "view.html",
        name=" | ".join(str(page) for page in pages),
        lead="One camera and one share of the time for all.",
        viewer=again(packed),
        warnings=(),
        version=version("moma-masonry"),
        kinds=table_of("row", (), dict),
        stones=table_of("row", (), dict),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return View(path, 0)


def write_elevation(model: Model, path: Path, scale: int | None = None) -> int:
    """Write the main elevation as SVG to scale; return the scale."""
    drawn = elevation(model, most=10**9, scale=scale)
    if drawn is None:
        raise UsageError("no face looks at the observer", where=str(path), remedy="ask for other stones")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<?xml version="1.0" encoding="UTF-8"?>\n{drawn.svg}\n', encoding="utf-8")
    return drawn.scale


def _cell(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
