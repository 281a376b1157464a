"""Stones of simple shapes: boxes, prisms, wedges, voussoirs, drums, and the arches, walls and columns they make.

Lengths are metres, angles radians. All corners are sharp: contact points lie at the true edges of the faces. Further
fields of `Block` (fidelity, mesh_size, velocity, …) are keywords of every function, and hold for its stones that are
not fixed.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from mechanics.arrays import Array
from mechanics.scene.scene import Block, Fidelity, Part
from mechanics.stones.materials import Material

Point = tuple[float, float]
Polygon = Sequence[Sequence[float]] | Array

LIMESTONE = Material("limestone", density=2400.0, young=1e10, poisson=0.2)
"""A sound limestone."""

BOX_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
"""The faces of a hexahedron, counter-clockwise seen from outside, for corners in the order of `box_corners`."""


def box_corners(low: Sequence[float] | Array, high: Sequence[float] | Array) -> Array:
    """Return the corners (8, 3) of an axis-parallel box: round the bottom, then round the top [m]."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return np.array([(x, y, z) for z in (z0, z1) for x, y in ring], dtype=float)


def box(
    code: str,
    low: Sequence[float] | Array,
    high: Sequence[float] | Array,
    material: Material = LIMESTONE,
    **fields: Any,
) -> Block:
    """Return an axis-parallel stone from corner `low` (3,) to corner `high` (3,) [m].

    Examples
    --------
    >>> ashlar = box("A1", (0, 0, 0), (0.6, 0.4, 0.3), mesh_size=0.1)
    >>> ashlar.vertices.max(axis=0).tolist()
    [0.6, 0.4, 0.3]
    """
    return Block(code, box_corners(low, high), BOX_FACES, material, **fields)


def prism(
    code: str,
    polygon: Polygon,
    depth: float,
    material: Material = LIMESTONE,
    at: float = 0.0,
    parts: Sequence[Polygon] = (),
    **fields: Any,
) -> Block:
    """Return a polygon of the x-z plane drawn along y.

    Parameters
    ----------
    code : of the stone
    polygon : (n, 2) corners, counter-clockwise with x to the right and z up [m]
    depth : along y [m]
    material : of the stone
    at : y of its middle [m]
    parts : convex polygons that fill a polygon that is not convex, without overlap

    Examples
    --------
    >>> from mechanics.stones.polyhedra import mass_properties
    >>> kite = prism("K", [(0, 0), (0.5, 0.2), (0, 1), (-0.5, 0.2)], depth=0.4)
    >>> round(mass_properties(kite.vertices, kite.faces).volume, 12)
    0.2
    """
    vertices, faces = _drawn(polygon, depth, at)
    pieces = tuple(Part(*_drawn(part, depth, at)) for part in parts)
    return Block(code, vertices, faces, material, parts=pieces, **fields)


def wedge(
    code: str, length: float, height: float, depth: float, material: Material = LIMESTONE, **fields: Any
) -> Block:
    """Return a wedge that rises along x from an edge at the origin to `height`; its underside is z = 0 [m].

    Examples
    --------
    >>> ramp = wedge("R", length=2.0, height=0.5, depth=1.0)
    >>> len(ramp.vertices), len(ramp.faces)
    (6, 5)
    """
    return prism(code, [(0.0, 0.0), (length, 0.0), (length, height)], depth, material, **fields)


def voussoir(
    code: str,
    radii: Point,
    angles: Point,
    depth: float,
    material: Material = LIMESTONE,
    centre: Point = (0.0, 0.0),
    **fields: Any,
) -> Block:
    """Return a voussoir whose intrados and extrados are straight.

    Parameters
    ----------
    code : of the stone
    radii : of intrados and extrados, at the joints [m]
    angles : of its two joints, from the x axis, the smaller first [rad]
    depth : along y, about y = 0 [m]
    material : of the stone
    centre : x and z of the centre of the arch [m]

    Examples
    --------
    >>> keystone = voussoir("K", radii=(1.8, 2.2), angles=(1.45, 1.69), depth=0.5)
    >>> round(float(keystone.vertices[:, 2].max()), 3)
    2.184
    """
    (inner, outer), origin = radii, np.array(centre)
    start, end = (np.array([np.cos(angle), np.sin(angle)]) for angle in angles)
    polygon = origin + np.array([inner * start, outer * start, outer * end, inner * end])
    return prism(code, polygon, depth, material, **fields)


def voussoir_arch(
    count: int,
    radii: Point,
    depth: float,
    angles: Point = (0.0, float(np.pi)),
    material: Material = LIMESTONE,
    centre: Point = (0.0, 0.0),
    prefix: str = "V",
    **fields: Any,
) -> tuple[Block, ...]:
    """Return the voussoirs V1, V2, … of an arch, all of the same angle; parameters as those of `voussoir`.

    Examples
    --------
    >>> arch = voussoir_arch(7, radii=(2.0, 2.3), depth=0.4, angles=(np.pi / 6, 5 * np.pi / 6))
    >>> [stone.code for stone in arch][:2], len(arch)
    (['V1', 'V2'], 7)
    """
    joints = pairwise(np.linspace(*angles, count + 1).tolist())
    return tuple(
        voussoir(f"{prefix}{k}", radii, joint, depth, material, centre, **fields)
        for k, joint in enumerate(joints, 1)
    )


