"""Walls rendered as photographs, with the outline of every stone: ashlar, coursed, an arch over a door, rubble.

Everything is synthetic. Grain, pores and weathering of the stone, stains, sun and shade, repairs let into stones,
vegetation, and joints that are flush or recessed are there because real photographs have them.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Ints
from survey.clouds.extras import optional
from survey.geometry.polygons import ring_area
from synthetic.rubble_wall import SIZE, make_rubble_wall

STYLES = ("ashlar", "coursed", "arch", "rubble")
"""Kinds of walls."""

_FINER = 3  # pixels along the side of one, of the drawing before it is averaged
_QUARRIES = (2.0, 9.0)  # scatter of the colours of stones, from one bed of one quarry to many [of 255]
_PATCHES = (0.01, 0.03)  # sizes of weathered patches of a stone [m]
_WEATHERED = (2.0, 5.0)  # scatter of their colours [of 255]
_REPAIRED = 0.05  # part of the stones of ashlar that have a repair let in
_DOOR = (0.55, 1.25, 0.34, 11)  # half width, springing and thickness of its arch [m], number of voussoirs


@dataclass(frozen=True)
class _Style:
    """Size, courses [m], lengths of stones [m], thickness of joints [m], and shift of corners [m]."""

    size: tuple[float, float]
    heights: tuple[float, float]
    lengths: tuple[float, float]
    joints: tuple[float, float]
    jitter: float


_STYLES = {
    "ashlar": _Style((3.2, 2.2), (0.28, 0.38), (0.40, 0.95), (0.007, 0.011), 0.0015),
    "coursed": _Style((2.4, 1.8), (0.14, 0.24), (0.18, 0.48), (0.011, 0.018), 0.004),
    "arch": _Style((3.2, 2.8), (0.26, 0.34), (0.38, 0.80), (0.008, 0.012), 0.0015),
}


@dataclass(frozen=True)
class RenderedWall:
    """A photograph of a wall, and its truth.

    Attributes
    ----------
    picture : (h, w, 3)
    depth : (h, w) distance of the surface before the plane of the faces [m]; NaN in an opening
    pixel : side of a pixel [m]
    outlines : (n, 2) of each stone, to the right and upwards from the lower left corner of the picture [m]
    kinds : of each stone
    opening : (n, 2) of the door; None without one
    """

    picture: NDArray[np.uint8]
    depth: NDArray[np.float32]
    pixel: float
    outlines: tuple[Array, ...]
    kinds: tuple[str, ...]
    opening: Array | None


def render_wall(
    style: str, seed: int, pixel: float = 0.002, clutter: bool = True, weathered: bool = False
) -> RenderedWall:
    """Render a wall; the same style and seed always give the same one.

    Parameters
    ----------
    style : one of `STYLES`
    seed : of the random numbers
    pixel : side of a pixel [m]
    clutter : whether stains, shade, repairs and vegetation are there
    weathered : whether damp and lichen have left patches of colour on the stones
    """
    chance = np.random.default_rng([STYLES.index(style), seed])
    opening: Array | None = None
    if style == "rubble":
        wall = make_rubble_wall(seed)
        size, outlines, kinds = SIZE, list(wall.stones), ["rubble"] * len(wall.stones)
    else:
        shape = _STYLES[style]
        size = shape.size
        outlines = _courses(shape, chance)
        kinds = ["ashlar"] * len(outlines)
        if style == "arch":
            outlines, kinds, opening = _with_door(outlines, shape, chance)
        if style == "ashlar" and clutter:
            outlines, kinds = _with_repairs(outlines, kinds, chance)
    shape_px = round(size[1] / pixel), round(size[0] / pixel)
    fine = rasterised(outlines, (shape_px[0] * _FINER, shape_px[1] * _FINER), pixel / _FINER)
    void = np.zeros_like(fine) if opening is None else rasterised([opening], fine.shape, pixel / _FINER)
    picture, depth = _painted(fine, void > 0, pixel, clutter, chance)
    if weathered:
        picture = _with_patches(picture, depth, pixel, np.random.default_rng([STYLES.index(style), seed, 2]))
    return RenderedWall(picture, depth, pixel, tuple(outlines), tuple(kinds), opening)


def rasterised(outlines: list[Array] | tuple[Array, ...], shape: tuple[int, ...], pixel: float) -> Ints:
    """Return the number of the outline of each pixel (h, w), counted from 1; 0: none.

    Parameters
    ----------
    outlines : (n, 2) to the right and upwards from the lower left corner of the picture [m]
    shape : rows and columns
    pixel : its side [m]
    """
    from PIL import Image, ImageDraw

    picture = Image.new("I", (shape[1], shape[0]))
    drawing = ImageDraw.Draw(picture)
    for number, ring in enumerate(outlines, start=1):
        corners = [(float(s) / pixel - 0.5, shape[0] - float(t) / pixel - 0.5) for s, t in ring]
        drawing.polygon(corners, fill=number)
    return np.asarray(picture, dtype=np.int64)


def _courses(shape: _Style, chance: np.random.Generator) -> list[Array]:
    """Lay stones course by course, head joints away from those below."""
    width, height = shape.size
    beds = [-0.12 * chance.random()]
    while beds[-1] < height:
        beds.append(beds[-1] + chance.uniform(*shape.heights))
    out: list[Array] = []
    below: list[float] = []
    slope = chance.normal(0.0, 0.002)
    for low, high in pairwise(beds):
        heads = [-chance.uniform(0.0, shape.lengths[0])]
        while heads[-1] < width:
            tries = [heads[-1] + chance.uniform(*shape.lengths) for _ in range(12)]
            heads.append(max(tries, key=lambda one: min([abs(one - b) for b in below] or [1.0])))
        lean = chance.normal(0.0, 0.006, len(heads))
        joint = chance.uniform(*shape.joints)
        for k, (left, right) in enumerate(pairwise(heads)):
            half = 0.5 * joint
            ring = np.array(
                [
                    (left + half, low + half),
                    (right - half, low + half),
                    (right - half + lean[k + 1], high - half),
                    (left + half + lean[k], high - half),
                ]
            )
            ring[:, 1] += slope * ring[:, 0]
            ring += chance.normal(0.0, shape.jitter, ring.shape)
            out += _clipped(ring, shape.size)
        below = heads
    return out


def _clipped(ring: Array, size: tuple[float, float]) -> list[Array]:
    """Return what of a ring is within the picture; nothing of slivers."""
    shapely = optional("shapely", "rendered walls")
    return _rings(shapely.intersection(shapely.polygons(ring), shapely.box(0.0, 0.0, *size)))


def _rings(shape: Any, least: float = 0.004) -> list[Array]:
    """Return the rings (n, 2) of a shape, counter-clockwise, without parts under `least` square metres."""
    parts = getattr(shape, "geoms", [shape])
    rings = [
        np.asarray(one.exterior.coords)[:-1]
        for one in parts
        if one.geom_type == "Polygon" and one.area > least
    ]
    return [ring if ring_area(ring) > 0.0 else ring[::-1] for ring in rings]


def _with_door(
    outlines: list[Array], shape: _Style, chance: np.random.Generator
) -> tuple[list[Array], list[str], Array]:
    """Cut a door with a semicircular arch into a wall of courses."""
    shapely = optional("shapely", "rendered walls")
    half, springing, thick, count = _DOOR
    middle, joint = 0.5 * shape.size[0] + chance.uniform(-0.15, 0.15), 0.5 * shape.joints[0]
    turn = np.linspace(0.0, np.pi, 61)
    round_ = np.column_stack([np.cos(turn), np.sin(turn)])
    foot = np.array([[half, -0.01], [-half, -0.01]])
    opening = np.vstack([foot[:1], half * round_ + np.array([0.0, springing]), foot[1:]])
    opening[:, 0] += middle
    outer = half + thick
    centre = np.array([middle, springing])
    ring = shapely.polygons(outer * round_ + centre)
    cut = shapely.union(ring.buffer(joint, join_style="mitre"), shapely.polygons(opening).buffer(0.0))
    out: list[Array] = []
    for one in outlines:
        out += _rings(shapely.difference(shapely.polygons(one), cut))
    kinds = ["ashlar"] * len(out)
    angles = np.linspace(0.0, np.pi, count + 1)
    for k, (start, stop) in enumerate(pairwise(angles)):
        inner = _radial(half, start, stop, joint)[::-1]
        outside = _radial(outer, start, stop, joint)
        out.append(np.vstack([outside, inner]) + centre)
        kinds.append("keystone" if k == count // 2 else "voussoir")
    return out, kinds, np.clip(opening, 0.0, None)


def _radial(radius: float, start: float, stop: float, joint: float) -> Array:
    """Return places on a circle between two radial joints."""
    spare = np.arcsin(joint / radius)
    turn = np.linspace(start + spare, stop - spare, 5)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])


def _with_repairs(
    outlines: list[Array], kinds: list[str], chance: np.random.Generator
) -> tuple[list[Array], list[str]]:
    """Let small stones into the corners of some."""
    shapely = optional("shapely", "rendered walls")
    out: list[Array] = []
    names: list[str] = []
    for ring, kind in zip(outlines, kinds, strict=True):
        low, high = ring.min(axis=0), ring.max(axis=0)
        span = high - low
        if chance.random() > _REPAIRED or span.min() < 0.25:
            out.append(ring)
            names.append(kind)
            continue
        size = span * chance.uniform(0.3, 0.45, 2)
        corner = np.where(chance.random(2) < 0.5, 0.0, 1.0)
        start = low + corner * (span - size)
        patch = shapely.box(*start, *(start + size))
        whole = shapely.polygons(ring)
        pieces = _rings(shapely.difference(whole, patch.buffer(0.006, join_style="mitre")))
        pieces += _rings(shapely.intersection(whole, patch))
        out += pieces
        names += [kind] * len(pieces)
    return out, names


def _painted(
    fine: Ints, void: NDArray[np.bool_], pixel: float, clutter: bool, chance: np.random.Generator
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Paint colours and depth of a wall, whose stones have numbers."""
    from scipy.ndimage import gaussian_filter

    count = int(fine.max())
    base = np.array([188.0, 180.0, 165.0]) + chance.normal(0.0, 3.0, 3)
    quarries = chance.uniform(*_QUARRIES)
    colours = base + chance.normal(0.0, quarries, (count + 1, 1))
    colours += chance.normal(0.0, 0.4 * quarries, (count + 1, 3))
    recessed = bool(chance.random() < 0.5)
    sign = -1.0 if recessed or chance.random() < 0.7 else 0.7
    colours[0] = base + sign * chance.uniform(24.0, 45.0) + chance.normal(0.0, 4.0, 3)
    colour = _averaged(np.where(void[..., None], (46.0, 44.0, 42.0), colours[fine]))
    mortar = _averaged(((fine == 0) & ~void)[..., None].astype(np.float64))[..., 0]
    like = np.clip(
        0.25 + 0.35 * _unit(gaussian_filter(chance.normal(size=mortar.shape), 0.15 / pixel)), 0.0, 0.85
    )
    colour += (mortar * like)[..., None] * (
        base - colours[0]
    )  # mortar that has the colour of the stone in places
    relief = np.where(fine > 0, chance.normal(0.0, 0.002, count + 1)[fine], -0.014 if recessed else -0.003)
    depth = _averaged(np.where(void, -0.4, relief)[..., None])[..., 0]
    open_ = _averaged(void[..., None].astype(np.float64))[..., 0]
    shape = depth.shape
    for sigma, strength in ((0.0, 3.5), (2.0, 3.0), (8.0, 3.0), (40.0, 4.0)):
        noise = gaussian_filter(chance.normal(size=shape), sigma) if sigma else chance.normal(size=shape)
        colour += (1.0 - open_[..., None]) * (strength * noise / noise.std())[..., None]
    depth += 0.0007 * _unit(gaussian_filter(chance.normal(size=shape), 0.015 / pixel))
    if recessed:
        slope = np.gradient(gaussian_filter(np.where(open_ > 0.5, 0.0, depth), 1.0), pixel)
        colour *= np.clip(1.0 + 0.10 * (slope[0] - 0.5 * slope[1]), 0.55, 1.25)[..., None]
    if clutter:
        _clutter(colour, depth, open_, pixel, chance)
    colour = gaussian_filter(colour, (0.7, 0.7, 0.0)) + chance.normal(0.0, 2.0, colour.shape)
    depth[open_ > 0.5] = np.nan
    return np.clip(np.round(colour), 0.0, 255.0).astype(np.uint8), depth.astype(np.float32)


