"""Walls with openings and arches of every kind: none has moved, or a part beside a joint leans as one."""

import numpy as np
import pytest

from pipelines.reports.survey.study import CHANCES
from survey.quality.courses import measure_courses
from survey.quality.departures.beds import WallBeds, find_bed_movements
from survey.quality.departures.faces import FaceMovement, WallFace, find_face_departures
from survey.quality.facades import facades_of
from survey.quality.precision import StoneQuality
from tests.validation.survey.arched_walls import ArchedWall, arched_survey, leaning_part, some_arched_wall
from tests.validation.survey.moved_walls import still

pytest.importorskip("shapely")


def findings(stones: list[StoneQuality]) -> list[WallBeds | WallFace]:
    facades = facades_of(stones)
    lengths = {one.code: one.length for one in stones}
    beds = find_bed_movements(measure_courses(stones, facades), lengths, CHANCES["beds"])
    return [*beds, *find_face_departures(stones, facades, CHANCES["faces"])]


def told(stones: list[StoneQuality]) -> list[str]:
    return [one.text for wall in findings(stones) for one in (*wall.movements, *wall.odd)]


@pytest.mark.parametrize(
    "wall", [ArchedWall("flat"), ArchedWall("oculus", named=False), ArchedWall("pointed", counted=True)]
)
def test_a_wall_at_rest_is_given_nothing(wall: ArchedWall) -> None:
    assert told(arched_survey(1, wall)) == []


@pytest.mark.slow
def test_of_a_thousand_walls_with_openings_fewer_than_ten_are_given_a_movement() -> None:
    moved = [
        seed
        for seed in range(1000)
        if any(wall.movements for wall in findings(arched_survey(seed, some_arched_wall(seed), still)))
    ]
    print(f"{len(moved)} of 1000: {moved}")
    assert len(moved) < 10


def lean_of(seed: int) -> tuple[list[FaceMovement], float]:
    """Return the movements of a wall of which a side leans as one, and the truth of the first [m]."""
    rng = np.random.default_rng(9000 + seed)
    wall = some_arched_wall(seed)
    tall, long = wall.courses * wall.height, wall.length
    amount = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.015, 0.03))
    joint = long * float(rng.uniform(0.25, 0.45))
    start, stop = (0.0, joint) if rng.random() < 0.5 else (long - joint, long)
    stones = arched_survey(seed, wall, leaning_part(amount, start, stop, tall))
    found = [one for face in findings(stones) for one in face.movements if isinstance(one, FaceMovement)]
    return found, amount * (found[0].high - found[0].low) / tall if found else amount


def is_right(found: list[FaceMovement], truth: float) -> bool:
    if [one.kind for one in found] != ["leaning part"]:
        return False
    return abs(found[0].amount - truth) < 3.0 * found[0].sigma


def test_a_side_that_leans_as_one_is_named_with_its_amount() -> None:
    assert is_right(*lean_of(2))


@pytest.mark.slow
def test_of_sixty_sides_that_lean_as_one_fifty_eight_are_named_with_their_amount() -> None:
    right = sum(is_right(*lean_of(seed)) for seed in range(60))
    print(f"{right} of 60")
    assert right >= 58
