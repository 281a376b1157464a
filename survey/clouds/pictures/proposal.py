"""Outlines of stones proposed from a picture of a wall, tile by tile."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Bools, Ints
from survey.clouds.pictures.bond import bond_of, join_weak, renumbered
from survey.clouds.pictures.channels import channels_of, grains, without_shade
from survey.clouds.pictures.joints import (
    DIRECTION,
    STEP_REACH,
    WIDTH,
    Field,
    Strength,
    combined,
    line_strength,
    step_evidence,
)
from survey.clouds.pictures.masonry import Named, name_stones
from survey.clouds.pictures.photograph import Photograph
from survey.clouds.pictures.regions import closed_regions, over_texture
from survey.clouds.pictures.scale import joint_width, resized, resized_field
from survey.clouds.pictures.shapes import outline_shapes, without_mortar
from survey.clouds.pictures.splitting import propose_missing
from survey.clouds.pictures.suitability import Findings, judge_picture, judge_result
from survey.clouds.settings import OutlineSettings
from survey.conventions import LARGELY
from survey.geometry.polygons import ring_area

_REACH = {"coursed": 1.0, "rubble": 6.0}  # farthest mortar from the middle of a joint, over its width
_HIDDEN = LARGELY  # part of a stone that something covers from which it is not proposed
_SAME = 0.3  # part of the smaller outline that two tiles share from which it is the same stone
_CHROMA = slice(1, 3)  # channels of a* and b*: those of lightness step at every edge of a shade
_OPEN = 6.0  # size of an opening over the width of a joint


@dataclass(frozen=True)
class ProposedBorder:
    """A border between two stones.

    Attributes
    ----------
    stones : their numbers in the proposal
    probability : that there is a joint
    place : (2,) its middle in the wall's plane [m]
    length : [m]
    """

    stones: tuple[int, int]
    probability: float
    place: tuple[float, float]
    length: float


@dataclass(frozen=True)
class ProposedStone:
    """A stone.

    Attributes
    ----------
    named : code, kind, course and place
    ring : (n, 2) corners in the wall's plane, counter-clockwise [m]
    score : probability that it is one whole stone: the least of those of its borders
    sigma : standard deviation of a corner [m]
    cut : whether the edge of the picture cuts it
    """

    named: Named
    ring: Array
    score: float
    sigma: float
    cut: bool


@dataclass(frozen=True)
class Proposal:
    """Outlines proposed from a picture.

    Attributes
    ----------
    stones : in reading order, from the ground
    borders : between them
    openings : (2, 2) lower left and upper right corner of each [m]
    masonry : "coursed" or "rubble", as the bond was judged
    joint : width of the joints [px], and [m]
    findings : doubts about the picture
    """

    stones: tuple[ProposedStone, ...]
    borders: tuple[ProposedBorder, ...]
    openings: tuple[Array, ...]
    masonry: str
    joint: tuple[float, float]
    findings: Findings


@dataclass(frozen=True)
class _Found:
    """A stone of a tile: ring and sigma in pixels of the picture, and borders by the number of the neighbour."""

    ring: Array
    sigma: float
    score: float
    borders: tuple[tuple[int, float, tuple[float, float], float], ...]


def propose_outlines(photograph: Photograph, settings: OutlineSettings | None = None) -> Proposal:
    """Propose the outlines of the stones of a wall.

    Parameters
    ----------
    photograph : with its place
    settings : kind of masonry and width of joints

    Returns
    -------
    Proposal : without stones where the picture is not fit for it; `findings` say why
    """
    chosen = settings or OutlineSettings()
    width, contrast = joint_width(photograph.pixels, photograph.depth)
    width = chosen.joint or width
    findings = judge_picture(photograph.pixels, width, contrast)
    kind = {"auto": "auto", "rubble": "rubble"}.get(chosen.masonry, "coursed")
    stones: list[_Found] = []
    voids: list[Array] = []
    for part in [] if findings.refused else _parts(photograph, width / WIDTH, chosen):
        kind, found, void = _tile(photograph, part, width / WIDTH, kind)
        stones = _together(stones, found)
        voids += void
    return _assembled(photograph, stones, voids, kind, width, findings)


def _together(stones: list[_Found], more: list[_Found]) -> list[_Found]:
    """Add the stones of a tile to those of others; of two that are the same, the one that is less cut stays."""
    if not stones:
        return more
    boxes = np.array([[stone.ring.min(axis=0), stone.ring.max(axis=0)] for stone in stones])
    taken = set()
    first = len(stones)
    renumber: dict[int, int] = {}
    out = list(stones)
    for k, added in enumerate(more):
        low, high = added.ring.min(axis=0), added.ring.max(axis=0)
        shared = np.clip(np.minimum(high, boxes[:, 1]) - np.maximum(low, boxes[:, 0]), 0.0, None).prod(axis=1)
        sizes = (boxes[:, 1] - boxes[:, 0]).prod(axis=1)
        same = np.flatnonzero(shared > _SAME * np.minimum(sizes, float((high - low).prod())))
        if len(same) == 0:
            renumber[k] = len(out)
            out.append(added)
            continue
        larger = int(same[np.argmax(shared[same])])
        renumber[k] = larger
        if larger not in taken and float((high - low).prod()) > sizes[larger] * 1.02:
            out[larger] = added
            taken.add(larger)
    moved = []
    for k, stone in enumerate(out):
        fresh = k >= first or k in taken
        moved.append(
            replace(
                stone, borders=tuple((renumber.get(other, -1), a, b, c) for other, a, b, c in stone.borders)
            )
            if fresh
            else stone
        )
    return moved


def _assembled(
    photograph: Photograph,
    stones: list[_Found],
    voids: list[Array],
    kind: str,
    width: float,
    findings: Findings,
) -> Proposal:
    """Place stones in the wall's plane, and name and order them."""
    places, shape = photograph.places, photograph.pixels.shape
    rings = [_counter_clockwise(places.place(stone.ring)) for stone in stones]
    openings = [np.sort(places.place(box), axis=0) for box in voids]
    coursed = kind != "rubble"
    last = np.array([shape[1], shape[0]]) - 1.0 - 0.5 * width
    cut = [
        bool((stone.ring.min(axis=0) < 0.5 * width).any() or (stone.ring.max(axis=0) > last).any())
        for stone in stones
    ]
    named = name_stones(rings, openings, coursed, cut)
    order = sorted(
        range(len(stones)), key=lambda k: (named[k].course or 0, named[k].course is None, named[k].code)
    )
    number = {k: n for n, k in enumerate(order)}
    out, borders = [], []
    for k in order:
        stone = stones[k]
        out.append(ProposedStone(named[k], rings[k], stone.score, stone.sigma * places.pixel, cut[k]))
        for other, chance, place, length in stone.borders:
            if other >= 0 and number[k] < number.get(other, -1):
                x, y = places.place(np.array([place]))[0].tolist()
                borders.append(
                    ProposedBorder((number[k], number[other]), chance, (x, y), length * places.pixel)
                )
    judged = judge_result(findings, rings, [stone.score for stone in out], coursed)
    joint = (width, width * places.pixel)
    if judged.refused:
        out, borders = [], []
    return Proposal(
        tuple(out), tuple(borders), tuple(openings), "coursed" if coursed else "rubble", joint, judged
    )


