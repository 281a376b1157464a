"""Names that look like others although their characters differ: refused, since nobody sees why one is not the other.

An A may be Latin, Greek or Cyrillic, and a hyphen may be a dash. The digits and letters of ASCII that resemble each
other (O and 0, l and 1) are left alone: both are common in codes, and every keyboard tells them apart.
"""

import unicodedata
from collections.abc import Iterable, Sequence
from typing import Any

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import InstrumentedAttribute, Session

_LETTERS = str.maketrans(
    "АВЕЅІЈКМНОРСТУХԌԚԜѴаеорсухѕіјһԁԛԝѵӏ" + "ΑΒΕΖΗΙΚΜΝΟΡΤΥΧαγικνορυ" + "ıօ‐‑‒–—−’‘′∕⁄",
    "ABESIJKMHOPCTYXGQWVaeopcyxsijhdqwvl" + "ABEZHIKMNOPTYXayikvopu" + "io------'''//",
)


def plain_form(name: str) -> str:
    """Return a name with each character replaced by the ASCII character that it looks like, if there is one.

    >>> plain_form("А1–Ｂ")
    'A1-B'
    >>> plain_form("Säule")
    'Säule'
    """
    return name if name.isascii() else unicodedata.normalize("NFKC", name).translate(_LETTERS)


def explained(name: str, similar: str) -> str:
    """Return what distinguishes two names that look alike, in words.

    >>> explained("А1", "A1")
    'А1 looks like A1, but has CYRILLIC CAPITAL LETTER A'
    """
    odd = [character for character in dict.fromkeys(name) if character not in similar] or [
        character for character in dict.fromkeys(similar) if character not in name
    ]
    characters = ", ".join(unicodedata.name(character, f"U+{ord(character):04X}") for character in odd[:3])
    holder = "has" if odd and odd[0] in name else "lacks"
    return f"{name[:40]} looks like {similar[:40]}, but {holder} {characters or 'other characters'}"


class Lookalikes:
    """Names in a column of the database, and those that look like them.

    Parameters
    ----------
    session : of the database
    column : of the names
    conditions : of the rows that count
    """

    def __init__(
        self, session: Session, column: InstrumentedAttribute[Any], *conditions: ColumnElement[bool]
    ) -> None:
        self._names = select(column).where(*conditions).distinct()
        self._session, self._column = session, column
        # names beyond ASCII, which are few; SQLite and PostgreSQL say so in words of their own
        sqlite = session.get_bind().dialect.name == "sqlite"
        beyond = column.op("GLOB")("*[^ -~]*") if sqlite else column.regexp_match("[^ -~]")
        self._odd = {plain_form(row): row for row in session.scalars(self._names.where(beyond))}

    def like(self, names: Sequence[str]) -> tuple[str, str] | None:
        """Return the first of new names that looks like another, new or there already, with the other; None: none."""
        ascii = {name for name in names if name.isascii()}
        for name in names:
            similar = (
                self._odd.setdefault(plain_form(name), name) if name not in ascii else self._odd.get(name)
            )
            if similar not in (None, name):
                return name, str(similar)
        odd = {form: name for form, name in self._odd.items() if name in set(names) - ascii}
        if not odd:
            return None
        stored_names: Iterable[str] = self._session.scalars(self._names.where(self._column.in_(list(odd))))
        for form in (*stored_names, *ascii):
            if form in odd and odd[form] != form:
                return odd[form], form
        return None
