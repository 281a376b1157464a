"""Formats of accelerograms that are text with a header: PEER's AT2, ESM and ITACA, K-NET and KiK-net, USGS SMC.

Each states the time step and the unit; units of the header are used. The direction of the component is read where the
header has it: east, north and up are x, y and z.
"""

import math
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ground.errors import SceneError
from mechanics.scene.loads.accelerogram import Accelerogram, Direction
from mechanics.scene.loads.tables import fail_at, number_at, numbered_lines

UNITS = {"g": 9.80665, "m/s2": 1.0, "cm/s2": 0.01, "gal": 0.01, "mm/s2": 1e-3, "%g": 0.0980665}
"""Sizes of the units of acceleration [m/s²]; each may be spelt as `unit_of` reads it."""

_MORE = {"gals": 0.01, "mgal": 1e-5, "um/s2": 1e-6, "nm/s2": 1e-9, "in/s2": 0.0254, "ft/s2": 0.3048}
_MARKS = str.maketrans(
    {"μ": "u", "−": "-", "\u2044": "/", "\u2215": "/"} | dict.fromkeys(" \t\u2009^*·⋅()[]")
)
_PER_SECOND = re.compile(r"(?P<length>[a-z]+?)(?:/s/s|/s2|/?s-2|/s-2)")

_NUMBER = r"([0-9]*\.?[0-9]+(?:[Ee][+-]?[0-9]+)?|[0-9]+\.)"
# both generations of the database: "NPTS=  7817, DT=   .0050 SEC" and "7817    .0050    NPTS, DT"
_STEPS = (
    re.compile(rf"NPTS\s*=\s*([0-9]+)\s*,?\s*DT\s*=\s*{_NUMBER}", re.IGNORECASE),
    re.compile(rf"^\s*([0-9]+)\s*,?\s+{_NUMBER}\s*,?\s*NPTS\s*,?\s*DT", re.IGNORECASE),
)
_HEADER = 4
_SMC = re.compile(
    r"\s*([1-9])\s+(UNCORRECTED|CORRECTED)?\s*(ACCELEROGRAM|ACCELERATION|VELOCITY|DISPLACEMENT)", re.I
)
_SMC_TEXT, _SMC_INTEGERS, _SMC_REALS = 11, 48, 50  # lines of text, numbers after them
_ESM_KEY = re.compile(r"([A-Z][A-Z0-9_/^]*)\s*:\s*(.*)")
_EAST, _NORTH, _UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_NAMED = {
    **dict.fromkeys(("E", "EW", "E-W", "WE", "W-E", "EAST"), _EAST),
    **dict.fromkeys(("N", "NS", "N-S", "SN", "NORTH"), _NORTH),
    **dict.fromkeys(("Z", "UP", "UD", "U-D", "V", "VER", "VERT", "VERTICAL"), _UP),
    **dict.fromkeys(("DOWN", "DN", "DWN"), (0.0, 0.0, -1.0)),
    "1": _NORTH,
    "2": _EAST,
    "3": _UP,
    "4": _NORTH,
    "5": _EAST,
    "6": _UP,  # of KiK-net
}

Lines = Sequence[tuple[int, str]]


def unit_of(text: str) -> float | None:
    """Return the size of a unit of acceleration, however it is spelt [m/s²]; None if it is not known.

    >>> [unit_of(one) for one in ("m/s²", "m s⁻²", "cm/s^2", "MM/SEC**2", "Gal", "furlong")]
    [1.0, 1.0, 0.01, 0.001, 0.01, None]
    """
    bare = unicodedata.normalize("NFKC", text).casefold().translate(_MARKS).replace("sec", "s")
    match = _PER_SECOND.fullmatch(bare)
    return {**UNITS, **_MORE}.get(bare if match is None else f"{match['length']}/s2")


def direction_of(text: str) -> Direction | None:
    """Return the direction (east, north, up) that a name or an azimuth states; None if it is neither."""
    word = text.strip().upper()
    if word in _NAMED and not word.isdigit():
        return _NAMED[word]
    if re.fullmatch(r"\d{1,3}(\.\d+)?", word) and float(word) <= 360.0:
        turn = math.radians(float(word))
        return (round(math.sin(turn), 12), round(math.cos(turn), 12), 0.0)
    return None


