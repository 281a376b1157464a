"""Results for ParaView: stones and contact points as time series, joints at the end of the run."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from archmodel.quantities import quantities_of, units_of
from mechanics.arrays import Array, Ints
from mechanics.results.contact_result import ContactResult, JointResult
from mechanics.results.result import BodyResult, Frame, Result
from mechanics.results.stress_values import utilisation
from mechanics.scene.laws.status import STATUSES
from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.elasticity.tensors import principal, von_mises
from pipelines.results.vtu import (
    CELL_TYPES,
    Cells,
    CellType,
    UnstructuredGrid,
    cells_of,
    write_pvd,
    write_vtu,
)

FIDELITIES = (Fidelity.FIXED, Fidelity.RIGID, Fidelity.DEFORMABLE)
"""Models of stones by their number in the files."""

CONTACT_ARRAYS = tuple(one for one in quantities_of("contact") if one not in ("status", "bodies", "joint"))
"""Values of contact points in the files, by their names in `ContactResult`."""

UNITS = units_of("point of a stone", "contact", "joint", "joint in joints.vtu")
"""Units of the arrays; all others are ratios, directions or numbers."""


def write_frames(result: Result, folder: Path) -> None:
    """Write every frame of stones and contacts with their indices `results.pvd` and `contacts.pvd`.

    Values that are not computed, such as stresses of rigid stones, are NaN.
    """
    cells, digits = body_cells(result), max(4, len(str(len(result.frames) - 1)))
    series: dict[str, list[tuple[float, str]]] = {"results": [], "contacts": []}
    for number, frame in enumerate(result.frames):
        for kind, grid in (
            ("results", body_grid(result, frame, cells)),
            ("contacts", contact_grid(frame.contacts)),
        ):
            name = f"{kind}_{number:0{digits}d}.vtu"
            write_vtu(folder / name, grid)
            series[kind].append((frame.time, name))
    for kind, datasets in series.items():
        write_pvd(folder / f"{kind}.pvd", datasets)


def write_joint_grid(result: Result, folder: Path) -> None:
    """Write `joints.vtu`, the joints at the end."""
    write_vtu(folder / "joints.vtu", joint_grid(result.joints))


def body_cells(result: Result) -> Cells:
    """Gather the finite elements of deformable stones and one polyhedron for each other stone."""
    connectivity, sizes, types, streams, ends = [], [], [], [], []
    offset, end = 0, 0
    for body in result.bodies:
        if body.element is not None:
            connectivity.append((body.cells + offset).ravel())
            sizes.append(np.full(len(body.cells), body.cells.shape[1]))
            types.append(np.full(len(body.cells), CELL_TYPES[body.element]))
            ends.append(np.full(len(body.cells), -1))
        else:
            connectivity.append(offset + np.unique([node for face in body.faces for node in face]))
            stream = np.fromiter(_stream(body, offset), dtype=np.int64)
            sizes.append(np.array([len(connectivity[-1])]))
            types.append(np.array([CellType.POLYHEDRON]))
            streams.append(stream)
            end += len(stream)
            ends.append(np.array([end]))
        offset += len(body.reference)
    no_faces = np.zeros(0, dtype=np.int64)
    return Cells(
        connectivity=np.concatenate(connectivity).astype(np.int64),
        offsets=np.cumsum(np.concatenate(sizes)).astype(np.int64),
        types=np.concatenate(types).astype(np.uint8),
        faces=np.concatenate(streams) if streams else no_faces,
        face_offsets=np.concatenate(ends).astype(np.int64) if streams else no_faces,
    )


def _stream(body: BodyResult, offset: int) -> Iterator[int]:
    """Yield the faces of a polyhedron in VTK's order."""
    yield len(body.faces)
    for face in body.faces:
        yield len(face)
        yield from (node + offset for node in face)


def body_grid(result: Result, frame: Frame, cells: Cells) -> UnstructuredGrid:
    """Make the grid of all stones in one frame, in single precision, which halves the files.

    Point data: displacement [m], velocity [m/s]; contact_force on the nodes of deformable stones [N];
    stress (xx, yy, zz, xy, yz, zx), von_mises, principal (σ1 ≥ σ2 ≥ σ3), mean_pressure [Pa];
    principal_direction_1, principal_direction_3; utilisation [-].
    Cell data: stone (index in the scene), fidelity (0 fixed, 1 rigid, 2 deformable), stress_error [-].
    """
    bodies = result.bodies
    stone = np.repeat(np.arange(len(bodies)), [max(len(body.cells), 1) for body in bodies])
    fidelity = np.array([FIDELITIES.index(body.fidelity) for body in bodies])
    error = np.array([np.nan if error is None else error for error in frame.stress_errors])
    return UnstructuredGrid(
        points=np.concatenate(frame.positions),
        cells=cells,
        point_data={
            name: values.astype(np.float32)
            for name, values in point_fields(bodies, result.scene.blocks, frame).items()
        },
        cell_data={
            "stone": stone.astype(np.int64),
            "fidelity": fidelity[stone].astype(np.int64),
            "stress_error": error[stone],
        },
        units=UNITS,
    )


