"""Decimal points and decimal commas: one mark per file, never guessed."""

import re

from ground.errors import SurveyError
from ground.tables.numbers import FARTHEST, parse_length, parse_number, shown

_PLAIN = re.compile(r"[-+.0-9eE]+").fullmatch  # a number to `float` made of these characters is one here too


class Decimals:
    """The decimal mark of a table: that of the first number that has one.

    Parameters
    ----------
    path : of the table, for errors
    commas : whether decimal commas are possible, because other characters separate the columns
    any_mark : numbers with both marks may stand in one table, as in workbooks, where each cell is a number or a text
    scales : units of the three coordinates [m]
    """

    def __init__(
        self,
        path: str,
        commas: bool,
        any_mark: bool = False,
        scales: tuple[float, float, float] = (1.0, 1.0, 1.0),
    ) -> None:
        self._path, self._commas, self._any_mark = path, commas, any_mark
        self._scales = None if scales == (1.0, 1.0, 1.0) else scales
        self._far = FARTHEST / min(scales)
        self._mark: str | None = None
        self._line = 0  # first line with that mark
        self._lengths: dict[str, float] = {}

    def place(self, texts: tuple[str, str, str], names: str, line: int) -> tuple[float, float, float]:
        """Read three coordinates [m]; `names` has a letter for each."""
        plain = self._plain(texts) if self._mark is not None else None
        if plain is not None:
            a, b, c = plain
        else:
            a, b, c = (self.number(text, name, line) for text, name in zip(texts, names, strict=True))
        if self._scales is None:
            return a, b, c
        u, v, w = self._scales
        return u * a, v * b, w * c

    def number(self, text: str, what: str, line: int) -> float:
        """Read one finite decimal number, as it stands; `what` names it in the error."""
        where = f"{self._path}:{line}"
        mark = "," if "," in text else "." if "." in text else None
        if mark == "," and not self._commas:
            raise SurveyError(
                f"{what} is {shown(text)}, with a decimal comma",
                where=where,
                remedy="write a point, or separate columns by semicolons or tabs",
            )
        if mark == "," and "." in text:
            raise SurveyError(
                f"{what} is {shown(text)}, with a comma and a point", where=where, remedy="write e.g. 1234,5"
            )
        if None not in (mark, self._mark) and mark != self._mark and not self._any_mark:
            raise SurveyError(
                f"{what} is {shown(text)}, but line {self._line} writes decimals with {self._mark!r}",
                where=where,
                remedy="keep to one decimal mark in a file",
            )
        value = parse_number(text.replace(",", "."), what, where, self._far)
        if self._mark is None and mark is not None:
            self._mark, self._line = mark, line
        return value

    def length(self, text: str, what: str, line: int, scale: float = 1.0) -> float:
        """Read one number that must be positive, in units of `scale` [m]."""
        length = self._lengths.get(text)  # such as the one sigma that all lines repeat
        if length is None:
            self.number(text, what, line)
            length = parse_length(text.replace(",", "."), what, f"{self._path}:{line}")
            if len(self._lengths) < 1000:
                self._lengths[text] = length
        return scale * length if scale != 1.0 else length

    def _plain(self, texts: tuple[str, str, str]) -> tuple[float, float, float] | None:
        """Read plain numbers, the fast path for most of a table; None for numbers that need a full check."""
        joined = "".join(texts)
        if self._mark == ",":
            if "." in joined:
                return None
            texts = (texts[0].replace(",", "."), texts[1].replace(",", "."), texts[2].replace(",", "."))
            joined = "".join(texts)
        if _PLAIN(joined) is None:
            return None
        try:
            a, b, c = float(texts[0]), float(texts[1]), float(texts[2])
        except ValueError:
            return None
        farthest = self._far
        return (
            (a, b, c)
            if -farthest <= a <= farthest and -farthest <= b <= farthest and -farthest <= c <= farthest
            else None
        )
