"""VTK XML files (.vtu, .pvd) with numpy alone: results are written even where VTK itself cannot load."""

import base64
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

__all__ = ["POLYHEDRON", "TETRAHEDRON", "VERTEX", "Grid", "write_pvd", "write_vtu"]

VERTEX, TETRAHEDRON, POLYHEDRON = 1, 10, 42  # cell types of VTK

Arrays = Mapping[str, NDArray[np.generic]]
_NAMES = {"f8": "Float64", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


@dataclass(frozen=True)
class Grid:
    """An unstructured grid.

    Attributes
    ----------
    points : (n, 3) [m]
    cells : node indices of each cell
    types : (nc,) VTK cell types
    faces : for each polyhedron, its faces as node indices; for other cells, nothing
    point_data, cell_data : named arrays of n or nc rows
    """

    points: NDArray[np.float64]
    cells: Sequence[Sequence[int]]
    types: NDArray[np.uint8]
    faces: Sequence[Sequence[Sequence[int]]]
    point_data: Arrays
    cell_data: Arrays


def write_vtu(path: Path, grid: Grid) -> None:
    """Write one unstructured grid, binary, readable by any ParaView since 4."""
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{len(grid.points)}" NumberOfCells="{len(grid.types)}">',
        "<PointData>",
        *(_array(name, values) for name, values in grid.point_data.items()),
        "</PointData>",
        "<CellData>",
        *(_array(name, values) for name, values in grid.cell_data.items()),
        "</CellData>",
        "<Points>",
        _array("Points", grid.points),
        "</Points>",
        "<Cells>",
        *_cells(grid),
        "</Cells>",
        "</Piece>",
        "</UnstructuredGrid>",
        "</VTKFile>",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_pvd(path: Path, datasets: Sequence[tuple[float, str]]) -> None:
    """Write the collection of (time [s], file name) that ParaView plays as one animation."""
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">',
        "<Collection>",
        *(
            f'<DataSet timestep="{time:.17g}" group="" part="0" file={quoteattr(name)}/>'
            for time, name in datasets
        ),
        "</Collection>",
        "</VTKFile>",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _cells(grid: Grid) -> list[str]:
    counts = [len(cell) for cell in grid.cells]
    arrays = [
        _array("connectivity", _flat(grid.cells)),
        _array("offsets", np.cumsum(counts, dtype=np.int64)),
        _array("types", grid.types.astype(np.uint8)),
    ]
    if any(grid.faces):
        streams = [
            [len(faces), *(n for face in faces for n in (len(face), *face))] if faces else []
            for faces in grid.faces
        ]
        ends = np.cumsum([len(stream) for stream in streams], dtype=np.int64)
        offsets = np.where([bool(stream) for stream in streams], ends, -1).astype(np.int64)
        arrays += [_array("faces", _flat(streams)), _array("faceoffsets", offsets)]
    return arrays


def _flat(rows: Sequence[Sequence[int]]) -> NDArray[np.int64]:
    return np.fromiter((n for row in rows for n in row), dtype=np.int64)


def _array(name: str, values: NDArray[np.generic]) -> str:
    """One binary array: base64 of its length in bytes, then of its bytes."""
    kind = _NAMES[values.dtype.str[1:]]
    components = values.shape[1] if values.ndim > 1 else 1
    content = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<")).tobytes()
    encoded = base64.b64encode(struct.pack("<Q", len(content)) + content).decode("ascii")
    shape = f' NumberOfComponents="{components}"' if components > 1 else ""
    return f'<DataArray type="{kind}" Name={quoteattr(name)}{shape} format="binary">{encoded}</DataArray>'
