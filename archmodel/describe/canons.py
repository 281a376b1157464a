"""Canonical proportions beside the measured ones: the verdict on a stone or structure, and the history of its canon."""

from collections.abc import Mapping

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.query.api import find_rows
from archmodel.query.attributes import CANON
from archmodel.tables.entries import Entry
from archmodel.tables.hierarchy import Kind, kind_chain, kind_of
from archmodel.tables.registered import TOLERANCE, Canon, canons


def canon_values(session: Session, root: str, code: str, kind: str) -> dict[str, object] | None:
    """Describe the canonical proportions that hold for a stone or structure, and how far it departs from them.

    Parameters
    ----------
    root : "entity" or "structure"
    code, kind : its own

    Returns
    -------
    dict
        proportions, of (the kind that states them), tolerance, stated_tolerance, departure in tolerances and verdict:
        "met", "within tolerance", "missed" or "not known"; None if its kind has none
    """
    canon = canons(session).get(kind)
    if canon is None:
        return None
    quoted = code.replace("'", "''")
    rows = find_rows(session, root, [f"code = '{quoted}'"], columns=[CANON.name])
    departure = rows[0][CANON.name] if rows else None
    verdict = "not known"
    if isinstance(departure, float | int):
        verdict = "met" if departure == 0 else "within tolerance" if departure <= 1.0 else "missed"
    return {
        "proportions": canon.expression,
        "of": canon.kind,
        "tolerance": TOLERANCE if canon.tolerance is None else canon.tolerance,
        "stated_tolerance": canon.tolerance is not None,
        "departure": departure,
        "verdict": verdict,
        **_source(session, canon.entry),
    }


def _source(session: Session, entry: int | None) -> Mapping[str, object]:
    row = None if entry is None else session.get(Entry, entry)
    return {} if row is None else {"entry": row.id, "author": row.author, "source": row.source}


def canons_of(session: Session, cls: type[Kind]) -> list[Canon]:
    """Return all canonical proportions ever stated of a kind and of the kinds above it, in the order of recording."""
    names = [kind_of(ancestor) for ancestor in kind_chain(cls)]
    return list(session.scalars(select(Canon).where(Canon.kind.in_(names)).order_by(Canon.id)))
