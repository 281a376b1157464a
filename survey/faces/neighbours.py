"""Spatial search among measured faces: the neighbours of a stone, and the faces of its wall."""

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from survey.arrays import Array
from survey.conventions import CORNERS, MOST, ONE_WAY
from survey.faces.planes import FaceFit

Indices = NDArray[np.intp]

_SAME_WAY = math.cos(ONE_WAY)  # faces turned farther belong to another wall
_ENOUGH = CORNERS  # least number of neighbours that define a plane
_REACH = MOST  # largest distance of a neighbour, in sizes of the stone
_LEANING = 0.03  # deviation of a wall from the plane of the marks, per distance from them


class MeasuredFace(Protocol):
    """A face with a code, a plane and an outline."""

    @property
    def code(self) -> str:
        """Code of the stone."""

    @property
    def fit(self) -> FaceFit:
        """Plane of the face."""

    @property
    def outline(self) -> Array:
        """Corners in order, (nv, 3) [m]."""


class Neighbours:
    """An index of measured faces by place.

    Parameters
    ----------
    faces : in any order
    """

    def __init__(self, faces: Sequence[MeasuredFace]) -> None:
        self.codes = tuple(face.code for face in faces)
        self._fits = [face.fit for face in faces]
        self._normals = np.array([face.fit.normal for face in faces]).reshape(-1, 3)
        self._corners = np.concatenate([face.outline for face in faces] or [np.empty((0, 3))])
        self._next = np.concatenate(
            [np.roll(face.outline, -1, axis=0) for face in faces] or [np.empty((0, 3))]
        )
        self._counts = np.array([len(face.outline) for face in faces], dtype=np.intp)
        self._starts = np.cumsum(self._counts) - self._counts
        self._centres = np.array([face.outline.mean(axis=0) for face in faces]).reshape(-1, 3)
        owner = np.repeat(np.arange(len(faces)), self._counts)
        self._radii = np.zeros(len(faces))
        np.maximum.at(self._radii, owner, np.linalg.norm(self._corners - self._centres[owner], axis=1))
        self._tree = cKDTree(self._centres) if faces else None

    def near(self, outline: Array, normal: Array) -> Indices:
        """Find three or more faces that face the same way within half the size of an outline (nv, 3); else none."""
        if self._tree is None:
            return np.empty(0, dtype=np.intp)
        centre = outline.mean(axis=0)
        reach = _REACH * float(np.linalg.norm(outline[:, None] - outline[None], axis=2).max())
        around = float(np.linalg.norm(outline - centre, axis=1).max()) + reach
        candidates = np.sort(self._tree.query_ball_point(centre, around + float(self._radii.max()))).astype(
            np.intp
        )
        apart = np.linalg.norm(self._centres[candidates] - centre, axis=1)
        candidates = candidates[
            (apart <= around + self._radii[candidates]) & (self._normals[candidates] @ normal >= _SAME_WAY)
        ]
        if len(candidates) < _ENOUGH:
            return np.empty(0, dtype=np.intp)
        indices: Indices = candidates[self._distances(outline, candidates) <= reach]
        return indices if len(indices) >= _ENOUGH else indices[:0]

    def _distances(self, outline: Array, indices: Indices) -> Array:
        """Compute the distance of some faces from an outline: of the nearest corner from an edge, (k,) [m]."""
        counts = self._counts[indices]
        first = np.cumsum(counts) - counts
        rows = np.repeat(self._starts[indices] - first, counts) + np.arange(counts.sum())
        to_outline = _to_segments(outline, self._corners[rows], self._next[rows]).min(axis=0)
        from_outline = _to_segments(self._corners[rows], outline, np.roll(outline, -1, axis=0)).min(axis=1)
        out: Array = np.minimum.reduceat(np.minimum(to_outline, from_outline), first)
        return out

    def on_wall(self, centre: Array, normal: Array, size: float) -> Indices:
        """Find three or more faces of the wall through a place: parallel to it and near its plane; else none."""
        arms = self._centres - centre
        heights = np.abs(arms @ normal)
        along = np.sqrt(np.maximum((arms**2).sum(axis=1) - heights**2, 0.0))
        same = (self._normals @ normal >= _SAME_WAY) & (heights <= np.maximum(size, _LEANING * along))
        indices: Indices = np.flatnonzero(same)
        return indices if len(indices) >= _ENOUGH else indices[:0]

    def outward(self, centre: Array, normal: Array, size: float) -> Array:
        """Turn the normal of a wall through a place to the side that most of its faces look to."""
        ahead, behind = self.on_wall(centre, normal, size), self.on_wall(centre, -normal, size)
        return -normal if len(behind) > len(ahead) else normal

    def fits(self, indices: Indices) -> list[FaceFit]:
        """Return the planes of some faces."""
        return [self._fits[i] for i in indices]


def _to_segments(points: Array, starts: Array, ends: Array) -> Array:
    """Compute the distances of points (p, 3) from segments (e, 3) to (e, 3), (p, e) [m]."""
    run = ends - starts
    length = np.maximum((run**2).sum(axis=1), 1e-300)
    from_start = points[:, None] - starts[None]
    fraction = np.clip((from_start * run).sum(axis=2) / length, 0.0, 1.0)
    out: Array = np.linalg.norm(from_start - fraction[..., None] * run, axis=2)
    return out