def reader_of(path: str | Path, start: str) -> Callable[[str | Path], Accelerogram] | None:
    """Return the reader of a text file by its ending and first lines; None for a table.

    Parameters
    ----------
    path : of the file
    start : its first lines
    """
    lines = start.splitlines()
    if Path(path).suffix.lower() == ".at2" or any(
        step.search(line) for step in _STEPS for line in lines[3:4]
    ):
        return read_at2
    if lines and lines[0].startswith("Origin Time"):
        return read_knet
    if any(line.startswith("SAMPLING_INTERVAL") for line in lines):
        return read_esm
    if lines and _SMC.match(lines[0]):
        return read_smc
    return None


def read_at2(path: str | Path) -> Accelerogram:
    """Read PEER's AT2: three lines of text, a line with NPTS and DT, then NPTS accelerations in units of g.

    Raises
    ------
    SceneError : with file and line
    """
    lines = list(numbered_lines(path))
    count, dt = _steps(path, lines)
    values: list[float] = []
    for number, line in lines[_HEADER:]:
        for text in line.split():
            if len(values) == count:
                fail_at(
                    path, number, f"more values than NPTS = {count}", "correct NPTS, or take the rest away"
                )
            values.append(number_at(path, number, text))
    if len(values) < count:
        what = f"{len(values)} values, but NPTS = {count}"
        fail_at(path, lines[-1][0], what, "the file is cut off: get it again, or correct NPTS")
    name = lines[1][1].strip()
    direction = direction_of(name.rpartition(",")[2])
    return Accelerogram(dt, UNITS["g"] * np.array(values), name or Path(path).stem, str(path), direction)


def _steps(path: str | Path, lines: Lines) -> tuple[int, float]:
    """Return NPTS and DT from the four lines of the header, whose third must give the unit g."""
    header = [line for _, line in lines[:_HEADER]]
    if len(header) < _HEADER:
        fail_at(path, len(header) or 1, "less than four lines", "give a file of PEER's AT2 format")
    if not re.search(r"ACCELERATION.*\bG\b", header[2], re.IGNORECASE):
        fail_at(path, 3, f"not an acceleration in units of g: {header[2].strip()!r}", "give the .AT2 file")
    for pattern in _STEPS:
        match = pattern.search(header[3])
        if match and int(match[1]) > 1 and float(match[2]) > 0:
            return int(match[1]), float(match[2])
    raise SceneError(
        f"no number of samples and step of time: {header[3].strip()!r}",
        where=f"{path}:4",
        remedy="write for example: NPTS=  4000, DT=   .0050 SEC",
    )


def read_esm(path: str | Path) -> Accelerogram:
    """Read a record of ESM or ITACA: lines of KEY: VALUE, then one acceleration per line.

    Raises
    ------
    SceneError : with file and line
    """
    keys: dict[str, tuple[int, str]] = {}
    values: list[float] = []
    last = 1
    for number, line in numbered_lines(path):
        text = line.strip()
        if not text:
            continue
        last = number
        match = _ESM_KEY.match(text) if not values else None
        if match:
            keys.setdefault(match[1], (number, match[2].strip()))
        elif values or text[0] in "+-.0123456789":
            values += [number_at(path, number, word) for word in text.split()]
    kind = keys.get("DATA_TYPE", (1, "ACCELERATION"))
    if "ACC" not in kind[1].upper():
        fail_at(path, kind[0], f"the data are {kind[1]!r}", "give the file of the acceleration (ACC)")
    unit = keys.get("UNITS", (1, "cm/s^2"))
    size = unit_of(unit[1])
    if size is None:
        fail_at(path, unit[0], f"unknown unit {unit[1]!r}", "give an acceleration in cm/s^2, m/s^2 or g")
    step = keys["SAMPLING_INTERVAL_S"] if "SAMPLING_INTERVAL_S" in keys else keys["SAMPLING_INTERVAL"]
    dt = number_at(path, step[0], step[1])
    if "NDATA" in keys:
        line_, text = keys["NDATA"]
        if number_at(path, line_, text) != len(values):
            what = f"{len(values)} values, but NDATA is {text}"
            fail_at(path, last, what, "the file is cut off: get it again, or correct NDATA")
    stream = keys.get("STREAM", keys.get("COMPONENT", (0, "")))[1].upper()
    direction = direction_of(stream) or (direction_of(stream[-1:]) if stream[-1:].isalpha() else None)
    station = " ".join(keys[key][1] for key in ("NETWORK", "STATION_CODE", "EVENT_ID") if key in keys)
    name = f"{station} {stream}".strip() or Path(path).stem
    return Accelerogram(dt, size * np.array(values), name, str(path), direction)


