"""Surveys of coursed walls with arches of many kinds, to whose extrados the stones of the wall are cut."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.errors import GeometryError
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import extrude
from survey.faces.faces import outline_face
from survey.quality.precision import StoneQuality, appraise
from survey.records.survey import BlockRecord
from tests.validation.survey.moved_walls import NOISE, Movement, still

Array = NDArray[np.float64]

KINDS = ("segmental", "round", "flat", "pointed", "relieving", "oculus", "lintel", "none")
"""Openings: arches, a relieving arch over a lintel, a round window, a lintel alone, and no opening."""

JOINT = 0.01  # [m]


@dataclass(frozen=True)
class ArchedWall:
    """A wall with one opening.

    Attributes
    ----------
    kind : of the opening
    named : whether arch stones have the kind "voussoir", or are plain ashlar in the survey
    counted : whether arch stones have the number of the course at their middle, or none
    length, courses, height : of the wall [m], their number, and the height of each [m]
    width, sill : of the opening, and the height of its foot [m]
    laid, noise : standard deviation of stones as laid, and of a coordinate [m]
    inside : points on each face besides its corners
    """

    kind: str = "segmental"
    named: bool = True
    counted: bool = False
    length: float = 6.0
    courses: int = 11
    height: float = 0.3
    width: float = 1.4
    sill: float = 0.0
    laid: float = 0.001
    noise: float = NOISE
    inside: int = 4


def some_arched_wall(seed: int) -> ArchedWall:
    """Return a wall of any kind and size."""
    rng = np.random.default_rng(seed)
    return ArchedWall(
        kind=str(rng.choice(KINDS)),
        named=bool(rng.random() < 0.5),
        counted=bool(rng.random() < 0.3),
        length=float(rng.uniform(5.0, 8.0)),
        courses=int(rng.integers(10, 14)),
        height=float(rng.uniform(0.22, 0.32)),
        width=float(rng.uniform(0.9, 1.6)),
        sill=float(rng.choice([0.0, 0.55])),
        laid=float(rng.choice([0.0, 0.001, 0.002, 0.003])),
        noise=float(rng.choice([0.001, 0.003])),
        inside=int(rng.integers(3, 9)),
    )


def arched_survey(seed: int, wall: ArchedWall, moved: Movement = still) -> list[StoneQuality]:
    """Measure an arched wall after it has moved, each stone as a whole."""
    rng = np.random.default_rng(seed)
    stones = []
    for code, kind, course, outline in _stones(rng, wall):
        if len(outline) < 3:  # above the wall
            continue
        middle = outline.mean(axis=0)
        share = rng.dirichlet(np.ones(len(outline)), wall.inside)
        flat = np.vstack([share @ outline, outline])
        places = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]])
        at = np.array([[middle[0], 0.0, middle[1]]] * 4)
        places = places + _rigid(places, at, moved, course or int(middle[1] / wall.height) + 1)
        places[:, 1] += rng.normal(0.0, wall.laid)
        places[:, 2] += rng.normal(0.0, wall.laid)
        places += rng.normal(0.0, wall.noise, places.shape)
        places[:, 1] *= -1.0
        record = BlockRecord(code, kind, course, places[wall.inside :], places[: wall.inside], wall.noise)
        try:
            face = outline_face(record, np.array([wall.length / 2, -30.0, 1.5]))
        except GeometryError:  # arrises as short as the noise: a reject in a survey
            continue
        stones.append(appraise(extrude(face, Depth(0.4, 0.02, "measured", "stone", 1))))
    return stones


def _rigid(places: Array, at: Array, moved: Movement, course: int) -> Array:
    """Return the movement of a stone's middle, with the turn of its face as the movement changes upwards."""
    up = np.array([0.0, 0.0, 0.01])
    first, second = moved(at, course)[0], moved(at + up, course)[0]
    change: Array = first + (places[:, 2:] - at[0, 2]) * (second - first) / 0.01
    return change


def _stones(rng: np.random.Generator, wall: ArchedWall) -> list[tuple[str, str, int | None, Array]]:
    """Return code, kind, course and outline (n, 2) of every stone."""
    import shapely

    opening, arch = _opening(wall)
    void = (
        shapely.union_all([opening, *arch]).buffer(JOINT, join_style="mitre")
        if arch or not opening.is_empty
        else opening
    )
    found: list[tuple[str, str, int | None, Array]] = []
    for course in range(1, wall.courses + 1):
        low, high = wall.height * (course - 1), wall.height * course - JOINT
        count = max(round(wall.length / 0.5), 3)
        sizes = rng.uniform(0.8, 1.2, count)
        sizes[0 if course % 2 else -1] *= 0.5
        edges = wall.length * np.concatenate([[0.0], np.cumsum(sizes)]) / sizes.sum()
        number = 0
        for start, stop in pairwise(edges.tolist()):
            rest = shapely.box(start, low, stop - JOINT, high).difference(void)
            for part in shapely.get_parts(rest).tolist():
                slim = part.simplify(0.002)
                if slim.area > 0.012 and slim.buffer(-0.03).area > 0.0:
                    number += 1
                    found.append((f"{course}-{number}", "ashlar", course, _ring(slim)))
    for k, stone in enumerate(arch):
        middle = int(stone.centroid.y / wall.height) + 1
        outline = _ring(
            shapely.intersection(stone, shapely.box(0, 0, wall.length, wall.courses * wall.height - JOINT))
        )
        lintel = wall.kind == "lintel" or (wall.kind == "relieving" and k == 0)
        kind = "lintel" if lintel else "voussoir" if wall.named else "ashlar"
        found.append((f"A-{k + 1}", kind, middle if wall.counted or lintel else None, outline))
    return found


