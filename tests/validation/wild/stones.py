"""Stones as surveys give them: warped, folded, cut into slivers, overlapping or gapped."""

from dataclasses import replace

import numpy as np

from mechanics.scene.scene import Block, Fidelity, Part
from mechanics.scene.shapes import BOX_FACES, LIMESTONE, box, prism
from mechanics.stones.polyhedra import mass_properties
from survey.geometry.folds import fold
from survey.geometry.solids import Solid
from survey.geometry.stone_parts import stone_parts
from survey.simplify.flattening import flatten, unfold


def ground(half=10.0, depth=1.0, top=0.0):
    """A fixed stone whose top is level."""
    return box("ground", (-half, -half, top - depth), (half, half, top), fidelity=Fidelity.FIXED)


def fixed(code, low, high):
    """A fixed box."""
    return box(code, low, high, fidelity=Fidelity.FIXED)


def stack(count, width, height, depth=None, gap=0.0, shift=0.0, **fields):
    """Boxes on one another about x = y = 0, from z = 0 up; `gap` under each one, negative: overlaps [m].

    `shift` is the offset along x of each one from the one below.
    """
    deep = width if depth is None else depth
    return tuple(
        box(
            f"S{k + 1}",
            (k * shift - width / 2, -deep / 2, k * height + (k + 1) * gap),
            (k * shift + width / 2, deep / 2, (k + 1) * height + (k + 1) * gap),
            **fields,
        )
        for k in range(count)
    )


def shifted(block, by, code=None):
    """A stone elsewhere, under another name."""
    move = np.asarray(by, dtype=float)
    parts = tuple(Part(part.vertices + move, part.faces) for part in block.parts)
    return replace(block, code=code or block.code, vertices=block.vertices + move, parts=parts)


def hexahedron(code, corners, **fields):
    """A stone from eight corners in the order of a box, whose faces may be warped [m]."""
    return Block(code, np.asarray(corners, dtype=float), BOX_FACES, LIMESTONE, **fields)


def as_imported(block):
    """The stone as MOMA makes it of an imported solid: faces plane within 2 mm, or unfolded, else convex parts."""
    faces = tuple(part for face in block.faces for part in fold(block.vertices, face, 1e-9))
    solid = Solid(block.code, block.vertices, faces)
    found = flatten(solid, 2e-3) or unfold(solid)
    plane = solid if found is None else found.solid
    parts = stone_parts(plane)
    return replace(
        block,
        vertices=plane.vertices,
        faces=plane.faces,
        parts=tuple(Part(one.vertices, one.faces) for one in parts) if len(parts) > 1 else (),
    )


def warped_stack(count, width, height, warp, seed=1):
    """A stack whose beds are warped surfaces that two stones share: opposite corners up, the others down by `warp`.

    The mean plane of each bed is level, the lowest and the highest are flat. The sides are warped at random, too.
    """
    chance = np.random.default_rng(seed)
    ring = 0.5 * width * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    saddle = np.array([1.0, -1.0, 1.0, -1.0])
    levels = []
    for k in range(count + 1):
        inner = 0 < k < count
        bend = warp * saddle * chance.choice([-1, 1]) if inner else np.zeros(4)
        twist = ring + (chance.uniform(-0.5, 0.5, (4, 2)) * warp)
        levels.append(np.column_stack([twist, k * height + bend]))
    return tuple(as_imported(hexahedron(f"S{k + 1}", np.vstack(levels[k : k + 2]))) for k in range(count))


def warped_sides(code, level, width, height, warp, seed):
    """A stone with level beds, corners off a square by up to `warp`, sides in triangles: not convex [m]."""
    chance = np.random.default_rng(seed)
    ring = 0.5 * width * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    rings = [
        np.column_stack([ring + chance.uniform(-warp, warp, (4, 2)), np.full(4, z)])
        for z in (level, level + height)
    ]
    # one and the other diagonal in turn: at least every second side of a random stone is folded inwards
    sides = []
    for k, (a, b, c, d) in enumerate(BOX_FACES[2:]):
        sides += [(a, b, c), (a, c, d)] if k % 2 else [(a, b, d), (b, c, d)]
    return as_imported(Block(code, np.vstack(rings), (*BOX_FACES[:2], *sides), LIMESTONE))


def folded_box(code, low, high, fold, **fields):
    """A box whose top has its middle pushed in by `fold`, as imported: not convex [m]."""
    plain = box(code, low, high)
    corners = plain.vertices
    middle = corners[4:].mean(axis=0) - [0.0, 0.0, fold]
    faces = [f for f in BOX_FACES if f != (4, 5, 6, 7)]
    faces += [(4, 5, 8), (5, 6, 8), (6, 7, 8), (7, 4, 8)]
    return as_imported(Block(code, np.vstack([corners, middle]), tuple(faces), LIMESTONE, **fields))


def valley_box(code, low, high, fold, slivers=True, **fields):
    """A box whose top has a valley of depth `fold` along its middle, given as convex parts [m].

    With `slivers` the parts are what is below the valley and two wedges as thick as the valley is deep; without, two
    halves side by side.
    """
    (x0, y0, z0), (x1, y1, z1) = low, high
    half, valley = 0.5 * (x0 + x1), z1 - fold
    outline = [(x0, z0), (x1, z0), (x1, z1), (half, valley), (x0, z1)]
    if slivers:
        parts = [
            [(x0, z0), (x1, z0), (x1, valley), (x0, valley)],
            [(half, valley), (x1, valley), (x1, z1)],
            [(x0, valley), (half, valley), (x0, z1)],
        ]
    else:
        parts = [
            [(x0, z0), (half, z0), (half, valley), (x0, z1)],
            [(half, z0), (x1, z0), (x1, z1), (half, valley)],
        ]
    return prism(code, outline, y1 - y0, at=0.5 * (y0 + y1), parts=parts, **fields)


def sliced_box(code, low, high, slice_, **fields):
    """A box in two convex parts, of which the upper one is a slice of that thickness [m]."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    cut = z1 - slice_
    parts = [
        [(x0, z0), (x1, z0), (x1, cut), (x0, cut)],
        [(x0, cut), (x1, cut), (x1, z1), (x0, z1)],
    ]
    outline = [(x0, z0), (x1, z0), (x1, z1), (x0, z1)]
    return prism(code, outline, y1 - y0, at=0.5 * (y0 + y1), parts=parts, **fields)


def scaled(blocks, factor):
    """The same stones at another size; velocities as the root (Froude)."""
    root = np.sqrt(factor)
    return tuple(
        replace(
            one,
            vertices=factor * one.vertices,
            parts=tuple(Part(factor * part.vertices, part.faces) for part in one.parts),
            velocity=(*(root * np.array(one.velocity[:3])), *(np.array(one.velocity[3:]) / root)),
        )
        for one in blocks
    )


def turning(block, pivot, spin):
    """A stone that turns about an axis through `pivot` (3,) with `spin` (3,) [rad/s]."""
    centre = mass_properties(block.vertices, block.faces).centroid
    v = np.cross(spin, centre - np.asarray(pivot))
    return replace(block, velocity=(*v.tolist(), *np.asarray(spin, dtype=float).tolist()))
