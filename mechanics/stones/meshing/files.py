"""Volume meshes as files of finite-element programs, written and read by meshio: a named set of cells for each stone.

Gmsh, Abaqus and MED files hold the codes of the stones as physical volumes, element sets and groups. VTK and Medit
files hold whole numbers alone; a file `FILE.stones.json` beside them lists the codes in the order of the numbers.
"""

import json
import os
import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import MeshError, MissingLibraryError, UsageError
from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import VolumeMesh

_ALL = frozenset(Element)
_NAMED_BY_MESHIO = {
    Element.TET4: "tetra",
    Element.TET10: "tetra10",
    Element.HEX8: "hexahedron",
    Element.HEX20: "hexahedron20",
    Element.HEX27: "hexahedron27",
}
_ELEMENTS = {name: element for element, name in _NAMED_BY_MESHIO.items()}
# MED's number of each kind of cell
_MED_GEOMETRY = {"TE4": 304, "T10": 310, "HE8": 308, "H20": 320}
_ABAQUS_LINE = 16  # entries that Abaqus reads from one line


@dataclass(frozen=True)
class _Format:
    """A file format of meshio.

    Attributes
    ----------
    writer : meshio's name of the writer; MSH 2.2 because Gmsh does not read meshio's 4.1
    elements : kinds of cells that it holds
    code : regular expression of the stone codes that it can hold as names; None: it holds numbers alone
    number : cell data with the number of each cell's stone, from 1 on
    """

    writer: str
    elements: frozenset[Element]
    code: str | None = None
    number: str = "stone"


_FORMATS: Mapping[str, _Format] = {
    ".msh": _Format("gmsh22", _ALL, r'[^"\\\n]{1,127}', "gmsh:physical"),
    ".inp": _Format("abaqus", _ALL - {Element.HEX27}, r"[A-Za-z][A-Za-z0-9_.-]{0,79}"),
    # Code_Aster knows 24 characters of a group
    ".med": _Format("med", _ALL - {Element.HEX27}, r"[!-.0-~][ -.0-~]{0,23}", "cell_tags"),
    ".vtu": _Format("vtu", _ALL),
    ".vtk": _Format("vtk", _ALL),
    ".mesh": _Format("medit", frozenset({Element.TET4, Element.HEX8}), number="medit:ref"),
}


def check_mesh_file(path: str | Path, stones: Mapping[str, Element] | None = None) -> None:
    """Refuse a file that meshes cannot be written into, before anything is computed.

    Parameters
    ----------
    path : of the file
    stones : by code, the elements of the stones that it must hold; None: not known yet

    Raises
    ------
    UsageError : no format has the ending of its name, it is a folder, or its format cannot hold the stones
    """
    form, where = _format(path), str(path)
    if Path(path).is_dir():
        raise UsageError("is a folder", where=where, remedy="name a file")
    if stones is None:
        return
    if not stones:
        raise UsageError(
            "no stone is deformable, so there is no mesh to write",
            where=where,
            remedy="make stones deformable in [bodies], or leave out the file of meshes",
        )
    suffix = Path(path).suffix.lower()
    for code, element in stones.items():
        if element not in form.elements:
            able = _listed(ending for ending, candidate in _FORMATS.items() if element in candidate.elements)
            raise UsageError(
                f"{suffix} files hold no {element} cells, which stone {code} has",
                where=where,
                remedy=f"give a name that ends in {able}, or another element in [mesh]",
            )
        if form.code is not None and not re.fullmatch(form.code, code):
            raise UsageError(
                f"{suffix} files cannot hold the name of stone {code!r}",
                where=where,
                remedy="give a name that ends in .vtu or .vtk",
            )
    if form.writer == "abaqus" and len({code.upper() for code in stones}) < len(stones):
        raise UsageError(
            "names of stones differ in upper and lower case alone, which Abaqus takes for the same",
            where=where,
            remedy="give a name that ends in .msh or .vtu",
        )


