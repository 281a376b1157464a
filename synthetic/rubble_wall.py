"""A wall of rubble in one leaf as somebody would trace it: a mask of its stones in white, synthetic.

The stones are the cells of a Voronoi diagram of jittered places, made higher before it is drawn and lower again
afterwards, so that beds are flatter than head joints are steep. Each pair of neighbours draws the thickness of its
joint, and both give half of it, so that the sides of the cells are the medial lines of the mortar.
"""

import io
import json
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Voronoi

from survey.arrays import Array

RUBBLE_SCENE = """\
# Rubble wall: synthetic, no such wall exists. Every key is explained in docs/scene.md.
{commands}
[scene]
name = "Rubble wall (synthetic)"

# Granite in lime mortar. All values are assumed, like the wall: of yours, say of each where it comes from, measured (in
# which test, on mortar, joint or masonry), of a model (whose) or assumed.
[materials.granite]
density = 2600.0   # kg/m³; assumed
young = 20e9       # Pa; assumed (without effect: stones count as rigid)
poisson = 0.2      # assumed (without effect)

[joints]
mode = "mortar"          # stones grow to the middle of the mortar between their outlines
mortar_density = 1800.0  # kg/m³; assumed

[contact]
placement = "area"  # joints open and crush like their area
spacing = 0.05      # m

[[laws]]
type = "elastic_joint"
friction = 0.7              # assumed
mortar_young = 0.5e9        # Pa; assumed; over the thickness of each joint it is its stiffness
mortar_poisson = 0.2        # assumed
tension = 0.1e6             # Pa; assumed; of the face between mortar and stone, not of the mortar
shear = 0.1e6               # Pa; assumed; of that face without pressure
energy_tension = 5.0        # J/m²; assumed: half the strength times 0.1 mm
energy_shear = 20.0         # J/m²; assumed: half the strength times 0.4 mm
compressive_strength = 5e6  # Pa; assumed; of the masonry

# The wall stands on the base of a rig, under a beam that is pushed and may turn.
[pushover]
height = 1.325  # m
load = 100e3    # N
head = "turns"
to = [0.01]     # m
"""
"""Scene of the sample."""

RUBBLE_WALL = "rubble-wall"
"""Name of the sample."""

SIZE = (1.0, 1.2)
"""Width and height of the wall [m]."""

DEPTH = 0.2
"""Thickness of the wall [m]."""

_COLUMNS, _ROWS = 5, 8
_STRETCH = np.array([1.0, 2.0])  # by which the diagram is wider and higher than the wall
_JITTER = 0.22  # of a cell's size: largest shift of its place
_JOINTS = (0.010, 0.025)  # least and largest thickness of the mortar between two stones [m]
_EDGES = (0.004, 0.010)  # and between a stone and the edge of the wall [m]
_PIXEL = 0.001  # [m]
_FINER = 8  # pixels along the side of one
_SEED = 1790


@dataclass(frozen=True)
class RubbleWall:
    """A wall of rubble.

    Attributes
    ----------
    cells : (n, 2) of each stone with its half of the mortar, counter-clockwise [m]
    stones : (n, 2) outline of each stone, counter-clockwise [m]
    joints : thickness of the mortar by the numbers of two stones [m]
    """

    cells: tuple[Array, ...]
    stones: tuple[Array, ...]
    joints: dict[tuple[int, int], float]


