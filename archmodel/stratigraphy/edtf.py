"""Years as the Extended Date/Time Format (ISO 8601-2) writes them: circa, before, after, between, centuries."""

import re

from ground.errors import UsageError

Bounds = tuple[int | None, int | None]

_YEAR = re.compile(r"(?P<sign>-?)(?P<year>[0-9X]{1,4}|[0-9]{5,6})(-[0-9]{2}(-[0-9]{2})?)?[?~%]?")
_WORDS = (
    (re.compile(r"(?:circa|ca\.?|c\.)\s+(.+)", re.IGNORECASE), r"\1~"),
    (re.compile(r"(?:before|until)\s+(.+)", re.IGNORECASE), r"../\1"),
    (re.compile(r"(?:after|from|since)\s+(.+)", re.IGNORECASE), r"\1/.."),
    (re.compile(r"between\s+(.+?)\s+and\s+(.+)", re.IGNORECASE), r"\1/\2"),
)


def year_bounds(name: str, value: int | str) -> Bounds:
    """Return the earliest and the latest year of a date; None where it is open.

    A date of which one is not sure (``1400~``, ``circa 1400``) has the bounds of its year: how far it may be off is
    not stated, and is not made up.

    Parameters
    ----------
    name : of the key, for errors
    value : a year, or a text of EDTF: ``1400``, ``1400~``, ``14XX``, ``1380/1420``, ``../1400``, ``1400/..``; or in
        words: circa 1400, before 1400, after 1400, between 1380 and 1420

    Raises
    ------
    UsageError
        if it is no such date, or ends before it begins

    >>> year_bounds("begins", "14XX"), year_bounds("begins", "circa 1400"), year_bounds("ends", "../1400")
    ((1400, 1499), (1400, 1400), (None, 1400))
    """
    if not isinstance(value, str):
        return value, value
    text = value.strip()
    for pattern, edtf in _WORDS:
        if (match := pattern.fullmatch(text)) is not None:
            text = match.expand(edtf)
            break
    ends = text.split("/")
    if len(ends) > 2:
        raise _refusal(name, value)
    first = _of_end(name, value, ends[0], 0, open_too=len(ends) == 2)
    last = _of_end(name, value, ends[-1], 1, open_too=len(ends) == 2)
    if first is not None and last is not None and first > last:
        raise UsageError(f"{name} {value!r} ends before it begins", remedy="give the earlier year first")
    return first, last


def _of_end(name: str, value: str, text: str, end: int, *, open_too: bool) -> int | None:
    """Return the first (0) or last (1) year of one end of an interval; None if it is open."""
    if open_too and text.strip() in ("", ".."):
        return None
    match = _YEAR.fullmatch(text.strip())
    # what is not known of a year are its last digits: 14XX, 140X
    if match is None or not re.fullmatch(r"[0-9]+X{0,3}", match["year"]):
        raise _refusal(name, value)
    negative = bool(match["sign"])
    year = int(match["year"].replace("X", "9" if bool(end) != negative else "0"))
    return -year if negative else year


def _refusal(name: str, value: str) -> UsageError:
    remedy = 'write a year, or "circa 1400", "1400~", "../1400", "1380/1420", "14XX"'
    return UsageError(f"{name} {value[:40]!r} is no date", remedy=remedy)
