"""Walls of plain stones whose beds and faces lie where a test puts them."""

from collections.abc import Callable

import numpy as np

from survey.quality.precision import StoneQuality
from tests.survey.quality.plain_stones import polygon_stone

Shift = Callable[[float, int], float]
"""Of the middle of a stone along the wall [m] and its course: a distance [m]."""


def none(along: float, course: int) -> float:
    """Shift nothing."""
    return 0.0


def wall(
    seed: int = 0,
    lift: Shift = none,
    out: Shift = none,
    *,
    courses: int = 8,
    length: float = 6.0,
    beds: float = 0.002,
    faces: float = 0.002,
    sigma: float = 0.002,
    gap: tuple[float, float, int, int] | None = None,
    **changes: object,
) -> list[StoneQuality]:
    """Return a running bond of stones half a metre long and 0.3 m high, whole stones lifted and shifted outwards.

    Parameters
    ----------
    lift, out : of each stone
    beds, faces : scatter of beds and faces as laid [m]
    sigma : of a corner, and of a face's place [m]
    gap : an opening: start, stop, first and last course
    """
    rng = np.random.default_rng(seed)
    stones = []
    for course in range(1, courses + 1):
        edges = np.arange(-0.25 * (course % 2), length + 0.01, 0.5)
        for k, start in enumerate(edges[:-1].tolist()):
            middle = start + 0.25
            if gap is not None and gap[0] < middle < gap[1] and gap[2] <= course <= gap[3]:
                continue
            low = 0.3 * (course - 1) + lift(middle, course) + rng.normal(0.0, beds)
            face = [(start, 0.0), (start + 0.49, 0.0), (start + 0.49, 0.29), (start, 0.29)]
            flat = np.array(face) + np.array([0.0, low]) + rng.normal(0.0, sigma, (4, 2))
            given = {"corner_sigma": np.full((4, 3), max(sigma, 1e-6)), "offset_sigma": max(sigma, 1e-6)}
            one = polygon_stone(f"{course}-{k + 1}", "ashlar", flat, course=course, **(given | changes))
            away = out(middle, course) + rng.normal(0.0, faces) + rng.normal(0.0, sigma)
            one.outline[:, 1] -= away  # they are seen from -y
            stones.append(one)
    return stones
