"""`results.vtkhdf`: stones and contact points of all frames in one file, which ParaView plays, also while it grows.

VTKHDF 2.1, read by VTK since 9.4, ParaView since 5.13 and PyVista. The mesh of the stones stands in the file once, with
their places in every frame; rigid stones are polygons, as polyhedra need VTK 9.6. Both blocks change with time, as a
block that does not makes the other unreadable.

HDF5 leaves a file that no library opens if its writer dies with it open. So no file under the name that users see is
ever open for writing: each frame is added to a second copy, which then takes the name
(docs/design/runs-and-checkpoints.md).
"""

import os
import shutil
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanics.results.result import BodyResult, Frame
from mechanics.scene.scene import Block
from pipelines.results.vtk import CONTACT_ARRAYS, FIDELITIES, point_fields, status_numbers
from pipelines.results.vtu import CELL_TYPES, CellType

RESULTS = "results.vtkhdf"
"""Name of the file."""

_ROOT = "VTKHDF"
_VERSION = (2, 1)
_CHUNK = 1 << 12  # bytes that an array of a growing file takes at least, at a time
_STEPS_CHUNK = 128  # frames of which a growing file stores the offsets at a time
ROOM = 1 << 20  # bytes of a file beside its frames, at most
SHARE = 0.04  # most of the time that a growing file, or checkpoints, may take; they wait where frames come faster [-]
_HEADERS = (
    "earliest",
    "v110",
)  # versions of HDF5; later ones lock out readers while a writer has the file open

Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class _Part:
    """One block in one frame.

    Attributes
    ----------
    points, cells, ids : their numbers; ids: of the points of all cells
    arrays : by name, those that the frame adds
    """

    points: int
    cells: int
    ids: int
    arrays: Arrays


class _Stones:
    """The block of the stones: one mesh, with places and fields that change."""

    def __init__(self, bodies: Sequence[BodyResult], blocks: Sequence[Block]) -> None:
        self._bodies, self._blocks = bodies, blocks
        self._elastic = any(body.element is not None for body in bodies)
        stone, kinds, sizes, nodes, offset = [], [], [], [], 0
        for number, body in enumerate(bodies):
            rows = body.cells if body.element is not None else [np.array(face) for face in body.faces]
            kind = CELL_TYPES[body.element] if body.element is not None else CellType.POLYGON
            stone += [number] * len(rows)
            kinds += [kind] * len(rows)
            sizes += [len(row) for row in rows]
            nodes += [np.asarray(row) + offset for row in rows]
            offset += len(body.reference)
        self._stone = np.array(stone, dtype=np.int32)
        fidelity = np.array([FIDELITIES.index(body.fidelity) for body in bodies], dtype=np.uint8)
        self._before = np.concatenate([body.reference for body in bodies])
        self.once: Arrays = {
            "Connectivity": np.concatenate(nodes).astype(np.int64),
            "Offsets": np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
            "Types": np.array(kinds, dtype=np.uint8),
            "CellData/stone": self._stone,
            "CellData/fidelity": fidelity[self._stone],
        }

    def part(self, frame: Frame) -> _Part:
        """Return the places and fields of a frame."""
        now = np.concatenate(frame.positions)
        fields = point_fields(self._bodies, self._blocks, frame, self._elastic)
        arrays: dict[str, NDArray[Any]] = {"Points": now}
        arrays |= {f"PointData/{name}": values.astype(np.float32) for name, values in fields.items()}
        if self._elastic:
            error = np.array([np.nan if error is None else error for error in frame.stress_errors])
            arrays["CellData/stress_error"] = error[self._stone].astype(np.float32)
        return _Part(len(now), len(self._stone), len(self.once["Connectivity"]), arrays)


class _ContactPoints:
    """The block of the contact points: a vertex each, in every frame others."""

    def __init__(self) -> None:
        self.once: Arrays = {}

    def part(self, frame: Frame) -> _Part:
        """Return the contact points of a frame."""
        contacts, count = frame.contacts, len(frame.contacts.gap)
        arrays: dict[str, NDArray[Any]] = {
            "Points": contacts.point,
            "Types": np.full(count, CellType.VERTEX, dtype=np.uint8),
            "Offsets": np.arange(count + 1, dtype=np.int32),
            "PointData/status": status_numbers(contacts).astype(np.uint8),
            "PointData/bodies": contacts.bodies.astype(np.int32),
            "PointData/joint": contacts.joint.astype(np.int32),
        }
        arrays |= {f"PointData/{name}": getattr(contacts, name) for name in CONTACT_ARRAYS}
        return _Part(count, count, count, arrays)


_Block = _Stones | _ContactPoints
_NOUGHT, _AT_CELL = "Nought", "CellDataBegin"  # offsets of what all frames share, and of fields of cells
_PER_FRAME = ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")


