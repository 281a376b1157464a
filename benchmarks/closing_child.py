"""One size of `benchmarks.closing`, in a process of its own; prints one line of JSON."""

import json
import sys
import time
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from benchmarks.memory import peak_bytes
from benchmarks.report import Row
from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.mesher import mesh_block
from pipelines.samples.buildings.openings import ArchShape
from pipelines.samples.buildings.walls import wall
from survey.extrusion.extrusion import SurveyedBlock
from survey.geometry.solids import Solid
from survey.joints.close import ClosedStones, close_joints
from survey.joints.settings import JointSettings
from survey.simplify.simplify import BlockyStone, simplify

__all__ = ["main"]

_T = TypeVar("_T")
_STONE = Material("stone", 2400.0, 10e9, 0.2)


def main() -> None:
    """Close the wall of as many stones as the command line says; mesh its stones if it gives a size."""
    stones, size = int(sys.argv[1]), float(sys.argv[2])
    _run(_wall(100), size)  # compiles the kernels and fills caches
    print(json.dumps({"rows": _run(_wall(stones), size)}))


def _wall(stones: int) -> list[SurveyedBlock]:
    return wall(stones, arch=ArchShape.SEGMENTAL).blocks()


def _run(blocks: list[SurveyedBlock], size: float) -> list[Row]:
    simplified, first = _timed("simplify", lambda: [simplify(block) for block in blocks])
    closed, second = _timed("close joints", lambda: _closed(simplified))
    rows = [first, second | _found(closed)]
    if size:
        nodes, third = _timed("mesh", lambda: _meshed(closed.solids, size))
        rows.append(third | {"nodes": float(np.mean(nodes))})
    return [{"stones": len(blocks)} | row for row in rows]


def _timed(stage: str, work: Callable[[], _T]) -> tuple[_T, Row]:
    """What some work gives, and its processor time and how much the process has grown at its peak."""
    before, start = peak_bytes() or 0, time.process_time()
    out = work()
    seconds = time.process_time() - start
    return out, {"stage": stage, "seconds": seconds, "memory": (peak_bytes() or 0) - before}


def _closed(stones: Sequence[BlockyStone]) -> ClosedStones:
    return close_joints(stones, JointSettings())


def _found(closed: ClosedStones) -> Row:
    report = closed.report
    return {
        "joints": len(report.joints),
        "open": sum(bool(joint.left_open) for joint in report.joints),
        "moved_mm": 1e3 * report.largest_displacement,
    }


def _meshed(solids: Sequence[Solid], size: float) -> list[int]:
    """Nodes of each stone's mesh."""
    blocks = (
        Block(s.code, s.vertices, s.faces, _STONE, Fidelity.DEFORMABLE, size, Element.TET10) for s in solids
    )
    return [len(mesh_block(block).nodes) for block in blocks]


if __name__ == "__main__":
    main()