def read_knet(path: str | Path) -> Accelerogram:
    """Read a record of K-NET or KiK-net: 17 lines of header, counts; the mean is taken out, as the networks advise.

    Raises
    ------
    SceneError : with file and line
    """
    header: dict[str, tuple[int, str]] = {}
    values: list[float] = []
    begun = False
    for number, line in numbered_lines(path):
        if not begun:
            key = line[:18].strip().rstrip(".").split("(")[0].strip()
            header[key] = (number, line[18:].strip())
            begun = line.startswith("Memo")
        else:
            values += [number_at(path, number, word) for word in line.split()]
    (rate,) = _header_numbers(path, header, "Sampling Freq", r"([0-9.]+)")
    gals, steps = _header_numbers(path, header, "Scale Factor", r"([0-9.]+)\s*\(gal\)\s*/\s*([0-9.]+)")
    counts = np.array(values)
    if len(counts) < 2:
        fail_at(path, 1, f"{len(counts)} values", "the file is cut off: get it again")
    acceleration = 0.01 * gals / steps * (counts - counts.mean())
    word = header.get("Dir", (0, ""))[1]
    direction = _NAMED.get(word.upper())
    name = f"{header.get('Station Code', (0, ''))[1]} {word}".strip() or Path(path).stem
    return Accelerogram(1.0 / rate, acceleration, name, str(path), direction)


def _header_numbers(
    path: str | Path, header: Mapping[str, tuple[int, str]], key: str, pattern: str
) -> tuple[float, ...]:
    """Return the numbers of one line of a header."""
    line, text = header.get(key, (1, ""))
    match = re.match(pattern, text, re.IGNORECASE)
    if match is None:
        fail_at(path, line, f"no {key} in the header", "give the file of K-NET as it is")
    numbers = tuple(number_at(path, line, group) for group in match.groups())
    if not all(number > 0.0 for number in numbers):
        fail_at(path, line, f"{key} is {text!r}", "give the file of K-NET as it is")
    return numbers


def read_smc(path: str | Path) -> Accelerogram:
    """Read a record of USGS's SMC: 11 lines of text, 48 integers, 50 reals, comments, values of ten characters [cm/s²].

    Raises
    ------
    SceneError : with file and line
    """
    lines = list(numbered_lines(path))
    kind = _SMC.match(lines[0][1])
    if kind is None or kind[3].upper() in ("VELOCITY", "DISPLACEMENT"):
        fail_at(path, 1, f"{lines[0][1].strip()!r} is not an acceleration", "give the accelerogram")
    at = _SMC_TEXT
    integers, at = _fixed(path, lines, at, _SMC_INTEGERS, 10, 8)
    reals, at = _fixed(path, lines, at, _SMC_REALS, 15, 5)
    comments, count, rate = int(integers[15]), int(integers[16]), reals[1]
    if not (rate > 0.0 and rate < 1e5 and count > 1 and 0 <= comments < len(lines)):
        what = f"{count} values at {rate:g} per second, {comments} comments"
        fail_at(path, at, what, "the header is damaged: get the file again")
    values, _ = _fixed(path, lines, at + comments, count, 10, 8)
    inclination, azimuth = integers[12], integers[13]
    direction: Direction | None = None
    if inclination in (0, 180):
        direction = (0.0, 0.0, 1.0 if inclination == 0 else -1.0)
    elif inclination == 90 and 0 <= azimuth <= 360:
        direction = direction_of(f"{azimuth:g}")
    name = " ".join(lines[5][1].split()) or Path(path).stem
    return Accelerogram(1.0 / rate, 0.01 * np.array(values), name, str(path), direction)


def _fixed(
    path: str | Path, lines: Lines, at: int, count: int, width: int, across: int
) -> tuple[list[float], int]:
    """Read numbers of fixed width, so many in a line; return them and the place of the next line."""
    values: list[float] = []
    while len(values) < count:
        if at >= len(lines):
            fail_at(
                path, len(lines), f"{len(values)} numbers, not {count}", "the file is cut off: get it again"
            )
        number, line = lines[at]
        cells = [line[width * k : width * (k + 1)].strip() for k in range(min(across, count - len(values)))]
        values += [number_at(path, number, cell) for cell in cells]
        at += 1
    return values, at
