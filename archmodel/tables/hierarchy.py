"""Hierarchies of kinds, that of entities and that of structures: names, definitions and subkinds of their classes."""

import difflib
import re
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, TypeVar
from weakref import WeakSet

from sqlalchemy import inspect
from sqlalchemy.orm import Session

from ground.errors import UsageError


class Kind:
    """A class of a hierarchy, whose rows are in the table of its most general kind.

    Class attributes, for those who write kinds
    -------------------------------------------
    __kind__ : the name; by default that of the class, rib_segment for RibSegment
    __users__ : the open databases that register the kind; None: it is built in
    """

    __kind__: ClassVar[str]
    __users__: ClassVar["WeakSet[Any] | None"] = None

    def __init_subclass__(cls, **options: Any) -> None:
        if "__kind__" not in cls.__dict__:
            cls.__kind__ = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
        super().__init_subclass__(**options)


K = TypeVar("K", bound=Kind)


def kind_of(cls: type[Kind]) -> str:
    """Return the name of a kind as users write it."""
    return cls.__kind__


def definition_of(cls: type[Kind]) -> str:
    """Return the one sentence that defines a kind."""
    return (cls.__doc__ or "").strip().split("\n", 1)[0]


def kind_chain(cls: type[K]) -> tuple[type[K], ...]:
    """Return the kind and its ancestors, most general first: Entity, Ashlar, Voussoir, Keystone."""
    root: type[K] = inspect(cls).base_mapper.class_
    return tuple(base for base in reversed(cls.__mro__) if issubclass(base, root))


def kinds_below(cls: type[K]) -> dict[str, type[K]]:
    """Return a kind and its subkinds by name, general before particular."""
    return {kind_of(entity_class): entity_class for entity_class in _descend(cls)}


def names_below(*classes: type[K]) -> set[str]:
    """Return the names of kinds and of all their subkinds."""
    return {name for cls in classes for name in kinds_below(cls)}


def _descend(cls: type[K]) -> Iterator[type[K]]:
    yield cls
    for child in cls.__subclasses__():
        if child.__users__ is not None and not child.__users__:
            continue  # registered in no database that is open
        yield from _descend(child)


def kinds_in(session: Session | None, cls: type[K]) -> dict[str, type[K]]:
    """Return, of a kind and its subkinds, those built in and those that the session's database registers itself."""
    user = None if session is None else session.get_bind().dialect
    return {
        name: entity_class
        for name, entity_class in kinds_below(cls).items()
        if entity_class.__users__ is None or (user is not None and user in entity_class.__users__)
    }


def kind_among(classes: Mapping[str, type[K]], name: str, thing: str = "kind") -> type[K]:
    """Return the kind of this name, in upper or lower case, with _, hyphen or blank between its words.

    Raises
    ------
    UsageError
        if there is none; names the nearest ones
    """
    if (cls := classes.get(re.sub(r"[\s-]+", "_", name[:80].strip().lower()))) is not None:
        return cls
    close_matches = difflib.get_close_matches(name[:40].strip().lower(), classes, n=3, cutoff=0.6)
    remedy = (
        f"did you mean {' or '.join(close_matches)}?"
        if close_matches
        else f"the kinds are {', '.join(classes)}"
    )
    raise UsageError(f"unknown {thing} {name[:40]!r}", remedy=remedy)