def _with_patches(
    picture: NDArray[np.uint8], depth: NDArray[np.float32], pixel: float, chance: np.random.Generator
) -> NDArray[np.uint8]:
    """Return a picture with patches of colour wherever there is wall."""
    from scipy.ndimage import gaussian_filter

    out = picture.astype(np.float64)
    for size in _PATCHES:
        noise = gaussian_filter(chance.normal(size=picture.shape), (size / pixel, size / pixel, 0.0))
        out += chance.uniform(*_WEATHERED) * _unit(noise) * np.isfinite(depth)[..., None]
    return np.clip(np.round(out), 0.0, 255.0).astype(np.uint8)


def _unit(noise: Array) -> Array:
    out: Array = noise / noise.std()
    return out


def _averaged(fine: Array) -> Array:
    """Return the means (h, w, channels) of the small pixels of each."""
    rows, columns, channels = fine.shape
    cells = fine.reshape(rows // _FINER, _FINER, columns // _FINER, _FINER, channels)
    out: Array = cells.mean(axis=(1, 3))
    return out


def _clutter(colour: Array, depth: Array, open_: Array, pixel: float, chance: np.random.Generator) -> None:
    """Add pores, stains, shade and vegetation."""
    from scipy.ndimage import gaussian_filter

    rows, columns = depth.shape
    y, x = np.mgrid[:rows, :columns] * pixel
    for _ in range(int(rows * columns * pixel**2 * 12)):
        place = chance.uniform(0.0, 1.0, 2) * (columns * pixel, rows * pixel)
        size = chance.uniform(0.002, 0.006)
        colour[(x - place[0]) ** 2 + (y - place[1]) ** 2 < size**2] *= 0.7
    for _ in range(3):
        place, size = (
            chance.uniform(0.0, 1.0, 2) * (columns * pixel, rows * pixel),
            chance.uniform(0.05, 0.15),
        )
        far = ((x - place[0]) / size) ** 2 + ((y - place[1]) / (3.0 * size)) ** 2
        colour *= (1.0 - 0.18 * np.exp(-far))[..., None]
    if chance.random() < 0.5:
        angle = chance.uniform(0.3, 1.2)
        edge = x * np.cos(angle) + y * np.sin(angle) - chance.uniform(0.3, 0.8) * columns * pixel
        colour *= (1.0 - 0.4 / (1.0 + np.exp(-edge / 0.004)))[..., None]
    leaf = gaussian_filter(chance.normal(size=depth.shape), 0.008 / pixel)
    for _ in range(int(chance.integers(0, 3))):
        place, size = (
            chance.uniform(0.0, 1.0, 2) * (columns * pixel, rows * pixel),
            chance.uniform(0.04, 0.09),
        )
        bush = ((x - place[0]) ** 2 + (y - place[1]) ** 2 < size**2) & (leaf > -0.3 * leaf.std())
        colour[bush] = np.array([70.0, 95.0, 50.0]) * (1.0 + 0.2 * leaf[bush] / leaf.std())[:, None]
        depth[bush] = 0.05
