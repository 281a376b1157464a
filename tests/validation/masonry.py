"""Arches, walls, façades, columns and overhangs as stones: the geometry of the static validation cases.

All corners are sharp: a stone's corner points lie at the true edge of its faces, and so do the contact points.
Where a case asks for inset points, the stones are chamfered (`chamfer`), so that their faces end before the edge.
"""

from itertools import pairwise

import numpy as np

from mechanics.scene.scene import Block, Fidelity, Part
from mechanics.stones.materials import Material

DENSITY = 2000.0
STONE = Material("stone", DENSITY, young=1e10, poisson=0.2)


def prism(code, polygon, depth=1.0, fidelity=Fidelity.RIGID, material=STONE, at=0.0):
    """A convex polygon (n, 2) of the x–z plane, counter-clockwise with x to the right and z up, drawn along y."""
    vertices, faces = _extruded(polygon, depth, at)
    return Block(code, vertices, faces, material, fidelity)


def _extruded(polygon, depth, at):
    polygon = np.asarray(polygon, dtype=float)
    n = len(polygon)
    front, back = (
        np.column_stack([polygon[:, 0], np.full(n, at + side * depth / 2), polygon[:, 1]]) for side in (-1, 1)
    )
    sides = [(i, n + i, n + (i + 1) % n, (i + 1) % n) for i in range(n)]
    faces = (tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides)
    return np.vstack([front, back]), faces


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


def voussoir(inner, outer, start, end, centre=(0.0, 0.0)):
    """Straight-faced voussoir between two radii and two angles [rad], which are counted from the x axis."""
    ray = np.array([[np.cos(a), np.sin(a)] for a in (start, end)])
    return np.array(centre) + np.array([inner * ray[0], outer * ray[0], outer * ray[1], inner * ray[1]])


def springers(inner, outer, depth=1.0):
    """Fixed blocks under the two joints of springing of a semicircular arch, exactly as wide as these."""
    low = inner - outer
    return tuple(
        prism(code, rectangle((x0, low), (x1, 0.0)), depth, Fidelity.FIXED)
        for code, x0, x1 in (("right", inner, outer), ("left", -outer, -inner))
    )


def semicircular_arch(count, thickness, radius=1.0, depth=None):
    """A semicircular arch of `count` voussoirs with mean radius `radius`, on two fixed springers.

    The joints lie on rays through the centre; intrados and extrados are straight between them, and their corners
    lie on the circles radius ∓ thickness/2.
    """
    inner, outer = radius - thickness / 2, radius + thickness / 2
    depth = thickness if depth is None else depth
    angle = np.linspace(0.0, np.pi, count + 1)
    stones = (prism(f"V{i + 1}", voussoir(inner, outer, angle[i], angle[i + 1]), depth) for i in range(count))
    return (*springers(inner, outer, depth), *stones)


def running_bond(courses, length, height, depth=None, inset=0.0):
    """Courses given from bottom to top as lists of stone lengths over `length`, on a fixed base of the same width.

    With `inset` the corners are cut by that much; the density is raised so that each stone keeps its weight.
    """
    depth = height if depth is None else depth
    width = length * sum(courses[0])
    base = rectangle((0.0, -height), (width, 0.0))
    blocks = [prism("base", base, depth, Fidelity.FIXED)]
    for row, course in enumerate(courses):
        ends = length * np.concatenate([[0.0], np.cumsum(course)])
        for k in range(len(course)):
            whole = rectangle((ends[k], row * height), (ends[k + 1], (row + 1) * height))
            cut = chamfer(whole, inset) if inset else whole
            material = Material("stone", DENSITY * area(whole) / area(cut), young=1e10, poisson=0.2)
            blocks.append(prism(f"{row + 1}-{k + 1}", cut, depth, material=material))
    return tuple(blocks)


def bond(count, rows, halves_first):
    """Courses of a running bond: `count` whole stones, alternating with courses that begin and end with a half one."""
    whole, halves = [1.0] * count, [0.5, *[1.0] * (count - 1), 0.5]
    return [halves if (row % 2 == 0) == halves_first else whole for row in range(rows)]


