"""Span and rise of arches, from the measured faces of their voussoirs.

Of each voussoir the two corners that are nearest to the middle of the opening lie on the intrados. The springings are
the lowest of them on either side. The crown is that of the circle through the intrados of the three voussoirs at
the middle, or its highest joint where that circle is lower, as at the point of a pointed arch.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.arrays import Array
from archmodel.tables.entities import Entity, Voussoir
from archmodel.tables.hierarchy import kinds_below
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Arch, Structure
from archmodel.tables.surveys import Measurement


@dataclass(frozen=True)
class ArchShape:
    """Shape of the intrados of an arch: clear width and height above the springings [m]."""

    span: float
    rise: float


def arch_shape(outlines: Sequence[Array], normals: Sequence[Array]) -> ArchShape | None:
    """Return the shape of an arch; None if no face was measured on a side.

    Parameters
    ----------
    outlines : (nv, 3) corners of the faces of one ring of voussoirs [m]
    normals : (3,) of each
    """
    facing = np.sum([np.zeros(3), *normals], axis=0)
    across = np.array([-facing[1], facing[0], 0.0])
    length = float(np.linalg.norm(across))
    if not outlines or not length > 0.0:
        return None
    flat = [np.column_stack([corners @ (across / length), corners[:, 2]]) for corners in outlines]
    whole = np.concatenate(flat)
    middle = np.array([0.5 * (whole[:, 0].min() + whole[:, 0].max()), whole[:, 1].min()])
    inner = [corners[np.argsort(np.linalg.norm(corners - middle, axis=1))[:2]] for corners in flat]
    every = np.concatenate(inner)
    sides = [every[every[:, 0] < middle[0]], every[every[:, 0] >= middle[0]]]
    if not all(len(side) for side in sides):
        return None
    left, right = (side[np.argmin(side[:, 1])] for side in sides)
    central = np.argsort([abs(corners[:, 0].mean() - middle[0]) for corners in inner])[:3]
    top = np.concatenate([inner[k] for k in central])
    crown = max(float(top[:, 1].max()), _crown(top))
    return ArchShape(float(right[0] - left[0]), crown - 0.5 * float(left[1] + right[1]))


def _crown(points: Array) -> float:
    """Return the height of the top of the circle that fits points (n, 2) best, if the points are on its upper half."""
    centred = points - points.mean(axis=0)
    matrix = np.column_stack([2.0 * centred, np.ones(len(points))])
    (x, y, c), _, rank, _ = np.linalg.lstsq(matrix, (centred**2).sum(axis=1), rcond=None)
    squared = c + x * x + y * y
    if rank < 3 or not squared > 0.0 or y > centred[:, 1].min():
        return -np.inf
    return float(points[:, 1].mean() + y + np.sqrt(squared))


def arch_shapes(session: Session) -> Mapping[int, ArchShape]:
    """Return the shapes of all arches by the number of the structure; of several rings the lowest counts."""
    rows = (
        select(Structure.id, Voussoir.ring, Measurement.outline, Measurement.normal)
        .join(Membership, Membership.structure_id == Structure.id)
        .join(Entity, Entity.id == Membership.entity_id)
        .join(Measurement, Measurement.entity_id == Entity.id)
        .where(
            Structure.kind.in_(kinds_below(Arch)),
            Entity.kind.in_(kinds_below(Voussoir)),
            *(table.superseded_id.is_(None) for table in (Structure, Membership, Measurement)),
        )
        .order_by(Structure.id, Membership.id)
    )
    arches: dict[int, list[tuple[int, Array, Array]]] = {}
    for number, ring, outline, normal in session.execute(rows):
        if len(outline) > 2:
            arches.setdefault(number, []).append((ring or 1, outline, normal))
    shapes = {}
    for number, stones in arches.items():
        lowest = min(ring for ring, _, _ in stones)
        ring_of = [(outline, normal) for ring, outline, normal in stones if ring == lowest]
        shape = arch_shape([outline for outline, _ in ring_of], [normal for _, normal in ring_of])
        if shape is not None:
            shapes[number] = shape
    return shapes
