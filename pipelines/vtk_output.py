"""The motion and the stresses as files for ParaView: one .vtu per frame, their index, contacts.vtu."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mechanics.laws.status import STATUSES
from mechanics.result import BodyResult, Result
from mechanics.scene import Fidelity
from pipelines.vtu import POLYHEDRON, TETRAHEDRON, VERTEX, Grid, write_pvd, write_vtu

__all__ = ["body_grid", "contact_grid", "write_frames"]

Array = NDArray[np.float64]

_FIDELITIES = (Fidelity.FIXED, Fidelity.RIGID, Fidelity.DEFORMABLE)


def write_frames(result: Result, folder: Path) -> None:
    """Write every frame, the index `results.pvd`, and the contact points at the end.

    The last frame carries the stresses; in earlier ones, and in rigid stones, they are NaN (not computed).
    """
    datasets = []
    last = len(result.frames) - 1
    digits = max(4, len(str(last)))
    for number, frame in enumerate(result.frames):
        name = f"results_{number:0{digits}d}.vtu"
        write_vtu(folder / name, body_grid(result, frame.positions, stressed=number == last))
        datasets.append((frame.time, name))
    write_pvd(folder / "results.pvd", datasets)
    write_vtu(folder / "contacts.vtu", contact_grid(result))


def body_grid(result: Result, positions: tuple[Array, ...], *, stressed: bool) -> Grid:
    """All stones where they are now: tetrahedra of deformable ones, one polyhedron for each other one.

    Point data: displacement [m], von_mises [Pa], stress (xx, yy, zz, xy, yz, zx) [Pa].
    Cell data: stone (index in the scene), fidelity (0 fixed, 1 rigid, 2 deformable).
    """
    cells: list[list[int]] = []
    faces: list[list[list[int]]] = []
    types: list[int] = []
    stones: list[int] = []
    offset = 0
    for index, body in enumerate(result.bodies):
        own_cells, own_faces, kind = _cells_of(body, offset)
        cells += own_cells
        faces += own_faces
        types += [kind] * len(own_cells)
        stones += [index] * len(own_cells)
        offset += len(body.reference)
    before = np.concatenate([body.reference for body in result.bodies])
    now = np.concatenate(positions)
    fidelities = np.array([_FIDELITIES.index(body.fidelity) for body in result.bodies])
    stone = np.array(stones, dtype=np.int64)
    return Grid(
        points=now,
        cells=cells,
        types=np.array(types, dtype=np.uint8),
        faces=faces,
        point_data={
            "displacement": now - before,
            "von_mises": np.concatenate(
                [_nodal(body, body.von_mises, 1, stressed)[:, 0] for body in result.bodies]
            ),
            "stress": np.concatenate([_nodal(body, body.stress, 6, stressed) for body in result.bodies]),
        },
        cell_data={"stone": stone, "fidelity": fidelities[stone].astype(np.int64)},
    )


def contact_grid(result: Result) -> Grid:
    """The contact points at the end, with their force [N], normal, gap [m], area [m²] and status (in STATUSES)."""
    contacts = result.contacts
    count = len(contacts.gap)
    status = np.array([STATUSES.index(str(one)) for one in contacts.status], dtype=np.int64)
    return Grid(
        points=contacts.point,
        cells=[[index] for index in range(count)],
        types=np.full(count, VERTEX, dtype=np.uint8),
        faces=[[] for _ in range(count)],
        point_data={
            "force": contacts.force,
            "normal": contacts.normal,
            "gap": contacts.gap,
            "area": contacts.area,
            "status": status,
            "bodies": contacts.bodies.astype(np.int64),
        },
        cell_data={},
    )


def _cells_of(body: BodyResult, offset: int) -> tuple[list[list[int]], list[list[list[int]]], int]:
    """Cells, their faces, and the cell type of one stone."""
    if body.fidelity is Fidelity.DEFORMABLE:
        tetrahedra = (body.cells + offset).tolist()
        return tetrahedra, [[] for _ in tetrahedra], TETRAHEDRON
    polygons = [[node + offset for node in face] for face in body.faces]
    return [sorted({node for face in polygons for node in face})], [polygons], POLYHEDRON


def _nodal(body: BodyResult, values: Array | None, components: int, stressed: bool) -> Array:
    count = len(body.reference)
    if values is None or not stressed:
        return np.full((count, components), np.nan)
    return values.reshape(count, components)
