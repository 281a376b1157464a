"""Wavefront OBJ: the polygons of each object, line by line."""

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, shown
from ground.tables.text_lines import TextLines
from survey.formats.solids.bodies import RawBody, compact

_CORNER = re.compile(r"(-?[0-9]{1,9})(?:/-?[0-9]*){0,2}").fullmatch
_PASSED_OVER = {
    *("vt", "vn", "vp", "s", "usemtl", "mtllib", "l", "p", "mg", "bevel", "c_interp", "d_interp", "lod"),
    *("maplib", "usemap", "shadow_obj", "trace_obj"),
}
_NOWHERE = float("nan")


@dataclass
class _Object:
    name: str
    line: int
    polygons: list[tuple[int, ...]] = field(default_factory=list)
    error: SurveyError | None = None


def obj_bodies(path: Path) -> Iterator[RawBody]:
    """Iterate over the objects of a file; where it has none, over its groups.

    Raises
    ------
    SurveyError
        if the file is not text
    """
    lines = TextLines(path)
    reader = _ObjReader(str(path))
    current, objects = _Object(path.stem, 1), False
    for number, line in _joined(lines):
        word, *others = line.split(None, 1)
        rest = others[0] if others else ""
        if word in ("o", "g"):
            if word == "g" and objects:
                continue
            objects = word == "o"
            if current.polygons or current.error is not None:
                yield reader.body(current, number)
            current = _Object(rest.strip() or path.stem, number)
        elif not word.startswith("#"):
            try:
                reader.take(word, rest.split("#", 1)[0].split(), current, number)
            except SurveyError as error:
                current.error = current.error or error
    if current.polygons or current.error is not None:
        yield reader.body(current, lines.end + 1)


def _joined(lines: TextLines) -> Iterator[tuple[int, str]]:
    """Iterate over the lines that are not empty; a backslash at the end of one joins the next."""
    first, whole = 0, ""
    for number, line in lines:
        text = line.rstrip()
        first = first or number
        if text.endswith("\\") and not text.lstrip().startswith("#"):
            whole += text[:-1] + " "
            continue
        if (whole := whole + text).strip():
            yield first, whole
        first, whole = 0, ""
    if whole.strip():
        yield first, whole


class _ObjReader:
    """Reader of vertices and faces; objects may share vertices."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._places = array("d")
        self._wrong: dict[int, SurveyError] = {}  # vertices that cannot be read

    def take(self, word: str, words: list[str], current: _Object, number: int) -> None:
        """Read a line of a vertex or face."""
        where = f"{self._path}:{number}"
        if word == "v":
            self._take_vertex(words, where)
        elif word == "f":
            current.polygons.append(self._polygon(words, where))
        elif word not in _PASSED_OVER:
            raise SurveyError(
                f"unknown word {shown(word)}", where=where, remedy="write o, g, v and f lines of polygons"
            )

    def _take_vertex(self, words: list[str], where: str) -> None:
        try:
            if len(words) not in (3, 4, 6, 7):  # with a weight, with colours
                raise SurveyError(f"a vertex of {len(words)} numbers", where=where, remedy="write: v X Y Z")
            numbers = [parse_number(word, "coordinate", where) for word in words[:3]]
            if len(words) in (4, 7) and parse_number(words[3], "weight", where) != 1.0:
                raise SurveyError(f"weight {words[3]}", where=where, remedy="write: v X Y Z")
            self._places.extend(numbers)
        except SurveyError as error:
            self._wrong[len(self._places) // 3] = error
            self._places.extend((_NOWHERE, _NOWHERE, _NOWHERE))

    def _polygon(self, words: list[str], where: str) -> tuple[int, ...]:
        count, corners = len(self._places) // 3, []
        for word in words:
            match = _CORNER(word)
            index = 0 if match is None else int(match[1])
            index = index - 1 if index > 0 else count + index if index < 0 else -1
            if not 0 <= index < count:
                raise SurveyError(
                    f"corner {shown(word)} of a face, after {count} vertices",
                    where=where,
                    remedy="count vertices from 1 through the whole file",
                )
            corners.append(index)
        if len(corners) < 2:  # one of two bounds nothing
            raise SurveyError(f"a face of {len(corners)} corners", where=where, remedy="write: f 1 2 3 …")
        return tuple(corners)

    def body(self, current: _Object, end: int) -> RawBody:
        """Make the body of an object, with the vertices that it uses."""
        used, polygons = compact(current.polygons)
        error = current.error
        if self._wrong and error is None:
            error = next((self._wrong[i] for i in used if i in self._wrong), None)
        return RawBody(
            current.name,
            np.array([self._places[3 * i : 3 * i + 3] for i in used]).reshape(-1, 3),
            polygons,
            current.line,
            end,
            error=error,
        )