class _Writer:
    """Blocks in an open file.

    Parameters
    ----------
    file : open for writing
    frames : number of frames that it will hold; None: it grows
    """

    def __init__(
        self, file: Any, blocks: Mapping[str, _Block], parts: Sequence[Mapping[str, _Part]] | None
    ) -> None:
        self._file, self._blocks, self._parts = file, blocks, parts
        self._filled: dict[tuple[Any, str], tuple[Any, int]] = {}

    def create(self, first: Mapping[str, _Part]) -> None:
        """Write what all frames share, and make room for the frames, which are like the first."""
        root = self._file.create_group(_ROOT, track_order=True)
        root.attrs["Version"] = np.array(_VERSION)
        root.attrs["Type"] = np.bytes_("MultiBlockDataSet")  # the composite that PyVista wraps
        tree = root.create_group("Assembly", track_order=True)
        for number, (name, block) in enumerate(self._blocks.items()):
            self._create_block(root.create_group(name), number, block, first[name])
            tree[name] = _soft_link(f"/{_ROOT}/{name}")

    def _create_block(self, group: Any, number: int, block: _Block, first: _Part) -> None:
        group.attrs["Version"], group.attrs["Type"] = np.array(_VERSION), np.bytes_("UnstructuredGrid")
        group.attrs["Index"] = number
        steps = group.create_group("Steps")
        steps.attrs["NSteps"] = 0
        for name, values in block.once.items():
            group[name] = values
        for name, like in first.arrays.items():
            total = (
                None
                if self._parts is None
                else sum(len(blocks[self._name(group)].arrays[name]) for blocks in self._parts)
            )
            self._make(group, name, like, total, _CHUNK)
        count = None if self._parts is None else len(self._parts)
        numbers = np.zeros(1, dtype=np.int64)
        self._make(steps, "Values", np.zeros(1), count)
        for name in ("NumberOfParts", "PartOffsets", "PointOffsets", _NOUGHT, _AT_CELL):
            self._make(steps, name, numbers, count)
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            self._make(steps, name, numbers[:, None], count)
        # fields of points begin where the points do: one array of offsets has many names
        for name in [*first.arrays, *block.once]:
            kind, _, field = name.partition("/")
            if field:
                offsets = (
                    "PointOffsets" if kind == "PointData" else _AT_CELL if name in first.arrays else _NOUGHT
                )
                steps[f"{kind}Offsets/{field}"] = steps[offsets]
        if isinstance(block, _Stones):
            for name, value in zip(_PER_FRAME, (first.points, first.cells, first.ids), strict=True):
                group[name] = np.array([value])
        else:
            for name in _PER_FRAME:
                self._make(group, name, numbers, count)
            # the points of all frames are counted from nought
            self._make(group, "Connectivity", np.zeros(1, dtype=np.int32), self._most(group), _CHUNK)

    @staticmethod
    def _name(group: Any) -> str:
        return str(group.name).rpartition("/")[2]

    def _most(self, group: Any) -> int | None:
        return (
            None if self._parts is None else max(blocks[self._name(group)].points for blocks in self._parts)
        )

    def _make(
        self, group: Any, name: str, like: NDArray[Any], total: int | None, least: int | None = None
    ) -> None:
        shape = like.shape[1:]
        if total is not None:
            group.create_dataset(name, (total, *shape), like.dtype)
            return
        bytes_of_row = max(1, like.dtype.itemsize * int(np.prod(shape, dtype=int)))
        rows = _STEPS_CHUNK if least is None else max(len(like), -(-least // bytes_of_row))
        group.create_dataset(name, (0, *shape), like.dtype, maxshape=(None, *shape), chunks=(rows, *shape))

    def add(self, instant: float, parts: Mapping[str, _Part]) -> None:
        """Add a frame; its number is written last."""
        for name, block in parts.items():
            self._add(self._file[f"{_ROOT}/{name}"], instant, block, isinstance(self._blocks[name], _Stones))

    def _add(self, group: Any, instant: float, block: _Part, shared: bool) -> None:
        steps = group["Steps"]
        count = int(steps.attrs["NSteps"])
        at = {name: self._append(group, name, values) for name, values in block.arrays.items()}
        if not shared:
            for name, number in zip(_PER_FRAME, (block.points, block.cells, block.ids), strict=True):
                self._append(group, name, np.array([number]))
            if (points_before := self._data(group, "Connectivity")[1]) < block.points:
                self._append(group, "Connectivity", np.arange(points_before, block.points, dtype=np.int32))
        offsets: dict[str, float] = {
            "Values": instant,
            "PartOffsets": 0 if shared else count,
            "NumberOfParts": 1,
            "PointOffsets": at["Points"],
            "CellOffsets": 0 if shared else at["Types"],
            "ConnectivityIdOffsets": 0,
            _NOUGHT: 0,
            _AT_CELL: count * block.cells if shared else 0,
        }
        for name, value in offsets.items():
            shape = (1, 1) if name in ("CellOffsets", "ConnectivityIdOffsets") else (1,)
            self._append(steps, name, np.full(shape, value))
        steps.attrs["NSteps"] = count + 1

    def _data(self, group: Any, name: str) -> tuple[Any, int]:
        """Return an array of the file, and how much of it is filled."""
        key = group.id, name
        if key not in self._filled:
            data = group[name]
            self._filled[key] = data, int(data.shape[0]) if self._parts is None else 0
        return self._filled[key]

    def _append(self, group: Any, name: str, values: NDArray[Any]) -> int:
        """Write values behind those that are there; return where they begin."""
        data, begin = self._data(group, name)
        end = begin + len(values)
        if self._parts is None:
            data.resize(end, axis=0)
        self._filled[group.id, name] = data, end
        data[begin:end] = values
        return begin


def _soft_link(path: str) -> Any:
    import h5py

    return h5py.SoftLink(path)


def _blocks_of(bodies: Sequence[BodyResult], blocks: Sequence[Block]) -> dict[str, _Block]:
    return {"stones": _Stones(bodies, blocks), "contacts": _ContactPoints()}


def _parts_of(blocks: Mapping[str, _Block], frame: Frame) -> dict[str, _Part]:
    return {name: block.part(frame) for name, block in blocks.items()}


def _begin(
    path: Path, blocks: Mapping[str, _Block], first: Frame, parts: Sequence[Mapping[str, _Part]] | None
) -> None:
    """Write a file without frames; made in memory, as HDF5 may not survive a disk that is full."""
    import h5py

    with h5py.File(
        "image", "w", driver="core", backing_store=False, block_size=ROOM, libver=_HEADERS
    ) as file:
        _Writer(file, blocks, parts).create(_parts_of(blocks, first))
        file.flush()
        image = file.id.get_file_image()
    path.write_bytes(image)


def _add(
    path: Path,
    blocks: Mapping[str, _Block],
    frames: Sequence[Frame],
    parts: Sequence[Mapping[str, _Part]] | None,
) -> None:
    """Add frames to a file; if there is no room on the disk, it stays as it is."""
    import h5py

    new = [_parts_of(blocks, frame) for frame in frames] if parts is None else parts
    size = sum(
        array.nbytes for written in new for block in written.values() for array in block.arrays.values()
    )
    least = sum(max(array.nbytes, _CHUNK) for block in new[-1].values() for array in block.arrays.values())
    with path.open("r+b") as room:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(room.fileno(), 0, path.stat().st_size + 2 * (size + least) + ROOM)
    with h5py.File(path, "r+", libver=_HEADERS, locking=False) as file:
        writer = _Writer(file, blocks, parts)
        for frame, written in zip(frames, new, strict=True):
            writer.add(frame.time, written)


def write_vtkhdf(
    path: Path, bodies: Sequence[BodyResult], blocks: Sequence[Block], frames: Sequence[Frame]
) -> None:
    """Write all frames of a run that is over, without room for more."""
    joined = _blocks_of(bodies, blocks)
    parts = [_parts_of(joined, frame) for frame in frames]
    _begin(path, joined, frames[0], parts)
    _add(path, joined, frames, parts)


class GrowingResults:
    """`results.vtkhdf` of a run in progress, which at any moment is whole, whatever happens to its writer.

    Parameters
    ----------
    path : of the file
    bodies, blocks : the stones at the start
    frames : those so far; the list to which the run adds others
    """

    def __init__(
        self, path: Path, bodies: Sequence[BodyResult], blocks: Sequence[Block], frames: Sequence[Frame]
    ) -> None:
        self._path, self._blocks, self._frames = path, _blocks_of(bodies, blocks), frames
        shown, hidden = (path.with_name(f".{letter}-{path.name}") for letter in "ab")
        # a copy of a run before this one may still have the name of the file
        for copy in (shown, hidden):
            copy.unlink(missing_ok=True)
        _begin(shown, self._blocks, frames[0], None)
        _add(shown, self._blocks, frames, None)
        shutil.copyfile(shown, hidden)
        self._copies = {shown: len(frames), hidden: len(frames)}  # with the frames that they hold
        self._show(shown)
        self._ended, self._took = time.perf_counter(), 0.0

    def update(self) -> None:
        """Add the frames that are new, unless that would slow down the run.

        Raises
        ------
        OSError, RuntimeError : the file cannot be written; what was there can still be read
        """
        began = time.perf_counter()
        if began - self._ended < self._took / SHARE:
            return
        hidden, count = list(self._copies.items())[-1]
        _add(hidden, self._blocks, self._frames[count:], None)
        self._show(hidden)
        others = {path: count for path, count in self._copies.items() if path != hidden}
        self._copies = {hidden: len(self._frames)} | others
        self._ended = time.perf_counter()
        self._took = self._ended - began

    def _show(self, copy: Path) -> None:
        """Let a copy have the name of the file, at once."""
        passing = self._path.with_name(f".{self._path.name}")
        passing.unlink(missing_ok=True)
        try:
            os.link(copy, passing)
        except OSError:
            shutil.copyfile(copy, passing)  # a file system without links
        with suppress(OSError), copy.open("rb") as file:
            os.fsync(file.fileno())
        passing.replace(self._path)
