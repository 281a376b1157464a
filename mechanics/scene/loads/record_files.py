"""Accelerograms from files: by their content, of PEER, ESM and ITACA, K-NET, SMC, MiniSEED and SAC, and tables."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array
from mechanics.scene.loads.accelerogram import Accelerogram, Direction
from mechanics.scene.loads.record_formats import UNITS, direction_of, reader_of, unit_of
from mechanics.scene.loads.tables import Table, fail_at, numbered_lines, read_table
from mechanics.scene.loads.waveforms import is_waveform, read_waveforms

_UNEVEN = 0.1  # largest deviation of the times of a table from equal steps, of a step [-]: tables round them
_TIMES = ("t", "time", "times", "zeit", "temps", "tempo", "tiempo", "s", "sec", "seconds")
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_UNIT = re.compile(
    r"\[\s*([^\]]+?)\s*\]|\(\s*([^)]+?)\s*\)|\bin\s+(\S+)|\bunits?\s*[:=]\s*(\S+)", re.IGNORECASE
)
_OTHERS = (
    *("velocity", "velocities", "vel", "v", "geschwindigkeit", "vitesse", "velocità", "velocidad"),
    *("displacement", "displacements", "disp", "dis", "d", "verschiebung", "weg", "déplacement"),
    *("spostamento", "desplazamiento"),
)
_OTHER_UNIT = r"(mm|cm|dm|m|km|in|ft)(\s*/\s*s|\s*s\^?-1)?"  # of velocities and displacements
_AGENCIES = (
    ("COSMOS", re.compile(r"\(Format v\d+\.\d+ with \d+ (text|comment) lines\)")),
    ("GeoNet (GNS)", re.compile(r"accelerogram.*\bGNS\b", re.IGNORECASE)),
    ("CSMIP (DMG)", re.compile(r"^(un)?corrected accelerogram", re.IGNORECASE)),
)  # formats of agencies by their first line
_LARGEST = 4.5 * UNITS["g"]  # above every ground acceleration ever recorded (4.1 g, Iwate-Miyagi 2008) [m/s²]
_SQUARE = 0.02  # cosine from which two components are not square to each other


def read_accelerogram(
    path: str | Path, unit: str | None = None, dt: float | None = None, axis: str = "x"
) -> Accelerogram:
    """Read one component of a record.

    Parameters
    ----------
    path : of a file whose content tells its format; otherwise a table
    unit : of UNITS, for files that state none
    dt : step of time, for files that state none [s]
    axis : "x", "y" or "z": the component that is taken of a file with several

    Raises
    ------
    SceneError : with file and line
    """
    accelerograms = read_accelerograms(path, unit, dt)
    if len(accelerograms) == 1:
        return accelerograms[0]
    alike = [accelerogram for accelerogram in accelerograms if accelerogram.direction == _AXES[axis]]
    if len(alike) != 1:
        names = ", ".join(accelerogram.name for accelerogram in accelerograms)
        raise SceneError(
            f"{len(accelerograms)} components ({names}), and {len(alike)} of them along {axis}",
            where=str(path),
            remedy="give one component per file, or name the columns x, y, z or E, N, Z",
        )
    return alike[0]


def read_accelerograms(
    path: str | Path, unit: str | None = None, dt: float | None = None
) -> tuple[Accelerogram, ...]:
    """Read all components of a file; see `read_accelerogram`."""
    records = _records(path, unit, dt)
    peak = max((float(np.abs(record.acceleration).max()) for record in records), default=0.0)
    if peak > _LARGEST:
        raise SceneError(
            f"a peak of {peak / UNITS['g']:.3g} g, more than was ever recorded",
            where=str(path),
            remedy="correct the unit (cm/s2?), or name the columns; if it is meant, write smaller values and a factor",
        )
    return records


def _records(path: str | Path, unit: str | None, dt: float | None) -> tuple[Accelerogram, ...]:
    if is_waveform(path):
        return read_waveforms(path, _size(path, unit, None))
    start = "\n".join(
        line for _, line in zip(range(100), (text for _, text in numbered_lines(path)), strict=False)
    )
    reader = reader_of(path, start)
    if reader is not None:
        return (reader(path),)
    _refuse_agency(path)
    return _of_table(path, unit, dt)


def _refuse_agency(path: str | Path) -> None:
    """Name formats of agencies that are not read."""
    try:
        with Path(path).open("rb") as file:
            head = file.readline(400).decode("ascii", "replace")
    except OSError:
        return  # the reader of tables says what is wrong
    for name, mark in _AGENCIES:
        if mark.search(head):
            raise SceneError(
                f"a record in the format of {name}, which is not read",
                where=str(path),
                remedy="export time and acceleration as CSV, e.g. with gmprocess of the USGS",
            )


def read_station(
    pattern: str | Path, unit: str | None = None, dt: float | None = None
) -> tuple[Accelerogram, ...]:
    """Read the components of one station: all files that a pattern such as ``IT.AQV.*.ASC`` matches, or one file.

    Raises
    ------
    SceneError : there is none, a direction is not known, or two components are in one direction
    """
    folder = Path(Path(pattern).anchor or ".") if Path(pattern).is_absolute() else Path()
    rest = str(Path(pattern).relative_to(folder)) if Path(pattern).is_absolute() else str(pattern)
    files = sorted(path for path in folder.glob(rest) if path.is_file())
    if not files:
        raise SceneError("no such file", where=str(pattern), remedy="name files, with * for what differs")
    accelerograms = [accelerogram for file in files for accelerogram in read_accelerograms(file, unit, dt)]
    for record in accelerograms:
        if record.direction is None:
            raise SceneError(
                f"the direction of {record.name!r} is not stated",
                where=record.source,
                remedy="give its files by x, y and z instead of station",
            )
    for k, record in enumerate(accelerograms):
        for later in accelerograms[k + 1 :]:
            if abs(float(np.dot(record.direction or (), later.direction or ()))) > _SQUARE:
                raise SceneError(
                    f"{record.name!r} and {later.name!r} are not square to each other",
                    where=later.source,
                    remedy="name the three components of one instrument",
                )
            if abs(record.dt - later.dt) > 1e-9 or len(record) != len(later):
                raise SceneError(
                    f"{len(later)} values at {later.dt:g} s, but {len(record)} at {record.dt:g} s of {record.name!r}",
                    where=later.source,
                    remedy="cut the components to the same time, or give them by x, y and z",
                )
    return tuple(accelerograms)


def _of_table(path: str | Path, unit: str | None, dt: float | None) -> tuple[Accelerogram, ...]:
    """Read a table of one to four columns: times [s] if it has any, then up to three components."""
    if unit is not None and unit_of(unit) is None:
        raise SceneError(f"unknown unit {unit!r}", where=str(path), remedy=f"give {', '.join(UNITS)}")
    table = _accelerations(path, read_table(path, "time, acceleration"))
    count = table.rows.shape[1]
    if count > 4:
        what = f"{count} columns"
        fail_at(
            path, int(table.lines[0]), what, "give time, and one to three accelerations, or name the columns"
        )
    size = _size(path, unit, table)
    timed = _has_times(table, dt)
    if timed:
        dt = _step(path, table, dt)
    elif dt is None:
        raise SceneError(
            "the table has no times",
            where=str(path),
            remedy="give 'dt', the time step in seconds, or a column of times",
        )
    values = table.rows[:, 1:] if timed else table.rows
    names = table.names[1:] if timed else table.names
    directions = _directions(names, values.shape[1])
    stem = Path(path).stem
    return tuple(
        Accelerogram(
            float(dt),
            size * values[:, k],
            stem if values.shape[1] == 1 else f"{stem} {'xyz'[k]}",
            str(path),
            direction,
        )
        for k, direction in enumerate(directions)
    )


def _accelerations(path: str | Path, table: Table) -> Table:
    """Return a table without its columns that are named as velocities or displacements, or state such a unit."""
    columns = [k for k, name in enumerate(table.names) if k == 0 or not _is_other(name)]
    if len(columns) == len(table.names):
        return table
    if len(columns) == 1 and _bare(table.names[0]) in _TIMES:
        what = f"no acceleration among {', '.join(table.names)}"
        fail_at(path, int(table.lines[0]) - 1, what, "give a column of accelerations")
    return replace(table, names=tuple(table.names[k] for k in columns), rows=table.rows[:, columns])


def _is_other(name: str) -> bool:
    """Return whether a column is named as a velocity or displacement, or states a unit of another quantity."""
    unit = _unit_in(name)
    words = _bare(name).split()
    return any(word in _OTHERS for word in words) or (
        unit is not None and re.fullmatch(_OTHER_UNIT, unit.replace("sec", "s")) is not None
    )


def _has_times(table: Table, dt: float | None) -> bool:
    """Return whether the first column is times: by its name, or because it rises in equal steps."""
    if table.names:
        return _bare(table.names[0]) in _TIMES
    count = table.rows.shape[1]
    if count in (2, 4):
        return count == 4 or dt is None or _rises(table.rows[:, 0])
    return count == 3 and _rises(table.rows[:, 0])


def _rises(column: Array) -> bool:
    steps = np.diff(column)
    return bool((steps > 0.0).all() and steps.max() < 1.5 * steps.min())


def _step(path: str | Path, table: Table, stated: float | None) -> float:
    """Return the step of the times of a table [s]."""
    unit = _unit_in(table.names[0]) if table.names else None
    time = table.rows[:, 0] * (1e-3 if unit == "ms" else 1.0)
    dt = float((time[-1] - time[0]) / (len(time) - 1))
    uneven = np.flatnonzero(~(np.abs(time - time[0] - dt * np.arange(len(time))) < _UNEVEN * dt))
    if len(uneven):
        steps = np.diff(time)
        at = int(np.abs(steps - np.median(steps)).argmax()) + 1  # where the step differs most
        what = f"time {time[at]:g} s is not at equal steps of {dt:g} s"
        fail_at(path, int(table.lines[at]), what, "resample the record")
    if stated is not None and abs(stated - dt) > 1e-3 * dt:
        raise SceneError(
            f"the times are {dt:g} s apart, but dt = {stated:g} s", where=str(path), remedy="leave dt out"
        )
    return dt


def _bare(name: str) -> str:
    return re.split(r"[\[(,_]|\bin\b", name.strip().casefold())[0].strip()


def _unit_in(text: str) -> str | None:
    match = _UNIT.search(text)
    return None if match is None else next(group for group in match.groups() if group).casefold()


def _size(path: str | Path, unit: str | None, table: Table | None) -> float:
    """Return the size of the unit [m/s²]: the one that the table states, else the given one."""
    stated = {}
    for text in (*table.names, *table.notes) if table is not None else ():
        word = _unit_in(text)
        size = None if word is None else unit_of(word.rstrip(".;,"))
        if size is not None:
            stated[size] = word
    if len(stated) > 1:
        raise SceneError(
            f"two units: {', '.join(map(str, stated.values()))}", where=str(path), remedy="keep one"
        )
    scale = None if unit is None else unit_of(unit)
    if unit is not None and scale is None:
        raise SceneError(f"unknown unit {unit!r}", where=str(path), remedy=f"give {', '.join(UNITS)}")
    for size, word in stated.items():
        if scale is not None and scale != size:
            raise SceneError(
                f"the file states {word!r}, but unit = {unit!r}",
                where=str(path),
                remedy="leave 'unit' out, or correct it",
            )
        return size
    if scale is None:
        raise SceneError(
            "the unit of the acceleration is not known", where=str(path), remedy=f"give {', '.join(UNITS)}"
        )
    return scale


def _directions(names: Sequence[str], count: int) -> list[Direction | None]:
    """Return the direction of each column by its name; of several without known names x, y and z in order."""
    named: list[Direction | None] = []
    for name in names:
        word = re.sub(r"^(acc\w*|a)[\s_.-]*", "", _bare(re.sub("_", " ", name))) or _bare(name)
        named.append(_AXES.get(word) or direction_of(word.split()[-1] if word.split() else ""))
    if count == 1:
        return named or [None]
    if named and all(one is not None for one in named):
        return named
    return [_AXES[axis] for axis in "xyz"[:count]]
