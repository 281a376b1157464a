"""Turtle 1.1, of which N-Triples are a part: the whole grammar, without a check of datatypes."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn
from urllib.parse import urljoin

from archmodel.skos.triples import RDF, Literal, Node, Triple, number_blank, refuse, tag_of

__all__ = ["parse_turtle"]

_LOCAL = r"(?:[\w:\-]|%[0-9A-Fa-f]{2}|\\[_~.!$&'()*+,;=/?\#@%\-])"
_TOKENS = re.compile(
    rf"""(?P<space>\s+|\#[^\n]*)
    |(?P<iri><(?:[^\x00-\x20<>"{{}}|^`\\]|\\u[0-9A-Fa-f]{{4}}|\\U[0-9A-Fa-f]{{8}})*>)
    |(?P<text>\"\"\"(?:"{{0,2}}(?:[^"\\]|\\.))*\"\"\"|'''(?:'{{0,2}}(?:[^'\\]|\\.))*'''
        |"(?:[^"\\\n\r]|\\.)*"|'(?:[^'\\\n\r]|\\.)*')
    |(?P<language>@[A-Za-z]+(?:-[A-Za-z0-9]+)*)
    |(?P<blank>_:\w(?:[\w.\-]*[\w\-])?)
    |(?P<name>(?:[^\W\d_](?:[\w.\-]*[\w\-])?)?:(?:{_LOCAL}(?:(?:{_LOCAL}|\.)*{_LOCAL})?)?)
    |(?P<number>[+\-]?(?:\d*\.\d+|\d+\.(?=[eE])|\d+)(?:[eE][+\-]?\d+)?)
    |(?P<word>[A-Za-z]+)
    |(?P<mark>\^\^|[;,.\[\]()])""",
    re.VERBOSE | re.DOTALL,
)
_ESCAPES = {"t": "\t", "b": "\b", "n": "\n", "r": "\r", "f": "\f", '"': '"', "'": "'", "\\": "\\"}


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    line: int


def parse_turtle(text: str, where: str, base: str = "") -> list[Triple]:
    """Return the statements of a text.

    Parameters
    ----------
    where : its name in messages
    base : IRI to which relative ones are relative

    Raises
    ------
    UsageError
        at the line of what is not Turtle
    """
    try:
        return list(_Parser(text, where, base).statements())
    except RecursionError:
        refuse(where, "too many brackets within brackets")


class _Parser:
    """Reader of one text, by a function for each rule of the grammar; `_out` collects statements."""

    def __init__(self, text: str, where: str, base: str) -> None:
        self._where, self._base = where, base
        self._prefixes: dict[str, str] = {}
        self._blank = number_blank()
        self._out: list[Triple] = []
        self._tokens = _tokens(text, where)
        self._token = next(self._tokens)

    def statements(self) -> Iterator[Triple]:
        """Yield the statements in the order of the text."""
        while self._token.kind != "end":
            word = self._token.text.lower()
            if word in ("@prefix", "@base", "prefix", "base"):
                self._directive(word)
            else:
                bare = self._token.text == "["
                subject = self._subject()
                if not (bare and self._token.text == "."):
                    self._properties(subject)
                self._expect(".")
            yield from self._out
            self._out.clear()

    def _directive(self, word: str) -> None:
        self._take()
        if word.endswith("prefix"):
            name = self._take("name").text
            if not name.endswith(":"):
                self._fail(f"the prefix {name[:40]!r} does not end with a colon")
            self._prefixes[name[:-1]] = self._iri(self._take("iri").text)
        else:
            self._base = self._iri(self._take("iri").text)
        if word.startswith("@"):
            self._expect(".")

    def _subject(self) -> str:
        node = self._node()
        if isinstance(node, Literal):
            self._fail("a text cannot be the subject of a statement")
        return node

    def _properties(self, subject: str) -> None:
        """Read predicates with their objects, up to a full stop or bracket."""
        while True:
            if self._token.text == "a" and self._token.kind == "word":
                self._take()
                predicate = f"{RDF}type"
            else:
                predicate = self._subject()
            self._out.append((subject, predicate, self._node()))
            while self._token.text == "," and self._token.kind == "mark":
                self._take()
                self._out.append((subject, predicate, self._node()))
            while self._token.text == ";" and self._token.kind == "mark":
                self._take()
                after = self._token.text if self._token.kind == "mark" else ""
                if after in (".", "]"):
                    return
                if after != ";":
                    break
            else:
                return

    def _node(self) -> Node:
        """Read an IRI, a blank node, a list or a text."""
        token = self._take()
        match token.kind, token.text:
            case "iri", text:
                return self._iri(text)
            case "name", text:
                return self._full(text)
            case "blank", text:
                return text
            case "text", text:
                return self._literal(text)
            case "number", text:
                return Literal(text)
            case "word", "true" | "false":
                return Literal(token.text)
            case "mark", "[" | "(":
                pass
            case _:
                self._fail(f"{token.text[:40]!r} where an IRI or a text should stand", token)
        return self._bracketed() if token.text == "[" else self._list()

    def _bracketed(self) -> str:
        node = next(self._blank)
        if self._token.text != "]":
            self._properties(node)
        self._expect("]")
        return node

    def _list(self) -> str:
        nodes = []
        while not (self._token.kind == "mark" and self._token.text == ")"):
            nodes.append(self._node())
        self._take()
        rest = f"{RDF}nil"
        for node in reversed(nodes):
            link = next(self._blank)
            self._out += [(link, f"{RDF}first", node), (link, f"{RDF}rest", rest)]
            rest = link
        return rest

    def _literal(self, text: str) -> Literal:
        quotes = 3 if text[:3] in ('"""', "'''") else 1
        content = _unescaped(text[quotes:-quotes])
        if self._token.kind == "language":
            return Literal(content, tag_of(self._take().text[1:]))
        if self._token.text == "^^":
            self._take()
            self._subject()
        return Literal(content)

    def _iri(self, text: str) -> str:
        return urljoin(self._base, _unescaped(text[1:-1]))

    def _full(self, text: str) -> str:
        prefix, _, local = text.partition(":")
        if prefix not in self._prefixes:
            self._fail(f"the prefix {prefix[:40]!r} is not declared")
        return self._prefixes[prefix] + re.sub(r"\\(.)", r"\1", local)

    def _take(self, kind: str | None = None) -> _Token:
        token = self._token
        if token.kind == "end" or (kind is not None and token.kind != kind):
            self._fail(f"{token.text[:40]!r} where {'more' if kind is None else f'a {kind}'} should stand")
        self._token = next(self._tokens)
        return token

    def _expect(self, mark: str) -> None:
        if self._token.kind != "mark" or self._token.text != mark:
            self._fail(f"{self._token.text[:40]!r} where {mark!r} should stand")
        self._token = next(self._tokens)

    def _fail(self, what: str, token: _Token | None = None) -> NoReturn:
        refuse(f"{self._where}:{(token or self._token).line}", what)


def _tokens(text: str, where: str) -> Iterator[_Token]:
    """Yield the tokens of a text, and one of the kind "end" for ever."""
    place, line = 0, 1
    while place < len(text):
        found = _TOKENS.match(text, place)
        if found is None:
            refuse(f"{where}:{line}", f"{text[place : place + 20]!r} is not Turtle")
        kind = found.lastgroup or ""
        if kind != "space":
            yield _Token(kind, found[0], line)
        line += found[0].count("\n")
        place = found.end()
    while True:
        yield _Token("end", "the end of the file", line)


def _unescaped(text: str) -> str:
    """Return a text with its escapes resolved."""
    if "\\" not in text:
        return text
    return re.sub(
        r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))",
        lambda found: (
            chr(int(found[1] or found[2], 16)) if found[3] is None else _ESCAPES.get(found[3], found[3])
        ),
        text,
        flags=re.DOTALL,
    )
