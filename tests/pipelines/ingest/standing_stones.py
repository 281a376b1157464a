"""Stones of walls and arches as records for a database: what is next to what follows from how they were made."""

from dataclasses import replace

import numpy as np

from archmodel.store.stones import store_survey
from mechanics.scene.scene import Block
from mechanics.scene.shapes import bond
from survey.geometry.solids import area_vector
from tests.archmodel.stones import box_stone, hash_of
from tests.validation import masonry

FRONT = np.array([0.0, -1.0, 0.0])


def stone(block, kind="ashlar", *, looks=FRONT, course=None, zone=None, depth=None, code=None):
    """A record of a block whose face is the side that looks most that way."""
    vertices = np.asarray(block.vertices, dtype=float)
    looks = np.asarray(looks, dtype=float)
    areas = [area_vector(vertices[list(face)]) for face in block.faces]
    seen = int(np.argmax([area @ looks / np.linalg.norm(area) for area in areas]))
    outline = vertices[list(block.faces[seen])]
    normal = areas[seen] / np.linalg.norm(areas[seen])
    return replace(
        box_stone(code or block.code, kind, course=course),
        zone=zone,
        depth=float(np.ptp(vertices @ looks)) if depth is None else depth,
        normal=normal,
        offset=float(normal @ outline[0]),
        centroid=outline.mean(axis=0),
        axes=np.linalg.svd(normal[None])[2][1:],
        vertices=outline,
        outline=outline,
        points=np.repeat(outline.mean(axis=0)[None], 9, axis=0),
        solid_vertices=vertices,
        solid_faces=tuple(tuple(face) for face in block.faces),
        vertex_sigma=np.full(vertices.shape, 0.003),
    )


def take_in(database, stones, name="wall"):
    """Store stones as a survey of this name."""
    with database.session() as session:
        return store_survey(session, name, f"{name}.moma", f"{hash_of(name):064x}", stones)


def wall(count=4, rows=4, zone=None):
    """A running bond of stretchers 0.6 × 0.3 m: stones "COURSE-PLACE", on a base of its own course 0."""
    blocks = masonry.running_bond(bond(count, rows, halves_first=True), 0.6, 0.3, 0.4)
    base = stone(blocks[0], course=0, zone=zone)
    courses = [int(block.code.split("-")[0]) for block in blocks[1:]]
    return [
        base,
        *(
            stone(block, "stretcher", course=course, zone=zone)
            for block, course in zip(blocks[1:], courses, strict=True)
        ),
    ]


def arch(count=9, thickness=0.4, radius=1.5, prefix="", at=(0.0, 0.0, 0.0), last="keystone"):
    """A semicircular arch on two springers, which are level blocks: V1 is the first from the right."""
    made = []
    for block in masonry.semicircular_arch(count, thickness, radius, 0.5):
        kind = "springer" if not block.code.startswith("V") else "voussoir"
        if block.code == f"V{(count + 1) // 2}" and count % 2:
            kind = last
        moved = replace_block(block, np.asarray(block.vertices) + at)
        made.append(stone(moved, kind, code=prefix + block.code))
    return made


def replace_block(block, vertices):
    """The block with other corners."""
    return Block(block.code, vertices, block.faces, block.material, block.fidelity)
