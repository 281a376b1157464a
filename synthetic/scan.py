"""Simulated scan of a wall, and outlines of its stones as somebody draws them over an orthophoto.

Everything is synthetic. The scanner's noise, the roughness of the stones, which neighbouring points share, mortar
behind the faces, worn corners, ivy, a scaffold tube and mixed pixels are there because real scans have them.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Bools
from survey.clouds.extras import optional
from synthetic.buildings.window import WindowBay
from synthetic.frame import TrueStone, WallFrame
from synthetic.measure import MeasuredStone, inset

JITTER = 0.005
"""Standard deviation of a drawn corner, across and up [m]."""

_NOISE = 0.0015  # standard deviation of one point along the line of sight [m]
_STREAK = 0.0003  # of a row of points: errors that the scanner makes for a whole line [m]
_ROUGH = 0.0007  # standard deviation of the roughness of the stones [m]
_ROUGHNESS_LENGTH = 0.015  # over which it is correlated [m]
_MORTAR = (0.010, 0.018)  # distance of mortar behind the faces [m]
_WORN = (0.025, 0.018)  # radius of a worn corner, and how far it lies behind the face [m]
_IVY = 26  # bushes
_IVY_SIZE = (0.06, 0.16)  # their radius [m]
_LEAVES = (0.005, 0.12)  # distance of leaves before the wall [m]
_DENSE = 0.6  # part of the points of a bush that lie on leaves
_TUBE = (
    -1.75,
    0.024,
    0.14,
)  # place along the wall of a scaffold tube, its radius, its distance before the wall [m]
_MIXED = 0.01  # part of the points between two surfaces, anywhere in space
_PIXEL = 0.003  # side of a pixel of masks [m]
_BEHIND = 0.35  # distance of what is seen through the window behind the wall [m]


@dataclass(frozen=True)
class Scan:
    """A scan with outlines.

    Attributes
    ----------
    points : (n, 3) in the site [m]
    colours : (n, 3)
    clutter : (n,) whether a point lies on something else than the wall
    outlines : (nv, 2) drawn corners of each stone in the wall's plane [m], in the order of the survey
    bay : the wall
    """

    points: Array
    colours: NDArray[np.uint8]
    clutter: Bools
    outlines: tuple[Array, ...]
    bay: WindowBay


def visible_corners(stone: TrueStone, measured: MeasuredStone) -> Array:
    """Return the corners (4, 2) of the visible face of a stone in the wall's plane, joints open [m]."""
    return inset(stone.plan.corners, measured.half_joints)


def scan_window(bay: WindowBay, spacing: float = 0.006, seed: int = 42, clutter: bool = True) -> Scan:
    """Scan the window bay.

    Parameters
    ----------
    bay : the wall
    spacing : distance of neighbouring points [m]
    seed : of the random numbers
    clutter : whether ivy, a tube and mixed pixels are there
    """
    rng = np.random.default_rng(seed)
    corners = [visible_corners(*pair) for pair in zip(bay.stones, bay.measured, strict=True)]
    flat, row = _grid(np.concatenate([stone.plan.corners for stone in bay.stones]), spacing, rng)
    depth, colours = _surface(bay, corners, flat, spacing, rng)
    opening = np.isnan(depth)
    depth[opening] = -_BEHIND + rng.normal(0.0, 0.05, int(opening.sum()))
    foreign = opening.copy()
    if clutter:
        foreign |= _clutter(flat, depth, colours, rng)
    depth += rng.normal(0.0, _NOISE, len(depth)) + rng.normal(0.0, _STREAK, row.max() + 1)[row]
    frame = bay.frame
    points = frame.origin + flat @ frame.axes[:2] + np.outer(depth, frame.axes[2])
    drawn = tuple(corner + rng.normal(0.0, JITTER, corner.shape) for corner in corners)
    return Scan(points, colours, foreign & ~opening, drawn, bay)


def _grid(corners: Array, spacing: float, rng: np.random.Generator) -> tuple[Array, NDArray[np.intp]]:
    """Return places in the wall's plane, line by line, and the line of each."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    counts = np.ceil((high - low) / spacing).astype(int)
    row, column = np.divmod(np.arange(counts.prod()), counts[0])
    flat = low + (np.column_stack([column, row]) + rng.random((len(row), 2))) * spacing
    return flat, row


def _surface(
    bay: WindowBay, corners: list[Array], flat: Array, spacing: float, rng: np.random.Generator
) -> tuple[Array, NDArray[np.uint8]]:
    """Return depth of the wall before its plane, NaN in the opening, and colours."""
    depth, colours = np.full(len(flat), np.nan), np.full((len(flat), 3), (70, 75, 85))
    rough = _roughness(flat, spacing, rng)
    for stone, measured, visible in zip(bay.stones, bay.measured, corners, strict=True):
        close = np.flatnonzero(_within(flat, stone.plan.corners))
        depth[close] = -rng.uniform(*_MORTAR) + 2.0 * rough[close]
        colours[close] = (188, 180, 165)
        visible_rows = close[_within(flat[close], visible)]
        out = _on_face(stone, bay.frame, flat[visible_rows]) + rough[visible_rows]
        if measured.worn_corner is not None:
            radius, back = _WORN
            apart = np.linalg.norm(flat[visible_rows] - visible[measured.worn_corner], axis=1)
            out -= back * np.clip(1.0 - apart / radius, 0.0, 1.0)
        depth[visible_rows] = out
        colours[visible_rows] = np.array([170, 155, 130]) + rng.integers(-25, 25)
    shade = rng.integers(-8, 9, len(flat))[:, None]
    return depth, np.clip(colours + shade, 0, 255).astype(np.uint8)


def _on_face(stone: TrueStone, frame: WallFrame, flat: Array) -> Array:
    """Return how far a face lies before the wall's plane [m]."""
    lift: Array = (stone.offset - frame.place(flat) @ stone.normal) / float(frame.axes[2] @ stone.normal)
    return lift


