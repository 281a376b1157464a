"""XML with the line of each element, which the standard readers do not keep."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, shown, unreadable


@dataclass
class Element:
    """An element of a document.

    Attributes
    ----------
    name : its tag
    attributes : by name
    where : ``file:line``
    text : its own text
    children : in order
    """

    name: str
    attributes: dict[str, str]
    where: str
    text: str = ""
    children: list["Element"] = field(default_factory=list)

    def fail(self, what: str, remedy: str) -> SurveyError:
        """Make an error at this element."""
        return SurveyError(what, where=self.where, remedy=remedy)

    def all(self, *path: str) -> Iterator["Element"]:
        """Yield the elements below this one along a path of tags."""
        for child in self.children:
            if child.name == path[0]:
                if len(path) == 1:
                    yield child
                else:
                    yield from child.all(*path[1:])

    def find(self, *path: str) -> "Element | None":
        """Return the first element along a path of tags."""
        return next(self.all(*path), None)

    def need(self, *path: str) -> "Element":
        """Return the first element along a path of tags, which must be there."""
        element = self.find(*path)
        if element is None:
            raise self.fail(f"<{self.name}> has no <{'/'.join(path)}>", "export the file again")
        return element

    def numbers(self, count: int | None = None) -> list[float]:
        """Return the numbers of the text, separated by blanks or commas."""
        words = self.text.replace(",", " ").split()
        if count is not None and len(words) != count:
            raise self.fail(f"<{self.name}> has {len(words)} numbers", f"{count} are expected")
        return [parse_number(word, self.name, self.where) for word in words]

    def number(self, name: str) -> float:
        """Return an attribute that is a number."""
        return parse_number(self.attribute(name), name, self.where)

    def attribute(self, name: str) -> str:
        """Return an attribute, which must be there."""
        if name not in self.attributes:
            raise self.fail(f"<{self.name}> has no {name!r}", "export the file again")
        return self.attributes[name]


def read_xml(path: Path, root: str) -> Element:
    """Read a document.

    Parameters
    ----------
    root : tag that its root must have

    Raises
    ------
    SurveyError
        naming file and line, if it is not such a document
    """
    top = Element("", {}, str(path))
    open_: list[Element] = [top]
    parser = expat.ParserCreate()

    def begin(name: str, attributes: dict[str, str]) -> None:
        """Open an element, with the line on which it stands."""
        made = Element(name, attributes, f"{path}:{parser.CurrentLineNumber}")
        open_[-1].children.append(made)
        open_.append(made)

    def end(name: str) -> None:
        """Close the innermost element."""
        open_.pop()

    def text(data: str) -> None:
        """Add text to the innermost element."""
        open_[-1].text += data

    def doctype(*_: object) -> None:
        """Refuse a document type, which may name other files."""
        raise SurveyError(
            "the document has a DOCTYPE",
            where=f"{path}:{parser.CurrentLineNumber}",
            remedy="remove it: it is not needed",
        )

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = begin, end, text
    parser.StartDoctypeDeclHandler = doctype
    parser.buffer_text = True
    try:
        with path.open("rb") as file:
            parser.ParseFile(file)
    except OSError as error:
        raise unreadable(path, error) from error
    except expat.ExpatError as error:
        raise SurveyError(
            f"this is not XML: {expat.errors.messages[error.code]}",
            where=f"{path}:{error.lineno}",
            remedy="export the file again",
        ) from error
    element = top.children[0]
    if element.name != root:
        raise element.fail(f"the document is <{shown(element.name)[1:-1]}>", f"<{root}> is expected")
    return element