def _counter_clockwise(ring: Array) -> Array:
    return ring if ring_area(ring) > 0.0 else ring[::-1]


def _parts(photograph: Photograph, factor: float, settings: OutlineSettings) -> Iterator[tuple[slice, slice]]:
    """Yield the parts of a picture, rows and columns, that are worked on one after another."""
    height, width = photograph.pixels.shape[:2]
    most, spare = round(settings.tile * factor), round(settings.overlap * factor)
    for rows in _overlapping(height, most, spare):
        for columns in _overlapping(width, most, spare):
            yield rows, columns


def _overlapping(length: int, most: int, spare: int) -> list[slice]:
    """Return the fewest parts of a side that overlap, all of about the same length."""
    count = max(1, int(np.ceil((length - spare) / (most - spare))))
    ends = np.round(np.linspace(0.0, max(length - spare, 0), count + 1)).astype(int).tolist()
    return [slice(start, min(stop + spare, length)) for start, stop in pairwise(ends)]


@dataclass(frozen=True)
class Fields:
    """Measurements of a part of a picture, at the resolution of the work.

    Attributes
    ----------
    image : (h, w) in which joints are high
    strength : of joints, 1 at a usual one
    parting : (h, w) evidence of a joint, or of a step of colour where that is stronger
    hidden, void : (h, w) where something stands before the wall, and where there is none
    colours : (c, h, w) of the stones, each over its grain
    """

    image: Field
    strength: Strength
    parting: Field
    hidden: Bools
    void: Bools
    colours: NDArray[np.float32]


