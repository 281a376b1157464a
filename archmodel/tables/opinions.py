"""Opinions of several authors on one subject, and the rule by which one of them holds.

A decision comes first, then what the rule of the kind says: the latest opinion, the most certain, or that of the
author who is named first. Of equal ones the latest holds.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import ColumnElement, FromClause, case, func, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from archmodel.tables.base import JSON_TYPE, Base
from archmodel.tables.entries import Recorded, held_index

RULES = ("latest", "certainty", "author")
"""Rules: by the date of the opinion, by its certainty, by the order of the authors."""

DISPUTABLE: Mapping[str, str] = {"of_phase": "phase_id", "made_of": "material_id"}
"""Kinds of statements of which one holds, and the column of what they state."""


class OpinionRule(Recorded, Base):
    """Rule by which one of several opinions holds.

    Attributes
    ----------
    about : kind of the statements, a key of DISPUTABLE
    rule : one of RULES
    authors : in the order in which they count; those not named come after them
    """

    __tablename__ = "opinion_rule"
    __table_args__ = (held_index("ix_opinion_rule_about", "about"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    about: Mapped[str]
    rule: Mapped[str]
    authors: Mapped[list[str]] = mapped_column(JSON_TYPE)


def rule_of(session: Session, about: str) -> OpinionRule:
    """Return the rule for a kind of statements; the latest holds where none is recorded."""
    rule = session.scalar(
        select(OpinionRule).where(OpinionRule.about == about, OpinionRule.superseded_id.is_(None))
    )
    return rule or OpinionRule(about=about, rule="latest", authors=[])


def preference(
    rule: OpinionRule, opinions: FromClause, decisions: FromClause
) -> Sequence[ColumnElement[Any]]:
    """Return the columns by which a select of opinions is ordered so that the first one holds.

    Parameters
    ----------
    rule : for their kind
    opinions : the table of statements, or an alias of it
    decisions : another alias of that table
    """
    decided = (
        select(decisions.c.id)
        .where(
            decisions.c.kind == "decision",
            decisions.c.chosen_id == opinions.c.id,
            decisions.c.superseded_id.is_(None),
        )
        .correlate(opinions)
        .exists()
    )
    columns: list[ColumnElement[Any]] = [case((decided, 0), else_=1)]
    if rule.rule == "certainty":
        columns.append(func.coalesce(opinions.c.certainty, -1.0).desc())
    elif rule.rule == "author":
        ranks = {author: rank for rank, author in enumerate(rule.authors)}
        columns.append(case(ranks, value=opinions.c.author, else_=len(ranks)))
    return (*columns, opinions.c.stated_on.desc(), opinions.c.id.desc())
