"""Meshing, stone by stone: `python -m benchmarks.meshing [--stones 1000 10000] [--meshers M …] [--json]`.

Time and quality of each mesher on boxes, voussoirs, slender, flat and leaning hexahedra of about 200 nodes, and
processor time for many distinct stones. See benchmarks/README.md for what the columns mean.
"""

import time
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.report import Row, columns, guarded, options_of, progress, show
from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import BOX_FACES, box_corners
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.choice import Mesher
from mechanics.stones.meshing.meshers.mesher import mesh_block
from mechanics.stones.meshing.quality import mesh_quality
from mechanics.stones.polyhedra import mass_properties

_LIMESTONE = Material("limestone", density=2000.0, young=1e10, poisson=0.2)
# edge length over the cube root of the volume with which meshes have about 200 nodes
_SIZES = {"box": 0.245, "voussoir": 0.235, "leaning": 0.245, "slender 1:20": 0.28, "flat 1:20": 0.41}
_MESHERS: dict[str, tuple[Mesher, Element]] = {
    "delaunay": (Mesher.DELAUNAY, Element.TET4),
    "gmsh": (Mesher.GMSH, Element.TET4),
    "grid of hexahedra": (Mesher.AUTO, Element.HEX8),
}
_TABLE = columns(
    "shape shape | mesher mesher | stones stones :d | nodes nodes :.0f | cells cells :.0f | "
    "ms ms per stone :.1f | quadratic_ms second order :.1f | angle dihedral angle, smallest :.1f | "
    "angle_median median stone :.1f | jacobian scaled Jacobian, smallest :.2f | "
    "jacobian_median median stone :.2f"
)
_MANY = columns(
    "stones distinct stones :d | mesher mesher | seconds seconds :.1f | ms ms per stone :.2f | "
    "nodes nodes per stone :.0f | angle dihedral angle, smallest :.1f | "
    "jacobian scaled Jacobian, smallest :.2f"
)


def main() -> None:
    """Run all shapes and sizes and print."""
    parser = options_of("meshing", __doc__)
    numbers, kinds = [1000, 10_000], list(_SIZES)
    parser.add_argument("--stones", type=int, nargs="*", default=numbers, help="how many distinct stones")
    parser.add_argument("--shapes", type=int, default=50, help="stones of each shape (50)")
    parser.add_argument("--meshers", nargs="+", choices=_MESHERS, default=list(_MESHERS))
    parser.add_argument("--kinds", nargs="*", choices=kinds, default=kinds, help="of the first table")
    options = parser.parse_args()
    rows = [_shape(shape, mesher, options.shapes) for shape in options.kinds for mesher in options.meshers]
    many = [_many(count, mesher) for count in options.stones for mesher in options.meshers]
    if options.json:
        show(rows + many, as_json=True)
        return
    for found, table in ((rows, _TABLE), (many, _MANY)):
        if found:
            show(found, table, as_json=False)


def _stone(shape: str, rng: np.random.Generator, code: str) -> Block:
    """A stone of a shape, of random proportions, turned and somewhere."""
    extent = rng.uniform(0.7, 1.3, 3) * {
        "slender 1:20": [1.0, 0.05, 0.05],
        "flat 1:20": [0.6, 0.6, 0.03],
    }.get(shape, [0.4, 0.3, 0.25])
    corners = box_corners((0, 0, 0), (1, 1, 1)) - 0.5
    if shape == "voussoir":
        corners = corners * np.where(corners[:, 2:] > 0, [1.0, 1.0, 1.0], [0.75, 1.0, 1.0])
    if shape == "leaning":  # a box seen in perspective: all its faces lean, and stay planar
        corners = corners / (1.0 + corners @ rng.uniform(-0.3, 0.3, 3))[:, None]
    corners = (corners * extent) @ Rotation.random(random_state=rng).as_matrix().T + rng.uniform(-10, 10, 3)
    size = _SIZES[shape] * mass_properties(corners, BOX_FACES).volume ** (1 / 3)
    return Block(code, corners, BOX_FACES, _LIMESTONE, Fidelity.DEFORMABLE, size)


def _meshing(stones: list[Block], mesher: str, second: bool = False) -> tuple[float, Row]:
    """Processor time [s], and what the meshes are like."""
    program, element = _MESHERS[mesher]
    if second:
        element = {Element.TET4: Element.TET10, Element.HEX8: Element.HEX20}[element]
    blocks = [replace(stone, mesher=program, element=element) for stone in stones]
    start = time.process_time()
    meshes = [mesh_block(block) for block in blocks]
    seconds = time.process_time() - start
    found = mesh_quality(meshes)
    angle, jacobian = [one.min_dihedral for one in found], [one.min_scaled_jacobian for one in found]
    return seconds, {
        "mesher": mesher,
        "stones": len(stones),
        "nodes": float(np.mean([one.nodes for one in found])),
        "cells": float(np.mean([one.cells for one in found])),
        "ms": 1e3 * seconds / len(stones),
        "angle": min(angle),
        "angle_median": float(np.median(angle)),
        "jacobian": min(jacobian),
        "jacobian_median": float(np.median(jacobian)),
    }


def _shape(shape: str, mesher: str, count: int) -> Row:
    progress(f"{shape}, {mesher}")
    rng = np.random.default_rng(1)
    stones = [_stone(shape, rng, f"S{k}") for k in range(count)]
    _meshing(stones[:2], mesher)  # kernels are compiled and libraries loaded beforehand
    _, row = _meshing(stones, mesher)
    _, second = _meshing(stones, mesher, second=True)
    return row | {"shape": shape, "quadratic_ms": second["ms"]}


def _many(count: int, mesher: str) -> Row:
    progress(f"{count} stones, {mesher}")
    rng = np.random.default_rng(2)
    stones = [_stone("leaning", rng, f"S{k}") for k in range(count)]
    _meshing(stones[:2], mesher)
    seconds, row = _meshing(stones, mesher)
    return row | {"shape": "leaning", "seconds": seconds}


if __name__ == "__main__":
    guarded(main)
