"""Boundary of each volume of a Gmsh mesh."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from enum import IntEnum
from pathlib import Path

import numpy as np

from survey.arrays import Ints
from survey.formats.solids.bodies import RawBody, check_coordinates, compact
from survey.formats.solids.msh.sections import MshFile


def _sides(text: str) -> tuple[tuple[int, ...], ...]:
    """Return the corners of the sides of an element, each a word of their numbers."""
    return tuple(tuple(map(int, side)) for side in text.split())


_TETRA = _sides("021 013 123 032")
_HEXA = _sides("0321 4567 0154 1265 2376 3047")
_WEDGE = _sides("021 345 0143 1254 2035")
_PYRAMID = _sides("0321 014 124 234 304")


class _Type(IntEnum):
    """Gmsh's numbers of elements of the first and second order, by their nodes."""

    TETRA_4, HEXA_8, WEDGE_6, PYRAMID_5 = 4, 5, 6, 7
    TETRA_10, HEXA_27, WEDGE_18, PYRAMID_14 = 11, 12, 13, 14
    HEXA_20, WEDGE_15, PYRAMID_13 = 17, 18, 19


_FACES: Mapping[int, tuple[tuple[int, ...], ...]] = {  # their corners counter-clockwise seen from outside
    **dict.fromkeys((_Type.TETRA_4, _Type.TETRA_10), _TETRA),
    **dict.fromkeys((_Type.HEXA_8, _Type.HEXA_20, _Type.HEXA_27), _HEXA),
    **dict.fromkeys((_Type.WEDGE_6, _Type.WEDGE_15, _Type.WEDGE_18), _WEDGE),
    **dict.fromkeys((_Type.PYRAMID_5, _Type.PYRAMID_13, _Type.PYRAMID_14), _PYRAMID),
}

Cells = list[tuple[int, Ints]]


def msh_bodies(path: Path) -> Iterator[RawBody]:
    """Iterate over the volumes of a mesh: physical ones, and the others by their entity.

    Raises
    ------
    SurveyError
        if the file cannot be read as a mesh
    """
    mesh = MshFile(path)
    check_coordinates(mesh.points, "node", str(path))
    for name, blocks in _volumes(mesh).items():
        used, polygons = compact(_boundary(blocks))
        yield RawBody(name, mesh.points[used], polygons)


def _volumes(mesh: MshFile) -> dict[str, Cells]:
    """Collect the elements of each volume, by type."""
    volumes: dict[str, Cells] = defaultdict(list)
    for element in mesh.elements:
        if element.type not in _FACES:
            continue
        both = np.column_stack([element.physical, element.entity])
        for group, entity in np.unique(both, axis=0).tolist():
            name = mesh.names.get(group) or (f"physical-{group}" if group else f"volume-{entity}")
            volumes[name].append((element.type, element.nodes[(both == (group, entity)).all(axis=1)]))
    return volumes


def _boundary(blocks: Cells) -> list[tuple[int, ...]]:
    """Return the faces that belong to one element only, as triangles; they merge to the planes of the stone later."""
    once: dict[frozenset[int], tuple[int, ...] | None] = {}
    for kind, cells in blocks:
        for cell in cells.tolist():
            for face in _FACES[kind]:
                polygon = tuple(cell[k] for k in face)
                key = frozenset(polygon)
                once[key] = None if key in once else polygon
    polygons = [polygon for polygon in once.values() if polygon is not None]
    return [
        (polygon[0], polygon[k], polygon[k + 1]) for polygon in polygons for k in range(1, len(polygon) - 1)
    ]
