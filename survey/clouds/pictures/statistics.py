"""Statistics of a bond: courses, headers and stretchers, sizes, and how head joints are staggered."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from survey.arrays import Array
from survey.conventions import SOME

_STAGGERED = SOME  # distance of a head joint from those below, over the height of its course, that bonds


def bond_statistics(
    rings: Sequence[Array], kinds: Sequence[str | None], courses: Sequence[int | None]
) -> list[tuple[str, str]]:
    """Return statistics of a bond, each with its name.

    Parameters
    ----------
    rings : (n, 2) outlines in the wall's plane [m]
    kinds, courses : of the stones; None where not known
    """
    if not rings:
        return []
    size = np.array([np.ptp(ring, axis=0) for ring in rings])
    rows: list[tuple[str, str]] = [
        ("Usual length and height", f"{np.median(size[:, 0]):.2f} × {np.median(size[:, 1]):.2f} m")
    ]
    numbers = sorted({course for course in courses if course is not None})
    if numbers:
        heights = [
            float(np.median([size[k, 1] for k, course in enumerate(courses) if course == number]))
            for number in numbers
        ]
        rows.append(("Height of courses", f"{min(heights):.2f} to {max(heights):.2f} m"))
        staggered, joints = _staggered(rings, courses, numbers)
        if joints:
            rows.append(("Staggered head joints", f"{staggered / joints:.0%} of {joints}"))
    headers, stretchers = (sum(one == kind for one in kinds) for kind in ("header", "stretcher"))
    if headers + stretchers:
        rows.append(("Headers", f"{headers / (headers + stretchers):.0%} of headers and stretchers"))
    return rows


def _staggered(
    rings: Sequence[Array], courses: Sequence[int | None], numbers: Sequence[int]
) -> tuple[int, int]:
    """Return how many head joints are away from those of the course below, and how many there are above one."""
    boxes = np.array([[ring.min(axis=0), ring.max(axis=0)] for ring in rings])
    heads: dict[int, list[float]] = {}
    for number in numbers:
        members = sorted(
            (k for k, course in enumerate(courses) if course == number), key=lambda k: float(boxes[k, 0, 0])
        )
        heads[number] = [
            0.5 * float(boxes[a, 1, 0] + boxes[b, 0, 0])
            for a, b in pairwise(members)
            if boxes[b, 0, 0] - boxes[a, 1, 0] < _STAGGERED * (boxes[a, 1, 1] - boxes[a, 0, 1])
        ]
    good = count = 0
    for below, above in pairwise(numbers):
        height = float(
            np.median(
                [boxes[k, 1, 1] - boxes[k, 0, 1] for k, course in enumerate(courses) if course == above]
            )
        )
        for place in heads[above]:
            if not heads[below]:
                continue
            count += 1
            good += min(abs(place - one) for one in heads[below]) > _STAGGERED * height
    return good, count