def _within(flat: Array, corners: Array) -> Bools:
    """Return which places lie in a convex polygon, counter-clockwise."""
    inside = np.ones(len(flat), dtype=bool)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = b - a
        inside &= side[0] * (flat[:, 1] - a[1]) - side[1] * (flat[:, 0] - a[0]) >= 0.0
    return inside


def _roughness(flat: Array, spacing: float, rng: np.random.Generator) -> Array:
    """Return correlated heights with the standard deviation of the stones' roughness."""
    from scipy.ndimage import gaussian_filter

    cells = np.floor((flat - flat.min(axis=0)) / spacing).astype(int)
    field = gaussian_filter(rng.normal(size=cells.max(axis=0) + 1), _ROUGHNESS_LENGTH / spacing)
    heights: Array = (field * (_ROUGH / field.std()))[cells[:, 0], cells[:, 1]]
    return heights


def _clutter(flat: Array, depth: Array, colours: NDArray[np.uint8], rng: np.random.Generator) -> Bools:
    """Put things before the wall; return which points lie on them."""
    foreign = rng.random(len(flat)) < _MIXED
    depth[foreign] = rng.uniform(-0.1, 0.14, int(foreign.sum()))
    low, high = flat.min(axis=0), flat.max(axis=0)
    for _ in range(_IVY):
        middle, radius = rng.uniform(low, high), rng.uniform(*_IVY_SIZE)
        bush = np.hypot(*(flat - middle).T) < radius * rng.uniform(0.8, 1.2, len(flat))
        leaves = bush & (rng.random(len(flat)) < _DENSE)
        depth[leaves] = rng.uniform(*_LEAVES, int(leaves.sum()))
        colours[leaves] = (60, 95, 45)
        foreign |= leaves
    place, radius, before = _TUBE
    tube = np.abs(flat[:, 0] - place) < radius
    depth[tube] = before + np.sqrt(radius**2 - (flat[tube, 0] - place) ** 2)
    colours[tube] = (120, 120, 125)
    return foreign | tube


def outlines_text(scan: Scan) -> str:
    """Return the drawn outlines as GeoJSON, in the plane of the wall."""
    features = []
    for ring, measured in zip(scan.outlines, scan.bay.measured, strict=True):
        record = measured.record
        attributes: dict[str, object] = {"code": record.code, "kind": record.kind}
        if record.course is not None:
            attributes["course"] = record.course
        if record.depth is not None:
            attributes |= {"depth": record.depth, "depth_sigma": record.depth_sigma}
        rounded = (np.round(ring, 4) + 0.0).tolist()
        shape = {"type": "Polygon", "coordinates": [[*rounded, rounded[0]]]}
        features.append(json.dumps({"type": "Feature", "properties": attributes, "geometry": shape}))
    about = json.dumps("synthetic: outlines of the stones of a window bay, drawn with 5 mm of jitter")
    return (
        f'{{"type": "FeatureCollection", "about": {about}, "features": [\n' + ",\n".join(features) + "\n]}\n"
    )


def write_masks(scan: Scan, path: Path) -> None:
    """Write the drawn outlines as a picture: stones in white, mortar in black, of the panel and nothing else."""
    from PIL import Image, ImageDraw

    panel = np.concatenate([stone.plan.corners for stone in scan.bay.stones])
    low, high = panel.min(axis=0), panel.max(axis=0)
    columns, rows = (int(one) for one in np.round((high - low) / _PIXEL))
    picture = Image.new("L", (columns, rows))
    drawing = ImageDraw.Draw(picture)
    for ring in scan.outlines:
        flat = (ring - low) / _PIXEL
        corners = [(float(x) - 0.5, rows - float(y) - 0.5) for x, y in flat]
        drawing.polygon(corners, fill=255)
        # neighbours whose outlines touch stay two pieces
        drawing.line([*corners, corners[0]], fill=0, width=2)
    picture.save(path)


def write_scan(scan: Scan, path: Path) -> None:
    """Write the points of a scan as LAZ, to a tenth of a millimetre.

    Raises
    ------
    UsageError
        if laspy or lazrs is not installed
    """
    laspy = optional("laspy", "LAZ files")
    optional("lazrs", "LAZ files")
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.scales = np.full(3, 1e-4)
    header.offsets = np.floor(scan.points.min(axis=0))
    # the date would make each file another
    header.creation_date = None
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = scan.points.T
    for name, values in zip(("red", "green", "blue"), scan.colours.T, strict=True):
        setattr(cloud, name, values.astype(np.uint16) * 257)
    cloud.write(str(path))
