"""Statements of RDF: subject, predicate, object; and a reader by the ending of a file."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from ground.errors import UsageError

__all__ = ["RDF", "Literal", "Node", "Triple", "number_blank", "read_text", "refuse", "tag_of"]

RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
"""Namespace of RDF."""


@dataclass(frozen=True)
class Literal:
    """Text of a statement.

    Attributes
    ----------
    text : without escapes
    language : tag (BCP 47), its first part in small letters; None for a text without one, a number, or a value of
        another type
    """

    text: str
    language: str | None = None


Node = str | Literal
"""IRI, blank node (``_:`` and a name), or text."""

Triple = tuple[str, str, Node]
"""Subject, predicate, object."""


def read_text(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    UsageError
        if it cannot be read, or is not UTF-8
    """
    try:
        return path.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        refuse(str(path), f"cannot be read: {error}", "save it as UTF-8")


def refuse(where: str, what: str, remedy: str = "save it again as Turtle by another program") -> NoReturn:
    """Refuse a file, at its line."""
    raise UsageError(what, where=where, remedy=remedy)


def number_blank() -> Iterator[str]:
    """Yield names of blank nodes that no file can write."""
    number = 0
    while True:
        number += 1
        yield f"_:-{number}"


def tag_of(text: str) -> str | None:
    """Return a language tag with its first part in small letters, as they are compared without regard to case."""
    first, dash, rest = text.strip().partition("-")
    return f"{first.lower()}{dash}{rest}" or None
