"""Kinds that users register: rows of the database, and classes of the hierarchy while it is open."""

import re
from typing import Any
from weakref import WeakSet

from sqlalchemy import Engine, ForeignKey, inspect, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from archmodel.tables.base import JSON_TYPE, Base, StoneAttribute
from archmodel.tables.entities import Entity, kinds
from moma.errors import DatabaseError

__all__ = ["RegisteredKind", "declare_registered", "release_registered"]


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

    def says(self) -> tuple[object, ...]:
        """Return all that defines the kind; two kinds for which it is equal are one."""
        own = {name: tuple(one) for name, one in self.attributes.items()}
        return self.name, self.parent, self.definition, self.canon, tuple(own.items())


_CLASSES: dict[tuple[object, ...], type[Entity]] = {}
"""Every class made in this process, by its parent and definition: a class cannot be unmade, but it can be reused."""


def declare_registered(session: Session) -> None:
    """Declare the kinds that this database registers, and release those that it no longer registers.

    They are known until `release_registered`. Rolling back a registration ends it.

    Raises
    ------
    DatabaseError
        if another open database gives one of the names to something else, or a parent is not known
    """
    user = session.get_bind().dialect
    declared: set[type[Entity]] = set()
    waiting = list(session.scalars(select(RegisteredKind).order_by(RegisteredKind.entry_id)))
    while waiting:
        ready = [one for one in waiting if one.parent in kinds()]
        if not ready:
            one = waiting[0]
            what = f"the kind {one.name} is a case of {one.parent}, which is not known"
            raise DatabaseError(what, remedy="use the version of MOMA that registered it")
        for kind in ready:
            cls = _declared(kind)
            _users(cls).add(user)
            declared.add(cls)
        waiting = [one for one in waiting if one not in ready]
    for cls in _CLASSES.values():
        if cls not in declared:
            _users(cls).discard(user)
    if (engine := session.get_bind().engine) is not None:
        # statements that were compiled before do not know the new kinds
        engine.clear_compiled_cache()


def release_registered(engine: Engine) -> None:
    """Release the kinds of a closing database; kinds that no open database registers are no longer known."""
    for cls in _CLASSES.values():
        _users(cls).discard(engine.dialect)


def _users(cls: type[Entity]) -> "WeakSet[Any]":
    """Return the open databases that register a kind."""
    assert cls.__users__ is not None
    return cls.__users__


def _declared(kind: RegisteredKind) -> type[Entity]:
    """Return the class of a kind, made or reused."""
    held = kinds().get(kind.name)
    parent = kinds()[kind.parent]
    key = (parent, *kind.says())
    cls = _CLASSES.get(key)
    if held is not None and held is not cls:
        what = f"the kind {kind.name} means something else here than in this database"
        raise DatabaseError(what, remedy="close the other database first, or rename one of the two kinds")
    identities: Any = inspect(Entity).polymorphic_map
    if cls is None:
        identities.pop(kind.name, None)
        cls = _CLASSES[key] = _made(kind, parent)
    identities[kind.name] = inspect(cls)
    return cls


def _made(kind: RegisteredKind, parent: Any) -> type[Entity]:
    """Make the class of a kind; its attributes are in ``Entity.own``."""
    own = tuple(StoneAttribute(name, unit, meaning) for name, (unit, meaning) in kind.attributes.items())
    contents: dict[str, object] = {
        "__doc__": kind.definition,
        # two definitions of one name are two classes
        "__module__": f"{__name__}.definition{len(_CLASSES)}",
        "__kind__": kind.name,
        "__own__": own,
        "__users__": WeakSet(),
    }
    if kind.canon is not None:
        contents["__canon__"] = kind.canon
    name = re.sub(r"(?:^|_)(.)", lambda found: found[1].upper(), kind.name)
    made: type[Entity] = type(parent)(name, (parent,), contents)
    return made