def write_meshes(path: str | Path, stones: Mapping[str, VolumeMesh]) -> None:
    """Write the volume meshes of stones into one file, each stone a named set of cells.

    The format is that of the ending of the name. The file appears whole or not at all, and replaces an earlier one.

    Raises
    ------
    UsageError : see `check_mesh_file`; or the file cannot be written

    Examples
    --------
    >>> import tempfile, numpy as np
    >>> from mechanics.stones.meshing.elements import Element
    >>> nodes = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> mesh = VolumeMesh(Element.TET4, nodes, np.array([[0, 1, 2, 3]]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_meshes(f"{folder}/stones.inp", {"A1": mesh, "A2": mesh})
    ...     sorted(read_meshes(f"{folder}/stones.inp"))
    ['A1', 'A2']
    """
    path = Path(path)
    check_mesh_file(path, {code: mesh.element for code, mesh in stones.items()})
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(prefix=f".{path.name}-", dir=path.parent))
    except OSError as error:
        raise UsageError(
            f"cannot be written: {error.strerror}", where=str(path), remedy="name another file"
        ) from error
    try:
        _write(fresh / path.name, _FORMATS[path.suffix.lower()], stones)
        for file in sorted(fresh.iterdir(), key=lambda file: file.name == path.name):  # the codes first
            os.replace(file, path.parent / file.name)
    finally:
        shutil.rmtree(fresh)


def read_meshes(path: str | Path) -> dict[str, VolumeMesh]:
    """Read the volume meshes of stones by code, from a file of `write_meshes` or of another program.

    Cells of surfaces and lines are left out, and so are cells in no set.

    Raises
    ------
    UsageError : no format has the ending of the name, or the file cannot be read
    MeshError : the file holds no named set of cells, or one with cells of two kinds
    """
    meshio = _meshio(path)
    path, form = Path(path), _format(path)
    try:
        mesh_file = meshio.read(path, file_format=form.writer.removesuffix("22"))
    except (OSError, meshio.ReadError) as error:
        raise UsageError(f"cannot be read: {error}", where=str(path), remedy="check the file") from error
    blocks = [(_ELEMENTS.get(block.type), block.data.astype(np.int64)) for block in mesh_file.cells]
    if form.writer == "med":
        blocks = [
            (element, cells if element is None else cells[:, _turned(element)]) for element, cells in blocks
        ]
    stones: dict[str, VolumeMesh] = {}
    for code, members in _sets(mesh_file, form, path).items():
        supported = [
            (element, cells[chosen])
            for (element, cells), chosen in zip(blocks, members, strict=True)
            if element is not None and len(chosen)
        ]
        kinds = {element for element, _ in supported}
        if len(kinds) > 1:
            raise MeshError(
                f"it has cells of two kinds: {_listed(sorted(kinds))}",
                where=f"{path}, stone {code}",
                remedy="mesh it with one kind of element",
            )
        if supported:
            used, cells = np.unique(np.concatenate([cells for _, cells in supported]), return_inverse=True)
            element = supported[0][0]
            stones[code] = VolumeMesh(element, mesh_file.points[used], cells.reshape(-1, element.cell_nodes))
    if not stones:
        raise MeshError(
            "no named set of volume cells",
            where=str(path),
            remedy="give each stone its set: a physical volume, an ELSET or a group with its code",
        )
    return stones


def _format(path: str | Path) -> _Format:
    suffix = Path(path).suffix.lower()
    if suffix not in _FORMATS:
        raise UsageError(
            f"no format of meshes has the ending {suffix!r}",
            where=str(path),
            remedy=f"give a name that ends in {_listed(_FORMATS)}",
        )
    return _FORMATS[suffix]


def _listed(words: Any) -> str:
    *first, last = map(str, words)
    return f"{', '.join(first)} or {last}" if first else last


def _meshio(path: str | Path) -> Any:
    """Load the package that reads and writes files of meshes."""
    try:
        import meshio
    except ImportError as error:
        what = "files of volume meshes need the package meshio, which is not installed"
        raise MissingLibraryError(what, where=str(path), remedy="pip install meshio") from error
    return meshio


def _codes_file(path: Path) -> Path:
    return path.with_name(f"{path.name}.stones.json")


