"""Kinds that a user registers: kept in the database, and classes of the hierarchy while it is open."""

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from archmodel.base import JSON_TYPE, Base

__all__ = ["RegisteredKind"]


class RegisteredKind(Base):
    """One kind of a user's own.

    Attributes
    ----------
    name : as users write it, e.g. "merlon"
    parent : name of the kind that it is a case of
    definition : one sentence
    canon : canonical proportions, as a query expression; None: those of the parent
    attributes : of its own, {name: [unit, definition]}; the unit is "-" for numbers without one, None for texts
    """

    __tablename__ = "kind"

    name: Mapped[str] = mapped_column(primary_key=True)
    parent: Mapped[str]
    definition: Mapped[str]
    canon: Mapped[str | None]
    attributes: Mapped[dict[str, tuple[str | None, str]]] = mapped_column(JSON_TYPE)
    entry_id: Mapped[int] = mapped_column(ForeignKey("entry.id"))
