"""Corners out of place in the plane of a face: in the window bay, and in walls drawn by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from survey.formats.reading import read_survey
from survey.quality.corners import SeenFace, Sign, misplaced_corners
from survey.quality.precision import StoneQuality, appraise
from survey.records.survey import BlockRecord, Reject, SurveyStream
from survey.registration.stones import survey_stones
from tests.survey.quality.plain_stones import polygon_stone, rectangle

WINDOW = Path("data/samples/window/window.moma")


def seen(stone: StoneQuality) -> SeenFace:
    return SeenFace(
        stone.code,
        stone.kind,
        stone.line,
        stone.normal,
        stone.outline,
        stone.worn_corners,
        stone.area,
        stone.length,
        stone.height,
    )


def signs(*stones: StoneQuality) -> dict[str, set[Sign]]:
    found: dict[str, set[Sign]] = {}
    for one in misplaced_corners([seen(stone) for stone in stones]):
        found.setdefault(one.code, set()).add(one.sign)
    return found


def bond(courses: int = 4, length: int = 6) -> list[StoneQuality]:
    """Return a running bond with half stones at its ends, joints of 10 mm."""
    out = []
    for course in range(courses):
        half = 0.25 * (course % 2)
        for k in range(length + course % 2):
            start, end = max(0.0, 0.5 * k - half), min(0.5 * length, 0.5 * (k + 1) - half)
            out.append(rectangle(f"{course}-{k}", "stretcher", start, 0.3 * course, end - start - 0.01, 0.29))
    return out


def with_corner(stone: StoneQuality, corner: int, x: float, z: float) -> StoneQuality:
    flat = stone.outline[:, [0, 2]].copy()
    flat[corner] += x, z
    return polygon_stone(stone.code, stone.kind, flat)


def test_a_sound_wall_with_half_stones_at_its_ends_has_no_sign() -> None:
    assert signs(*bond()) == {}


def test_a_corner_in_the_neighbour_is_an_overlap_of_both() -> None:
    stones = bond()
    stones[2] = with_corner(stones[2], 1, 0.25, 0.0)
    found = signs(*stones)
    assert Sign.OVERLAP in found["0-2"]
    assert found["0-3"] == {Sign.OVERLAP}
    assert set(found) == {"0-2", "0-3"}


def test_a_corner_that_leaves_a_hole_is_an_angle_without_neighbour() -> None:
    stones = bond()
    stones[2] = with_corner(stones[2], 1, -0.25, 0.0)
    assert signs(*stones) == {"0-2": {Sign.ANGLE}}


def test_a_corner_in_the_air_beside_the_wall_is_a_size_or_an_angle() -> None:
    stones = bond()
    stones[5] = with_corner(stones[5], 2, 0.25, 0.0)
    assert signs(*stones)["0-5"] >= {Sign.ANGLE}
    long = bond()
    long[5] = rectangle("0-5", "stretcher", 2.5, 0.0, 0.49 + 0.4, 0.29)
    assert signs(*long) == {"0-5": {Sign.SIZE}}


def test_a_skewback_is_followed_by_its_neighbour_and_a_broken_corner_is_short() -> None:
    stones = bond()
    stones[2] = with_corner(stones[2], 2, -0.1, 0.0)  # cut obliquely, and so is the next
    stones[3] = with_corner(stones[3], 3, -0.1, 0.0)
    chipped = polygon_stone(
        "0-5", "stretcher", [(2.5, 0), (2.95, 0), (2.99, 0.05), (2.99, 0.29), (2.5, 0.29)]
    )
    assert signs(*stones[:5], chipped, *stones[6:]) == {}


def test_a_worn_corner_is_not_expected_anywhere() -> None:
    stones = bond()
    stones[2] = replace(with_corner(stones[2], 1, -0.25, 0.0), worn_corners=(0, 1, 2, 3))
    assert signs(*stones) == {}


def test_a_face_that_stands_back_does_not_overlap_the_one_in_front() -> None:
    back = rectangle("back", "stretcher", 0.1, 0.0, 0.49, 0.29)
    away = replace(back, outline=back.outline + np.array([0.0, 0.4, 0.0]))
    assert "back" in signs(*bond(), back)
    assert signs(*bond(), away) == {}


@pytest.fixture(scope="module")
def window() -> tuple[SurveyStream, list[BlockRecord], list[StoneQuality]]:
    survey = read_survey(WINDOW, "moma")
    stream = SurveyStream(survey.head, iter(()))
    return stream, list(survey.blocks), made(stream, list(survey.blocks))


def made(stream: SurveyStream, records: list[BlockRecord]) -> list[StoneQuality]:
    stones = survey_stones(replace(stream, blocks=iter(records))).stones
    return [appraise(one) for one in stones if not isinstance(one, Reject)]


def test_the_window_bay_has_no_sign(
    window: tuple[SurveyStream, list[BlockRecord], list[StoneQuality]],
) -> None:
    assert signs(*window[2]) == {}


def test_most_corners_of_ashlars_that_are_25_cm_off_show(
    window: tuple[SurveyStream, list[BlockRecord], list[StoneQuality]],
) -> None:
    """Stones of the arch and the reveals have oblique sides of their own, and are left out here."""
    stream, records, stones = window
    rng = np.random.default_rng(12)
    tried = shown = 0
    for place in rng.permutation(len(records))[:60].tolist():
        record, stone = records[place], stones[place]
        if record.kind not in ("header", "stretcher") or stone.worn or len(record.vertices) != 4:
            continue
        along = np.cross([0.0, 0.0, 1.0], stone.normal)
        up = np.array([0.0, 0.0, 1.0])
        shift = 0.25 * [along, -along, up, -up][int(rng.integers(4))]
        vertices = record.vertices.copy()
        vertices[rng.integers(4)] += shift
        moved = made(stream, [replace(record, vertices=vertices)])
        tried += 1
        shown += record.code in signs(*stones[:place], *moved, *stones[place + 1 :])
    assert tried > 20
    assert shown >= 0.9 * tried
