"""Weights of the probability of joints, fitted to rendered walls by logistic regression."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.ndimage import find_objects

from benchmarks.report import progress
from survey.arrays import Array, Bools, Ints
from survey.clouds.pictures.bond import Bond, bond_of, join_weak, renumbered
from survey.clouds.pictures.joints import WIDTH
from survey.clouds.pictures.photograph import Photograph
from survey.clouds.pictures.proposal import Fields, joined_regions, measured_fields
from survey.clouds.pictures.regions import closed_regions
from survey.clouds.pictures.scale import joint_width
from survey.clouds.pictures.splitting import dividing_lines, line_features, propose_missing
from survey.clouds.world import PixelPlace
from synthetic.buildings.rendered_walls import STYLES, rasterised, render_wall

_ROUNDS = 2  # fits, each to the regions that the weights of the one before leave
_RIDGE = 0.1  # penalty on the square of a weight, so that classes that a plane parts have finite weights
_PURE = 0.7  # part of the stone of a region that is of one true stone, without which it says nothing

Samples = list[tuple[Array, bool]]


def fitted(draws: int) -> Iterator[tuple[str, Array]]:
    """Yield names and weights: of borders in courses and in rubble, of missing joints, and of borders that stayed."""
    walls = [one for seed in range(draws) for weathered in (False, True) for one in _walls(seed, weathered)]
    stayed: Samples = []
    missing: Array | None = None
    for kind in ("coursed", "rubble"):
        own = [(fields, true) for style, fields, true in walls if (style == "rubble") == (kind == "rubble")]
        weights: Array | None = None
        for _ in range(_ROUNDS):
            borders: Samples = []
            lines: Samples = []
            for fields, true in own:
                _collect(fields, true, kind, weights, borders, lines)
            weights = _regression(borders)
        assert weights is not None
        yield kind, weights
        if kind == "coursed":
            missing = _regression(lines)
            yield "missing", missing
        for fields, true in own:
            stayed += _stayed(fields, true, kind, weights, missing if kind == "coursed" else None)
    yield "stayed", _regression(stayed)


def _stayed(fields: Fields, true: Ints, kind: str, weights: Array, missing: Array | None) -> Samples:
    """Return the borders that stay in the end: what their features amount to, and whether they are between stones."""
    regions = joined_regions(fields, kind, weights)
    if missing is not None:
        regions = propose_missing(regions, fields.strength, fields.hidden, weights=missing)
    bond = bond_of(regions, fields.strength, fields.colours, fields.hidden, kind)
    return [
        (np.array([1.0, terms @ weights]), different) for terms, different in _samples(bond, regions, true)
    ]


def _walls(seed: int, weathered: bool) -> Iterator[tuple[str, Fields, Ints]]:
    for style in STYLES:
        progress(f"{style} {seed}")
        wall = render_wall(style, seed, weathered=weathered)
        places = PixelPlace(np.eye(2), np.zeros(2))
        photograph = Photograph(Path("wall.png"), wall.picture, None, None, places, True)
        width, _ = joint_width(wall.picture)
        whole = slice(0, wall.picture.shape[0]), slice(0, wall.picture.shape[1])
        fields = measured_fields(photograph, whole, width / WIDTH)
        shape = fields.image.shape
        yield style, fields, rasterised(wall.outlines, shape, wall.pixel * wall.picture.shape[0] / shape[0])


def _collect(
    fields: Fields, true: Ints, kind: str, weights: Array | None, borders: Samples, missing: Samples
) -> None:
    """Add the borders of a wall before and after regions are joined, and the lines across regions."""
    regions = closed_regions(fields.parting, fields.void)
    bond = bond_of(regions, fields.strength, fields.colours, fields.hidden, kind)
    if weights is not None:
        bond.weights = weights
    borders += _samples(bond, regions, true)
    join_weak(bond)
    regions = renumbered(regions, bond)
    borders += _samples(bond, regions, true)
    for number, box in enumerate(find_objects(regions), start=1):
        if box is None:
            continue
        for axis, whole, after, line in dividing_lines(regions, number, box, fields.strength, fields.hidden):
            there = true[box] if axis else true[box].T
            first, second = (_main(there, part) for part in (whole & ~after, after))
            if first and second:
                missing.append((line_features(whole, after, line), first != second))


def _main(true: Ints, part: Bools) -> int:
    """Return the true stone that fills half of a part; 0 if none does."""
    counts = np.bincount(true[part], minlength=1)
    counts[0] = 0
    return int(counts.argmax()) if counts.max() > 0.5 * part.sum() else 0


def _samples(bond: Bond, regions: Ints, true: Ints) -> Samples:
    rows, count = int(regions.max()) + 1, int(true.max()) + 1
    shared = np.bincount((regions * count + true).ravel(), minlength=rows * count).reshape(rows, count)
    all_, shared = shared.sum(axis=1), np.where(np.arange(count) == 0, 0, shared)
    best, stone = shared.argmax(axis=1), shared.max(axis=1)
    pure = (stone > _PURE * np.maximum(shared.sum(axis=1), 1)) & (stone > 0.5 * all_)
    return [
        (bond.features(a, b), bool(best[a] != best[b]))
        for a, others in bond.borders.items()
        for b in others
        if a < b and pure[a] and pure[b]
    ]


def _regression(samples: Samples) -> Array:
    """Return the weights of a logistic regression by Newton's method."""
    terms, right = np.array([one for one, _ in samples]), np.array([float(one) for _, one in samples])
    weights, ridge = np.zeros(terms.shape[1]), np.diag([1e-3] + [_RIDGE] * (terms.shape[1] - 1))
    for _ in range(60):
        chance = 1.0 / (1.0 + np.exp(-np.clip(terms @ weights, -30.0, 30.0)))
        hessian = (terms * (chance * (1.0 - chance))[:, None]).T @ terms + ridge
        weights += np.linalg.solve(hessian, terms.T @ (right - chance) - ridge @ weights)
    out: Array = weights
    return out
