"""gmsh MSH: the boundary of each volume, through meshio."""

import contextlib
import io
import re
import warnings
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moma.errors import SurveyError
from survey.formats.bodies import RawBody
from survey.formats.fields import FARTHEST

__all__ = ["msh_bodies"]

_FACES = {  # of each element, its corners counter-clockwise seen from outside, in the order of meshio
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
_LINEAR = re.compile(r"(tetra|hexahedron|wedge|pyramid)\d*")
_HUGE = re.compile(rb"(?<![\w.+-])\d{9,}(?![\w.])").search  # a number of a node that memory could not hold
_UNCLOSED = "not closed"


def msh_bodies(path: Path) -> Iterator[RawBody]:
    """Go through the volumes of a mesh: physical ones, and the others by their entity.

    Raises
    ------
    SurveyError
        if the file cannot be read as a mesh
    """
    mesh = _read(path)
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1:] != (3,) or not (np.abs(points) <= FARTHEST).all():
        raise SurveyError(
            f"a node is not finite, or beyond {FARTHEST:g} m",
            where=str(path),
            remedy="coordinates are in metres",
        )
    for name, blocks in _volumes(mesh).items():
        polygons: list[tuple[int, ...]] = []
        error = None
        for kind, cells in blocks:
            if cells.size and not (cells.min() >= 0 and cells.max() < len(points)):
                error = SurveyError(
                    f"{name}: an element of a node that there is not", where=str(path), remedy="mesh it again"
                )
            polygons += [tuple(one[k] for k in face) for one in cells.tolist() for face in _FACES[kind]]
        boundary = _boundary(polygons)
        used = sorted({i for polygon in boundary for i in polygon})
        new = {old: k for k, old in enumerate(used)}
        vertices = np.empty((0, 3)) if error is not None else points[used]
        local = [tuple(new[i] for i in polygon) for polygon in boundary]
        yield RawBody(name, vertices, _cut(local), error=error)


def _read(path: Path) -> Any:
    """Read a mesh; whatever goes wrong in meshio, and whatever it only warns of, refuses the file."""
    import meshio

    said = io.StringIO()
    try:
        data = path.read_bytes()
        if b"\\0" not in data and _HUGE(data):
            raise ValueError("the number of a node or element is beyond any mesh")
        with warnings.catch_warnings(), contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
            warnings.simplefilter("error")
            mesh = meshio.gmsh.read(str(path))
        if _UNCLOSED in said.getvalue():
            raise ValueError("a section has no end: the file may be cut short")
    except Exception as error:
        text = " ".join(str(error).split())[:120] or type(error).__name__
        raise SurveyError(
            f"cannot be read as a gmsh mesh: {text}", where=str(path), remedy="export MSH 2.2 or 4.1"
        ) from error
    return mesh


def _volumes(mesh: Any) -> dict[str, list[tuple[str, NDArray[np.int64]]]]:
    """The elements of each volume, corner nodes only."""
    names = {int(tag): name for name, (tag, dim) in mesh.field_data.items() if int(dim) == 3}
    physical = mesh.cell_data.get("gmsh:physical")
    entities = mesh.cell_data.get("gmsh:geometrical")
    volumes: dict[str, list[tuple[str, NDArray[np.int64]]]] = defaultdict(list)
    for k, block in enumerate(mesh.cells):
        found = _LINEAR.fullmatch(block.type)
        if found is None or not len(block.data):
            continue
        cells = np.asarray(block.data)[:, : max(max(face) for face in _FACES[found[1]]) + 1]
        groups = np.zeros(len(cells), dtype=int) if physical is None else np.asarray(physical[k])
        volume = np.zeros(len(cells), dtype=int) if entities is None else np.asarray(entities[k])
        for group, entity in sorted(set(zip(groups.tolist(), volume.tolist(), strict=True))):
            name = names.get(group) or (f"physical-{group}" if group else f"volume-{entity}")
            volumes[name].append((found[1], cells[(groups == group) & (volume == entity)]))
    return volumes


def _boundary(polygons: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Faces that belong to one element only."""
    once: dict[frozenset[int], tuple[int, ...] | None] = {}
    for polygon in polygons:
        key = frozenset(polygon)
        once[key] = None if key in once else polygon
    return [polygon for polygon in once.values() if polygon is not None]


def _cut(polygons: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Quadrilaterals as two triangles each, which merge to the planes of the stone."""
    out: list[tuple[int, ...]] = []
    for polygon in polygons:
        out += [(polygon[0], polygon[k], polygon[k + 1]) for k in range(1, len(polygon) - 1)]
    return out
