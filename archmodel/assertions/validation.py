"""Checks of texts, numbers, years and choices in assertions."""

import difflib
import math
import unicodedata
from collections.abc import Iterable

from archmodel.tables.base import LARGEST_INTEGER
from ground.errors import UsageError

MAX_TEXT = 10_000
"""Longest text [characters]; a longer one belongs in a document."""


def checked_text(name: str, value: str | None) -> str | None:
    """Check a text in words, of several lines perhaps, and strip outer space; None stays None.

    Its letters get their composed form (NFC), so that ü typed as one character or as two is one letter.
    """
    if value is None:
        return None
    text = unicodedata.normalize("NFC", value.strip())
    if not text or any(not character.isprintable() and character not in "\n\t" for character in text):
        what = f"{name} {value[:40]!a} has no visible character, or some that cannot be typed"
        raise UsageError(what, remedy="write a text")
    if len(text) > MAX_TEXT:
        remedy = "put it into a document, and refer to that"
        raise UsageError(f"{name} has {len(text)} characters, at most {MAX_TEXT}", remedy=remedy)
    return text


def checked_label(name: str, value: str) -> str:
    """Check a code or a name: one line, at most 200 characters; its letters get their composed form (NFC)."""
    value = unicodedata.normalize("NFC", value)
    if not value.strip() or value != value.strip() or not value.isprintable() or len(value) > 200:
        remedy = "write up to 200 characters in one line, without blanks at the ends"
        raise UsageError(f"{name} {value[:40]!a} is not a name", remedy=remedy)
    return value


def checked_number(
    name: str,
    value: float | None,
    unit: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
) -> float | None:
    """Check a finite number within bounds; None stays None."""
    if value is None:
        return None
    number = isinstance(value, int | float) and not isinstance(value, bool)
    finite = number and abs(value) < 1e300 and math.isfinite(value)
    bounds = {
        f"above {above}": finite and (above is None or value > above),
        f"at least {at_least}": finite and (at_least is None or value >= at_least),
        f"below {below}": finite and (below is None or value < below),
        f"at most {at_most}": finite and (at_most is None or value <= at_most),
    }
    if not all(bounds.values()):
        asked = [text for text in bounds if not text.endswith("None")]
        in_unit = "" if unit == "-" else f" in {unit}"
        remedy = ", ".join([f"give a finite number{in_unit}", *asked])
        raise UsageError(f"{name} is {str(value)[:40]}", remedy=remedy)
    return float(value)


def checked_whole(name: str, value: int | None, lowest: int, highest: int = LARGEST_INTEGER) -> int | None:
    """Check an integer within bounds, both included; None stays None."""
    if value is None:
        return None
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole or not lowest <= value <= highest:
        bounds = f"from {lowest} to {highest}" if highest < LARGEST_INTEGER else f"from {lowest} on"
        raise UsageError(f"{name} is {str(value)[:40]}", remedy=f"give a whole number {bounds}")
    return value


def checked_years(begins: int | None, ends: int | None) -> None:
    """Check that years are in order; negative ones are before the common era."""
    for name, year in (("begins", begins), ("ends", ends)):
        checked_whole(name, year, -1_000_000, 9999)
    if begins is not None and ends is not None and begins > ends:
        raise UsageError(f"begins in {begins} and ends in {ends}", remedy="give the earlier year first")


def checked_choice(name: str, value: str, choices: Iterable[str]) -> str:
    """Check that a value is one of the known names."""
    names = list(choices)
    if value in names:
        return value
    close_matches = difflib.get_close_matches(value[:40].strip().lower(), names, n=3, cutoff=0.5)
    remedy = (
        f"did you mean {' or '.join(close_matches)}?" if close_matches else f"they are {', '.join(names)}"
    )
    raise UsageError(f"unknown {name} {value[:40]!r}", remedy=remedy)
