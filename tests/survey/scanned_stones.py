"""Synthetic scans: boxes covered with small triangles, whose points scatter as those of a scanner on dressed stone."""

from itertools import pairwise
from pathlib import Path

import numpy as np

Array = np.ndarray


def scanned_box(size, spacing=0.02, noise=0.001, seed=0) -> tuple[Array, Array]:
    """Return points (nv, 3) [m] and triangles (nt, 3) of a closed box with one corner at the origin."""
    size = np.asarray(size, float)
    counts = np.maximum(2, np.round(size / spacing)).astype(int)
    numbers: dict[tuple[int, ...], int] = {}
    triangles = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, counts[axis]):
            for i, j in np.ndindex(counts[u], counts[v]):
                quad = []
                for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    place = [0, 0, 0]
                    place[axis], place[u], place[v] = int(side), i + di, j + dj
                    quad.append(numbers.setdefault(tuple(place), len(numbers)))
                a, b, c, d = quad if side else quad[::-1]
                triangles += [(a, b, c), (a, c, d)]
    points = np.array(list(numbers), float) / counts * size
    return points + np.random.default_rng(seed).normal(0.0, noise, points.shape), np.array(triangles)


def write_ply(path: Path, points: Array, triangles: Array) -> None:
    """Write a binary PLY, marked as synthetic."""
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment synthetic\n"
        f"element vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    path.write_bytes(head.encode() + points.astype("<f8").tobytes() + rows.tobytes())


def scanned_wall(folder: Path, courses=6, spacing=0.012) -> int:
    """Write a wall of scanned stones in running bond, joints of 10 mm, one PLY each; return their number."""
    folder.mkdir(parents=True, exist_ok=True)
    count = 0
    for course in range(courses):
        edges = np.arange(0.0, 3.01, 0.5) if course % 2 == 0 else np.r_[0.0, np.arange(0.25, 3.0, 0.5), 3.0]
        for start, end in pairwise(edges):
            points, triangles = scanned_box((end - start - 0.01, 0.3, 0.24), spacing, seed=count)
            write_ply(
                folder / f"S{course}-{count:02d}.ply",
                points + np.array([start, 0.0, 0.25 * course]),
                triangles,
            )
            count += 1
    return count