def semicircular_arch(
    count: int,
    thickness: float,
    radius: float = 1.0,
    depth: float | None = None,
    material: Material = LIMESTONE,
    **fields: Any,
) -> tuple[Block, ...]:
    """Return a semicircular arch on two fixed springers, `right` and `left`, that are as wide as its joints.

    Parameters
    ----------
    count : of voussoirs
    thickness : of the ring [m]
    radius : mean of intrados and extrados [m]
    depth : along y; None: as thick [m]
    material : of all stones

    Examples
    --------
    >>> [stone.code for stone in semicircular_arch(3, thickness=0.2)]
    ['right', 'left', 'V1', 'V2', 'V3']
    """
    inner, outer = radius - thickness / 2, radius + thickness / 2
    deep = thickness if depth is None else depth
    springers = (
        box(code, (x0, -deep / 2, inner - outer), (x1, deep / 2, 0.0), material, fidelity=Fidelity.FIXED)
        for code, x0, x1 in (("right", inner, outer), ("left", -outer, -inner))
    )
    return (*springers, *voussoir_arch(count, (inner, outer), deep, material=material, **fields))


def bond(count: int, courses: int, halves_first: bool = False) -> list[list[float]]:
    """Return the courses of a running bond for `wall`: `count` whole stones, in turn with half ones at both ends.

    Examples
    --------
    >>> bond(2, 3)
    [[1.0, 1.0], [0.5, 1.0, 0.5], [1.0, 1.0]]
    """
    whole, halves = [1.0] * count, [0.5, *[1.0] * (count - 1), 0.5]
    return [halves if (course % 2 == 0) == halves_first else whole for course in range(courses)]


def wall(
    courses: Sequence[Sequence[float]],
    length: float,
    height: float,
    depth: float,
    material: Material = LIMESTONE,
    slab: bool = True,
    **fields: Any,
) -> tuple[Block, ...]:
    """Return a wall along x from x = 0, its stones named by course and place: 1-1, 1-2, …

    Parameters
    ----------
    courses : from bottom to top, lengths of the stones over `length`, such as `bond` gives; negative: left open
    length, height : of a whole stone [m]
    depth : along y, about y = 0 [m]
    material : of all stones
    slab : put the wall on a fixed stone `base` whose top is z = 0; if not, the lowest course is fixed

    Examples
    --------
    >>> stones = wall(bond(4, 6), length=0.5, height=0.25, depth=0.3)
    >>> len(stones), stones[-1].code
    (28, '6-5')
    """
    wide = length * sum(map(abs, courses[0]))
    ground = box(
        "base", (0.0, -depth / 2, -height), (wide, depth / 2, 0.0), material, fidelity=Fidelity.FIXED
    )
    blocks = [ground] if slab else []
    for row, course in enumerate(courses):
        ends = length * np.concatenate([[0.0], np.cumsum(np.abs(course))])
        stones = [
            box(
                f"{row + 1}-{k + 1}",
                (a, -depth / 2, row * height),
                (b, depth / 2, (row + 1) * height),
                material,
                **fields,
            )
            for k, (a, b) in enumerate(pairwise(ends))
            if course[k] > 0
        ]
        fixed = row == 0 and not slab
        blocks += [replace(stone, fidelity=Fidelity.FIXED) for stone in stones] if fixed else stones
    return tuple(blocks)


def drum(
    code: str, bottom: Polygon, top: Polygon, levels: Point, material: Material = LIMESTONE, **fields: Any
) -> Block:
    """Return an upright stone between two convex polygons (n, 2) in x and y, at two levels z [m].

    Both are counter-clockwise seen from above, and similar, so that the sides are planar.
    """
    n = len(bottom)
    rings = [
        np.column_stack([np.asarray(ring, dtype=float), np.full(n, z)])
        for ring, z in zip((bottom, top), levels, strict=True)
    ]
    sides = ((k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n))
    faces = (tuple(range(n - 1, -1, -1)), tuple(range(n, 2 * n)), *sides)
    return Block(code, np.vstack(rings), faces, material, **fields)


def column(
    drums: int,
    diameter: float,
    height: float,
    top: float | None = None,
    sides: int = 8,
    material: Material = LIMESTONE,
    **fields: Any,
) -> tuple[Block, ...]:
    """Return a column about the z axis on a fixed drum, `base`, whose top is z = 0.

    Parameters
    ----------
    drums : how many; the stones are named drum 1, drum 2, … from below
    diameter : of the circle through the corners, at the foot [m]
    height : of a drum [m]
    top : diameter at the top, linear between; None: the same [m]
    sides : of a drum, its first corner above the x axis
    material : of all stones

    Examples
    --------
    >>> shaft = column(6, diameter=0.8, height=0.5, top=0.6)
    >>> shaft[-1].code, round(float(shaft[-1].vertices[:, 0].max()), 12)
    ('drum 6', 0.316666666667)
    """
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = 0.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    slender = 0.0 if top is None else top - diameter
    rings = [(diameter + slender * max(k, 0) / drums) * ring for k in range(-1, drums + 1)]
    base = drum("base", rings[0], rings[1], (-height, 0.0), material, fidelity=Fidelity.FIXED)
    shaft = (
        drum(f"drum {k + 1}", rings[k + 1], rings[k + 2], (k * height, (k + 1) * height), material, **fields)
        for k in range(drums)
    )
    return (base, *shaft)


def _drawn(polygon: Polygon, depth: float, at: float) -> tuple[Array, tuple[tuple[int, ...], ...]]:
    """Corners and faces of a polygon of the x-z plane drawn along y about y = `at`."""
    flat = np.asarray(polygon, dtype=float)
    n = len(flat)
    front, back = (
        np.column_stack([flat[:, 0], np.full(n, at + side * depth / 2), flat[:, 1]]) for side in (-1, 1)
    )
    sides = ((i, n + i, n + (i + 1) % n, (i + 1) % n) for i in range(n))
    return np.vstack([front, back]), (tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides)
