"""Strict parsing of numbers, and errors of files that cannot be read."""

import math
import re

from ground.errors import SurveyError

EMPTY = frozenset(("-", "--", "–", "—", "n/a", "na", "nan", "none", "null", "?"))
"""Words for a value that is not known, in lower case."""

FARTHEST = 1e8
"""Largest coordinate: no site frame reaches farther, and sums of squares stay finite [m]."""

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_GROUPED = re.compile(
    r"[+-]?\d{1,3}(?:(?P<mark>['’\u00a0\u202f])\d{3}(?:(?P=mark)\d{3})*(?:[.,]\d*)?|(?: \d{3})+[.,]\d+)",
    re.ASCII,
)
_GROUPS = re.compile(r"\d['’\u00a0\u202f ]\d{3}", re.ASCII)


def parse_number(text: str, what: str, where: str, farthest: float = FARTHEST) -> float:
    """Read one finite decimal number, no larger than `farthest`; `what` names it in the error."""
    if not text:
        remedy = "fill it in; the formulas of a workbook have values once it is opened and saved"
        raise SurveyError(f"{what} is empty", where=where, remedy=remedy)
    if _NUMBER.fullmatch(text) is None:
        raise SurveyError(f"{what} is {shown(text)}, not a number", where=where, remedy="write e.g. 12.345")
    value = float(text)
    if not math.isfinite(value) or abs(value) > farthest:
        unit = " m" if farthest == FARTHEST else ""
        raise SurveyError(
            f"{what} is {shown(text)}, beyond {farthest:g}{unit}",
            where=where,
            remedy="coordinates are in metres",
        )
    return value


def is_number(text: str, commas: bool = False) -> bool:
    """Return whether a text is a decimal number; with `commas`, also one with a decimal comma."""
    return _NUMBER.fullmatch(text.replace(",", ".", 1) if commas else text) is not None


def has_groups(row: str) -> bool:
    """Return whether a row may have numbers whose thousands are set apart."""
    return _GROUPS.search(row) is not None


def ungrouped(text: str) -> str:
    """Return a number without the marks between its thousands, any other text as it is.

    Points and commas stay, which may be decimal marks. A blank counts before decimals only, as it may part two numbers.

    Examples
    --------
    >>> ungrouped("2'683'400.968"), ungrouped("1 248 078,34"), ungrouped("12 345"), ungrouped("1.234,5")
    ('2683400.968', '1248078,34', '12 345', '1.234,5')
    """
    return re.sub(r"['’\s]", "", text) if _GROUPED.fullmatch(text) else text


def parse_length(text: str, what: str, where: str) -> float:
    """Read one number that must be positive."""
    value = parse_number(text, what, where)
    if value <= 0.0:
        raise SurveyError(f"{what} is {shown(text)}", where=where, remedy="it must be greater than 0")
    return value


def shown(text: str) -> str:
    """Quote a text, cut to fit on a line."""
    return repr(text if len(text) <= 40 else text[:37] + "…")


def unreadable(path: object, error: Exception, remedy: str = "give an existing file") -> SurveyError:
    """Make the error of a file that the operating system cannot read."""
    reason = getattr(error, "strerror", None) or error
    return SurveyError(f"cannot be read: {reason}", where=str(path), remedy=remedy)
