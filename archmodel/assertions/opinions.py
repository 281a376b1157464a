"""Decisions between opinions, and the rules by which opinions hold."""

from collections.abc import Mapping, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.plain_values import statement_values
from archmodel.assertions.statements import PLAIN, Remark, remark_row
from archmodel.assertions.validation import checked_choice, checked_label
from archmodel.store.find_by_code import Subjects
from archmodel.store.revisions import NOTHING, RowCounts, end_rows
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import Decision, Statement
from archmodel.tables.opinions import DISPUTABLE, RULES, OpinionRule
from ground.errors import UsageError


def decide(
    session: Session,
    entry: Entry,
    about: str,
    subjects: Subjects,
    match: Mapping[str, object],
    remark: Remark = PLAIN,
) -> RowCounts:
    """Decide which opinion of several about some subjects holds, as long as its author holds it.

    Parameters
    ----------
    about : kind of the statements, "of_phase" or "made_of"
    match : values of the one chosen, by the names of ``plain_values.statement_values`` or ``author``

    Raises
    ------
    UsageError
        if no held statement about a subject has these values, or several
    """
    checked_choice("kind of opinions", about, DISPUTABLE)
    outcome = NOTHING
    for owner, batch in subjects.batches():
        outcome += _decide_batch(session, entry, about, owner, batch, match, remark)
    return outcome


def _decide_batch(
    session: Session,
    entry: Entry,
    about: str,
    owner: str,
    numbers: Sequence[int],
    match: Mapping[str, object],
    remark: Remark,
) -> RowCounts:
    column = getattr(Statement, owner)
    rows = session.scalars(
        select(Statement).where(
            column.in_(numbers), Statement.kind.in_((about, "decision")), Statement.superseded_id.is_(None)
        )
    ).all()
    before = {getattr(row, owner): row for row in rows if isinstance(row, Decision) and row.about == about}
    chosen: dict[int, list[Statement]] = {number: [] for number in numbers}
    for row in rows:
        if not isinstance(row, Decision) and says(row, match):
            chosen[getattr(row, owner)].append(row)
    if wrong := [number for number in numbers if len(chosen[number]) != 1]:
        some = len(chosen[wrong[0]])
        what = f"{some or 'no'} opinions of {about} about {len(wrong)} of the subjects match"
        raise UsageError(what, remedy="name the one that holds by its author or value; see: moma show CODE")
    details = remark_row(session, entry, remark)
    outcome = NOTHING
    for number in numbers:
        (choice,), old = chosen[number], before.get(number)
        if old is not None and old.chosen_id == choice.id and old.author == entry.author:
            outcome += RowCounts(unchanged=1)
            continue
        if old is not None:
            end_rows(session, entry, Statement, [old.id])
        session.add(
            Decision(
                **{owner: number},
                **details,
                about=about,
                chosen_id=choice.id,
                entry_id=entry.id,
                supersedes_id=None if old is None else old.id,
            )
        )
        outcome += RowCounts(replaced=1) if old is not None else RowCounts(new=1)
    session.flush()
    return outcome


def says(statement: Statement, match: Mapping[str, object]) -> bool:
    """Return whether a statement has these values; ``author`` is whose opinion it is."""
    values = {**statement_values(statement), "author": statement.author}
    return all(values.get(name) == value for name, value in match.items())


def set_rule(session: Session, entry: Entry, about: str, rule: str, authors: Sequence[str] = ()) -> RowCounts:
    """Record by which rule one of several opinions of a kind holds.

    Parameters
    ----------
    about : kind of the statements, "of_phase" or "made_of"
    rule : "latest", "certainty" or "author"
    authors : for "author": in the order in which they count

    Raises
    ------
    UsageError
        if authors are given without that rule, or the rule without authors
    """
    checked_choice("kind of opinions", about, DISPUTABLE)
    checked_choice("rule", rule, RULES)
    names = [checked_label("author", author) for author in dict.fromkeys(authors)]
    if (rule == "author") != bool(names):
        remedy = 'give authors = ["…"], the first counts most, with rule = "author" and with no other'
        raise UsageError(f"the rule {rule!r} with {len(names)} authors", remedy=remedy)
    old = session.scalar(
        select(OpinionRule).where(OpinionRule.about == about, OpinionRule.superseded_id.is_(None))
    )
    if old is not None and (old.rule, old.authors) == (rule, names):
        return RowCounts(unchanged=1)
    if old is not None:
        end_rows(session, entry, OpinionRule, [old.id])
    session.add(OpinionRule(about=about, rule=rule, authors=names, entry_id=entry.id))
    session.flush()
    return RowCounts(new=1) if old is None else RowCounts(replaced=1)
