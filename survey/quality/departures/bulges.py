"""Local bulges of a wall: their profile, and what their amount is worth when neither extent nor profile is known.

A bulge either ends at a radius r, cos²(π d/2r), or fades, exp(-2 d²/ρ²); stones as rough as those of a wall do not tell
which. The amount is the mean of those by both profiles, and its variance has three parts: that of the fit; that of
middle and radius, which are fitted too and of which a smaller one goes with a larger amount (linearised); and half the
difference of the two profiles, squared.
"""

import math
from dataclasses import replace

import numpy as np

from survey.arrays import Array
from survey.quality.departures.shapes import Found, Sample

_FADING = 0.75  # ρ over r of the two profiles that are most alike about a common plane [-]


def bulge_profile(places: tuple[float, ...], along: Array, up: Array) -> Array:
    """Return the values of a bulge that ends at a radius.

    Parameters
    ----------
    places : middle along the wall and up, and radius [m]
    along, up : (n,) places of the stones [m]
    """
    away = np.minimum(np.hypot(along - places[0], up - places[1]) / places[2], 1.0)
    ends: Array = np.cos(0.5 * math.pi * away) ** 2
    return ends


def _fading_profile(places: tuple[float, ...], along: Array, up: Array) -> Array:
    away = np.hypot(along - places[0], up - places[1]) / (_FADING * places[2])
    fades: Array = np.exp(-2.0 * away**2)
    return fades


def with_extent_and_profile(sample: Sample, found: Found, step: float) -> Found:
    """Return a bulge with the amount by two profiles, and a σ that holds its extent and its profile.

    Parameters
    ----------
    sample : departures of the stones, in one group
    found : the bulge, as fitted with the profile that ends
    step : of its places, for their derivatives [m]
    """
    places, root = found.shape.places, 1.0 / np.sqrt(sample.variance)
    basis = np.linalg.qr(root[:, None] * sample.nuisance)[0]

    def free(values: Array) -> Array:
        """Return weighted columns (n, k) without what the nuisance explains."""
        weighted = root[:, None] * values
        rest: Array = weighted - basis @ (basis.T @ weighted)
        return rest

    columns = [found.field]
    for k, size in enumerate(places):
        ends = (
            tuple(size + way * step if i == k else p for i, p in enumerate(places)) for way in (1.0, -1.0)
        )
        after, before = (bulge_profile(end, sample.along, sample.up) for end in ends)
        columns.append(found.amount * (after - before) / (2.0 * step))
    rows = free(np.column_stack(columns))
    normal = rows.T @ rows
    extent = max(float(np.linalg.pinv(normal)[0, 0] * normal[0, 0]), 1.0)
    fading = free(_fading_profile(places, sample.along, sample.up)[:, None])[:, 0]
    amount = float(fading @ free(sample.values[:, None])[:, 0]) / max(float(fading @ fading), 1e-12)
    half = 0.5 * (amount - found.amount)
    return replace(found, amount=found.amount + half, sigma=math.hypot(found.sigma * math.sqrt(extent), half))
