"""Statements of RDF files: subject, predicate, object; rdflib reads them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn
from xml.sax import SAXParseException

from ground.errors import UsageError

RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
"""Namespace of RDF."""

_XML = (".rdf", ".owl")


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
"""IRI, name of a blank node, or text."""

Triple = tuple[str, str, Node]
"""Subject, predicate, object."""


def read_triples(path: Path) -> list[Triple]:
    """Return the statements of a file of Turtle, N-Triples or RDF/XML, in its order.

    Raises
    ------
    UsageError
        if it cannot be read, is not UTF-8, or not RDF
    """
    import rdflib  # takes half a second
    from rdflib.exceptions import ParserError
    from rdflib.plugins.parsers.notation3 import BadSyntax

    found: list[Triple] = []

    class Statements(rdflib.Graph):
        """Graph that notes its statements as they come: those of a graph have no order."""

        def add(self, triple: Any) -> "Statements":
            """Note a statement."""
            subject, predicate, target = triple
            text = isinstance(target, rdflib.Literal)
            node = Literal(str(target), _tag(target.language)) if text else str(target)
            found.append((str(subject), str(predicate), node))
            return self

    try:
        text = path.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        refuse(str(path), f"cannot be read: {error}", "save it as UTF-8")
    xml = path.suffix.lower() in _XML and text.lstrip().startswith("<")
    try:
        Statements().parse(data=text, format="xml" if xml else "turtle", publicID=f"file:///{path.name}")
    except BadSyntax as error:
        refuse(f"{path}:{error.lines + 1}", f"it is not Turtle: {error._why}")
    except RecursionError:
        refuse(str(path), "it has brackets within brackets without end")
    except (ParserError, SAXParseException) as error:
        refuse(str(path), f"it is not RDF/XML: {error}")
    except (AssertionError, IndexError):
        refuse(str(path), "it ends within a statement or a text")
    return found


def _tag(language: str | None) -> str | None:
    """Return a language tag with its first part in small letters, as they are compared without regard to case."""
    first, dash, rest = (language or "").partition("-")
    return f"{first.lower()}{dash}{rest}" or None


def refuse(where: str, what: str, remedy: str = "save it again as Turtle by another program") -> NoReturn:
    """Refuse a file, at its line."""
    raise UsageError(what, where=where, remedy=remedy)
