"""Agreement of photographs with each other, and control points that contradict them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ground.errors import MomaError
from survey.arrays import Array
from survey.conventions import CHECKED, SIGNIFICANT
from survey.orientation.bundle.adjustment import Prepared, Solution, adjust, prepare
from survey.orientation.bundle.control import FAR_OFF
from survey.orientation.bundle.resection import TRIPLES, similarity_between
from survey.orientation.bundle.start import start_values, without_start
from survey.orientation.network import Control, Network, listed
from survey.orientation.projection import project

POOR = 3e-3
"""Median residual over the longer side of a photograph, beyond which an orientation is none."""

AGREE = SIGNIFICANT
"""σ₀ up to which photographs agree with each other without control points."""


SEARCHES = 60
"""Adjustments in the search of gross errors: rounds of data snooping, photographs left out one at a time."""


def useful_marks(network: Network) -> tuple[NDArray[np.bool_], list[str]]:
    """Return the marks that take part: those of points with two rays, or of control points."""
    rays = np.bincount(network.point, minlength=len(network.names))
    control = np.zeros(len(network.names), dtype=bool)
    control[[gcp.point for gcp in network.control if not gcp.check]] = True
    lone = (rays == 1) & ~control
    remarks = []
    if lone.any():
        names = [network.names[i] for i in np.flatnonzero(lone)]
        what = "1 point is" if len(names) == 1 else f"{len(names)} points are"
        remarks.append(f"{what} marked on one photograph only and left out: {listed(names)}")
    return ~lone[network.point], remarks


def with_marks(network: Network, used: NDArray[np.bool_]) -> Network:
    """Return a network with some of its marks."""
    return replace(
        network,
        photo=network.photo[used],
        point=network.point[used],
        image=network.image[used],
        sigma=network.sigma[used],
        lines=network.lines[used],
    )


def median_misfit(network: Network, prepared: Prepared, solution: Solution) -> float:
    """Return the median residual over the longer side of the photographs; infinite if they look the other way."""
    off = np.empty(len(prepared.order))
    values = solution.unknowns
    photo = network.photo[prepared.order]
    for f, one in enumerate(network.photos):
        mine = photo == f
        camera = replace(network.cameras[one.camera], inner=values.inner[one.camera])
        rows = prepared.order[mine]
        seen = project(camera, values.rotation[f], values.station[f], values.point[network.point[rows]])
        off[mine] = np.linalg.norm(seen - network.image[rows], axis=1) / max(camera.size)
    off[~np.isfinite(off)] = np.inf
    return float(np.median(off)) if len(off) else 0.0


def contradicted_control(network: Network, alone: Solution) -> list[tuple[Control, float]]:
    """Return the control points that most others contradict, the worst first, and how far off they are [m]."""
    gcps = [
        gcp for gcp in network.control if not gcp.check and np.isfinite(alone.unknowns.point[gcp.point]).all()
    ]
    if len(gcps) <= CHECKED:
        return []
    there = np.array([gcp.place for gcp in gcps])
    off = np.linalg.norm(
        fitted_places(alone.unknowns.point[[gcp.point for gcp in gcps]], there) - there, axis=1
    )
    sigma = np.sqrt([np.trace(gcp.covariance) / 3.0 for gcp in gcps])
    wrong = off > FAR_OFF * np.maximum(np.median(off), sigma)
    if len(gcps) - wrong.sum() < CHECKED:
        return []
    return [(gcps[k], float(off[k])) for k in np.argsort(-off) if wrong[k]]


def fitted_places(source: Array, target: Array) -> Array:
    """Move places by the similarity that most of them agree with: of all triples, that of the least median misfit."""
    best, least = source, np.inf
    rng = np.random.default_rng(0)
    for _ in range(TRIPLES):
        three = rng.choice(len(source), 3, replace=False)
        rotation, shift, scale = similarity_between(source[three], target[three])
        moved = scale * source @ rotation.T + shift
        misfit = float(np.median(np.linalg.norm(moved - target, axis=1)))
        if misfit < least:
            best, least = moved, misfit
    return best


def adjusted_alone(network: Network) -> tuple[Solution, float] | None:
    """Adjust the photographs without their control points; None if they do not agree with each other either.

    Returns
    -------
    the solution and its σ₀
    """
    free = without_start(replace(network, control=()))
    try:
        start = next(iter(start_values(free)))
        prepared = prepare(start, keep=useful_marks(start)[0])
        solution = adjust(start, prepared)
    except MomaError:
        return None
    if median_misfit(start, prepared, solution) >= POOR:
        return None
    return solution, sigma0_of(prepared, solution)


def sigma0_of(prepared: Prepared, solution: Solution) -> float:
    """Return σ₀ of an adjustment; the root of its sum of squares where nothing is redundant."""
    redundancy = prepared.observations - prepared.count + prepared.datum
    return float(np.sqrt(solution.square / max(redundancy, 1)))


def exchanged_control(network: Network, gcps: Sequence[Control], places: Mapping[int, Array]) -> str:
    """Return a sentence on two control points of which each lies where the other should; empty if there are none.

    Parameters
    ----------
    gcps : that are wrong
    places : (3,) of each, by its point, where the photographs put it [m]
    """
    for k, first in enumerate(gcps):
        for second in gcps[k + 1 :]:
            here, there = places[first.point], places[second.point]
            apart = min(np.linalg.norm(here - first.place), np.linalg.norm(there - second.place))
            across = max(np.linalg.norm(here - second.place), np.linalg.norm(there - first.place))
            if FAR_OFF * across < apart:
                return f". {network.names[first.point]} and {network.names[second.point]} are exchanged"
    return ""
