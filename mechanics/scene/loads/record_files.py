"""Accelerograms from files: two columns of text, and the format of the PEER ground motion database."""

import re
from pathlib import Path

import numpy as np

from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.tables import fail_at, number_at, numbered_lines, read_columns
from moma.errors import SceneError

__all__ = ["UNITS", "read_accelerogram", "read_at2", "read_csv"]

UNITS = {"g": 9.80665, "m/s2": 1.0, "cm/s2": 0.01}

_UNEVEN = 0.1  # largest deviation of the times of a table from equal steps, of a step [-]: tables round them

_NUMBER = r"([0-9]*\.?[0-9]+(?:[Ee][+-]?[0-9]+)?|[0-9]+\.)"
# both generations of the database: "NPTS=  7817, DT=   .0050 SEC" and "7817    .0050    NPTS, DT"
_STEPS = (
    re.compile(rf"NPTS\s*=\s*([0-9]+)\s*,?\s*DT\s*=\s*{_NUMBER}", re.IGNORECASE),
    re.compile(rf"^\s*([0-9]+)\s*,?\s+{_NUMBER}\s*,?\s*NPTS\s*,?\s*DT", re.IGNORECASE),
)
_HEADER = 4


def read_accelerogram(path: str | Path, unit: str | None = None) -> Accelerogram:
    """Read a record: PEER's format if the name ends in .at2; otherwise a table, with its `unit` of UNITS.

    Raises
    ------
    SceneError : with file and line
    """
    if Path(path).suffix.lower() == ".at2":
        return read_at2(path)
    if unit is None:
        raise SceneError(
            "the unit of the acceleration is not known", where=str(path), remedy=f"give {', '.join(UNITS)}"
        )
    return read_csv(path, unit)


def read_csv(path: str | Path, unit: str) -> Accelerogram:
    """Read a table of times [s], at equal steps, and accelerations in `unit`; see `read_columns` for the format.

    Raises
    ------
    SceneError : with file and line
    """
    if unit not in UNITS:
        raise SceneError(f"unknown unit {unit!r}", where=str(path), remedy=f"give {', '.join(UNITS)}")
    lines, rows = read_columns(path, "time, acceleration")
    time, acceleration = rows.T
    dt = (time[-1] - time[0]) / (len(time) - 1)
    uneven = np.flatnonzero(~(np.abs(time - time[0] - dt * np.arange(len(time))) < _UNEVEN * dt))
    if len(uneven):
        at = int(uneven[0])
        fail_at(
            path,
            int(lines[at]),
            f"time {time[at]:g} s is not at equal steps of {dt:g} s",
            "resample the record",
        )
    return Accelerogram(float(dt), UNITS[unit] * acceleration, Path(path).stem, str(path))


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
    return Accelerogram(dt, UNITS["g"] * np.array(values), name or Path(path).stem, str(path))


def _steps(path: str | Path, lines: list[tuple[int, str]]) -> tuple[int, float]:
    """Return NPTS and DT from the four lines of the header, whose third must give the unit g."""
    header = [line for _, line in lines[:_HEADER]]
    if len(header) < _HEADER:
        fail_at(path, len(header) or 1, "less than four lines", "give a file of PEER's AT2 format")
    if not re.search(r"ACCELERATION.*\bG\b", header[2], re.IGNORECASE):
        fail_at(path, 3, f"not an acceleration in units of g: {header[2].strip()!r}", "give the .AT2 file")
    for pattern in _STEPS:
        found = pattern.search(header[3])
        if found and int(found[1]) > 1 and float(found[2]) > 0:
            return int(found[1]), float(found[2])
    raise SceneError(
        f"no number of samples and step of time: {header[3].strip()!r}",
        where=f"{path}:4",
        remedy="write for example: NPTS=  4000, DT=   .0050 SEC",
    )
