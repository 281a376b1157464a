"""Stones of a wall in the plane y = 0, seen from -y, as in a report, without any measurement."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from survey.quality.precision import StoneQuality

SIGMA = 0.002


def polygon_stone(
    code: str, kind: str, polygon: list[tuple[float, float]] | NDArray[np.float64], **changes: Any
) -> StoneQuality:
    """Return a stone whose face is a polygon (x, z), counter-clockwise."""
    flat = np.asarray(polygon, dtype=float)
    outline = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]])
    x, z = flat[:, 0], flat[:, 1]
    area = 0.5 * float((x * np.roll(z, -1) - np.roll(x, -1) * z).sum())
    given: dict[str, Any] = {
        "code": code,
        "kind": kind,
        "course": 1,
        "zone": None,
        "line": 1,
        "source": "points",
        "provenance": "points measured on the face",
        "sigma": SIGMA,
        "points": 20,
        "rms": SIGMA,
        "sigma0": 1.0,
        "redundancy": 17,
        "blunders": (),
        "worn": (),
        "shape": "plane",
        "shape_text": "plane",
        "tilt_sigma": 0.2,
        "offset_sigma": 0.0005,
        "depth": 0.4,
        "depth_sigma": 0.02,
        "depth_source": "guess",
        "depth_origin": "kind",
        "length": float(np.ptp(x)),
        "height": float(np.ptp(z)),
        "dimension_sigma": SIGMA * 2**0.5,
        "area": area,
        "skew": 0.0,
        "normal": np.array([0.0, -1.0, 0.0]),
        "outline": outline,
        "corner_sigma": np.full(outline.shape, SIGMA),
        "worn_corners": (),
        "standardised": np.zeros(20, np.float32),
    }
    return StoneQuality(**(given | changes))


def rectangle(
    code: str, kind: str, x: float, z: float, length: float, height: float, **changes: Any
) -> StoneQuality:
    """Return a stone with an upright rectangular face, (x, z) its lower left corner."""
    polygon = [(x, z), (x + length, z), (x + length, z + height), (x, z + height)]
    return polygon_stone(code, kind, polygon, **changes)
