"""Gross errors that no test of single marks finds: control points and photographs that contradict all others.

They are sought by leaving out one at a time: without the wrong one the others agree. A photograph is then oriented by
the points that the others show, as its mirror image and with a camera constant of its own, which tells what is wrong.
"""

from dataclasses import dataclass, replace

import numpy as np

from ground.errors import MomaError
from survey.arrays import Array
from survey.orientation.bundle.adjustment import Solution
from survey.orientation.bundle.agreement import (
    AGREE,
    POOR,
    adjusted_alone,
    contradicted_control,
    exchanged_control,
    fitted_places,
    useful_marks,
    with_marks,
)
from survey.orientation.bundle.resection import resect
from survey.orientation.network import Camera, Network, listed
from survey.orientation.projection import directions, project

__all__ = ["Healed", "healed", "without_photo"]

_MAX_PHOTOS = 30  # photographs that are left out one at a time, those with the most suspected marks first
_CONSTANTS = np.geomspace(0.25, 4.0, 17)  # camera constants tried, over the stated one: steps of 19 %
_FINE = np.geomspace(0.92, 1.09, 9)  # those tried about the best of these: steps of 2 %
_MOST_AGREE = 0.8  # part of the points of a photograph that a diagnosis explains
_LEAST_POINTS = 6  # points of a photograph by which it is diagnosed
_BETTER = 0.2  # misfit of a diagnosis over that of the photograph as it stands


@dataclass(frozen=True)
class Healed:
    """A network without what contradicts the rest.

    Attributes
    ----------
    network : without the marks of a photograph that is wrong, wrong control points only check
    photos : photographs that were left out, with the reason
    remarks : what was left out and why, in words
    """

    network: Network
    photos: dict[str, str]
    remarks: tuple[str, ...]


def healed(network: Network, suspicion: Array | None = None) -> Healed | None:
    """Leave out the control points or the photograph without which the others agree; None if there are none such.

    Parameters
    ----------
    suspicion : (nf,) part of the marks of each photograph that were found wrong; None: not known
    """
    agreed = adjusted_alone(network)
    photos, remarks = dict[str, str](), list[str]()
    if agreed is None or agreed[1] >= AGREE:
        wrong = _wrong_photo(network, suspicion)
        if wrong is None:
            return None
        photo, agreed = wrong
        name, reason = network.photos[photo].name, _diagnosis(network, photo, agreed[0])
        photos[name] = reason
        remarks.append(f"photograph {name} left out, which the others contradict: {reason}")
        network = without_photo(network, photo)
    control = contradicted_control(network, agreed[0])
    if control:
        names = [f"{network.names[gcp.point]} ({off:.3g} m)" for gcp, off in control]
        gcps = [gcp for gcp in network.control if not gcp.check]
        here = fitted_places(
            agreed[0].unknowns.point[[gcp.point for gcp in gcps]], np.array([gcp.place for gcp in gcps])
        )
        places = dict(zip((gcp.point for gcp in gcps), here, strict=True))
        pairs = exchanged_control(network, [gcp for gcp, _ in control], places)
        remarks.append(
            f"control points left out, which are far from where the others put them: {listed(names)}{pairs}"
        )
        wrong_points = {gcp.point for gcp, _ in control}
        network = replace(
            network,
            control=tuple(
                replace(gcp, check=gcp.check or gcp.point in wrong_points) for gcp in network.control
            ),
            start=np.where(
                np.isin(np.arange(len(network.names)), list(wrong_points))[:, None], np.nan, network.start
            ),
        )
    return Healed(network, photos, tuple(remarks)) if remarks else None


def without_photo(network: Network, photo: int) -> Network:
    """Return a network without a photograph and its marks."""
    rest = with_marks(network, network.photo != photo)
    marked = np.bincount(rest.point, minlength=len(network.names)) > 0
    return replace(
        rest,
        photos=tuple(other for f, other in enumerate(network.photos) if f != photo),
        control=tuple(gcp for gcp in network.control if marked[gcp.point]),
        photo=rest.photo - (rest.photo > photo),
    )


def _wrong_photo(network: Network, suspicion: Array | None) -> tuple[int, tuple[Solution, float]] | None:
    """Return the photograph without which the others agree, and their adjustment; None without exactly one."""
    order = np.arange(len(network.photos))
    if suspicion is not None:
        order = np.argsort(-suspicion, kind="stable")
    trials = list[tuple[float, int, Solution]]()
    for f in order[:_MAX_PHOTOS].tolist():
        rest = without_photo(network, f)
        if len(rest.photos) < 2 or not useful_marks(rest)[0].any():
            continue
        if (agreed := adjusted_alone(rest)) is not None and agreed[1] < AGREE:
            trials.append((agreed[1], f, agreed[0]))
    if not trials:
        return None
    sigma0, photo, solution = min(trials, key=lambda trial: trial[0])
    return photo, (solution, sigma0)


def _diagnosis(network: Network, photo: int, solution: Solution) -> str:
    """Return what is wrong with a photograph, by the points that the others show; the camera is the adjusted one."""
    place = solution.unknowns.point
    rows = np.flatnonzero((network.photo == photo) & np.isfinite(place[network.point]).all(axis=1))
    if len(rows) < _LEAST_POINTS:
        return f"only {len(rows)} of its points are known from others"
    number = network.photos[photo].camera
    camera = replace(network.cameras[number], inner=solution.unknowns.inner[number])
    image, points = network.image[rows], place[network.point[rows]]
    as_it_is = _misfit(camera, image, points)
    mirrored = _misfit(camera, np.abs(image - (camera.size[0], 0)), points)
    if mirrored < POOR and mirrored < _BETTER * as_it_is:
        return "it is mirrored: its marks fit if x is counted from the right edge. Mark the picture as it was taken"
    scale = _best_constant(camera, image, points, _CONSTANTS)
    scale *= _best_constant(_scaled(camera, scale), image, points, _FINE)
    if _misfit(_scaled(camera, scale), image, points) < min(POOR, _BETTER * as_it_is):
        return (
            f"its marks fit a camera constant of about {scale * camera.inner[0]:.3g} {camera.unit} instead of "
            f"{camera.inner[0]:.4g}: give it a camera of its own"
        )
    return "its marks fit neither mirrored nor with another camera constant. Check the numbers of its points"


def _scaled(camera: Camera, scale: float) -> Camera:
    return replace(camera, inner=camera.inner * np.r_[scale, np.ones(len(camera.inner) - 1)])


def _best_constant(camera: Camera, image: Array, points: Array, scales: Array) -> float:
    """Return the scale of the camera constant with which a photograph fits best."""
    misfits = [_misfit(_scaled(camera, scale), image, points) for scale in scales]
    return float(scales[int(np.argmin(misfits))])


def _misfit(camera: Camera, image: Array, points: Array) -> float:
    """Return by how much of a photograph its points miss after a resection, so that most of them are within it."""
    try:
        resected = resect(directions(camera, image), points)
    except MomaError:
        return np.inf
    if resected is None:
        return np.inf
    seen = project(camera, resected[0], resected[1], points)
    off = np.linalg.norm(seen - image, axis=1) / max(camera.size)
    off[~np.isfinite(off)] = np.inf
    return float(np.quantile(off, _MOST_AGREE, method="higher"))
