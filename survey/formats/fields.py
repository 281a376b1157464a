"""Strict parsing of numbers and names, shared by all formats."""

import math
import re
import unicodedata

from moma.errors import SurveyError

__all__ = [
    "CODE",
    "FARTHEST",
    "KIND",
    "code_of",
    "parse_course",
    "parse_length",
    "parse_number",
    "shown",
    "unreadable",
]

CODE = re.compile(r"[^\W_][\w.+/:-]{0,63}")
"""Pattern of the name of a stone."""

_NOT_IN_CODES = re.compile(r"[^\w.+/:-]+")

KIND = re.compile(r"[a-z][a-z0-9_-]{0,31}")
"""Pattern of the name of a kind of stone."""

FARTHEST = 1e8
"""Largest coordinate: no site frame reaches farther, and sums of squares stay finite [m]."""

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def parse_number(text: str, what: str, where: str, far: float = FARTHEST) -> float:
    """Read one finite decimal number, no larger than `far`; `what` names it in the error."""
    if _NUMBER.fullmatch(text) is None:
        raise SurveyError(f"{what} is {shown(text)}, not a number", where=where, remedy="write e.g. 12.345")
    value = float(text)
    if not math.isfinite(value) or abs(value) > far:
        unit = " m" if far == FARTHEST else ""
        raise SurveyError(
            f"{what} is {shown(text)}, beyond {far:g}{unit}", where=where, remedy="coordinates are in metres"
        )
    return value


def parse_length(text: str, what: str, where: str) -> float:
    """Read one number that must be positive."""
    value = parse_number(text, what, where)
    if value <= 0.0:
        raise SurveyError(f"{what} is {shown(text)}", where=where, remedy="it must be greater than 0")
    return value


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
    words = (_NOT_IN_CODES.sub("", one) for one in unicodedata.normalize("NFC", name).split())
    code = "_".join(one for one in words if one).lstrip("_.+/:-")
    return code if CODE.fullmatch(code) else ""


def shown(text: str) -> str:
    """Quote a text, cut to fit on a line."""
    return repr(text if len(text) <= 40 else text[:37] + "…")


def unreadable(path: object, error: Exception, remedy: str = "give an existing file") -> SurveyError:
    """Make the error of a file that the operating system cannot read."""
    reason = getattr(error, "strerror", None) or error
    return SurveyError(f"cannot be read: {reason}", where=str(path), remedy=remedy)
