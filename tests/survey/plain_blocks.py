"""Stones whose exact shape is known: as measured in a wall in the plane y = 0, and as solids of any place."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from survey.arrays import Array
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import SurveyedBlock, extrude
from survey.extrusion.imported_solids import block_of_solid
from survey.faces.faces import outline_face
from survey.geometry.solids import Solid
from survey.records.survey import BlockRecord, SolidRecord
from tests.survey.joints.assemblies import prism

DEPTH = Depth(0.4, None, "test", "kind", 1)
OBSERVER = np.array([0.5, -9.0, 0.5])


def stone(code: str, *corners: tuple[float, float], tilt: float = 0.0) -> SurveyedBlock:
    """A stone measured in a wall in the plane y = 0, seen from -y; x to the right, z up."""
    vertices = np.array([(x, tilt * x, z) for x, z in corners])
    record = BlockRecord(code, "header", 1, vertices, np.empty((0, 3)), 0.002)
    return extrude(outline_face(record, OBSERVER), DEPTH)


def box(code: str, x0: float, x1: float, z0: float, z1: float) -> SurveyedBlock:
    return stone(code, (x0, z0), (x1, z0), (x1, z1), (x0, z1))


def drawn(
    code: str, outline: Sequence[tuple[float, float]] | Array, near: float = 0.0, far: float = 0.4
) -> Solid:
    """A prism on a polygon (n, 2) of the x–z plane, from y = near to y = far."""
    flat = np.asarray(outline, dtype=float)
    front, back = (np.column_stack([flat[:, 0], np.full(len(flat), y), flat[:, 1]]) for y in (near, far))
    return prism(code, front, back)


def cuboid(code: str, low: Sequence[float], high: Sequence[float]) -> Solid:
    """A box from one corner to the other."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return drawn(code, [(x0, z0), (x1, z0), (x1, z1), (x0, z1)], y0, y1)


def as_stone(solid: Solid, observer: Array = OBSERVER) -> SurveyedBlock:
    """A solid as a stone that another program made, seen from a place."""
    record = SolidRecord(solid.code, "header", 1, solid.vertices, solid.faces, line=1)
    return block_of_solid(record, observer, "test")


def bond(
    courses: int = 3, per_course: int = 3, width: float = 0.01, noise: float = 0.0, seed: int = 0
) -> list[Solid]:
    """A running bond in the plane y = 0 whose joints are open; front corners, and those behind them, are noisy."""
    rng, out = np.random.default_rng(seed), []
    for course in range(courses):
        halves = course % 2
        joints = [0.0, *(k + 1.0 - 0.5 * halves for k in range(per_course - 1 + halves)), float(per_course)]
        for k, (a, b) in enumerate(pairwise(joints)):
            low, high = 0.3 * course + width / 2, 0.3 * (course + 1) - width / 2
            left, right = 0.6 * a + width / 2, 0.6 * b - width / 2
            flat = np.array([(left, low), (right, low), (right, high), (left, high)])
            out.append(drawn(f"B{course}-{k}", flat + rng.normal(0.0, noise, (4, 2)) if noise else flat))
    return out


def moved(solid: Solid, turn: Array, shift: Array) -> Solid:
    """A solid turned by a matrix, then shifted."""
    return Solid(solid.code, solid.vertices @ turn.T + shift, solid.faces)
