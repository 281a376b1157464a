"""Tokens of query expressions, and errors that point at a token."""

import re
import unicodedata
from dataclasses import dataclass

from ground.errors import QueryError

MAX_LENGTH = 2000
"""Longest expression [characters]."""

KEYWORDS = frozenset({"and", "or", "not", "in", "like", "is", "null"})

_NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")
_TOKEN = re.compile(
    r"""\s* (?: (?P<quoted> '(?:[^']|'')*' | "(?:[^"]|"")*" )
              | (?P<sign> [=!<>]+ | [(),] )
              | (?P<word> [^\s'"=!<>(),]+ ) )""",
    re.VERBOSE,
)


@dataclass(frozen=True)
class Token:
    """Token of an expression.

    Attributes
    ----------
    role : quoted, sign, word, number, keyword or end
    text : the piece, without its quotes; keywords in lower case
    position : of its first character in the expression, from 1
    source : the whole expression
    """

    role: str
    text: str
    position: int
    source: str


def complaint(token: Token, what: str, remedy: str | None = None) -> QueryError:
    """Make an error that points at a token."""
    shown = token.source if len(token.source) <= 60 else token.source[:57] + "..."
    # The expression is the user's: whatever cannot be printed is escaped, so that the error is one line.
    where = ascii(shown) if not shown.isprintable() else f'"{shown}"'
    return QueryError(what, where=f"{where} at character {token.position}", remedy=remedy)


def tokenise(text: str) -> list[Token]:
    """Split an expression into tokens, with an end token after the last; letters are in their composed form (NFC)."""
    text = unicodedata.normalize("NFC", text)
    if len(text) > MAX_LENGTH:
        token = Token("end", "", MAX_LENGTH, text)
        raise complaint(
            token,
            f"the expression has {len(text)} characters",
            f"use {MAX_LENGTH} at most, or several --where",
        )
    for position, character in enumerate(text, start=1):
        if not (character.isprintable() or character in "\t\n\r") and not character.isspace():
            raise complaint(Token("end", "", position, text), f"the character {character!a} cannot be used")
    tokens: list[Token] = []
    end = len(text.rstrip())
    position = 0
    while position < end:
        match = _TOKEN.match(text, position)
        if match is None:
            start = position + len(text[position:]) - len(text[position:].lstrip())
            raise complaint(Token("end", "", start + 1, text), "the quote is not closed")
        role = str(match.lastgroup)
        tokens.append(_token(role, match[role], match.start(role) + 1, text))
        position = match.end()
    return [*tokens, Token("end", "", end + 1, text)]


def _token(role: str, piece: str, position: int, source: str) -> Token:
    """Return a token with its true role."""
    if role == "quoted":
        piece = piece[1:-1].replace(piece[0] * 2, piece[0])
    elif role == "word" and piece.lower() in KEYWORDS:
        role, piece = "keyword", piece.lower()
    elif role == "word" and _NUMBER.fullmatch(piece):
        role = "number"
    return Token(role, piece, position, source)


def named(token: Token) -> str:
    """Name a token in an error."""
    return "the end" if token.role == "end" else repr(token.text[:40])
