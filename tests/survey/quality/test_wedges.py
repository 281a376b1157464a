"""Stones that span an opening, by their kinds or by the fan of their joints; what is cut to them is no bed."""

import math
from itertools import pairwise

import numpy as np
import pytest

from survey.quality.courses import measure_courses
from survey.quality.facades import facades_of
from survey.quality.precision import StoneQuality
from survey.quality.wedges import sides_of, spanning_stones
from tests.survey.quality.departures.test_beds import beds_of
from tests.survey.quality.plain_stones import polygon_stone, rectangle

CENTRE, INNER, OUTER = (3.0, 0.4), 1.0, 1.35
ANGLES = np.linspace(math.radians(35.0), math.radians(145.0), 10)


def ring(first: float, last: float) -> list[tuple[float, float]]:
    """Return a voussoir between two angles [rad]."""
    corners = [(INNER, first), (OUTER, first), (OUTER, last), (INNER, last)]
    return [(CENTRE[0] + r * math.cos(a), CENTRE[1] + r * math.sin(a)) for r, a in corners]


def arch(kind: str, course: int | None = None) -> list[StoneQuality]:
    """Return nine voussoirs with joints of a centimetre."""
    shave = 0.005 / INNER
    every = [ring(a + shave, b - shave) for a, b in pairwise(ANGLES.tolist())]
    return [polygon_stone(f"A-{k}", kind, one, course=course) for k, one in enumerate(every)]


def over(x: float) -> float:
    """Height of the extrados with its joint at a place along the wall [m]."""
    return CENTRE[1] + math.sqrt(max((OUTER + 0.01) ** 2 - (x - CENTRE[0]) ** 2, 0.0))


def wall_over_an_arch(seed: int, kind: str, course: int | None = None) -> list[StoneQuality]:
    """Return six courses of 0.3 m, of which the stones over the crown are cut to the extrados."""
    rng = np.random.default_rng(seed)
    stones = arch(kind, course)
    for number in range(1, 9):
        low, high = 0.3 * (number - 1), 0.3 * number - 0.01
        for k in range(12):
            start, stop = 0.5 * k + 0.25 * (number % 2), 0.5 * k + 0.25 * (number % 2) + 0.49
            half = math.sqrt(max((OUTER + 0.01) ** 2 - (low - CENTRE[1]) ** 2, 0.0))
            crossings = [x for x in (CENTRE[0] - half, CENTRE[0] + half) if start + 0.05 < x < stop - 0.05]
            places = sorted([start, stop, *crossings, 0.5 * (start + stop)])
            cut = [(x, max(low, over(x))) for x in places]
            if min(z for _, z in cut) > high - 0.05 or (high < 1.45 and 2.0 < start + 0.25 < 4.0):
                continue
            lower = cut if max(z for _, z in cut) > low else [cut[0], cut[-1]]
            if max(z for _, z in lower) > high - 0.05:
                continue
            outline = np.array([*lower, (stop, high), (start, high)])
            outline[:, 1] += rng.normal(0.0, 0.001)
            outline += rng.normal(0.0, 0.001, outline.shape)
            stones.append(polygon_stone(f"{number}-{k}", "ashlar", outline, course=number))
    return stones


def spanning(stones: list[StoneQuality]) -> set[str]:
    (facade,) = facades_of(stones)
    return {stones[i].code for i in spanning_stones(stones, sides_of(stones, facade))}


@pytest.mark.parametrize(("kind", "course"), [("voussoir", None), ("ashlar", None), ("ashlar", 6)])
def test_stones_cut_to_an_extrados_have_no_bed_of_their_course(kind: str, course: int | None) -> None:
    """Whatever the stones of the arch are called, and whether they are counted with a course."""
    stones = wall_over_an_arch(3, kind, course)
    assert spanning(stones) >= {f"A-{k}" for k in range(9)}
    beds = beds_of(stones)
    assert beds.movements == ()
    assert beds.odd == ()
    assert beds.scatter < 0.002
    (line,) = (one for one in measure_courses(stones, facades_of(stones)) if one.course == 6)
    assert not {f"A-{k}" for k in range(9)} & set(line.stones)


def test_a_lintel_and_what_is_cut_to_it_have_no_bed_of_their_course() -> None:
    row = [rectangle(f"1-{k}", "ashlar", 0.5 * k, 0.0, 0.49, 0.29) for k in range(12)]
    lintel = rectangle("L", "lintel", 2.0, 0.3, 1.5, 0.4, course=2)
    above = [
        rectangle(
            f"2-{k}",
            "ashlar",
            0.5 * k,
            0.71 if 4 <= k <= 6 else 0.3,
            0.49,
            0.18 if 4 <= k <= 6 else 0.59,
            course=2,
        )
        for k in range(12)
        if not 4 <= k <= 6 or k == 5
    ]
    lines = measure_courses([*row, lintel, *above], facades_of([*row, lintel, *above]))
    second = next(one for one in lines if one.course == 2)
    assert set(second.stones) == {one.code for one in above} - {"2-5"}
    assert second.rms < 1e-9


def test_ordinary_courses_and_rough_stones_make_no_arch() -> None:
    stones = [
        polygon_stone(f"{c}-{k}", "ashlar", np.array(quadrilateral(c, k)) + noise(100 * c + k), course=c)
        for c in range(1, 6)
        for k in range(10)
    ]
    assert spanning(stones) == set()


def quadrilateral(course: int, number: int) -> list[tuple[float, float]]:
    x, z = 0.5 * number + 0.25 * (course % 2), 0.3 * (course - 1)
    return [(x, z), (x + 0.49, z), (x + 0.49, z + 0.29), (x, z + 0.29)]


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, 0.006, (4, 2))
