"""Surveys of walls whose movement is known: the truth beside what a total station would have measured.

A wall of courses in running bond, with or without an opening, is laid with the scatter of masons, moved, and measured
point by point with noise; the chain plane, outline, depth makes stones of the points.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import extrude
from survey.faces.faces import outline_face
from survey.quality.precision import StoneQuality, appraise
from survey.records.survey import BlockRecord

Array = NDArray[np.float64]
Movement = Callable[[Array, int], Array]
"""Displacement (n, 3) of places (n, 3) of a stone of a course [m]: along the wall, outwards, up."""

NOISE = 0.003


@dataclass(frozen=True)
class Wall:
    """What a wall is like before it moves.

    Attributes
    ----------
    length, courses, height : of the wall [m], their number, and the height of each [m]
    opening : start and stop along it, first and last course; None without one
    laid : standard deviation of beds and of faces as masons laid them [m]
    noise : standard deviation of a coordinate [m]
    sigma : as stated [m]
    inside : points on each face besides its corners
    depths : depth of stones by code; others are `depth` ± a tenth
    depth : usual depth [m]
    """

    length: float = 6.0
    courses: int = 10
    height: float = 0.3
    opening: tuple[float, float, int, int] | None = (2.4, 3.6, 3, 7)
    laid: float = 0.002
    noise: float = NOISE
    sigma: float = NOISE
    inside: int = 6
    depths: dict[str, float] = field(default_factory=dict)
    depth: float = 0.4


def still(places: Array, course: int) -> Array:
    """Move nothing."""
    return np.zeros_like(places)


def survey_of(
    seed: int, wall: Wall = Wall(), moved: Movement = still, proud: dict[str, float] | None = None
) -> list[StoneQuality]:
    """Measure a wall after it has moved; stones named in `proud` stand so far out of it."""
    rng = np.random.default_rng(seed)
    stones = []
    for course in range(1, wall.courses + 1):
        for number, (start, stop) in enumerate(_spans(rng, wall, course), start=1):
            code = f"{course}-{number}"
            low, high = wall.height * (course - 1), wall.height * course - 0.01
            corners = np.array([[start, low], [stop, low], [stop, high], [start, high]])
            share = rng.dirichlet(np.ones(4), wall.inside)
            flat = np.vstack([share @ corners, corners])
            places = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]])
            places = places + moved(places, course)
            places[:, 1] += (proud or {}).get(code, 0.0) + rng.normal(0.0, wall.laid)
            places[:, 2] += rng.normal(0.0, wall.laid)
            places += rng.normal(0.0, wall.noise, places.shape)
            places[:, 1] *= -1.0  # outwards is to the viewer, who stands at negative y
            depth = Depth(
                wall.depths.get(code, wall.depth * rng.normal(1.0, 0.1)), None, "measured", "stone", 1
            )
            record = BlockRecord(
                code, "ashlar", course, places[wall.inside :], places[: wall.inside], wall.sigma
            )
            stones.append(
                appraise(extrude(outline_face(record, np.array([wall.length / 2, -30.0, 1.5])), depth))
            )
    return stones


def _spans(rng: np.random.Generator, wall: Wall, course: int) -> list[tuple[float, float]]:
    parts = [(0.0, wall.length)]
    if wall.opening is not None and wall.opening[2] <= course <= wall.opening[3]:
        parts = [(0.0, wall.opening[0]), (wall.opening[1], wall.length)]
    found = []
    for left, right in parts:
        count = max(round((right - left) / 0.55), 2)
        sizes = rng.uniform(0.85, 1.15, count)
        if course % 2:
            sizes[0] *= 0.5
        else:
            sizes[-1] *= 0.5
        edges = left + (right - left) * np.concatenate([[0.0], np.cumsum(sizes)]) / sizes.sum()
        found += [(float(a) + 0.005, float(b) - 0.005) for a, b in pairwise(edges)]
    return found


def some_wall(seed: int) -> Wall:
    """Return a wall like many: 3 to 6 m long, 5 to 10 courses, laid to 4 mm or better, 5 to 12 points on a face."""
    rng = np.random.default_rng(seed)
    return Wall(
        length=float(rng.uniform(3.0, 6.0)),
        courses=int(rng.integers(5, 11)),
        opening=None if rng.random() < 0.5 else (1.2, 2.0, 2, 4),
        laid=float(rng.choice([0.0, 0.001, 0.002, 0.004])),
        inside=int(rng.integers(1, 9)),
    )


def settled_pier(amount: float, start: float, stop: float, last: int = 99) -> Movement:
    """Lower what lies between two places, in the courses up to one: stones go down as a whole."""

    def moved(places: Array, course: int) -> Array:
        inside = start < places[-4:, 0].mean() < stop and course <= last
        return np.tile([0.0, 0.0, -amount if inside else 0.0], (len(places), 1))

    return moved


def leaning(amount: float, height: float) -> Movement:
    """Turn the wall about its base, by an amount at the top."""
    return lambda places, course: np.column_stack(
        [0.0 * places[:, 0], amount * places[:, 2] / height, 0.0 * places[:, 0]]
    )


def bulging(amount: float, at: tuple[float, float], radius: float) -> Movement:
    """Push a round part of the wall outwards."""

    def moved(places: Array, course: int) -> Array:
        away = np.hypot(places[:, 0] - at[0], places[:, 2] - at[1]) / radius
        out = amount * np.exp(-(away**2) * 2.0)
        return np.column_stack([0.0 * out, out, 0.0 * out])

    return moved


def leaning_corner(amount: float, start: float, stop: float, height: float) -> Movement:
    """Push the upper corner of the wall outwards, the rest staying behind."""

    def moved(places: Array, course: int) -> Array:
        share = np.clip((places[:, 0] - start) / (stop - start), 0.0, None)
        out = amount * share * places[:, 2] / height
        return np.column_stack([0.0 * out, out, 0.0 * out])

    return moved
