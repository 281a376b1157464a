"""Fields of a text survey: the strict reading of numbers, names and lines that all formats share."""

import math
import re
from pathlib import Path

from moma.errors import SurveyError

__all__ = ["CODE", "KIND", "parse_length", "parse_number", "read_lines"]

CODE = re.compile(r"[^\W_][\w.+/:-]{0,63}")
KIND = re.compile(r"[a-z][a-z0-9_-]{0,31}")
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_FARTHEST = 1e8  # metres: no site frame reaches farther, and sums of squares stay finite


def read_lines(path: Path) -> list[str]:
    """Read a UTF-8 text file as lines, without their ends.

    Only line feeds end a line, as in an editor, so that line numbers agree with what the user sees.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SurveyError(
            f"cannot be read: {error.strerror or error}",
            where=str(path),
            remedy="give an existing survey file",
        ) from error
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise SurveyError(
            f"byte 0x{data[error.start]:02x} is not UTF-8",
            where=f"{path}:{line}",
            remedy="save the file as UTF-8",
        ) from error
    return [line.removesuffix("\r") for line in text.split("\n")]


def parse_number(text: str, what: str, where: str) -> float:
    """Read one finite decimal number; `what` names it in the error."""
    if _NUMBER.fullmatch(text) is None:
        raise SurveyError(f"{what} is {_shown(text)}, not a number", where=where, remedy="write e.g. 12.345")
    value = float(text)
    if not math.isfinite(value) or abs(value) > _FARTHEST:
        raise SurveyError(
            f"{what} is {_shown(text)}, beyond {_FARTHEST:g} m",
            where=where,
            remedy="coordinates are in metres",
        )
    return value


def parse_length(text: str, what: str, where: str) -> float:
    """Read one number that must be positive."""
    value = parse_number(text, what, where)
    if value <= 0.0:
        raise SurveyError(f"{what} is {_shown(text)}", where=where, remedy="it must be greater than 0")
    return value


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "…")