def point_fields(
    bodies: Sequence[BodyResult], blocks: Sequence[Block], frame: Frame, stress: bool = True
) -> dict[str, Array]:
    """Compute the fields of the points of all stones in one frame; of stresses and nodal forces only if wanted."""
    before, now = np.concatenate([body.reference for body in bodies]), np.concatenate(frame.positions)
    motion = {"displacement": now - before, "velocity": np.concatenate(frame.velocities)}
    if not stress:
        return motion
    forces = frame.nodal_forces or (None,) * len(bodies)
    on_nodes = [
        np.full((len(place), 3), np.nan) if force is None else force
        for place, force in zip(frame.positions, forces, strict=True)
    ]
    return motion | _stresses(blocks, frame) | {"contact_force": np.concatenate(on_nodes)}


def _stresses(blocks: Sequence[Block], frame: Frame) -> dict[str, Array]:
    """Compute the fields derived from the stress of the points; NaN where there is no stress."""
    stress = np.concatenate(
        [
            np.full((len(place), 6), np.nan) if stress is None else stress
            for place, stress in zip(frame.positions, frame.stresses, strict=True)
        ]
    )
    stressed = np.isfinite(stress[:, 0])
    values, first, third = (np.full((len(stress), 3), np.nan) for _ in range(3))
    values[stressed], directions = principal(stress[stressed])
    first[stressed], third[stressed] = directions[:, 0], directions[:, 2]
    used, start = np.full(len(stress), np.nan), 0
    for block, place in zip(blocks, frame.positions, strict=True):
        rows = slice(start, start := start + len(place))
        used[rows] = utilisation(values[rows], block.material)
    return {
        "stress": stress,
        "von_mises": von_mises(stress),
        "principal": values,
        "principal_direction_1": first,
        "principal_direction_3": third,
        "mean_pressure": -values.mean(axis=1),
        "utilisation": used,
    }


def contact_grid(contacts: ContactResult) -> UnstructuredGrid:
    """Make the grid of contact points: force [N], pressure [Pa], lengths [m], area [m²], status, bodies, joint."""
    count = len(contacts.gap)
    return UnstructuredGrid(
        points=contacts.point,
        cells=cells_of(CellType.VERTEX, [[index] for index in range(count)]),
        point_data={
            **{name: getattr(contacts, name) for name in CONTACT_ARRAYS},
            "status": status_numbers(contacts),
            "bodies": contacts.bodies.astype(np.int64),
            "joint": contacts.joint.astype(np.int64),
        },
        cell_data={},
        units=UNITS,
    )


def status_numbers(contacts: ContactResult) -> Ints:
    """Return the number of the status of each contact point in the files (nc,)."""
    return np.array([STATUSES.index(str(status)) for status in contacts.status], dtype=np.int64)


def joint_grid(joints: JointResult) -> UnstructuredGrid:
    """Make the grid of the joints' polygons, with the values of `JointResult`."""
    # where faces no longer overlap, the polygon shrinks to a point
    polygons = [
        polygon if len(polygon) > 2 else np.tile(centre, (3, 1))
        for polygon, centre in zip(joints.polygon, joints.centroid, strict=True)
    ]
    sizes = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    ends = np.cumsum(sizes)
    values: dict[str, Array | Ints] = {
        "bodies": joints.bodies.astype(np.int64),
        "parted": joints.parted.astype(np.int64),
        "sliver": joints.sliver.astype(np.int64),
        "normal": joints.frame[:, 0],
        "in_kern": joints.in_kern.astype(np.int64),
        "area": joints.area,
    }
    for name in quantities_of("joint in joints.vtu", "joint"):
        if name not in values and hasattr(joints, name):
            values[name] = getattr(joints, name)
    return UnstructuredGrid(
        points=np.concatenate([*polygons, np.zeros((0, 3))]),
        cells=cells_of(
            CellType.POLYGON, [range(end - size, end) for size, end in zip(sizes, ends, strict=True)]
        ),
        point_data={},
        cell_data=values,
        units=UNITS,
    )
