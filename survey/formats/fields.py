"""Strict parsing of names of stones and kinds, and of courses, shared by all formats."""

import re
import unicodedata

from ground.errors import SurveyError
from ground.tables.numbers import shown

CODE = re.compile(r"[^\W_][\w.+/:-]{0,63}")
"""Pattern of the name of a stone."""

_NOT_IN_CODES = re.compile(r"[^\w.+/:-]+")

KIND = re.compile(r"[a-z][a-z0-9_-]{0,31}")
"""Pattern of the name of a kind of stone."""


NO_COURSE = frozenset(("arch", "vault", "bogen", "gewölbe", "arc", "voûte", "arco", "volta", "bóveda"))
"""Words that stand for the course of stones of an arch or vault, which have none."""

NUMBERED_ANEW = "most numbers of stones stand in several courses: they are numbered anew in each"
"""What is wrong where the number of a stone does not name it."""


def parse_course(text: str, where: str) -> int:
    """Read the number of a course."""
    whole, _, rest = text.partition("." if "." in text else ",")  # spreadsheets write 1.0 and 1,0
    if not (whole.isascii() and whole.isdigit() and len(whole) <= 6 and not rest.strip("0")):
        raise SurveyError(
            f"course {shown(text)} is not a whole number",
            where=where,
            remedy="count courses from the ground: 1, 2, …",
        )
    return int(whole)


def code_of(name: str) -> str:
    """Return the code of a stone from its name as people write it; empty if nothing is left.

    Blanks become ``_``; other characters that a code cannot have are left out.

    Examples
    --------
    >>> code_of("Stein 12a"), code_of("N° 5"), code_of("(Größe) 7, neu")
    ('Stein_12a', 'N_5', 'Größe_7_neu')
    """
    if CODE.fullmatch(name):
        return name
    words = (_NOT_IN_CODES.sub("", word) for word in unicodedata.normalize("NFC", name).split())
    code = "_".join(word for word in words if word).lstrip("_.+/:-")
    return code if CODE.fullmatch(code) else ""
