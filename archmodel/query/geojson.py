"""Faces of stones as GeoJSON (RFC 7946), for geographic information systems and drawing programs.

Coordinates are metres in the frame of the site, not degrees. A vertical face has no area in plan, hence `flat`:
polygons in the plane of the wall, u along it to the right as one looks at it, v upwards.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from archmodel.arrays import Array
from archmodel.query.api import FoundFace
from ground.errors import UsageError

MAX_ANGLE = math.radians(30.0)
"""Faces that look farther than this from the mean direction are not of one wall [rad]."""

LEVEL = 0.05
"""A direction nearer to the vertical than this (sine) has no horizontal axis of its own."""

DECIMALS = 6
"""Of coordinates: micrometres."""


def feature_collection(faces: Iterable[FoundFace]) -> dict[str, object]:
    """Make one feature for each face, with its attributes as properties; no geometry where none was measured."""
    return {"type": "FeatureCollection", "features": [_feature(face) for face in faces]}


def flattened(faces: Sequence[FoundFace]) -> list[FoundFace]:
    """Return the faces with outlines (nv, 2) in the plane of the wall [m]: u along it, v upwards.

    For a wall without slope, v is the height z. Level faces (a paving) have u = x, v = y if they look up.

    Raises
    ------
    UsageError
        if the faces do not look in one direction within 30°
    """
    measured = [face for face in faces if face.normal is not None]
    if not measured:
        return list(faces)
    normals = np.array([face.normal for face in measured])
    mean = normals.mean(axis=0)
    size = float(np.linalg.norm(mean))
    # Normals that cancel have no mean; within 30° of it, they add up to more than half their number.
    normal = mean / size if size > 0.5 else normals[0]
    cosines = normals @ normal
    worst = int(np.argmin(cosines))
    if cosines[worst] < math.cos(MAX_ANGLE):
        angle = math.degrees(math.acos(max(-1.0, float(cosines[worst]))))
        raise UsageError(
            f"the face of {measured[worst].row.get('code', 'a stone')} looks {angle:.0f}° away from the others",
            where="--flat",
            remedy="select the stones of one wall, e.g. by member_of(…) or zone",
        )
    axes = _axes(normal)
    return [
        face if face.outline is None else FoundFace(face.outline @ axes.T, face.normal, face.row)
        for face in faces
    ]


def _axes(normal: Array) -> Array:
    """Return directions u and v (2, 3) in the plane, so that u × v is the normal."""
    along = np.array([-normal[1], normal[0], 0.0])
    if float(np.linalg.norm(along)) < LEVEL:
        along = np.array([math.copysign(1.0, normal[2]), 0.0, 0.0])
    along /= np.linalg.norm(along)
    up = np.cross(normal, along)
    return np.array([along, up / np.linalg.norm(up)])


def _feature(face: FoundFace) -> dict[str, object]:
    geometry: dict[str, object] | None = None
    if face.outline is not None:
        # A ring ends where it began; -0.0 is 0.
        ring = (np.vstack([face.outline, face.outline[:1]]).round(DECIMALS) + 0.0).tolist()
        geometry = {"type": "Polygon", "coordinates": [ring]}
    return {"type": "Feature", "id": face.row.get("code"), "geometry": geometry, "properties": face.row}
