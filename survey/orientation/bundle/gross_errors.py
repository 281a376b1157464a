"""Gross errors that no test of single marks finds: control points and photographs that contradict all others.

They are sought by leaving out one at a time: without the wrong one the others agree. A photograph is then oriented by
the points that the others show, as its mirror image and with a lens of its own, which tells what is wrong. The lens has
a camera constant and a distortion of its own: with the distortion of the others the marks of another lens fit none.
"""

from dataclasses import dataclass, replace

import numpy as np

from ground.errors import MomaError
from survey.arrays import Array
from survey.conventions import CRITICAL
from survey.orientation.bundle.adjustment import EXTERIOR, Solution, adjust, prepare
from survey.orientation.bundle.agreement import (
    AGREE,
    SEARCHES,
    adjusted_alone,
    contradicted_control,
    exchanged_control,
    fitted_places,
    useful_marks,
    with_marks,
)
from survey.orientation.bundle.resection import resect
from survey.orientation.bundle.statistics import statistics
from survey.orientation.network import INTERIOR, Camera, Control, Network, Photo, listed
from survey.orientation.projection import directions

_OTHER_LENS = ("c", "K1")
"""What is estimated of the lens of a photograph that may have been taken by another."""

_UNDISTORTED = np.isin(INTERIOR, ("c", "xp", "yp"))
"""What is taken of a camera for another lens in front of it."""

_LEAST_POINTS = len(EXTERIOR) + len(_OTHER_LENS)
"""Points of a photograph by which it is diagnosed: at least as many redundant coordinates as unknowns."""


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
        wrong = _wrong_photo(network, suspicion, AGREE if agreed is None else min(AGREE, agreed[1] / AGREE))
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


def _wrong_photo(
    network: Network, suspicion: Array | None, limit: float
) -> tuple[int, tuple[Solution, float]] | None:
    """Return the photograph without which the others agree best, and their adjustment.

    None if they agree without none: then σ of all marks is too small, or several photographs are wrong.

    Parameters
    ----------
    limit : σ₀ below which they agree, and far better than with it
    """
    order = np.arange(len(network.photos))
    if suspicion is not None:
        order = np.argsort(-suspicion, kind="stable")
    trials = list[tuple[float, int, Solution]]()
    for f in order[:SEARCHES].tolist():
        rest = without_photo(network, f)
        if len(rest.photos) < 2 or not useful_marks(rest)[0].any():
            continue
        if (agreed := adjusted_alone(rest)) is not None and agreed[1] < limit:
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
    camera = replace(network.cameras[number], inner=solution.unknowns.inner[number], free=())
    single = _Photograph(network.image[rows], network.sigma[rows], place[network.point[rows]])
    mirrored = replace(single, image=np.abs(single.image - (camera.size[0], 0)))
    another = replace(camera, inner=np.where(_UNDISTORTED, camera.inner, 0.0), free=_OTHER_LENS)
    as_mirror, by_lens = _fit(camera, mirrored), _fit(another, single)
    if as_mirror is not None and (by_lens is None or as_mirror.sigma0 < by_lens.sigma0):
        return "it is mirrored: its marks fit if x is counted from the right edge. Mark the picture as it was taken"
    if by_lens is None:
        return (
            "its marks fit neither mirrored nor with another camera constant. Check the numbers of its points"
        )
    stated, unit, (found, sigma) = camera.inner[0], camera.unit, by_lens.constant
    what = f"a camera constant of about {found:.3g} ± {sigma:.2g} {unit} instead of {stated:.4g}"
    if abs(found - stated) < CRITICAL * sigma:
        what = f"another distortion, with a camera constant of {found:.4g} ± {sigma:.2g} {unit}"
    return f"its marks fit {what}: give it a camera of its own"


@dataclass(frozen=True)
class _Photograph:
    """Marks of a photograph: image (n, 2) and sigma (n, 2) [px], and the places (n, 3) of their points [m]."""

    image: Array
    sigma: Array
    points: Array


@dataclass(frozen=True)
class _SingleFit:
    """Fit of a photograph: its σ₀, and the camera constant with its standard deviation."""

    sigma0: float
    constant: tuple[float, float]


def _fit(camera: Camera, marks: _Photograph) -> _SingleFit | None:
    """Orient a photograph by points that are known, without its worst marks; None if most do not agree."""
    resected = resect(directions(camera, marks.image), marks.points)
    if resected is None:
        return None
    count = len(marks.points)
    network = Network(
        "",
        (camera,),
        (Photo("", 0, resected[0], resected[1]),),
        tuple(str(i) for i in range(count)),
        marks.points,
        tuple(Control(i, place, np.zeros((3, 3))) for i, place in enumerate(marks.points)),
        np.zeros(count, dtype=np.int64),
        np.arange(count),
        marks.image,
        marks.sigma,
        np.zeros(count, dtype=np.int64),
    )
    used = np.ones(count, dtype=bool)
    while 2 * used.sum() > count and used.sum() >= _LEAST_POINTS:
        try:
            prepared = prepare(network, keep=used)
            solution = adjust(network, prepared)
            result = statistics(network, prepared, solution)
        except MomaError:
            return None
        if result.sigma0 < AGREE and not solution.behind:
            # the first of what is estimated after the orientation
            variance = result.cameras[len(EXTERIOR), len(EXTERIOR)] if camera.free else 0.0
            return _SingleFit(
                result.sigma0, (solution.unknowns.inner[0, 0], result.sigma0 * float(np.sqrt(variance)))
            )
        used[np.abs(result.standardised).max(axis=1).argmax()] = False
    return None
