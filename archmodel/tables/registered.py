"""Kinds that users register, of stones or of structures: rows of the database, and classes while it is open.

Canonical proportions are statements about kinds, registered or built in: they are replaced and withdrawn.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from weakref import WeakSet

from sqlalchemy import Engine, ForeignKey, func, inspect, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from archmodel.tables.base import JSON_TYPE, Base, StoneAttribute
from archmodel.tables.entities import Entity, kinds
from archmodel.tables.entries import Recorded, held_at, held_index
from archmodel.tables.hierarchy import Kind, kind_chain, kind_of, kinds_below, kinds_in
from archmodel.tables.structures import Structure, structure_kinds
from ground.errors import DatabaseError

NO_ATTRIBUTES = "a kind of structure, and those have no attributes of their own"
"""What is wrong with a kind of structure that has them."""

TOLERANCE = 1.0 / 24.0
"""Tolerance of canonical proportions without a stated one, as a share of the canonical number [-]: half an inch in a
foot of twelve. Rules of proportion count whole inches, and a stone cut to the nearest one departs by half of one."""


def all_kinds() -> Mapping[str, type[Kind]]:
    """Return every kind of entity and of structure by its name; a name is in one hierarchy only."""
    return {**kinds(), **structure_kinds()}


class RegisteredKind(Base):
    """One kind of a user's own, of entities or of structures as its parent is.

    Attributes
    ----------
    name : as users write it, e.g. "merlon"
    parent : name of the kind that it is a case of
    definition : one sentence
    canon : canonical proportions, as a query expression; None: those of the parent
    attributes : of its own, {name: [unit, definition]}; the unit is "-" for numbers without one, None for texts;
        kinds of structures have none
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


class Canon(Recorded, Base):
    """Canonical proportions of a kind, as somebody states them.

    Attributes
    ----------
    kind : name of the kind, of stones or of structures
    proportions : query expression over its attributes; None: those that the program or the registration of the kind
        gave it were withdrawn
    tolerance : share of the canonical number by which it may be missed [-]; None: not stated
    """

    __tablename__ = "canon"
    __table_args__ = (held_index("ix_canon_kind", "kind"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    proportions: Mapped[str | None]
    tolerance: Mapped[float | None]
    supersedes_id: Mapped[int | None] = mapped_column(ForeignKey("canon.id"))


@dataclass(frozen=True)
class Proportions:
    """Canonical proportions that hold for a kind.

    Attributes
    ----------
    kind : of which they were stated: itself, or a more general one
    expression : query expression
    tolerance : share of the canonical number [-]; None: not stated
    entry : number of the entry that states them; None: they came with the kind
    """

    kind: str
    expression: str
    tolerance: float | None = None
    entry: int | None = None


def canons(session: Session | None) -> dict[str, Proportions]:
    """Return the canonical proportions of all kinds that have some: their own, or those of the nearest kind above."""
    stated = {}
    if session is not None:
        session.flush()
        stated = {
            ancestor.kind: ancestor for ancestor in session.scalars(select(Canon).where(held_at(Canon)))
        }
    kinds_here: dict[str, type[Kind]] = {**kinds_in(session, Entity), **kinds_in(session, Structure)}
    proportions: dict[str, Proportions] = {}
    for name, cls in kinds_here.items():
        for ancestor in reversed(kind_chain(cls)):
            kind, inherent = kind_of(ancestor), ancestor.__dict__.get("__canon__")
            if (row := stated.get(kind)) is not None:
                if row.proportions is not None:
                    proportions[name] = Proportions(kind, row.proportions, row.tolerance, row.entry_id)
                    break
            elif "__canon__" in ancestor.__dict__:
                if inherent is not None:
                    proportions[name] = Proportions(kind, inherent)
                break
    return proportions


_CLASSES: dict[tuple[object, ...], type[Kind]] = {}
"""Every class made in this process, by its parent and definition: a class cannot be unmade, but it can be reused."""


def declare_registered(session: Session) -> None:
    """Declare the kinds that this database registers, and release those that it no longer registers.

    They are known until `release_registered`. Rolling back a registration ends it.

    Raises
    ------
    DatabaseError
        if another open database gives one of the names to something else, a parent is not known, or a kind of
        structure has attributes
    """
    user = session.get_bind().dialect
    declared: set[type[Kind]] = set()
    waiting = list(session.scalars(select(RegisteredKind).order_by(RegisteredKind.entry_id)))
    while waiting:
        ready = [one for one in waiting if one.parent in all_kinds()]
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


def _users(cls: type[Kind]) -> "WeakSet[Any]":
    """Return the open databases that register a kind."""
    assert cls.__users__ is not None
    return cls.__users__


def _declared(kind: RegisteredKind) -> type[Kind]:
    """Return the class of a kind, made or reused."""
    known = all_kinds()
    held, parent = known.get(kind.name), known[kind.parent]
    if issubclass(parent, Structure) and kind.attributes:
        raise DatabaseError(f"{kind.name} is {NO_ATTRIBUTES}", remedy="leave out attributes")
    key = (parent, *kind.says())
    cls = _CLASSES.get(key)
    if held is not None and held is not cls:
        what = f"the kind {kind.name} means something else here than in this database"
        raise DatabaseError(what, remedy="close the other database first, or rename one of the two kinds")
    identities: Any = inspect(parent).polymorphic_map
    if cls is None:
        identities.pop(kind.name, None)
        cls = _CLASSES[key] = _made(kind, parent)
    identities[kind.name] = inspect(cls)
    return cls


def _made(kind: RegisteredKind, parent: Any) -> type[Kind]:
    """Make the class of a kind; attributes of an entity are in ``Entity.own``."""
    contents: dict[str, object] = {
        "__doc__": kind.definition,
        # two definitions of one name are two classes
        "__module__": f"{__name__}.definition{len(_CLASSES)}",
        "__kind__": kind.name,
        "__users__": WeakSet(),
    }
    if issubclass(parent, Entity):
        own = kind.attributes.items()
        contents["__own__"] = tuple(StoneAttribute(name, unit, meaning) for name, (unit, meaning) in own)
    if kind.canon is not None:
        contents["__canon__"] = kind.canon
    name = re.sub(r"(?:^|_)(.)", lambda found: found[1].upper(), kind.name)
    made: type[Kind] = type(parent)(name, (parent,), contents)
    return made


def refuse_unknown_kinds(session: Session, *roots: type[Entity] | type[Structure]) -> None:
    """Refuse a database with kinds that are not declared, because another program added its own.

    Parameters
    ----------
    roots : the most general kinds of the hierarchies in question

    Raises
    ------
    DatabaseError
        naming such a kind
    """
    for root in roots:
        known = kinds_below(root)
        unknown = next((kind for kind in _stored_kinds(session, root) if kind not in known), None)
        if unknown is not None:
            remedy = (
                "open the database again if it was registered since; "
                "else use the version of MOMA that stored it"
            )
            raise DatabaseError(f"the database holds a kind {unknown!r} that is not declared", remedy=remedy)


def _stored_kinds(session: Session, root: type[Entity] | type[Structure]) -> list[str]:
    """Return the kinds of stored rows, stepping from one to the next: through the index, where there is one."""
    kind = root.__table__.c.kind
    stored = select(func.min(kind).label("kind")).cte("stored", recursive=True)
    following = select(func.min(kind)).where(kind > stored.c.kind).correlate(stored).scalar_subquery()
    stored = stored.union_all(select(following).where(stored.c.kind.is_not(None)))
    return list(session.scalars(select(stored.c.kind).where(stored.c.kind.is_not(None))))
