"""Names in expressions that only the database knows: stones, structures, marks, documents, runs."""

import difflib
from collections.abc import Iterable, Sequence

from sqlalchemy import Row, select

from archmodel.query.scope import MAX_RUNS, Context
from archmodel.query.tokens import Token, complaint
from archmodel.store.find_by_code import no_such_code
from archmodel.tables.entities import Entity
from archmodel.tables.knowledge import Document, MasonMark, Phase, Statement
from archmodel.tables.runs import Run
from archmodel.tables.structures import Structure
from archmodel.tables.surveys import Survey
from archmodel.tables.terms import vocabulary
from ground.errors import QueryError, UsageError

MAX_SHOWN = 12
"""So many names are listed where none is like what was written."""


def meant(written: str, choices: Iterable[str], what: str) -> str:
    """Suggest names: the nearest ones, or the first of all if none is near."""
    names = list(choices)
    lower = {name.lower(): name for name in names}
    similar = difflib.get_close_matches(written[:40].lower(), lower, n=3, cutoff=0.5)
    if similar:
        return f"did you mean {' or '.join(lower[name] for name in similar)}?"
    shown = [*names[:MAX_SHOWN], "…"] if len(names) > MAX_SHOWN else names
    return f"{what} are {', '.join(shown)}" if shown else f"there are no {what.removeprefix('the ')} yet"


def stone_named(context: Context, code: Token) -> Row[int, float | None, float | None, float | None]:
    """Return number and centroid (x, y, z) of a stone."""

    def look() -> Row[int, float | None, float | None, float | None]:
        """Return key and centroid of the stone; refuse a code that no stone has."""
        stone = select(Entity.id, Entity.x, Entity.y, Entity.z).where(Entity.code == code.text)
        row = context.session.execute(stone).one_or_none()
        if row is None:
            error = no_such_code(context.session, code.text, Entity.code)
            raise complaint(code, error.what, error.remedy)
        return row

    row: Row[int, float | None, float | None, float | None] = context.once(("stone", code.text), look)
    return row


def structure_named(context: Context, code: Token) -> int:
    """Return the number of a structure that is held now."""

    def look() -> int:
        """Return the key of the structure; refuse a code that no structure has."""
        structure = select(Structure.id).where(Structure.code == code.text, Structure.superseded_id.is_(None))
        number = context.session.scalar(structure)
        if number is None:
            codes = select(Structure.code).where(Structure.superseded_id.is_(None)).order_by(Structure.code)
            remedy = meant(code.text, context.session.scalars(codes), "the structures")
            raise complaint(code, f"there is no structure {code.text[:40]!r} in the database", remedy)
        return number

    return int(context.once(("structure", code.text), look))


def marks_named(context: Context, sign: Token) -> list[str]:
    """Return the signs of a mason mark and of narrower terms; an error if none of them is held."""
    held_signs = select(MasonMark.sign).where(MasonMark.superseded_id.is_(None), MasonMark.sign.is_not(None))
    signs = context.once("marks", lambda: sorted(set(context.session.scalars(held_signs))))
    named = terms_named(context, "mark", sign)
    if not set(named) & set(signs):
        what = f"there is no mason mark {sign.text[:40]!r} in the database"
        raise complaint(sign, what, meant(sign.text, signs, "the marks"))
    return named


def author_named(context: Context, author: Token) -> str:
    """Return the name of an author of statements that are held; an error if there is none."""
    held_authors = select(Statement.author).where(Statement.superseded_id.is_(None)).distinct()
    names = context.once("authors", lambda: sorted(filter(None, context.session.scalars(held_authors))))
    if author.text not in names:
        what = f"nothing that is held was stated by {author.text[:40]!r}"
        raise complaint(author, what, meant(author.text, names, "the authors"))
    return author.text


