"""Leica's GSI-8 and GSI-16: one block of words per line.

A word has a word index of two digits, four characters of information, a sign, and 8 or 16 characters of data; a ``*``
before the line announces 16. Read are the number of the point (11), codes (41 to 49, on a line of their own before the
points, or 71 to 79 on the line of the point), easting, northing and height of a target (81, 82, 83) and of a station
(84, 85, 86). The last character of the information states the unit. The description that the code template takes
apart is made of the code words, separated by blanks; without any it is the number of the point. Other words are
passed over; lines without coordinates too.
"""

import re
from pathlib import Path

from ground.tables.numbers import shown
from ground.tables.text_lines import TextLines
from ground.units import CENTI, DECI, FOOT, MILLI
from survey.formats.fields import code_of
from survey.formats.options import ReadingOptions
from survey.formats.tables.reader import PointCollector
from survey.records.survey import SurveyStream

_WORD = re.compile(r"(\d{2})(....)([+-])(.+)")
_LAST_DIGIT = {
    "0": MILLI,
    "1": MILLI * FOOT,
    "6": DECI * MILLI,
    "7": DECI * MILLI * FOOT,
    "8": CENTI * MILLI,
}
"""Length of the last digit of a coordinate by the character for its unit [m]."""

Place = tuple[float, float, float]


def open_gsi(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read the points of a file and return its stones one by one.

    Parameters
    ----------
    path : the file
    options : the code template, kinds, sigma, the head of another file

    Returns
    -------
    SurveyStream : its head also has the stations of the file

    Raises
    ------
    SurveyError
        naming file and line, if the file as a whole is wrong
    """
    path = Path(path)
    lines = TextLines(path)
    collector = PointCollector(path, options or ReadingOptions(), unique=False)
    code, points = "", 0
    for number, line in lines:
        text = line.strip()
        if not text:
            continue
        words = _words(text, number, lines)
        here = " ".join(word for word in (words.get(f"7{k}", "") for k in range(1, 10)) if word)
        if "41" in words and "11" not in words:
            code = " ".join(word for word in (words.get(f"4{k}", "") for k in range(1, 10)) if word)
            continue
        name = words.get("11", "")
        target, station = _place(words, "81", "82", "83"), _place(words, "84", "85", "86")
        if target is None and station is not None:
            collector.add_station(code_of(name) or name, station, number)
        elif target is not None:
            points += 1
            collector.add(name, here or code or name, target, number)
    collector.close()
    if not points:
        raise lines.fail(
            lines.end,
            "no point has coordinates (words 81, 82, 83)",
            "export coordinates, not only measurements",
        )
    return SurveyStream(collector.head, collector.table.records(), remarks=collector.remarks)


def _words(text: str, number: int, lines: TextLines) -> dict[str, str]:
    """Return the data of the words of a line by their index; of coordinates the number in metres as text."""
    wide = text.startswith("*")
    size = 16 if wide else 8
    values: dict[str, str] = {}
    at, text = 0, text.removeprefix("*")
    while at < len(text):
        word = text[at : at + 7 + size]
        parts = _WORD.fullmatch(word)
        if parts is None or len(parts[4].rstrip()) > size or (len(word) < 7 + size and len(parts[4]) < 1):
            raise lines.fail(
                number,
                f"{shown(word)} is not a word of GSI-{size}",
                "export GSI-8 or GSI-16 again, or the points as a table",
            )
        index, data = parts[1], parts[4].rstrip()
        if index in ("81", "82", "83", "84", "85", "86"):
            unit = _LAST_DIGIT.get(parts[2][-1])
            if unit is None or not data.isdigit():
                raise lines.fail(
                    number,
                    f"{shown(word)} is not a coordinate in metres or feet",
                    "export the coordinates again",
                )
            values[index] = repr(int(parts[3] + data) * unit)
        else:
            values[index] = data.lstrip("0") or ("0" if index == "11" else "")
        at += 7 + size
        while at < len(text) and text[at] == " ":
            at += 1
    return values


def _place(words: dict[str, str], *indices: str) -> Place | None:
    if not all(index in words for index in indices):
        return None
    x, y, z = (float(words[index]) for index in indices)
    return x, y, z
