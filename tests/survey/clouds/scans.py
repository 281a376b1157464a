"""A small synthetic wall of six stones, its scan, and files of both in many formats."""

import json

import numpy as np

LENGTH, HEIGHT = 0.5, 0.3
"""Size of a stone [m]."""
JOINT = 0.01
ORIGIN = np.array([100.0, 200.0, 10.0])
RIGHT, UP, OUT = np.array([0.8, 0.6, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.6, -0.8, 0.0])
FRAME = "origin = [100.0, 200.0, 10.0]\nright = [0.8, 0.6, 0.0]\n"
RELIEF = (0.004, -0.003, 0.0, 0.006, -0.002, 0.001)
"""How far each stone stands before the wall's plane [m]."""
CODES = ("A1", "A2", "A3", "B1", "B2", "B3")


def rings():
    """Outlines (4, 2) of the stones in the wall's plane."""
    half = JOINT / 2
    corners = np.array(
        [(half, half), (LENGTH - half, half), (LENGTH - half, HEIGHT - half), (half, HEIGHT - half)]
    )
    return [corners + np.array((LENGTH * i, HEIGHT * j)) for j in range(2) for i in range(3)]


def scan(spacing=0.01, noise=0.001, seed=1):
    """Points (n, 3) of the wall: faces of stones, and mortar 15 mm behind."""
    rng = np.random.default_rng(seed)
    s, t = np.meshgrid(np.arange(0, 3 * LENGTH, spacing), np.arange(0, 2 * HEIGHT, spacing))
    flat = np.column_stack([s.ravel(), t.ravel()]) + rng.random((s.size, 2)) * spacing
    depth = np.full(len(flat), -0.015)
    for ring, relief in zip(rings(), RELIEF, strict=True):
        inside = ((flat > ring[0]) & (flat < ring[2])).all(axis=1)
        depth[inside] = relief
    depth += rng.normal(0.0, noise, len(flat))
    return ORIGIN + flat[:, :1] * RIGHT + flat[:, 1:] * UP + depth[:, None] * OUT


def in_space(ring):
    """Corners (n, 3) of an outline."""
    return ORIGIN + ring[:, :1] * RIGHT + ring[:, 1:] * UP


def geojson(path, shapes=None, codes=CODES, **more):
    """Write outlines; `more` are lists of further attributes."""
    features = []
    for k, ring in enumerate(rings() if shapes is None else shapes):
        said = {"code": codes[k]} | {name: values[k] for name, values in more.items()}
        closed = [*np.asarray(ring).tolist(), np.asarray(ring)[0].tolist()]
        features.append(
            {"type": "Feature", "properties": said, "geometry": {"type": "Polygon", "coordinates": [closed]}}
        )
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")
    return path


def frame(folder):
    """Write the wall's frame."""
    path = folder / "wall.toml"
    path.write_text(FRAME, encoding="utf-8")
    return path


def las(path, points, colours=None):
    """Write a LAS or LAZ file with laspy."""
    import laspy

    header = laspy.LasHeader(point_format=7 if colours is not None else 6, version="1.4")
    header.scales, header.offsets = np.full(3, 1e-4), np.floor(points.min(axis=0))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = points.T
    if colours is not None:
        for name, values in zip(("red", "green", "blue"), colours.T, strict=True):
            setattr(cloud, name, values.astype(np.uint16) * 257)
    cloud.write(str(path))
    return path


def xyz(path, points):
    """Write a text file of points."""
    np.savetxt(path, points, fmt="%.4f")
    return path
