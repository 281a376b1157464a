"""Leaves: stones that are prisms between the same two planes, known by their outlines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import PER_MILLE, THINNEST, VANISHING
from survey.extrusion.extrusion import SurveyedBlock
from survey.joints.settings import JointMode, JointSettings
from survey.records.survey import FRAME_NOTE, OUTLINE_NOTE
from survey.simplify.simplify import BlockyStone

_DRAWN = THINNEST  # metres: distance within which planes that were stated, not measured, are the same
_TURNED = PER_MILLE  # of a stone's size: by which it may depart from a prism
_FRAME = 2e-3  # metres: distance within which stones state the same frame
_DECIMALS = 9  # of the frame's coordinates in metres: what is left of rounding


@dataclass(frozen=True)
class Leaf:
    """Stones that are prisms between the same two planes.

    Attributes
    ----------
    members : numbers of the stones
    right, up, normal : (3,) axes of the plane of the outlines, the normal towards the observer [-]
    front, depth : height of the front plane along the normal, and distance of the back plane behind it [m]
    frame : (2, 2) lower left and upper right corner of the leaf along `right` and `up` [m]
    outlines : (n, 2) of the members along these, counter-clockwise [m]
    """

    members: tuple[int, ...]
    right: Array
    up: Array
    normal: Array
    front: float
    depth: float
    frame: Array
    outlines: tuple[Array, ...]

    def place(self, flat: Array, behind: float) -> Array:
        """Return places (n, 3) of (n, 2) in the plane of the leaf, so far behind its front [m]."""
        across, upward = flat[:, :1], flat[:, 1:]
        out: Array = across * self.right + upward * self.up + (self.front - behind) * self.normal
        return out


@dataclass(frozen=True)
class _Prism:
    number: int
    normal: Array
    front: float
    depth: float
    stated: Array | None


Stone = SurveyedBlock | BlockyStone


def find_leaves(stones: Sequence[Stone], settings: JointSettings) -> list[Leaf]:
    """Find the stones that are to grow.

    Parameters
    ----------
    stones : of the building
    settings : with `grow`, all prisms between the same two planes, else those that came in as outlines alone

    Raises
    ------
    GeometryError
        if stones are to grow and there are no two prisms between the same planes
    """
    if settings.mode is not JointMode.MORTAR or settings.grow is False:
        return []
    drawn = settings.grow is None
    prisms = [
        prism
        for number, stone in enumerate(stones)
        if (not drawn or OUTLINE_NOTE in stone.face.record.notes)
        and (prism := _prism(number, stone)) is not None
    ]
    within = _DRAWN if drawn else settings.straightness
    leaves = []
    while prisms:
        seed = prisms[0]
        alike = [prism for prism in prisms if _alike(seed, prism, within)]
        prisms = [prism for prism in prisms if not any(prism is other for other in alike)]
        if len(alike) > 1:
            leaves.append(_leaf(stones, alike, settings.margin))
    if not drawn and not leaves:
        what = "grow in [joints], but no two stones are prisms between the same two planes"
        raise GeometryError(what, where="joints", remedy="leave grow out, or check depths and faces")
    return leaves


def _prism(number: int, stone: Stone) -> _Prism | None:
    """Return the planes of a stone; None if it is no prism square to its face, or lies flat."""
    normal, outline = stone.face.fit.normal, stone.face.outline
    heights = stone.solid.vertices @ normal
    front, depth = float((outline @ normal).mean()), stone.depth.value
    off = np.minimum(np.abs(heights - front), np.abs(heights - front + depth))
    if len(stone.solid.vertices) != 2 * len(outline) or off.max() > _TURNED * depth:
        return None
    if stone.extrusion.tail != 1.0 or float(np.hypot(*normal[:2])) < 0.5:
        return None
    right, up = _axes(normal)
    return _Prism(number, normal, front, depth, _stated_frame(stone, right, up))


def _axes(normal: Array) -> tuple[Array, Array]:
    """Return unit vectors to the right and upwards in an upright plane seen from its front."""
    up = np.array([0.0, 0.0, 1.0]) - normal[2] * normal
    up /= np.linalg.norm(up)
    return np.cross(up, normal), up


def _stated_frame(stone: Stone, right: Array, up: Array) -> Array | None:
    """Return the frame (2, 2) that the survey states by its distances from the outline; None if it does not."""
    note = stone.face.record.notes.get(FRAME_NOTE)
    if note is None:
        return None
    left, below, beyond, above = (float(word) for word in note.split())
    flat = stone.face.record.vertices @ np.column_stack([right, up])
    return np.array(
        [flat.min(axis=0) - np.array([left, below]), flat.max(axis=0) + np.array([beyond, above])]
    )


def _alike(seed: _Prism, candidate: _Prism, within: float) -> bool:
    if float(np.linalg.norm(seed.normal - candidate.normal)) > max(within, 1e-6):
        return False
    if max(abs(seed.front - candidate.front), abs(seed.depth - candidate.depth)) > within:
        return False
    if seed.stated is None or candidate.stated is None:
        return seed.stated is candidate.stated
    return float(np.abs(seed.stated - candidate.stated).max()) <= _FRAME


def _leaf(stones: Sequence[Stone], prisms: Sequence[_Prism], margin: float) -> Leaf:
    normal = np.mean([prism.normal for prism in prisms], axis=0)
    if abs(normal[2]) < VANISHING:
        normal[2] = 0.0
    normal /= np.linalg.norm(normal)
    right, up = _axes(normal)
    flat = [stones[prism.number].face.outline @ np.column_stack([right, up]) for prism in prisms]
    stated = [prism.stated for prism in prisms if prism.stated is not None]
    if stated:
        frame = np.mean(np.array(stated), axis=0, dtype=np.float64)
    else:
        every = np.concatenate(flat)
        frame = np.array([every.min(axis=0) - margin, every.max(axis=0) + margin])
    return Leaf(
        members=tuple(prism.number for prism in prisms),
        right=right,
        up=up,
        normal=normal,
        front=float(np.mean([prism.front for prism in prisms])),
        depth=float(np.mean([prism.depth for prism in prisms])),
        frame=np.round(frame, _DECIMALS),
        outlines=tuple(flat),
    )
