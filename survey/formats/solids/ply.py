"""PLY: vertices and polygons, from text or binary files."""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, shown, unreadable
from ground.tables.text_lines import TextLines
from survey.formats.solids.bodies import RawBody, check_coordinates

_TYPES = {  # by name: the code of `struct`
    **dict.fromkeys(("char", "int8"), "b"),
    **dict.fromkeys(("uchar", "uint8"), "B"),
    **dict.fromkeys(("short", "int16"), "h"),
    **dict.fromkeys(("ushort", "uint16"), "H"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
_INTEGERS = "bBhHiI"
_LISTS = ("vertex_indices", "vertex_index")
_SINGLE = float(np.finfo(np.float32).eps)  # relative resolution of single precision
_LONGEST_HEADER = 1 << 16  # bytes
_REMEDY = "export the PLY again"


@dataclass(frozen=True)
class _Property:
    """One value per row, of type `kind`; or a list of them, with a count of type `count` before."""

    name: str
    kind: str
    count: str | None = None


@dataclass(frozen=True)
class _Element:
    name: str
    length: int
    properties: list[_Property] = field(default_factory=list)


def ply_bodies(path: Path) -> Iterator[RawBody]:
    """Read a file: one body, or several that do not touch.

    Raises
    ------
    SurveyError
        if the file is not a PLY, or is cut short
    """
    start = _read(path, _LONGEST_HEADER)
    if not start.startswith((b"ply\n", b"ply\r\n")):
        raise SurveyError("this is not a PLY", where=f"{path}:1", remedy="the first line must be 'ply'")
    stop = start.find(b"end_header")
    stop = start.find(b"\n", stop) + 1 if stop >= 0 else 0
    if not stop:
        raise SurveyError("the header has no end", where=f"{path}:1", remedy=_REMEDY)
    order, elements = _header(start[:stop].decode("latin-1").splitlines(), str(path))
    if order is None:
        lines = TextLines(path)
        rows = _TextRows(lines, start[:stop].count(b"\n"))
        return iter([_body(elements, rows, path, f"{path}:{lines.end}", lines.end + 1)])
    return iter([_body(elements, _BinaryRows(_read(path, -1), stop, order, str(path)), path, str(path), 0)])


def _read(path: Path, size: int) -> bytes:
    try:
        with path.open("rb") as handle:
            return handle.read(size)
    except OSError as error:
        raise unreadable(path, error) from error


def _header(lines: list[str], path: str) -> tuple[str | None, list[_Element]]:
    """Return the byte order, None for text, and the elements in order."""
    orders = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
    order: str | None = ""
    elements: list[_Element] = []
    for number, line in enumerate(lines[1:], start=2):
        match line.split():
            case [] | ["comment" | "obj_info", *_] | ["end_header"]:
                continue
            case ["format", name, "1.0"] if name in orders and order == "":
                order = orders[name]
            case ["element", name, count] if count.isascii() and count.isdigit() and len(count) < 10:
                elements.append(_Element(name, int(count)))
            case ["property", kind, name] if kind in _TYPES and elements:
                elements[-1].properties.append(_Property(name, _TYPES[kind]))
            case ["property", "list", count, kind, name] if (
                kind in _TYPES and elements and (_TYPES.get(count, "f") in _INTEGERS)
            ):
                elements[-1].properties.append(_Property(name, _TYPES[kind], _TYPES[count]))
            case _:
                raise SurveyError(f"cannot read {shown(line)}", where=f"{path}:{number}", remedy=_REMEDY)
    if order == "":
        raise SurveyError("the header has no format", where=f"{path}:1", remedy=_REMEDY)
    return order, elements


class _TextRows:
    """The rows of a text file, one per line."""

    def __init__(self, lines: TextLines, header: int) -> None:
        self._lines, self._path = lines, lines.path
        self._rows = ((number, line) for number, line in lines if number > header and line.strip())

    def column(self, element: _Element, names: Sequence[str]) -> list[list[tuple[float, ...]]]:
        """Read the rows of an element; return the values of some of its properties, row by row."""
        return [self._row(element.properties, names) for _ in range(element.length)]

    def _row(self, properties: Sequence[_Property], names: Sequence[str]) -> list[tuple[float, ...]]:
        number, line = next(self._rows, (self._lines.end, ""))
        words, at, row = line.split(), 0, dict[str, tuple[float, ...]]()
        where = f"{self._path}:{number}"
        for entry in properties:
            length = 1
            if entry.count is not None:
                length = int(self._numbers(words, at, 1, "i", where)[0])
                at += 1
            if entry.name in names or length < 0 or at + length > len(words):
                row[entry.name] = self._numbers(words, at, length, entry.kind, where)
            at += length
        if at != len(words):
            raise SurveyError(f"{len(words)} numbers for {at}", where=where, remedy=_REMEDY)
        return [row[name] for name in names]

    def _numbers(self, words: list[str], at: int, length: int, kind: str, where: str) -> tuple[float, ...]:
        some = words[at : at + length]
        if length < 0 or len(some) < length:
            raise SurveyError(f"{len(words)} numbers are too few", where=where, remedy=_REMEDY)
        for word in some:
            if kind in _INTEGERS and not (word.isascii() and word.removeprefix("-").isdigit()):
                raise SurveyError(f"{shown(word)} is not a whole number", where=where, remedy=_REMEDY)
        return tuple(parse_number(word, "number", where) for word in some)

    def check_end(self) -> None:
        """Check that no row follows."""
        number, _ = next(self._rows, (0, ""))
        if number:
            raise self._lines.fail(number, "more rows than the header has", _REMEDY)


class _BinaryRows:
    """The rows of a binary file."""

    def __init__(self, data: bytes, start: int, order: str, path: str) -> None:
        self._data, self._at, self._order, self._path = data, start, order, path

    def column(self, element: _Element, names: Sequence[str]) -> list[list[tuple[float, ...]]]:
        """Read the rows of an element; return the values of some of its properties, row by row."""
        alike = self._alike(element, names)
        return (
            [self._row(element.properties, names) for _ in range(element.length)] if alike is None else alike
        )

    def _alike(self, element: _Element, names: Sequence[str]) -> list[list[tuple[float, ...]]] | None:
        """Read all rows at once if their lists are as long as those of the first; None if they are not."""
        if not element.length:
            return []
        start = self._at
        lengths = [0 if property_.count is None else -1 for property_ in element.properties]
        if -1 in lengths:
            for k, entry in enumerate(element.properties):
                lengths[k] = 0 if entry.count is None else int(self._take(entry.count, 1)[0])
                self._take(entry.kind, 1 if entry.count is None else lengths[k])
            self._at = start
            if min(lengths) < 0:
                return None
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for k, entry in enumerate(element.properties):
            kind = self._order + entry.kind
            if entry.count is None:
                fields.append((f"v{k}", kind))
            else:
                fields += [(f"n{k}", self._order + entry.count), (f"v{k}", kind, (lengths[k],))]
        row = np.dtype(fields)
        if self._at + element.length * row.itemsize > len(self._data):
            return None
        table = np.frombuffer(self._data, row, element.length, self._at)
        for k, entry in enumerate(element.properties):
            if entry.count is not None and (table[f"n{k}"] != lengths[k]).any():
                return None
        self._at += element.length * row.itemsize
        place = {one.name: k for k, one in enumerate(element.properties)}
        columns = [table[f"v{place[name]}"].reshape(element.length, -1).tolist() for name in names]
        return [[tuple(value) for value in values] for values in zip(*columns, strict=True)]

    def _row(self, properties: Sequence[_Property], names: Sequence[str]) -> list[tuple[float, ...]]:
        row = dict[str, tuple[float, ...]]()
        for entry in properties:
            length = 1 if entry.count is None else int(self._take(entry.count, 1)[0])
            row[entry.name] = self._take(entry.kind, length)
        return [row[name] for name in names]

    def _take(self, kind: str, length: int) -> tuple[float, ...]:
        size = struct.calcsize(kind) * length
        if length < 0 or self._at + size > len(self._data):
            raise SurveyError("the file is cut short", where=self._path, remedy=_REMEDY)
        out: tuple[float, ...] = struct.unpack_from(f"{self._order}{length}{kind}", self._data, self._at)
        self._at += size
        return out

    def check_end(self) -> None:
        """Check that no row follows."""
        if self._data[self._at :].strip():
            raise SurveyError("more rows than the header has", where=self._path, remedy=_REMEDY)


def _body(
    elements: list[_Element], rows: _TextRows | _BinaryRows, path: Path, where: str, end: int
) -> RawBody:
    places: list[tuple[float, float, float]] = []
    polygons: list[tuple[int, ...]] = []
    resolution = 0.0
    for element in elements:
        if not element.properties:
            continue
        names = [entry.name for entry in element.properties]
        if element.name == "vertex":
            if not {"x", "y", "z"} <= set(names):
                raise SurveyError("vertices without x, y and z", where=where, remedy=_REMEDY)
            resolution = (
                _SINGLE
                if any(entry.kind == "f" for entry in element.properties if entry.name in "xyz")
                else 0.0
            )
        lists = [name for name in names if name in _LISTS]
        wanted = ["x", "y", "z"] if element.name == "vertex" else lists[:1] if element.name == "face" else []
        for values in rows.column(element, wanted):
            if element.name == "vertex":
                (x, *_), (y, *_), (z, *_) = values
                places.append((x, y, z))
            elif wanted:
                polygons.append(tuple(map(int, values[0])))
    rows.check_end()
    vertices = np.array(places, dtype=np.float64).reshape(-1, 3)
    check_coordinates(vertices, "corner", where)
    if any(not 0 <= index < len(vertices) for polygon in polygons for index in polygon):
        raise SurveyError("a face refers to a vertex that does not exist", where=where, remedy=_REMEDY)
    line = 1 if end else 0
    scale = float(np.abs(vertices).max(initial=0.0))
    return RawBody(path.stem, vertices, polygons, line, end, resolution * scale)
