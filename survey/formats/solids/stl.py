"""STL: the triangles of each solid, from text or binary files."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, shown, unreadable
from ground.tables.text_lines import TextLines
from survey.formats.solids.bodies import RawBody, check_coordinates

_SINGLE = float(np.finfo(np.float32).eps)  # relative resolution of single precision
_ORDER: Mapping[str, tuple[str, ...]] = {  # the line that must follow
    "solid": ("facet", "endsolid"),
    "facet": ("outer",),
    "outer": ("vertex",),
    "endloop": ("endfacet",),
    "endfacet": ("facet", "endsolid"),
    "endsolid": ("solid",),
}


def stl_bodies(path: Path) -> Iterator[RawBody]:
    """Iterate over the solids of a file; a binary file is one.

    Raises
    ------
    SurveyError
        if the file is neither text nor a binary STL
    """
    binary = _read_binary(path)
    if binary is None:
        yield from _text_bodies(_lines(path), path.stem)
    else:
        yield binary


def _read_binary(path: Path) -> RawBody | None:
    """Read the triangles of a binary file; None if its length is not that of one."""
    from trimesh.exchange.stl import HeaderError, load_stl_binary

    try:
        with path.open("rb") as handle:
            loaded = load_stl_binary(handle)
    except HeaderError:
        return None
    except OSError as error:
        raise unreadable(path, error) from error
    vertices = np.asarray(loaded.get("vertices", np.empty((0, 3))), dtype=np.float64).reshape(-1, 3)
    check_coordinates(vertices, "corner", str(path))
    triangles = [tuple(triangle) for triangle in np.arange(len(vertices)).reshape(-1, 3).tolist()]
    return RawBody(
        path.stem, vertices, triangles, resolution=_SINGLE * float(np.abs(vertices).max(initial=0.0))
    )


def _lines(path: Path) -> TextLines:
    try:
        return TextLines(path)
    except SurveyError as error:
        raise SurveyError(
            f"neither a text nor a whole binary STL: {error.what}",
            where=error.where,
            remedy="export it again",
        ) from error


def _text_bodies(lines: TextLines, stem: str) -> Iterator[RawBody]:
    name, begin = stem, 0
    allowed: tuple[str, ...] = ("solid",)
    corners: list[tuple[float, ...]] = []
    for number, line in lines:
        words = line.split()
        if not words:
            continue
        word = words[0].lower()
        if word not in allowed:
            raise lines.fail(
                number, f"{shown(words[0])} where {' or '.join(allowed)} should be", "export it again"
            )
        if word == "solid":
            name, begin, corners = line.strip()[5:].strip() or stem, number, []
        elif word == "vertex":
            corners.append(_corner(words, f"{lines.path}:{number}"))
        elif word == "endsolid":
            triangles = [(k, k + 1, k + 2) for k in range(0, len(corners), 3)]
            yield RawBody(name, np.array(corners).reshape(-1, 3), triangles, begin, number + 1)
        allowed = _ORDER.get(word) or (("endloop",) if len(corners) % 3 == 0 else ("vertex",))
    if not begin or allowed != ("solid",):
        raise lines.fail(
            lines.end, f"the file ends where {' or '.join(allowed)} should be", "export it again"
        )


def _corner(words: list[str], where: str) -> tuple[float, ...]:
    if len(words) != 4:
        raise SurveyError(f"a vertex of {len(words) - 1} numbers", where=where, remedy="write: vertex X Y Z")
    return tuple(parse_number(word, "coordinate", where) for word in words[1:])