def make_rubble_wall(seed: int = _SEED) -> RubbleWall:
    """Make the wall; the same seed always gives the same one."""
    chance = np.random.default_rng(seed)
    across, up = SIZE[0] / _COLUMNS, SIZE[1] / _ROWS
    places = np.array(
        [
            ((column + 0.5 + 0.25 * (-1) ** row) * across, (row + 0.5) * up)
            for row in range(_ROWS)
            for column in range(_COLUMNS)
        ]
    )
    places += chance.uniform(-_JITTER, _JITTER, places.shape) * [across, up]
    places *= _STRETCH
    count = len(places)
    images = []
    for axis in (0, 1):
        for end in (0.0, SIZE[axis]):
            mirrored = places.copy()
            mirrored[:, axis] = 2.0 * end * _STRETCH[axis] - mirrored[:, axis]
            images.append(mirrored)
    diagram = Voronoi(np.concatenate([places, *images]))
    joints: dict[tuple[int, int], float] = {}
    cuts: list[list[tuple[Array, float]]] = [[] for _ in range(count)]
    for (i, j), ends in zip(diagram.ridge_points.tolist(), diagram.ridge_vertices, strict=True):
        i, j = min(i, j), max(i, j)
        if i >= count:
            continue
        first, second = diagram.points[i], diagram.points[j]
        inner = j < count
        thickness = float(chance.uniform(*(_JOINTS if inner else _EDGES)))
        if inner and min(ends) >= 0:
            joints[i, j] = thickness
        for stone, near, far in ((i, first, second), *(((j, second, first),) if inner else ())):
            normal = (far - near) * _STRETCH
            normal /= np.linalg.norm(normal)
            away = 0.5 * thickness if inner else thickness
            cuts[stone].append((normal, float(normal @ (0.5 * (first + second) / _STRETCH)) - away))
    cells, stones = [], []
    for stone in range(count):
        cell = diagram.vertices[diagram.regions[diagram.point_region[stone]]] / _STRETCH
        middle = cell.mean(axis=0)
        cell = cell[np.argsort(np.arctan2(*(cell - middle).T[::-1]))]
        cells.append(cell)
        for normal, offset in cuts[stone]:
            cell = _clipped(cell, normal, offset)
        stones.append(cell)
    return RubbleWall(tuple(cells), tuple(stones), joints)


def _clipped(ring: Array, normal: Array, offset: float) -> Array:
    """Return the part of a convex polygon (n, 2) where normal · x ≤ offset."""
    heights = ring @ normal - offset
    out = []
    for k in range(len(ring)):
        here, there = heights[k - 1], heights[k]
        if (here > 0.0) != (there > 0.0):
            out.append(ring[k - 1] + here / (here - there) * (ring[k] - ring[k - 1]))
        if there <= 0.0:
            out.append(ring[k])
    return np.array(out)


def mask_png(wall: RubbleWall) -> bytes:
    """Draw the stones in white on black, and say in the file that they are synthetic."""
    from PIL import Image, ImageDraw
    from PIL.PngImagePlugin import PngInfo

    # finer first: Pillow paints every pixel that a side touches
    columns, rows = (round(_FINER * one / _PIXEL) for one in SIZE)
    picture = Image.new("L", (columns, rows), 0)
    draw = ImageDraw.Draw(picture)
    for ring in wall.stones:
        pixels = np.array([0.0, rows]) + ring * np.array([_FINER, -_FINER]) / _PIXEL - 0.5
        draw.polygon([(x, y) for x, y in pixels.tolist()], fill=255)
    shares = np.asarray(picture).reshape(rows // _FINER, _FINER, columns // _FINER, _FINER).mean(axis=(1, 3))
    about = PngInfo()
    about.add_text("Title", "Rubble wall (synthetic): no such wall exists")
    out = io.BytesIO()
    Image.fromarray(np.where(shares > 127.5, 255, 0).astype(np.uint8)).save(out, "PNG", pnginfo=about)
    return out.getvalue()


def rubble_truth(wall: RubbleWall) -> str:
    """Write the true outlines as JSON, a stone to a line."""
    stones = [
        json.dumps(
            {
                "outline": (np.round(stone, 6) + 0.0).tolist(),
                "with_mortar": (np.round(cell, 6) + 0.0).tolist(),
            }
        )
        for stone, cell in zip(wall.stones, wall.cells, strict=True)
    ]
    about = "true outlines of a synthetic wall of rubble, to the right and upwards from its lower left corner; metres"
    lines = ",\n".join(stones)
    return f'{{\n"about": {json.dumps(about)},\n"stones": [\n{lines}\n]\n}}\n'