def measured_fields(photograph: Photograph, part: tuple[slice, slice], factor: float) -> Fields:
    """Measure a part of a picture, whose pixels become `factor` times as large."""
    from scipy.ndimage import maximum_filter

    pixels = resized(photograph.pixels[part], factor)
    depth = None if photograph.depth is None else resized_field(photograph.depth[part], factor)
    left_out = None
    if photograph.left_out is not None:
        left_out = resized_field(photograph.left_out[part].astype(np.float32), factor) > 0.5
    channels, hidden, void = channels_of(pixels, depth, left_out)
    channels = without_shade(channels)
    image = combined(channels)
    strength, colours = over_texture(line_strength(image, hidden)), grains(channels)
    veil = maximum_filter(hidden, 2 * STEP_REACH + 1)
    steps = np.where(veil, np.float32(0.0), step_evidence(colours[_CHROMA]))
    parting = np.maximum(strength.evidence, steps)
    return Fields(image, strength, parting, hidden, void, colours)


def joined_regions(fields: Fields, kind: str, weights: Array | None = None) -> Ints:
    """Return the regions (h, w) of a part of a picture, those that are one stone joined, by other weights if given."""
    regions = closed_regions(fields.parting, fields.void)
    bond = bond_of(regions, fields.strength, fields.colours, fields.hidden, kind)
    if weights is not None:
        bond.weights = weights
    join_weak(bond)
    return renumbered(regions, bond)


def _tile(
    photograph: Photograph, part: tuple[slice, slice], factor: float, kind: str
) -> tuple[str, list[_Found], list[Array]]:
    fields = measured_fields(photograph, part, factor)
    if kind == "auto":
        kind = _kind_of(fields.strength)
    regions = joined_regions(fields, kind)
    if kind == "coursed":
        regions = propose_missing(regions, fields.strength, fields.hidden)
    found = _stones_of(regions, fields, kind)
    corner = np.array([part[1].start, part[0].start], dtype=np.float64)
    size = np.array([part[1].stop - part[1].start, part[0].stop - part[0].start])
    scale = size / np.array(regions.shape[::-1])
    return kind, [_moved(one, corner, scale, factor) for one in found], _boxes(fields.void, corner, scale)


def _kind_of(strength: Strength) -> str:
    """Return whether most joints are of one direction or square to it, as in courses, or of all, as in rubble."""
    strong = strength.evidence > 0.6
    if not strong.any():
        return "coursed"
    quarter = np.round(strength.angle[strong] / DIRECTION).astype(int) % round(0.5 * np.pi / DIRECTION)
    share = np.bincount(quarter, strength.evidence[strong])
    return "coursed" if 2.0 * share.max() > share.sum() else "rubble"


def _stones_of(regions: Ints, fields: Fields, kind: str) -> list[_Found]:
    """Return the stones of regions, in pixels of the work."""
    bond = bond_of(regions, fields.strength, fields.colours, fields.hidden, kind)
    stone = without_mortar(regions, fields.image, fields.hidden, _REACH[kind])
    shapes = outline_shapes(regions, stone, fields.hidden)
    count = np.bincount(regions.ravel())
    veiled = np.bincount(regions.ravel(), fields.hidden.ravel().astype(np.float64), len(count))
    shapes = [shape for shape in shapes if veiled[shape.number] <= _HIDDEN * count[shape.number]]
    place = {one.number: k for k, one in enumerate(shapes)}
    out = []
    for one in shapes:
        borders = []
        for other, border in bond.borders[one.number].items():
            chance = bond.certainty(one.number, other)
            row, column = (border.sums[2:4] / border.length).tolist()
            borders.append((place.get(other, -1), chance, (column, row), border.length))
        score = min([chance for _, chance, _, length in borders if length > WIDTH] or [1.0])
        out.append(_Found(one.ring, one.sigma, score, tuple(borders)))
    return out


def _moved(stone: _Found, corner: Array, scale: Array, factor: float) -> _Found:
    """Return a stone in pixels of the picture."""
    borders = tuple(
        (other, chance, tuple(((np.array(place) + 0.5) * scale - 0.5 + corner).tolist()), length * factor)
        for other, chance, place, length in stone.borders
    )
    ring = (stone.ring + 0.5) * scale - 0.5 + corner
    return replace(stone, ring=ring, sigma=stone.sigma * factor, borders=borders)


def _boxes(void: Bools, corner: Array, scale: Array) -> list[Array]:
    """Return the boxes (2, 2) of what is open, in pixels of the picture."""
    from scipy.ndimage import find_objects, label

    numbers, _ = label(void)
    return [
        (np.array([(x.start, y.start), (x.stop, y.stop)]) * scale - 0.5 + corner)
        for y, x in find_objects(numbers)
        if min(y.stop - y.start, x.stop - x.start) > _OPEN * WIDTH
    ]
