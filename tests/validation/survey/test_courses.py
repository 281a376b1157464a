"""Sloping and sagging courses, and stones that contradict their kind, recovered from noisy measurements.

Walls with known deformations are measured point by point with noise of 2 mm; their stones' beds lie 3 mm high or low
besides, as masons laid them. Every number is then found by the whole chain: plane, outline, depth, bed line. Predicted
standard deviations are those of Student's t with ν = stones - parameters, whose variance is ν/(ν - 2); so normalised
errors squared are compared with that (1 ± 0.15).
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy import stats

from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import extrude
from survey.faces.faces import outline_face
from survey.quality.canon import deviations, standards
from survey.quality.contradictions import contradictions
from survey.quality.courses import measure_courses
from survey.quality.facades import facades_of
from survey.quality.precision import appraise
from survey.records.survey import BlockRecord

SIGMA, BED = 0.002, 0.003
STONES, LENGTH, HEIGHT = 18, 0.55, 0.3
SLOPE, SAG = 3e-3, -8e-3
SPAN = STONES * LENGTH


def bed_line(x, course):
    """3 mm/m everywhere; the second course sags by 8 mm in the middle of its chord besides."""
    from_middle = (x - SPAN / 2) / (SPAN / 2)
    return HEIGHT * course + SLOPE * x + (SAG * (1 - from_middle**2) if course == 2 else 0.0)


DEPTH = Depth(0.3, 0.03, "a rule", "kind", 1)


def measured_stone(rng, code, kind, course, corners, depth=DEPTH, chip=0.0):
    """Of true corners (4, 2) in the plane y = 0: its quality, with six more points on its face.

    With `chip` its first corner is worn away: measured so far behind the face and above the bed.
    """
    share = rng.dirichlet(np.ones(4), 6)
    flat = np.vstack([share @ corners, corners])
    points = np.column_stack([flat[:, 0], np.zeros(10), flat[:, 1]]) + rng.normal(0, SIGMA, (10, 3))
    points[6] += [0.0, chip, chip]
    record = BlockRecord(code, kind, course, points[6:], points[:6], SIGMA)
    return appraise(extrude(outline_face(record, np.array([SPAN / 2, -30.0, 2.0])), depth))


def wall(rng, courses=(1, 2, 3), laid=BED, chips=()):
    """Stones W1-0, …; those named in `chips` lack their lower left corner, 60 mm deep and high."""
    stones = []
    for course in courses:
        edges = np.concatenate([[0.0], np.cumsum(rng.uniform(0.8, 1.2, STONES))])
        edges *= SPAN / edges[-1]
        for k, (left, right) in enumerate(pairwise(edges)):
            low = bed_line(np.array([left + 0.005, right - 0.005]), course) + rng.normal(0, laid)
            corners = np.array(
                [[left, low[0]], [right, low[1]], [right, low[1] + 0.29], [left, low[0] + 0.29]]
            )
            code = f"W{course}-{k}"
            stones.append(measured_stone(rng, code, "ashlar", course, corners, chip=0.06 * (code in chips)))
    return stones


def lines_of(stones):
    return {line.course: line for line in measure_courses(stones, facades_of(stones))}


def normalised(count, laid):
    """(slope and sag errors over their sigmas, lines); courses 1 and 3 are straight, so their sag is nothing."""
    rng = np.random.default_rng(71)
    slopes, sags, lines = [], [], []
    for _ in range(count):
        for course, line in lines_of(wall(rng, laid=laid)).items():
            sag = SAG if course == 2 else 0.0
            sags.append((line.sag - sag) / line.sag_sigma)
            if (
                course != 2
            ):  # the slope of a line through a parabola is the chord's only where stones are even
                slopes.append((line.slope - SLOPE) / line.slope_sigma)
            lines.append(line)
    return np.array(slopes), np.array(sags), lines


@pytest.mark.parametrize("count", [50, pytest.param(700, marks=pytest.mark.slow)])
def test_slope_and_sag_of_courses_are_found_within_their_precision(count):
    slopes, sags, lines = normalised(count, BED)
    found = [
        np.mean(errors**2) * (STONES - parameters - 2) / (STONES - parameters)
        for errors, parameters in ((slopes, 2), (sags, 3))
    ]
    typical = np.median([line.slope_sigma for line in lines]), np.median([line.sag_sigma for line in lines])
    print(
        f"variances {found[0]:.3f}, {found[1]:.3f}; σ {typical[0] * 1e3:.2f} mm/m, {typical[1] * 1e3:.2f} mm"
    )
    # 1 ± 0.15 is asked for; a hundred slopes say it to √(2/100) × 3 = 0.42 only, so fewer must agree with that
    np.testing.assert_allclose(found, 1.0, atol=max(0.15, 3 * np.sqrt(2 / len(slopes))))
    assert abs(slopes.mean()) < 4 / np.sqrt(len(slopes))
    assert abs(sags.mean()) < 4 / np.sqrt(len(sags))
    # what is there is said to be there, what is not is not: 1 % of straight courses may be called bent
    bent = [line for line in lines if line.course == 2]
    straight = [line for line in lines if line.course != 2]
    assert np.mean([line.slope > 0.0 and line.slope_probability < 0.01 for line in lines]) > 0.99
    # the power of the two-sided test at 1 %: non-central t
    power = stats.nct.sf(stats.t.isf(0.005, STONES - 3), STONES - 3, -SAG / typical[1])
    assert np.mean([line.sag < 0.0 and line.sag_probability < 0.01 for line in bent]) == pytest.approx(
        power, abs=3 * np.sqrt(0.25 / len(bent))
    )
    wrong = sum(line.sag_probability < 0.01 for line in straight)
    print(f"{wrong} of {len(straight)} straight courses called bent")
    assert wrong <= stats.binom.isf(1e-4, len(straight), 0.01)


def test_beds_laid_to_a_hair_are_not_said_to_be_better_known_than_they_are():
    # τ cannot be estimated below 0, so where it is 0 predicted variances are a little large, never small
    slopes, sags, _ = normalised(30, 0.0)
    assert 0.6 < np.mean(slopes**2) < 1.2
    assert 0.6 < np.mean(sags**2) < 1.2


def test_worn_corners_do_not_bend_their_course():
    sound = lines_of(wall(np.random.default_rng(73), courses=(1,)))[1]
    worn = lines_of(wall(np.random.default_rng(73), courses=(1,), chips={"W1-0", "W1-1", "W1-2"}))[1]
    assert worn.left_out == 3
    assert worn.slope == pytest.approx(sound.slope, abs=sound.slope_sigma)
    assert worn.sag == pytest.approx(sound.sag, abs=sound.sag_sigma)
    assert worn.rms < 1.5 * sound.rms


# --- theory against measurement ---


def bonded_wall(rng, courses=12, odd=None):
    """Headers 0.28 m and stretchers 0.60 m long, cut to ± 25 mm, in Flemish bond; header `odd` is 0.85 m long."""
    stones = []
    deep = {
        "header": Depth(0.5, 0.03, "broken ends", "kind", 1),
        "stretcher": Depth(0.25, 0.03, "drawing of 1912", "kind", 2),
    }
    for course in range(1, courses + 1):
        x = -0.2 * (course % 2)
        for k in range(14):
            kind = ("header", "stretcher")[(k + course) % 2]
            length = rng.normal(0.28 if kind == "header" else 0.6, 0.025)
            code = f"W{course}-{k}"
            if code == odd:
                length = 0.85
            z, height = HEIGHT * course, 0.29 + rng.normal(0, 0.004)
            corners = np.array([[x, z], [x + length, z], [x + length, z + height], [x, z + height]])
            stones.append(measured_stone(rng, code, kind, course, corners, deep[kind]))
            x += length + 0.01
    return stones


def test_sound_walls_are_hardly_ever_contradicted():
    rng = np.random.default_rng(81)
    flagged = measured = odd = 0
    for _ in range(12):  # 2,016 stones
        stones = bonded_wall(rng)
        flagged += len({one.code for one in contradictions(stones, facades_of(stones))})
        odd += sum(one.worst > 3.5 for one in deviations(stones, standards(stones, ())))
        measured += len(stones)
    print(f"{flagged} of {measured} sound stones contradicted, {odd} called unusual")
    assert measured >= 2000
    assert flagged < 0.02 * measured
    assert odd < 0.02 * measured


@pytest.mark.parametrize("code", ["W5-3", "W1-1", "W12-12"])
def test_a_header_longer_than_its_stretchers_is_flagged(code):
    rng = np.random.default_rng(82)
    stones = bonded_wall(rng, odd=code)
    assert next(one.kind for one in stones if one.code == code) == "header"
    found = contradictions(stones, facades_of(stones))
    assert found[0].code == code  # the most significant
    assert found[0].significance > 3
    assert any("stretchers" in one.text for one in found if one.code == code)
    # and it is unusual for a header
    unusual = {one.code: one for one in deviations(stones, standards(stones, ()))}[code]
    assert unusual.length == pytest.approx(0.85 - 0.28, abs=0.03)
    assert unusual.length_score > 5
