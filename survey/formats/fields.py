"""Strict parsing of numbers and names, shared by all formats."""

import math
import re

from moma.errors import SurveyError

__all__ = ["CODE", "FARTHEST", "KIND", "parse_course", "parse_length", "parse_number", "shown", "unreadable"]

CODE = re.compile(r"[^\W_][\w.+/:-]{0,63}")
"""Pattern of the name of a stone."""

KIND = re.compile(r"[a-z][a-z0-9_-]{0,31}")
"""Pattern of the name of a kind of stone."""

FARTHEST = 1e8
"""Largest coordinate: no site frame reaches farther, and sums of squares stay finite [m]."""

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def parse_number(text: str, what: str, where: str) -> float:
    """Read one finite decimal number; `what` names it in the error."""
    if _NUMBER.fullmatch(text) is None:
        raise SurveyError(f"{what} is {shown(text)}, not a number", where=where, remedy="write e.g. 12.345")
    value = float(text)
    if not math.isfinite(value) or abs(value) > FARTHEST:
        raise SurveyError(
            f"{what} is {shown(text)}, beyond {FARTHEST:g} m",
            where=where,
            remedy="coordinates are in metres",
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
    if not (text.isascii() and text.isdigit() and len(text) <= 6):
        raise SurveyError(
            f"course {shown(text)} is not a whole number",
            where=where,
            remedy="count courses from the ground: 1, 2, …",
        )
    return int(text)


def shown(text: str) -> str:
    """Quote a text, cut to fit on a line."""
    return repr(text if len(text) <= 40 else text[:37] + "…")


def unreadable(path: object, error: Exception, remedy: str = "give an existing file") -> SurveyError:
    """Make the error of a file that the operating system cannot read."""
    reason = getattr(error, "strerror", None) or error
    return SurveyError(f"cannot be read: {reason}", where=str(path), remedy=remedy)