def _ring(polygon: Any) -> Array:
    import shapely

    return np.array(shapely.geometry.polygon.orient(polygon).exterior.coords)[:-1]


def _opening(wall: ArchedWall) -> tuple[Any, list[Any]]:
    """Return the opening, and the stones over it."""
    import shapely

    half, middle = wall.width / 2.0, wall.length / 2.0
    springing = wall.height * math.floor(1.5 / wall.height) + 0.4 * wall.height
    rectangle = shapely.box(middle - half, wall.sill, middle + half, springing)
    ring = 0.3
    if wall.kind == "none":
        return shapely.Polygon(), []
    if wall.kind == "oculus":
        return shapely.Point(middle, springing).buffer(0.8 * half), _arc(
            (middle, springing), 0.8 * half, ring, -math.pi, math.pi, 13
        )
    if wall.kind in ("lintel", "relieving"):
        top = wall.height * math.floor(springing / wall.height) + wall.height - JOINT
        lintel = shapely.box(middle - half - 0.2, springing, middle + half + 0.2, max(top, springing + 0.15))
        if wall.kind == "lintel":
            return rectangle, [lintel]
        angle = math.radians(50.0)
        radius = (half + 0.35) / math.sin(angle)
        centre = (middle, springing + 0.05 - radius * math.cos(angle) + 0.1)
        arch = _arc(centre, radius, 0.22, math.pi / 2 - angle, math.pi / 2 + angle, 11)
        lintel = lintel.difference(shapely.union_all(arch).buffer(JOINT))
        return rectangle, [max(shapely.get_parts(lintel).tolist(), key=lambda one: one.area), *arch]
    if wall.kind == "flat":
        return rectangle, _flat(middle, half, springing, ring)
    if wall.kind == "round":
        return rectangle.union(shapely.Point(middle, springing).buffer(half)), _arc(
            (middle, springing), half, ring, 0.0, math.pi, 11
        )
    if wall.kind == "pointed":
        right = _arc((middle - half * 0.5, springing), 1.5 * half, ring * 0.8, 0.0, math.acos(1.0 / 3.0), 5)
        left = [shapely.affinity.scale(one, -1.0, 1.0, origin=(middle, 0.0)) for one in right]
        halves = [shapely.box(middle + JOINT / 2, 0, 99, 99), shapely.box(-99, 0, middle - JOINT / 2, 99)]
        arch = [
            one.intersection(side) for row, side in zip((right, left), halves, strict=True) for one in row
        ]
        circles = [
            shapely.Point(middle + side * half * 0.5, springing).buffer(1.5 * half) for side in (-1, 1)
        ]
        head = circles[0].intersection(circles[1]).intersection(shapely.box(0, springing, 99, 99))
        return rectangle.union(head), arch
    angle = math.radians(48.0)
    radius = half / math.sin(angle)
    centre = (middle, springing - radius * math.cos(angle))
    head = shapely.Point(centre).buffer(radius).intersection(shapely.box(0, springing, 99, 99))
    return rectangle.union(head), _arc(centre, radius, ring, math.pi / 2 - angle, math.pi / 2 + angle, 11)


def _arc(
    centre: tuple[float, float], radius: float, ring: float, first: float, last: float, count: int
) -> list[Any]:
    """Return voussoirs between two angles."""
    import shapely

    found = []
    for a, b in pairwise(np.linspace(first, last, count + 1).tolist()):
        shave = 0.5 * JOINT / radius
        corners = [
            (centre[0] + r * math.cos(t), centre[1] + r * math.sin(t))
            for r, t in (
                (radius, a + shave), (radius + ring, a + shave), (radius + ring, b - shave), (radius, b - shave)
            )
        ]  # fmt: skip
        found.append(shapely.Polygon(corners))
    return found


def _flat(middle: float, half: float, low: float, ring: float, count: int = 9) -> list[Any]:
    """Return the stones of a flat arch, whose joints meet in one point below."""
    import shapely

    below = half / math.tan(math.radians(28.0))
    edges = np.linspace(-half, half, count + 1)
    out = edges * (below + ring) / below
    shave = 0.5 * JOINT
    return [
        shapely.Polygon(
            [
                (middle + edges[k] + shave, low),
                (middle + edges[k + 1] - shave, low),
                (middle + out[k + 1] - shave, low + ring),
                (middle + out[k] + shave, low + ring),
            ]
        )
        for k in range(count)
    ]


def leaning_part(amount: float, start: float, stop: float, height: float) -> Movement:
    """Turn the stones between two places about the base, by an amount at the top; the others stay."""

    def moved(places: Array, course: int) -> Array:
        inside = start < places[:, 0].mean() < stop
        out = amount * places[:, 2] / height * inside
        return np.column_stack([0.0 * out, out, 0.0 * out])

    return moved