def cuboid(code, low, high, fidelity=Fidelity.RIGID):
    """An axis-parallel stone from corner `low` (3,) to corner `high` (3,)."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return prism(code, rectangle((x0, z0), (x1, z1)), y1 - y0, fidelity, at=(y0 + y1) / 2)


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
        prism("base", rectangle((-20.0, -2.0), (20.0, 0.0)), 1.0, Fidelity.FIXED),
        compound("right", outline, parts),
        compound("left", _mirrored(outline), [_mirrored(part) for part in parts]),
    ]
    angle = np.linspace(np.pi / 6, 5 * np.pi / 6, 13)
    blocks += [
        prism(f"V{i + 1}", voussoir(inner, outer, angle[i], angle[i + 1], centre), 1.0) for i in range(12)
    ]
    return tuple(blocks)


def compound(code, outline, parts, depth=1.0):
    """A stone whose polygon (n, 2) is not convex, with the convex polygons that fill it."""
    vertices, faces = _extruded(outline, depth, 0.0)
    return Block(code, vertices, faces, STONE, parts=tuple(Part(*_extruded(p, depth, 0.0)) for p in parts))


def _mirrored(polygon):
    return polygon[::-1] * [-1.0, 1.0]


def facade(count, courses, returns, brick=(0.08, 0.04, 0.028)):
    """A façade of `count` bricks along x with return walls of `returns` bricks along y at both ends, in running bond.

    In the first and every other course the façade runs through to the corners and the returns begin behind it; in
    the others the returns run through, with a half brick at their end, and the façade lies between them, shifted by
    half a brick. Bricks are twice as long as wide. Without returns every other course begins and ends with a half
    brick.
    """
    length, width, height = brick
    total, deep = count * length, width + returns * length
    low, high = (-width, -width, -height), (total + width, deep + width, 0.0)
    blocks = [cuboid("base", low, high, Fidelity.FIXED)]
    for row in range(courses):
        through = row % 2 == 0
        front = np.arange(0.0, total + width / 2, length) if through else np.arange(width, total, length)
        if not returns and not through:
            front = np.array([0.0, *front, total])
        spans = [((a, 0.0), (b, width)) for a, b in pairwise(front)]
        side = np.arange(width if through else 0.0, deep + width / 2, length)
        side = side if through else np.array([*side, deep])
        for x in (0.0, total - width) if returns else ():
            spans += [((x, a), (x + width, b)) for a, b in pairwise(side)]
        z = (row * height, (row + 1) * height)
        blocks += [cuboid(f"{row + 1}-{k + 1}", (*a, z[0]), (*b, z[1])) for k, (a, b) in enumerate(spans)]
    return tuple(blocks)


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
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = 0.5 * diameter * np.column_stack([np.cos(angle), np.sin(angle)])
    blocks = []
    for i in range(-1, count):
        z = np.array([[i * height], [(i + 1) * height]])
        vertices = np.vstack([np.column_stack([ring, np.full(sides, level)]) for level in z[:, 0]])
        walls = [(k, (k + 1) % sides, sides + (k + 1) % sides, sides + k) for k in range(sides)]
        faces = (tuple(range(sides - 1, -1, -1)), tuple(range(sides, 2 * sides)), *walls)
        fidelity = Fidelity.FIXED if i < 0 else Fidelity.RIGID
        blocks.append(Block("base" if i < 0 else f"drum {i + 1}", vertices, faces, STONE, fidelity))
    return tuple(blocks)


def tapered_column():
    """The column of Dimitri, De Lorenzis & Zavarise 2011, as HybriDFEM drew it: seven drums and a capital, 5.95 m
    high.

    Its width goes linearly from 1.11 m at the foot to 0.90 m at the top; the capital is 0.21 m high; 1 m deep.
    """
    height, capital, foot, top = 5.95, 0.21, 1.11, 0.90
    level = np.append(np.linspace(0.0, height - capital, 8), height)
    half = 0.5 * (foot - (foot - top) * level / height)
    blocks = [prism("base", rectangle((-1.25, -0.75), (1.25, 0.0)), 1.0, Fidelity.FIXED)]
    for i in range(8):
        corners = [
            (-half[i], level[i]),
            (half[i], level[i]),
            (half[i + 1], level[i + 1]),
            (-half[i + 1], level[i + 1]),
        ]
        blocks.append(prism(f"drum {i + 1}", corners, 1.0))
    return tuple(blocks)
