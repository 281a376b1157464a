"""VTK XML files (.vtu, .pvd) written with numpy alone, so that results do not depend on loading VTK."""

import base64
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.elements import Element


class CellType(IntEnum):
    """Cell types of VTK, by its names."""

    VERTEX = 1
    LINE = 3
    POLYGON = 7
    TETRA = 10
    HEXAHEDRON = 12
    QUADRATIC_TETRA = 24
    QUADRATIC_HEXAHEDRON = 25
    TRIQUADRATIC_HEXAHEDRON = 29
    POLYHEDRON = 42


CELL_TYPES: Mapping[Element, CellType] = {
    Element.TET4: CellType.TETRA,
    Element.TET10: CellType.QUADRATIC_TETRA,
    Element.HEX8: CellType.HEXAHEDRON,
    Element.HEX20: CellType.QUADRATIC_HEXAHEDRON,
    Element.HEX27: CellType.TRIQUADRATIC_HEXAHEDRON,
}

Arrays = Mapping[str, NDArray[np.generic]]
_LEVEL = 1  # of compression: higher levels take long and save little
_NAMES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


@dataclass(frozen=True)
class Cells:
    """Cells of a grid.

    Attributes
    ----------
    connectivity : node indices of all cells, cell by cell
    offsets : (nc,) end of each cell in `connectivity`
    types : (nc,) VTK cell types
    faces : for each polyhedron its number of faces, then for each face its number of nodes and the nodes
    face_offsets : (nc,) end of each polyhedron in `faces`; -1 for other cells; empty without polyhedra
    """

    connectivity: Ints
    offsets: Ints
    types: NDArray[np.uint8]
    faces: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    face_offsets: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


@dataclass(frozen=True)
class UnstructuredGrid:
    """Unstructured grid.

    Attributes
    ----------
    points : (n, 3) [m]
    cells : on these points
    point_data, cell_data : named arrays of n or nc rows
    units : by name of the array; ratios and numbers have none
    """

    points: Array
    cells: Cells
    point_data: Arrays
    cell_data: Arrays
    units: Mapping[str, str] = field(default_factory=dict)


def cells_of(kind: int, rows: Sequence[Sequence[int]]) -> Cells:
    """Make cells of one type other than polyhedra."""
    return Cells(
        connectivity=np.fromiter((node for row in rows for node in row), dtype=np.int64),
        offsets=np.cumsum([len(row) for row in rows], dtype=np.int64),
        types=np.full(len(rows), kind, dtype=np.uint8),
    )


def write_vtu(path: Path, grid: UnstructuredGrid) -> None:
    """Write one unstructured grid, binary, readable by any ParaView since 4."""
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{len(grid.points)}" NumberOfCells="{len(grid.cells.types)}">',
        "<PointData>",
        *(_array(name, values, grid.units.get(name)) for name, values in grid.point_data.items()),
        "</PointData>",
        "<CellData>",
        *(_array(name, values, grid.units.get(name)) for name, values in grid.cell_data.items()),
        "</CellData>",
        "<Points>",
        _array("Points", grid.points, "m"),
        "</Points>",
        "<Cells>",
        *_cells(grid.cells),
        *("</Cells>", "</Piece>", "</UnstructuredGrid>", "</VTKFile>"),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_pvd(path: Path, datasets: Sequence[tuple[float, str]]) -> None:
    """Write a collection of (time [s], file name), which ParaView plays as one animation."""
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">',
        "<Collection>",
        *(
            f'<DataSet timestep="{time:.17g}" group="" part="0" file="{escape(name)}"/>'
            for time, name in datasets
        ),
        "</Collection>",
        "</VTKFile>",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _cells(cells: Cells) -> list[str]:
    arrays = [
        _array("connectivity", cells.connectivity),
        _array("offsets", cells.offsets),
        _array("types", cells.types),
    ]
    if len(cells.faces):
        arrays += [_array("faces", cells.faces), _array("faceoffsets", cells.face_offsets)]
    return arrays


def _array(name: str, values: NDArray[np.generic], unit: str | None = None) -> str:
    """Encode one array, compressed, with its unit where VTK expects it.

    Base64 of the numbers of blocks, of bytes in a block, of bytes in a last one that is shorter, and of bytes
    compressed; then base64 of the one block.
    """
    kind = _NAMES[values.dtype.str[1:]]
    components = values.shape[1] if values.ndim > 1 else 1
    content = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<")).tobytes()
    block = zlib.compress(content, _LEVEL)
    sizes = struct.pack("<4Q", 1, len(content), 0, len(block)) if content else struct.pack("<3Q", 0, 0, 0)
    encoded = "".join(base64.b64encode(piece).decode("ascii") for piece in (sizes, block if content else b""))
    shape = f' NumberOfComponents="{components}"' if components > 1 else ""
    label = ""
    if unit is not None:
        label = f'<InformationKey name="UNITS_LABEL" location="vtkDataArray">{escape(unit)}</InformationKey>'
    return (
        f'<DataArray type="{kind}" Name="{escape(name)}"{shape} format="binary">{encoded}{label}</DataArray>'
    )
