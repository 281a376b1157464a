"""Surveys as a table: one measured point per line, as spreadsheets and point exports give them.

The first line names the columns, in any order: ``block,kind,course,role,x,y,z`` and, if wanted, ``sigma`` and
``depth``. ``role`` is ``vertex`` for a corner of the face, in order around it, or ``point`` for any other
point on it. Lengths are metres with a decimal point; empty fields mean "not known". Lines of one block may
lie anywhere.
"""

import csv
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from moma.errors import SurveyError
from survey.formats.fields import CODE, KIND, parse_length, parse_number, read_lines
from survey.records import BlockRecord, Survey, SurveyHead

__all__ = ["read_csv"]

_NEEDED = ("block", "kind", "course", "role", "x", "y", "z")
_OPTIONAL = ("sigma", "depth")
_ROLES = ("vertex", "point")


@dataclass
class _Block:
    """The lines of one block that have been read."""

    code: str
    kind: str
    course: int | None
    line: int
    places: dict[str, list[list[float]]] = field(default_factory=lambda: {role: [] for role in _ROLES})
    sigmas: list[float] = field(default_factory=list)
    depth: float | None = None


def read_csv(path: Path, default_sigma: float = 0.003) -> Survey:
    """Read a table of points.

    Parameters
    ----------
    path : the file, UTF-8
    default_sigma : standard deviation of a coordinate where no line of a block gives one [m]

    Returns
    -------
    Survey without observer and depth rules: corners run counter-clockwise seen from outside. A block's
    sigma is the root mean square of those of its points.

    Raises
    ------
    SurveyError
        naming file and line, when any line is wrong
    """
    path = Path(path)
    lines = read_lines(path)
    columns = _columns(_split(lines[0], f"{path}:1"), f"{path}:1")
    blocks: dict[str, _Block] = {}
    for number, line in enumerate(lines[1:], start=2):
        if line.strip():
            where = f"{path}:{number}"
            values = _split(line, where)
            if len(values) != len(columns):
                raise SurveyError(
                    f"{len(values)} fields for {len(columns)} columns",
                    where=where,
                    remedy="fill every column",
                )
            _take(blocks, dict(zip(columns, values, strict=True)), number, where)
    if not blocks:
        raise SurveyError(
            "the table has no points", where=f"{path}:{len(lines)}", remedy="add one line per point"
        )
    records = tuple(_record(block, default_sigma, str(path)) for block in blocks.values())
    return Survey(SurveyHead(path.stem, str(path)), records)


def _split(line: str, where: str) -> list[str]:
    try:
        rows = list(csv.reader([line], strict=True))
    except csv.Error as error:
        raise SurveyError(
            f"not a table line: {error}", where=where, remedy="check quotes and commas"
        ) from error
    return [value.strip() for value in rows[0]] if rows else []


def _columns(names: list[str], where: str) -> list[str]:
    expected = f"{','.join(_NEEDED)}[,sigma][,depth]"
    missing = [name for name in _NEEDED if name not in names]
    if missing:
        raise SurveyError(f"no column {missing[0]!r}", where=where, remedy=f"begin with: {expected}")
    for name in names:
        if name not in _NEEDED + _OPTIONAL or names.count(name) > 1:
            raise SurveyError(
                f"unknown or repeated column {name[:40]!r}", where=where, remedy=f"use: {expected}"
            )
    return names


def _take(blocks: dict[str, _Block], row: dict[str, str], line: int, where: str) -> None:
    """Add one line to its block."""
    for name, pattern in (("block", CODE), ("kind", KIND)):
        if pattern.fullmatch(row[name]) is None:
            raise SurveyError(
                f"{name} {row[name][:40]!r} is not a {name} name",
                where=where,
                remedy="write e.g. W01-01, header",
            )
    course = _course(row["course"], where)
    block = blocks.setdefault(row["block"], _Block(row["block"], row["kind"], course, line))
    if (block.kind, block.course) != (row["kind"], course):
        raise SurveyError(
            f"kind or course of block {block.code} differs from line {block.line}",
            where=where,
            remedy="give every line of a block the same kind and course",
        )
    if row["role"] not in _ROLES:
        raise SurveyError(f"role {row['role'][:40]!r}", where=where, remedy="write vertex or point")
    block.places[row["role"]].append([parse_number(row[axis], axis, where) for axis in "xyz"])
    if row.get("sigma"):
        block.sigmas.append(parse_length(row["sigma"], "sigma", where))
    if row.get("depth"):
        depth = parse_length(row["depth"], "depth", where)
        if block.depth not in (None, depth):
            raise SurveyError(
                f"depth {depth:g} m, but {block.depth:g} m before",
                where=where,
                remedy="give a block one depth",
            )
        block.depth = depth


def _course(text: str, where: str) -> int | None:
    if not text:
        return None
    if not (text.isascii() and text.isdigit() and len(text) <= 6):
        raise SurveyError(f"course {text[:40]!r}", where=where, remedy="write a whole number, or nothing")
    return int(text)


def _record(block: _Block, default_sigma: float, path: str) -> BlockRecord:
    vertices = block.places["vertex"]
    if len(vertices) < 3:
        raise SurveyError(
            f"block {block.code} has {len(vertices)} vertices",
            where=f"{path}:{block.line}",
            remedy="a face needs 3 lines of role vertex or more",
        )
    squares = [sigma**2 for sigma in block.sigmas]
    return BlockRecord(
        code=block.code,
        kind=block.kind,
        course=block.course,
        vertices=np.array(vertices),
        points=np.array(block.places["point"]).reshape(-1, 3),
        sigma=math.sqrt(sum(squares) / len(squares)) if squares else default_sigma,
        depth=block.depth,
        depth_source=None if block.depth is None else "column depth of the table",
        line=block.line,
    )
