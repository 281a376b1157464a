"""Arches, walls, columns and overhangs as stones: the geometry of the static validation cases.

All corners are sharp: a stone's corner points lie at the true edge of its faces, and so do the contact points.
Where a case asks for inset points, the stones are chamfered (`chamfer`), so that their faces end before the edge.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from mechanics.scene import shapes
from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import BOX_FACES, box, column, prism, voussoir_arch, wall
from mechanics.stones.materials import Material

DENSITY = 2000.0
STONE = Material("stone", DENSITY, young=1e10, poisson=0.2)


def rectangle(low, high):
    """Corners (4, 2) of an axis-parallel rectangle, counter-clockwise."""
    (x0, z0), (x1, z1) = low, high
    return np.array([[x0, z0], [x1, z0], [x1, z1], [x0, z1]])


def chamfer(polygon, width):
    """Cut each corner of a convex polygon (n, 2) so that every edge ends `width` before its corner."""
    after = np.roll(polygon, -1, axis=0) - polygon
    after = after / np.linalg.norm(after, axis=1)[:, None]
    before = np.roll(after, 1, axis=0)
    return np.stack([polygon - width * before, polygon + width * after], axis=1).reshape(-1, 2)


def area(polygon):
    """Area of a polygon (n, 2)."""
    x, z = np.asarray(polygon).T
    return 0.5 * float(np.sum(x * np.roll(z, -1) - z * np.roll(x, -1)))


def semicircular_arch(count, thickness, radius=1.0, depth=None):
    """A semicircular arch of `count` voussoirs with mean radius `radius`, on two fixed springers."""
    return shapes.semicircular_arch(count, thickness, radius, depth, STONE)


def running_bond(courses, length, height, depth=None, inset=0.0):
    """Courses given from bottom to top as lists of stone lengths over `length`, on a fixed base of the same width.

    With `inset` the corners are cut by that much; the density is raised so that each stone keeps its weight.
    """
    deep = height if depth is None else depth
    base, *stones = wall(courses, length, height, deep, STONE)
    return (base, *(inset_stone(stone, inset, deep) for stone in stones)) if inset else (base, *stones)


def inset_stone(stone, inset, depth):
    low, high = stone.vertices.min(axis=0)[[0, 2]], stone.vertices.max(axis=0)[[0, 2]]
    whole = rectangle(low, high)
    cut = chamfer(whole, inset)
    return prism(stone.code, cut, depth, replace(STONE, density=DENSITY * area(whole) / area(cut)))


def cuboid(code, low, high, fidelity=Fidelity.RIGID):
    """An axis-parallel stone from corner `low` (3,) to corner `high` (3,)."""
    return box(code, low, high, STONE, fidelity=fidelity)


def buttressed_arch():
    """The arch on buttresses of Dimitri, De Lorenzis & Zavarise 2011, as HybriDFEM drew it.

    Twelve voussoirs between 30° and 150°, radii 10 m and 11.5 m about (0, 16.4 m), skewbacks that belong to
    buttresses 5 m wide and 30 m high. A buttress is one stone of three convex parts: the shaft, and the skewback with
    the intrados below it, in two.
    """
    centre, inner, outer = np.array([0.0, 16.4]), 10.0, 11.5
    below, foot = (centre + np.array([inner, z]) for z in (0.0, inner * np.tan(np.pi / 6)))
    middle, crown = (centre + inner * np.array([np.cos(a), np.sin(a)]) for a in (np.pi / 12, np.pi / 6))
    outline = np.array([[10, 0], [15, 0], [15, 30], [10, 30], foot, crown, middle, below])
    parts = [
        rectangle((10.0, 0.0), (15.0, 30.0)),
        np.array([below, foot, middle]),
        np.array([foot, crown, middle]),
    ]
    blocks = [
        prism("base", rectangle((-20.0, -2.0), (20.0, 0.0)), 1.0, STONE, fidelity=Fidelity.FIXED),
        prism("right", outline, 1.0, STONE, parts=parts),
        prism("left", _mirrored(outline), 1.0, STONE, parts=[_mirrored(part) for part in parts]),
    ]
    angles = np.pi / 6, 5 * np.pi / 6
    return (*blocks, *voussoir_arch(12, (inner, outer), 1.0, angles, STONE, tuple(centre)))


def _mirrored(polygon):
    return polygon[::-1] * [-1.0, 1.0]


def overhanging_stack(count, part, length=1.0, height=0.2, depth=0.4):
    """Equal stones on a table that ends at x = 0; the k-th from the top overhangs the next by part · length/(2k)."""
    blocks = [cuboid("table", (-2 * length, -depth / 2, -height), (0.0, depth / 2, 0.0), Fidelity.FIXED)]
    end = 0.0
    for k in range(count, 0, -1):
        end += part * length / (2 * k)
        z = (count - k) * height
        low, high = (end - length, -depth / 2, z), (end, depth / 2, z + height)
        blocks.append(cuboid(f"stone {k}", low, high))
    return tuple(blocks)


def drums(count, diameter, height, sides=4):
    """A stack of prisms with `sides` corners on a circle, the first on the x axis; on a fixed one that is as wide."""
    return column(count, diameter, height, sides=sides, material=STONE)


def lune(rings, sectors, thickness, eye=0.02):
    """One of the equal lunes of a hemispherical dome of mean radius 1 m, on a fixed base, between two fixed walls.

    The walls are planes of symmetry: what they push is what the neighbours would. They are named first. `eye` is the
    half angle that is left open at the top.
    """
    half, inner, outer = np.pi / sectors, 1.0 - thickness / 2, 1.0 + thickness / 2
    latitude = np.linspace(0.0, np.pi / 2 - eye, rings + 1)
    corners = [(inner, -half), (outer, -half), (outer, half), (inner, half)]

    def ring(angle):
        radius, around = np.array(corners).T
        flat = radius * np.cos(angle)
        return np.column_stack([flat * np.cos(around), flat * np.sin(around), radius * np.sin(angle)])

    walls = []
    for name, side in (("left", -1.0), ("right", 1.0)):
        away = np.array([np.cos(half), side * np.sin(half), 0.0])
        out = np.array([-np.sin(half), side * np.cos(half), 0.0])
        sheet = np.array([0.0 * away, 1.5 * away, 1.5 * away + [0, 0, 1.5], [0, 0, 1.5]])
        low, high = (sheet, sheet + 0.1 * out) if side < 0 else (sheet + 0.1 * out, sheet)
        walls.append(_hexahedron(name, low, high, Fidelity.FIXED))
    base = _hexahedron("base", ring(0.0) - [0, 0, 0.1], ring(0.0), Fidelity.FIXED)
    beds = list(map(ring, latitude))
    return (*walls, base, *(_hexahedron(f"ring {k}", a, b) for k, (a, b) in enumerate(pairwise(beds))))


def _hexahedron(code, low, high, fidelity=Fidelity.RIGID):
    """A stone from four corners below (4, 3) and four above them, both counter-clockwise seen from above."""
    return Block(code, np.vstack([low, high]), BOX_FACES, STONE, fidelity=fidelity)


def tapered_column():
    """The column of Dimitri, De Lorenzis & Zavarise 2011, as HybriDFEM drew it: seven drums and a capital, 5.95 m
    high.

    Its width goes linearly from 1.11 m at the foot to 0.90 m at the top; the capital is 0.21 m high; 1 m deep.
    """
    height, capital, foot, top = 5.95, 0.21, 1.11, 0.90
    level = np.append(np.linspace(0.0, height - capital, 8), height)
    half = 0.5 * (foot - (foot - top) * level / height)
    blocks = [cuboid("base", (-1.25, -0.5, -0.75), (1.25, 0.5, 0.0), Fidelity.FIXED)]
    for i in range(8):
        corners = [
            (-half[i], level[i]),
            (half[i], level[i]),
            (half[i + 1], level[i + 1]),
            (-half[i + 1], level[i + 1]),
        ]
        blocks.append(prism(f"drum {i + 1}", corners, 1.0, STONE))
    return tuple(blocks)
