"""RDF/XML as vocabularies are published in it: nodes with properties, nested or referred to, with languages."""

from collections.abc import Iterator
from urllib.parse import urljoin
from xml.etree import ElementTree as etree

from archmodel.skos.triples import RDF, Literal, Triple, number_blank, refuse, tag_of

__all__ = ["parse_rdf_xml"]

_XML = "{http://www.w3.org/XML/1998/namespace}"
_R = f"{{{RDF}}}"
_SYNTAX = frozenset(f"{_R}{name}" for name in ("about", "ID", "nodeID", "resource", "parseType", "datatype"))


def parse_rdf_xml(text: str, where: str, base: str = "") -> list[Triple]:
    """Return the statements of a text; parameters and errors as of `archmodel.skos.turtle.parse_turtle`."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        refuse(where, "XML with a document type")
    try:
        root = etree.fromstring(text)
    except etree.ParseError as error:
        refuse(where, f"cannot be read: {error}")
    nodes = list(root) if root.tag == f"{_R}RDF" else [root]
    reader = _Reader(base)
    settings = reader.inherited(root, (base, None))
    for node in nodes:
        reader.read_node(node, settings)
    return reader.out


_Settings = tuple[str, str | None]
"""Base of relative IRIs, and language, as outer elements state them."""


class _Reader:
    """Reader that collects statements; blank nodes of a file keep their names."""

    def __init__(self, base: str) -> None:
        self.out: list[Triple] = []
        self._blank = number_blank()
        self._base = base

    def inherited(self, element: etree.Element, settings: _Settings) -> _Settings:
        """Return base and language within an element."""
        language = element.get(f"{_XML}lang")
        base = urljoin(settings[0], element.get(f"{_XML}base", ""))
        return base, settings[1] if language is None else tag_of(language)

    def read_node(self, element: etree.Element, settings: _Settings) -> str:
        """Read an element of a node with its properties; return the node."""
        base, language = settings = self.inherited(element, settings)
        about, number, name = (element.get(f"{_R}{key}") for key in ("about", "ID", "nodeID"))
        if about is not None:
            node = urljoin(base, about)
        elif number is not None:
            node = urljoin(base, f"#{number}")
        else:
            node = next(self._blank) if name is None else f"_:{name}"
        if element.tag != f"{_R}Description":
            self.out.append((node, f"{RDF}type", _iri(element.tag)))
        self._read_attributes(element, node, language)
        for child in element:
            self._read_property(child, node, settings)
        return node

    def _read_property(self, element: etree.Element, node: str, settings: _Settings) -> None:
        base, language = settings = self.inherited(element, settings)
        predicate, kind = _iri(element.tag), element.get(f"{_R}parseType")
        resource, name = element.get(f"{_R}resource"), element.get(f"{_R}nodeID")
        if kind == "Resource":
            inner = next(self._blank)
            self.out.append((node, predicate, inner))
            for child in element:
                self._read_property(child, inner, settings)
        elif resource is not None or name is not None:
            target = f"_:{name}" if resource is None else urljoin(base, resource)
            self.out.append((node, predicate, target))
            self._read_attributes(element, target, language)
        elif len(element) and kind != "Literal":
            targets = [self.read_node(child, settings) for child in element]
            self.out += [(node, predicate, target) for target in targets]
        else:
            self.out.append((node, predicate, Literal("".join(element.itertext()), language)))

    def _read_attributes(self, element: etree.Element, node: str, language: str | None) -> None:
        for name, text in _properties(element):
            self.out.append((node, name, text if name == f"{RDF}type" else Literal(text, language)))


def _properties(element: etree.Element) -> Iterator[tuple[str, str]]:
    """Yield the attributes that are properties."""
    for name, text in element.attrib.items():
        if name.startswith("{") and not name.startswith(_XML) and name not in _SYNTAX:
            yield _iri(name), text


def _iri(tag: str) -> str:
    """Return the IRI of an element's name."""
    space, _, local = tag.removeprefix("{").partition("}")
    return f"{space}{local}"
