"""Refusals of marks, control points and stations that contradict each other, where the photographs agree."""

from dataclasses import replace
from typing import Literal

import numpy as np

from ground.errors import GeometryError, MomaError, SurveyError
from survey.conventions import ENOUGH
from survey.orientation.bundle.adjustment import Solution
from survey.orientation.bundle.agreement import (
    AGREE,
    POOR,
    adjusted_alone,
    contradicted_control,
    fitted_places,
)
from survey.orientation.bundle.control import FAR_OFF, control_tests
from survey.orientation.bundle.start import check_mirrored, swapped
from survey.orientation.bundle.statistics import Statistics
from survey.orientation.network import Network, Photo, listed
from survey.orientation.projection import project

Blunders = Literal["report", "remove"]
"""Treatment of marks that the test finds wrong."""

_STATIONS = ENOUGH  # observed stations of which one that is off can be told


def check_control(network: Network, solution: Solution, result: Statistics, blunders: Blunders) -> None:
    """Refuse control points of which most are far off, where the photographs agree with each other without them.

    A few that are wrong pull the others off; they are left to the search for blunders where there is one.

    Raises
    ------
    SurveyError
    """
    tests = control_tests(network, solution, result)
    scores = np.array([test for gcp, test in zip(network.control, tests, strict=True) if not gcp.check])
    if not (scores > FAR_OFF).any() or (agreed := adjusted_alone(network)) is None:
        return
    _check_hand(network, agreed[0])
    if np.median(scores) <= FAR_OFF or agreed[1] >= AGREE:
        return
    if blunders == "report" or not contradicted_control(network, agreed[0]):
        raise _control_misfit(network, agreed[0])


def check_contradictions(
    network: Network, oriented: Network, solution: Solution, misfit: float, failure: MomaError | None
) -> None:
    """Refuse an orientation that contradicts its marks, its control points or its start values."""
    values = solution.unknowns
    photos = tuple(
        replace(photo, rotation=r, station=s)
        for photo, r, s in zip(oriented.photos, values.rotation, values.station, strict=True)
    )
    pair = swapped(network, replace(oriented, photos=photos))
    if pair is not None:
        raise _swapped(network, *pair)
    _check_stations(network, solution)
    if misfit < POOR:
        return
    check_control_alone(network)
    if failure is not None:
        raise failure
    worst = _worst(oriented, solution)
    raise GeometryError(
        f"the marks contradict each other: half miss by over {misfit:.1%} of a photograph, most on {worst.name}",
        where=worst.where or network.path,
        remedy="check the marks of this photograph, and the camera",
    )


def check_control_alone(network: Network) -> None:
    """Refuse control points that do not fit photographs which agree with each other without them."""
    adjusted_points = [gcp for gcp in network.control if not gcp.check]
    if not adjusted_points or (agreed := adjusted_alone(network)) is None:
        return
    _check_hand(network, agreed[0])
    raise _control_misfit(network, agreed[0])


def _control_misfit(network: Network, alone: Solution) -> SurveyError:
    """Return the error that names the few control points that are wrong, or tells that they do not fit as a whole."""
    if wrong := contradicted_control(network, alone):
        names = [f"{network.names[gcp.point]} ({off:.3g} m)" for gcp, off in wrong]
        return SurveyError(
            f"control points are far from where the others put them: {listed(names)}",
            where=wrong[0][0].where or network.path,
            remedy="check their coordinates and their number on the photographs, or let them only check the result",
        )
    first = next(gcp for gcp in network.control if not gcp.check)
    return SurveyError(
        "the control points do not fit the photographs, which agree with each other without them",
        where=first.where or network.path,
        remedy="check the numbers, the order and the unit of their coordinates",
    )


def _check_stations(network: Network, solution: Solution) -> None:
    """Refuse observed stations that contradict the photographs, naming those that are swapped or one that is off."""
    seen = [f for f, photo in enumerate(network.photos) if photo.observed_station is not None]
    if len(seen) < _STATIONS:
        return
    there = np.array([network.photos[f].observed_station for f in seen])
    sigma = np.array([network.photos[f].station_sigma for f in seen]).max(axis=1)
    off = np.linalg.norm(solution.unknowns.station[seen] - there, axis=1)
    if not (off > FAR_OFF * sigma).any():
        return
    free = replace(
        network,
        control=(),
        photos=tuple(
            replace(photo, observed_station=None, observed_rotation=None) for photo in network.photos
        ),
    )
    if (agreed := adjusted_alone(free)) is None:
        return
    here = fitted_places(agreed[0].unknowns.station[seen], there)
    distances = np.linalg.norm(here - there, axis=1)
    apart = np.linalg.norm(here[:, None] - there[None], axis=2)
    worst = int(np.argmax(distances))
    photo = network.photos[seen[worst]]
    for index in range(len(seen)):
        across, off_both = max(apart[worst, index], apart[index, worst]), min(distances[[worst, index]])
        if index != worst and FAR_OFF * across < off_both:
            raise _swapped(network, *sorted((seen[worst], seen[index])))
    if distances[worst] > FAR_OFF * sigma[worst]:
        raise SurveyError(
            f"the observed station of photograph {photo.name} is {distances[worst]:.3g} m from where the others put it",
            where=photo.where or network.path,
            remedy="check its coordinates, and to which photograph they belong",
        )


def _swapped(network: Network, a: int, b: int) -> SurveyError:
    first, second = network.photos[a], network.photos[b]
    return SurveyError(
        f"photographs {first.name} and {second.name} are swapped: each fits the orientation given for the other",
        where=first.where or network.path,
        remedy="give the marks to the photograph that they were made on",
    )


def _check_hand(network: Network, alone: Solution) -> None:
    """Refuse mirrored control points."""
    gcps = [gcp for gcp in network.control if not gcp.check]
    source = alone.unknowns.point[[gcp.point for gcp in gcps]]
    fine = np.isfinite(source).all(axis=1)
    check_mirrored(source[fine], np.array([gcp.place for gcp in gcps])[fine], network)


def _worst(network: Network, solution: Solution) -> Photo:
    values, off = solution.unknowns, list[float]()
    for f, photo in enumerate(network.photos):
        mine = network.photo == f
        seen = project(
            network.cameras[photo.camera],
            values.rotation[f],
            values.station[f],
            values.point[network.point[mine]],
        )
        miss = np.linalg.norm(seen - network.image[mine], axis=1)
        off.append(float(np.median(np.where(np.isfinite(miss), miss, np.inf))))
    return network.photos[int(np.argmax(off))]