def terms_named(context: Context, name: str, word: Token) -> list[str]:
    """Return the term of a vocabulary that is written so, in any language, and all narrower ones.

    Raises
    ------
    QueryError
        in a closed vocabulary, if there is no such term
    """
    terms = context.once(("vocabulary", name), lambda: vocabulary(context.session, name))
    try:
        return list(terms.below(terms.named(word.text)))
    except UsageError as error:
        raise complaint(word, error.what, error.remedy) from None


def campaign_named(context: Context, campaign: Token) -> str:
    """Return the name of a survey that was taken in; an error if there is none."""
    surveys = select(Survey.name).distinct().order_by(Survey.name)
    names = context.once("campaigns", lambda: list(context.session.scalars(surveys)))
    if campaign.text not in names:
        what = f"there is no survey {campaign.text[:40]!r} in the database"
        raise complaint(campaign, what, meant(campaign.text, names, "the surveys"))
    return campaign.text


def phase_begins(context: Context, phase: Token) -> int:
    """Return the first year of a phase; an error if there is no such phase, or its years are not known."""
    dated = select(Phase.name, Phase.begins, Phase.ends).where(Phase.superseded_id.is_(None))
    phases: dict[str, tuple[int | None, int | None]] = context.once(
        "phases", lambda: {row.name: (row.begins, row.ends) for row in context.session.execute(dated)}
    )
    if phase.text not in phases:
        what = f"there is no phase {phase.text[:40]!r} in the database"
        raise complaint(phase, what, meant(phase.text, sorted(phases), "the phases"))
    begins, ends = phases[phase.text]
    year = ends if begins is None else begins
    if year is None:
        what = f"the years of the phase {phase.text[:40]!r} are not known, and phases are ordered by them"
        raise complaint(phase, what, "state begins or ends in [[phase]]")
    return year


def document_named(context: Context, code: Token) -> int:
    """Return the number of a document that is held now."""
    current = (
        select(Document.code, Document.id).where(Document.superseded_id.is_(None)).order_by(Document.code)
    )
    documents: dict[str, int] = context.once(
        "documents", lambda: {row.code: row.id for row in context.session.execute(current)}
    )
    if code.text not in documents:
        what = f"there is no document {code.text[:40]!r} in the database"
        raise complaint(code, what, meant(code.text, documents, "the documents"))
    return documents[code.text]


def run_with_number(context: Context, token: Token, number: str) -> int:
    """Return the number of a run; an error if there is none.

    Parameters
    ----------
    token : where it is written
    number : as it is written; that of a study may follow its name, as in study3
    """
    runs, number = _runs(context), number.removeprefix("study")
    # No int() of what is no number, and no number that is longer than any run's.
    run = int(number) if number.isascii() and number.isdigit() and len(number) < 11 else -1
    if run not in runs:
        raise complaint(token, f"there is no run {number[:40]!r} in the database", _known_runs(runs))
    used: set[int] = context.once("runs used", set)
    used.add(run)
    if len(used) > MAX_RUNS:
        raise complaint(token, f"more than {MAX_RUNS} runs", "ask in several queries")
    return run


def refuse_unknown_run(context: Context) -> None:
    """Refuse a run that is not in the database, if one is named."""
    runs = _runs(context) if context.run is not None else ()
    if context.run is not None and context.run not in runs:
        what = "there is no such run in the database"
        raise QueryError(what, where=f"run {context.run}", remedy=_known_runs(runs))


def _runs(context: Context) -> list[int]:
    """Select the numbers of all runs."""
    runs: list[int] = context.once(
        "runs", lambda: list(context.session.scalars(select(Run.id).order_by(Run.id)))
    )
    return runs


def _known_runs(runs: Sequence[int]) -> str:
    """List the latest runs, for an error."""
    if not runs:
        return "there are no runs yet (moma run SCENE)"
    return f"the runs are {'…, ' if len(runs) > MAX_SHOWN else ''}{', '.join(map(str, runs[-MAX_SHOWN:]))}"
