"""LMGC90: rigid bodies of BODIES.DAT, turned as DOF.INI beside it says, and held as DRV_DOF.DAT beside it says.

Polyhedra (POLYR) stay as they are, planes (PLANx), which have a thickness, are boxes. A body is numbered by its place
in the file, as LMGC90 does, whatever number the file states.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from ground.errors import SurveyError
from ground.tables.text_lines import TextLines
from survey.arrays import Array
from survey.formats.solids.bodies import RawBody, check_coordinates

_FIELD = re.compile(r"(\w+(?:\(\d\))?)\s*=\s*([-+]?\d*\.?\d+(?:[EeDd][-+]?\d+)?)")
_ALL = {*"123456"}  # components of the velocity of a rigid body
_DIGITS = float(
    np.finfo(np.float32).eps
)  # LMGC90 writes eight digits: a little more than single precision [-]
_REMEDY = "export the body as polyhedra (POLYR), or leave it out with --keep-going"
_SHAPES = ("PLANx", "POLYR")
_AXES = [f"{axis}{at}" for axis in ("alp", "bet", "gam") for at in "123"]


@dataclass
class _Body:
    """A rigid body: place and principal moments of inertia, and its contactors by the line on which each begins."""

    number: int
    line: int
    kind: str
    place: dict[str, float] = field(default_factory=dict)
    inertia: dict[str, float] = field(default_factory=dict)
    contactors: list["_Contactor"] = field(default_factory=list)
    end: int = 0


@dataclass
class _Contactor:
    """Shape of a body, or of a part of it: corners and triangles, and all other numbers by their names."""

    kind: str
    line: int
    points: list[tuple[float, float, float]] = field(default_factory=list)
    triangles: list[tuple[int, int, int]] = field(default_factory=list)
    values: dict[str, float] = field(default_factory=dict)


def lmgc90_bodies(path: Path) -> Iterator[RawBody]:
    """Iterate over the bodies of BODIES.DAT; the polyhedra of a cluster are separate bodies.

    Raises
    ------
    SurveyError
        if the file is none, or a number cannot be read
    """
    frames, held = _frames(path.with_name("DOF.INI")), _held(path.with_name("DRV_DOF.DAT"))
    for body in _bodies(path):
        name = str(body.number)
        kind = "support" if body.number in held else None
        if body.kind != "RBDY3":
            yield _refused(path, body, f"it is {body.kind}, not a rigid body in space (RBDY3)", _REMEDY)
            continue
        frame = frames.get(body.number)
        if any(body.inertia.values()) and frame is None:
            remedy = f"put DOF.INI into the same folder, with body {body.number}"
            yield _refused(path, body, "its corners are in its axes of inertia, which DOF.INI has", remedy)
            continue
        strange = sorted({each.kind for each in body.contactors} - {*_SHAPES})
        if strange or not body.contactors:
            what = f"its shape is {' and '.join(strange)}, not POLYR" if strange else "it has no contactor"
            yield _refused(path, body, what, _REMEDY)
            continue
        for at, each in enumerate(body.contactors, 1):
            label = name if len(body.contactors) == 1 else f"{name}-{at}"
            where = f"{path}:{each.line}"
            corners, faces = (_box if each.kind == "PLANx" else _polyhedron)(each, where)
            points = _placed(corners, body, frame)
            check_coordinates(points, "corner", where)
            resolution = _DIGITS * float(np.abs(corners).max(initial=0.0))
            yield RawBody(label, points, faces, body.line, body.end, resolution, kind=kind)


def _refused(path: Path, body: _Body, what: str, remedy: str) -> RawBody:
    error = SurveyError(what, where=f"{path}:{body.line}", remedy=remedy)
    name = f"{body.number}" if body.kind == "RBDY3" else f"{body.kind}-{body.line}"
    return RawBody(name, np.zeros((0, 3)), (), body.line, body.end, error=error)


def _polyhedron(contactor: _Contactor, where: str) -> tuple[Array, Sequence[tuple[int, ...]]]:
    """Return the corners (nv, 3) and the triangles of a polyhedron."""
    corners, triangles, values = contactor.points, contactor.triangles, contactor.values
    count = int(values.get("nb_vertex", len(corners)))
    faces = int(values.get("nb_faces", values.get("nb_face", len(triangles))))
    if count != len(corners) or faces != len(triangles):
        what = f"{len(corners)} of {count} corners and {len(triangles)} of {faces} faces"
        raise SurveyError(what, where=where, remedy="the file is cut short, or was changed by hand")
    if not all(0 <= at < count for each in triangles for at in each):
        raise SurveyError(f"a face has a corner beyond {count}", where=where, remedy="export the file again")
    return np.array(corners).reshape(-1, 3), triangles


def _box(contactor: _Contactor, where: str) -> tuple[Array, Sequence[tuple[int, ...]]]:
    """Return the corners (8, 3) and faces of a plane: a box of twice its axes, in a frame within that of its body."""
    half = np.array(list(contactor.values.values())[:3])  # whatever their names
    if len(half) < 3 or not (half > 0).all():
        raise SurveyError("a plane without three half axes", where=where, remedy="export the file again")
    corners = np.array(list(product((-1.0, 1.0), repeat=3))) * half
    axes = np.eye(3)
    if all(name in contactor.values for name in _AXES):
        axes = np.array([contactor.values[name] for name in _AXES]).reshape(3, 3)
    shift = np.array(contactor.points[0]) if contactor.points else np.zeros(3)
    # triangles, which the reader of solids turns outwards and unites
    return corners @ axes + shift, [tuple(face) for face in ConvexHull(corners).simplices.tolist()]


def _placed(corners: Array, body: _Body, frame: Array | None) -> Array:
    """Return corners (n, 3), which are about the centre of the body in its axes, in the frame of the file."""
    centre = np.array([body.place.get(f"coo{axis}", 0.0) for axis in (1, 2, 3)])
    placed: Array = corners + centre if frame is None else corners @ frame[:3] + centre + frame[3]
    return placed


def _bodies(path: Path) -> Iterator[_Body]:
    """Read the bodies, line by line."""
    lines = TextLines(path)
    body: _Body | None = None
    section, count = "", 0
    for number, line in lines:
        text = line.strip()
        if text.startswith("$"):
            if body is not None and text.startswith(("$bdyty", "$$$$$$")):
                body.end = number
                yield body
                body = None
            section = text.split()[0]
        elif section == "$bdyty" and text and not text.startswith("!"):
            words = text.split()
            if len(words) < 2 or not words[1].isdigit():
                raise lines.fail(number, "a body without a number", "write e.g. RBDY3      1")
            count += words[0] == "RBDY3"
            body, section = _Body(count, number, words[0]), ""
        elif body is not None:
            _take(body, section, text, lines, number)
    if body is not None:
        raise lines.fail(lines.end, f"body {body.number} has no end", "the file is cut short: copy it again")


def _take(body: _Body, section: str, text: str, lines: TextLines, number: int) -> None:
    """Read a line of a body."""
    values = _fields(text)
    if section == "$blmty":
        body.inertia |= {name: value for name, value in values.items() if name in ("I1", "I2", "I3")}
    elif section == "$nodty":
        body.place |= values
    elif section == "$tacty" and text:
        words = text.split()
        if len(words) > 1 and "=" not in words[0] and words[1].isdigit():
            body.contactors.append(_Contactor(words[0], number, values=values))
        elif text.startswith("coo") and body.contactors:
            body.contactors[-1].points.append(_three(list(values.values()), lines, number))
        elif text.startswith("ver") and body.contactors:
            corners = _three(list(values.values()), lines, number)
            body.contactors[-1].triangles.append(
                (int(corners[0]) - 1, int(corners[1]) - 1, int(corners[2]) - 1)
            )
        elif body.contactors:
            body.contactors[-1].values |= values


def _three(values: list[float], lines: TextLines, number: int) -> tuple[float, float, float]:
    if len(values) != 3:
        raise lines.fail(number, f"{len(values)} numbers in place of three", "the file was changed by hand")
    return values[0], values[1], values[2]


def _fields(text: str) -> dict[str, float]:
    """Return the numbers of a line by their names; D marks the exponent of a double in Fortran.

    >>> _fields("coo1= 0.4800000D+01  coo2=-1.5E-01")
    {'coo1': 4.8, 'coo2': -0.15}
    """
    return {name: _double(value) for name, value in _FIELD.findall(text)}


def _double(text: str) -> float:
    return float(text.replace("D", "E").replace("d", "e"))


def _records(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Iterate over the rigid bodies of a file beside BODIES.DAT: number, and lines."""
    number, rows, begins = 0, list[str](), False
    for _, line in TextLines(path) if path.is_file() else ():
        words = line.split()
        if line.startswith("!"):
            continue
        if begins and words:
            number, begins = int(words[1]) if len(words) > 1 and words[1].isdigit() else 0, False
        elif words[:1] == ["$bdyty"]:
            begins, rows = True, []
        elif words[:1] == ["$$$$$$"]:
            yield number, rows
            rows = []
        else:
            rows.append(line)


def _frames(path: Path) -> dict[int, Array]:
    """Return by body its axes as rows, and its displacement, (4, 3)."""
    found = {}
    for number, rows in _records(path):
        values = _fields(" ".join(rows))
        names = [f"{row}({axis})" for row in "abgX" for axis in (1, 2, 3)]
        if all(name in values for name in names):
            found[number] = np.array([values[name] for name in names]).reshape(4, 3)
    return found


def _held(path: Path) -> set[int]:
    """Return the bodies of which every degree of freedom is driven with velocity zero."""
    found = set()
    for number, rows in _records(path):
        still = set()
        for words in (row.split() for row in rows):
            if words[:1] == ["vlocy"] and len(words) > 2 and not _double(words[2]):
                still.add(words[1])
        if still >= _ALL:
            found.add(number)
    return found
