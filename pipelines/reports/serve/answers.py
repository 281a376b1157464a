"""Answers of the server, from a session: tables, faces, views and solids."""

import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from archmodel.query.api import find_faces, find_rows
from archmodel.query.geojson import feature_collection
from archmodel.tables.entities import Entity
from archmodel.tables.runs import Run
from archmodel.tables.surveys import Survey
from ground.errors import UsageError
from pipelines.reports.view import as_known_text, database_model, view_page
from pipelines.results.table_csv import csv_text

COLUMNS = (
    *("code", "kind", "course", "zone", "phase", "depth", "depth_origin", "von_mises_p99"),
    "displacement_max",
)
"""Attributes of a table where a request names none."""

_KEPT = 4  # views that are kept, as long as nothing is recorded
_AT_ONCE = 2  # views and solids that are made at a time


class Answers:
    """Answers with at most so many rows; some views are kept."""

    def __init__(self, rows: int) -> None:
        self._most = rows
        self._views: OrderedDict[Any, str] = OrderedDict()
        self._lock, self._room = threading.Lock(), threading.Semaphore(_AT_ONCE)

    def home(self, session: Session, place: str) -> dict[str, Any]:
        """Return the counts of the database."""
        counts = session.execute(
            select(Entity.kind, func.count()).group_by(Entity.kind).order_by(Entity.kind)
        )
        return {
            "place": place.rpartition("/")[2],
            "surveys": list(session.scalars(select(Survey.name).order_by(Survey.id))),
            "kinds": [(kind, count) for kind, count in counts],
            "runs": session.scalar(select(func.count()).select_from(Run)),
        }

    def rows(
        self, session: Session, kind: str, where: Sequence[str], run: int | None, columns: Sequence[str]
    ) -> tuple[list[dict[str, Any]], bool]:
        """Return rows, and whether there are more than the limit."""
        found = find_rows(session, kind, where, run, columns, limit=self._most + 1)
        return found[: self._most], len(found) > self._most

    def csv(self, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> str:
        """Format rows as CSV."""
        return csv_text(columns, rows)

    def geojson(
        self, session: Session, kind: str, where: Sequence[str], run: int | None, columns: Sequence[str]
    ) -> dict[str, Any]:
        """Return faces as GeoJSON."""
        self._refuse_more(session, kind, where, run)
        return feature_collection(find_faces(session, kind, where, run, columns))

    def view(
        self,
        session: Session,
        entry: int | None,
        kind: str,
        where: Sequence[str],
        run: int | None,
        *,
        dated: bool = False,
    ) -> str:
        """Return the page with a viewer; kept until an entry is made. `dated`: it says of which entry it is."""
        key = (entry, kind, tuple(where), run, dated)
        with self._lock:
            if key in self._views:
                self._views.move_to_end(key)
                return self._views[key]
        with self._room:
            self._refuse_more(session, kind, where, run)
            name = session.scalar(select(Survey.name).order_by(Survey.id)) or "MOMA"
            if dated and entry is not None:
                name = f"{name}, {as_known_text(session, entry)}"
            text, _ = view_page(session, name, kind, where, run)
        with self._lock:
            self._views[key] = text
            while len(self._views) > _KEPT:
                self._views.popitem(last=False)
        return text

    def glb(self, session: Session, kind: str, where: Sequence[str], run: int | None) -> bytes:
        """Return the solids as GLB: a node for each code; `origin` of the scene's extras is to be added to places."""
        from trimesh import Scene, Trimesh

        with self._room:
            self._refuse_more(session, kind, where, run)
            model = database_model(session, "stones", kind, where, run)
            stones = model.stones
            scene = Scene(metadata={"origin": np.asarray(model.origin).tolist()})
            first = np.searchsorted(stones.owner, np.arange(len(stones.codes) + 1))
            faces = np.searchsorted(stones.owner[stones.triangles[:, 0]], np.arange(len(stones.codes) + 1))
            for number, code in enumerate(stones.codes):
                own = stones.triangles[faces[number] : faces[number + 1]] - first[number]
                solid = Trimesh(stones.vertices[first[number] : first[number + 1]], own, process=False)
                scene.add_geometry(solid, node_name=code, geom_name=code)
            return bytes(scene.export(file_type="glb"))

    def _refuse_more(self, session: Session, kind: str, where: Sequence[str], run: int | None) -> None:
        if len(find_rows(session, kind, where, run, ("code",), limit=self._most + 1)) > self._most:
            raise UsageError(f"more than {self._most} stones", remedy="ask for fewer, or raise --row-limit")