def _write(path: Path, form: _Format, stones: Mapping[str, VolumeMesh]) -> None:
    meshio = _meshio(path)
    starts = np.cumsum([0, *(len(mesh.nodes) for mesh in stones.values())])
    cells: dict[Element, list[Ints]] = {}
    numbers: dict[Element, list[Ints]] = {}
    for number, (start, mesh) in enumerate(zip(starts, stones.values(), strict=False), 1):
        order = _turned(mesh.element) if form.writer == "med" else slice(None)
        cells.setdefault(mesh.element, []).append(mesh.cells[:, order] + start)
        numbers.setdefault(mesh.element, []).append(np.full(len(mesh.cells), number))
    number_of = [np.concatenate(arrays) for arrays in numbers.values()]
    whole = meshio.Mesh(
        np.concatenate([mesh.nodes for mesh in stones.values()]),
        [(_NAMED_BY_MESHIO[element], np.concatenate(arrays)) for element, arrays in cells.items()],
    )
    if form.writer == "abaqus":
        whole.cell_sets = {
            code: [np.flatnonzero(block == number) for block in number_of]
            for number, code in enumerate(stones, 1)
        }
    else:
        sign = -1 if form.writer == "med" else 1  # MED numbers families of cells below zero
        whole.cell_data[form.number] = [sign * block for block in number_of]
    if form.writer == "gmsh22":
        whole.cell_data["gmsh:geometrical"] = whole.cell_data[form.number]
        whole.field_data = {code: np.array([number, 3]) for number, code in enumerate(stones, 1)}
    elif form.writer == "med":
        whole.cell_tags = {-number: [code] for number, code in enumerate(stones, 1)}
    meshio.write(path, whole, file_format=form.writer)
    if form.writer == "med":
        _name_geometry(path)
    elif form.writer == "abaqus":
        path.write_text("".join(map(_for_abaqus, path.read_text("utf-8").splitlines())), encoding="utf-8")
    elif form.code is None:
        _codes_file(path).write_text(
            json.dumps({"stones": list(stones)}, ensure_ascii=False), encoding="utf-8"
        )


def _name_geometry(path: Path) -> None:
    """Add the attribute without which Code_Aster cannot read the cells of a MED file, and which meshio leaves out."""
    import h5py

    with h5py.File(path, "r+") as file:
        for mesh in file["ENS_MAA"].values():
            for step in mesh.values():
                for kind, group in step["MAI"].items():
                    group.attrs["GEO"] = _MED_GEOMETRY[kind]


def _for_abaqus(line: str) -> str:
    """Adapt a line for Abaqus: plain displacement elements, not hybrid ones, and no more entries than it reads."""
    entries = re.sub(r"^(\*ELEMENT, TYPE=C3D\d+)\w*", r"\1", line).split(",")
    parts = (entries[:_ABAQUS_LINE], entries[_ABAQUS_LINE:])
    return ",\n".join(",".join(row) for row in parts if row) + "\n"


def _turned(element: Element) -> list[int]:
    """Return VTK's number of each node of a cell in MED's order; applied twice, it changes nothing.

    MED goes round the first side of a cell the other way.
    """
    corner = [0, 2, 1, 3] if element.is_tetrahedron else [0, 3, 2, 1, 4, 7, 6, 5]
    number = {frozenset(corners): node for node, corners in enumerate(element.node_corners)}
    return [number[frozenset(corner[k] for k in corners)] for corners in element.node_corners]


def _sets(mesh_file: Any, form: _Format, path: Path) -> dict[str, list[Ints]]:
    """Return by code the cells of each block that belong to a stone."""
    if form.writer == "abaqus":
        return {
            code: [np.asarray(member, dtype=np.int64) for member in members]
            for code, members in mesh_file.cell_sets.items()
        }
    numbers: list[Array] = mesh_file.cell_data.get(
        form.number, [np.zeros(len(cell.data)) for cell in mesh_file.cells]
    )
    if form.writer == "gmsh22":
        codes = {
            int(number): code for code, (number, dimension) in mesh_file.field_data.items() if dimension == 3
        }
    elif form.writer == "med":
        # the file has them in the order of their names
        codes = {number: names[0] for number, names in sorted(mesh_file.cell_tags.items(), reverse=True)}
    else:
        codes = dict(enumerate(_codes(_codes_file(path)), 1))
    return {code: [np.flatnonzero(block == number) for block in numbers] for number, code in codes.items()}


def _codes(path: Path) -> list[str]:
    try:
        codes = json.loads(path.read_text(encoding="utf-8"))["stones"]
        return [str(code) for code in codes]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UsageError(
            f"the codes of the stones cannot be read: {error}",
            where=str(path),
            remedy="keep this file beside that of the meshes",
        ) from error
