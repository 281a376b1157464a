"""Plain pictures of walls, made quickly, with the boxes of their stones."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from survey.clouds.pictures.photograph import Photograph
from survey.clouds.world import PixelPlace

JOINT = 4
"""Width of the joints [px]."""


def courses(rows=4, columns=4, height=44, length=90, joint=JOINT):
    """Boxes (x0, y0, x1, y1) of stones in running bond, and the shape of their picture [px]."""
    boxes = []
    for row in range(rows):
        heads = [0, *range(length // 2 if row % 2 else length, columns * length, length), columns * length]
        boxes += [
            (a + joint // 2, row * height + joint // 2, b - joint // 2, (row + 1) * height - joint // 2)
            for a, b in pairwise(heads)
        ]
    return boxes, (rows * height, columns * length)


def painted(boxes, shape, stone=175.0, mortar=110.0, noise=4.0, seed=1):
    """A picture (h, w, 3) of stones of slightly different greys."""
    rng = np.random.default_rng(seed)
    grey = np.full(shape, mortar)
    for x0, y0, x1, y1 in boxes:
        grey[y0:y1, x0:x1] = stone + rng.normal(0.0, 3.0)
    return as_picture(grey + rng.normal(0.0, noise, shape))


def as_picture(grey):
    """A picture (h, w, 3) of grey values (h, w)."""
    return np.repeat(np.clip(grey, 0.0, 255.0).astype(np.uint8)[..., None], 3, axis=2)


def photograph(pixels, depth=None, pixel=0.004):
    """A picture with its place: the lower left corner is the origin."""
    places = PixelPlace(np.diag([pixel, -pixel]), np.array([0.5 * pixel, (len(pixels) - 0.5) * pixel]))
    return Photograph(Path("wall.png"), pixels, depth, None, places, True)


def found_overlaps(proposal, boxes, shape, pixel=0.004):
    """The largest intersection over union of each box with a proposed stone."""
    from shapely import area, box, intersection, polygons

    rings = [polygons(one.ring) for one in proposal.stones]
    out = []
    for x0, y0, x1, y1 in boxes:
        true = box(x0 * pixel, (shape[0] - y1) * pixel, x1 * pixel, (shape[0] - y0) * pixel)
        shared = [area(intersection(one, true)) for one in rings]
        out.append(
            max((s / (area(one) + area(true) - s) for s, one in zip(shared, rings, strict=True)), default=0.0)
        )
    return np.array(out)
