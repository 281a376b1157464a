"""Values to start from: orientations of all photographs and places of all points, in the frame of the control points.

What the file gives is used; it is brought to the control points by a similarity where it is in another frame. What is
missing is found from what is known: photographs by resection from four known points, points by intersection of two
photographs, and with nothing known the best pair of photographs by relative orientation.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ground.errors import GeometryError, SurveyError
from survey.arrays import Array
from survey.conventions import CHECKED, FEW, LARGELY, LEVEL, SOME, TENTH
from survey.orientation.bundle.resection import (
    essential_orientations,
    intersect_many,
    resect,
    similarity_between,
)
from survey.orientation.network import Network, Photo
from survey.orientation.projection import directions

FLAT = 5e-3
"""Extent of control points off their plane over that in it, below which mirrored ones fit as well."""

_APART = FEW  # mean distance of start values from control points, over the extent of these, from which they are moved
_BETTER = SOME  # misfit of the right hand over that of the wrong one
_ALIKE = TENTH  # difference of a reflection from an exchange or a change of sign of coordinates
_MOST_AGREE = LARGELY  # part of the known points of a photograph that must agree on its orientation
_NARROW = LEVEL  # angle between rays below which a point is not used for resections


def without_start(network: Network) -> Network:
    """Return a network without start values, apart from control points and observed or fixed orientations."""
    start = np.full_like(network.start, np.nan)
    for gcp in network.control:
        if not gcp.check:
            start[gcp.point] = gcp.place
    photos = tuple(
        photo if photo.fixed else replace(photo, station=None, rotation=None) for photo in network.photos
    )
    return replace(network, start=start, photos=photos)


def start_values(network: Network) -> Iterator[Network]:
    """Yield the network with start values; several times where a relative orientation is ambiguous.

    Parameters
    ----------
    network : its own start values in the frame of its control points, see `aligned`

    Raises
    ------
    SurveyError, GeometryError
        if a photograph cannot be oriented, naming it, or the control points are mirrored
    """
    rays = _rays(network)
    control = {gcp.point: gcp.place for gcp in network.control if not gcp.check}
    oriented = {
        f: (photo.rotation, photo.station)
        for f, photo in enumerate(network.photos)
        if photo.rotation is not None and photo.station is not None
    }
    places = {i: place for i, place in enumerate(network.start) if np.isfinite(place).all()}
    if oriented or _resectable(network, control):
        yield _filled(network, rays, dict(oriented), {**places, **control})
        return
    for first in _pairs(network, rays):
        filled = _filled(network, rays, first, {}, strict=False)
        if any(photo.rotation is None for photo in filled.photos):
            continue
        yield aligned(filled, always=True)
    _filled(network, rays, {}, dict(control))  # names what cannot be oriented
    raise GeometryError(
        "no pair of photographs can be oriented", where=network.path, remedy="mark more common points"
    )


def check_mirrored(source: Array, target: Array, network: Network) -> None:
    """Refuse control points that fit only as a reflection.

    Parameters
    ----------
    source, target : (n, 3) places in the frame of the photographs, and as control points [m]

    Raises
    ------
    SurveyError
    """
    if len(source) < 4:
        return

    def misfit(mirrored: bool) -> float:
        """Return the root mean square distance [m] that a similarity leaves, mirrored or not."""
        rotation, shift, scale = similarity_between(source, target, mirrored=mirrored)
        return float(np.sqrt(((scale * source @ rotation.T + shift - target) ** 2).sum(axis=1).mean()))

    extent = float(np.linalg.norm(np.std(target, axis=0)))
    right, wrong = misfit(False), misfit(True)
    if wrong < _BETTER * right and right > 1e-4 * extent:
        gcp = next(entry for entry in network.control if not entry.check)
        raise SurveyError(
            f"the control points are mirrored: they fit to {wrong:.3g} m as a reflection, to {right:.3g} m otherwise",
            where=gcp.where or network.path,
            remedy="check the order and the signs of their coordinates, which must form a right-handed system, and "
            "that y of the marks counts downwards",
        )


def aligned(network: Network, always: bool = False) -> Network:
    """Bring start values into the frame of the control points, if they are in another.

    Raises
    ------
    SurveyError
        if the control points are mirrored
    """
    control = [
        gcp for gcp in network.control if not gcp.check and np.isfinite(network.start[gcp.point]).all()
    ]
    stations = [
        photo for photo in network.photos if photo.observed_station is not None and photo.station is not None
    ]
    if len(control) + len(stations) < 3:
        return network
    source = np.array(
        [*(network.start[gcp.point] for gcp in control), *(station.station for station in stations)]
    )
    target = np.array([*(gcp.place for gcp in control), *(station.observed_station for station in stations)])
    if control:
        check_mirrored(source, target, network)
    extent = float(np.linalg.norm(np.std(target, axis=0)))
    if not always and np.linalg.norm(source - target, axis=1).mean() <= _APART * extent:
        return network
    rotation, shift, scale = similarity_between(source, target)
    shape = np.linalg.svd(target - target.mean(axis=0), compute_uv=False)
    if control and not always and shape[2] < FLAT * shape[0] and _looks_mirrored(source, target):
        raise SurveyError(
            "the control points lie in a plane that shows its other side to the photographs: they are mirrored",
            where=control[0].where or network.path,
            remedy="check the order and the signs of their coordinates: they must form a right-handed system",
        )
    photos = tuple(
        photo
        if photo.rotation is None or photo.station is None or photo.fixed
        else replace(
            photo, rotation=rotation @ photo.rotation, station=scale * rotation @ photo.station + shift
        )
        for photo in network.photos
    )
    start = scale * network.start @ rotation.T + shift
    return replace(network, photos=photos, start=start)


def _looks_mirrored(source: Array, target: Array) -> bool:
    """Return True if points of one plane differ by the sign of x or y, or by the order of the two.

    A turn to the other side of the plane fits them as well, but nobody turns a frame like that.
    """
    fitted, _, _ = similarity_between(source, target, mirrored=True)
    usual = (np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0]), np.eye(3)[[1, 0, 2]])
    return any(float(np.abs(fitted - mirrored).max()) < _ALIKE for mirrored in usual)


def _rays(network: Network) -> Array:
    """Return the direction of each mark in the axes of its camera, (n, 3)."""
    out = np.empty((len(network.photo), 3))
    which = np.array([photo.camera for photo in network.photos])[network.photo]
    for m, camera in enumerate(network.cameras):
        out[which == m] = directions(camera, network.image[which == m])
    for k in np.flatnonzero(~np.isfinite(out).all(axis=1))[:1]:
        raise SurveyError(
            f"the distortion of camera {network.camera_of(network.photo[k]).name} has no inverse at this mark",
            where=network.where(int(k)),
            remedy="check K and P of the camera",
        )
    return out


def _resectable(network: Network, control: dict[int, Array]) -> bool:
    controlled = np.isin(network.point, list(control))
    return bool((np.bincount(network.photo[controlled], minlength=1) >= CHECKED).any())


def _filled(
    network: Network,
    rays: Array,
    oriented: dict[int, tuple[Array, Array]],
    places: dict[int, Array],
    strict: bool = True,
) -> Network:
    """Orient the remaining photographs and intersect the remaining points, in turn."""
    of_photo = [np.flatnonzero(network.photo == f) for f in range(len(network.photos))]
    firm, misfits = set(places), set[int]()
    while True:
        _intersect(network, rays, oriented, places, firm)
        waiting = [f for f in range(len(network.photos)) if f not in oriented]
        usable = {f: [k for k in of_photo[f] if network.point[k] in firm] for f in waiting}
        ready = sorted((f for f in waiting if len(usable[f]) >= CHECKED), key=lambda f: -len(usable[f]))
        progress = False
        for f in ready:
            if len(usable[f]) < 0.5 * len(usable[ready[0]]):
                break
            resected = resect(rays[usable[f]], np.array([places[network.point[k]] for k in usable[f]]))
            if resected is None or resected[2] < max(CHECKED, _MOST_AGREE * len(usable[f])):
                misfits.add(f)
                continue
            oriented[f] = resected[:2]
            progress = True
        if not progress:
            break
    photos = list[Photo]()
    for f, photo in enumerate(network.photos):
        if f in oriented:
            photos.append(
                replace(photo, rotation=oriented[f][0], station=oriented[f][1])
                if photo.rotation is None
                else photo
            )
        elif strict:
            raise _not_oriented(network, f, len(usable.get(f, ())), f in misfits)
        else:
            photos.append(photo)
    start = network.start.copy()
    for i, place in places.items():
        start[i] = place
    return replace(network, photos=tuple(photos), start=start)


def _not_oriented(network: Network, f: int, count: int, misfit: bool) -> SurveyError:
    photo = network.photos[f]
    what = f"photograph {photo.name} cannot be oriented: "
    if misfit:
        what += f"its {count} known points do not lie as it shows them"
        remedy = "check their marks, the control points (are they mirrored?) and the unit of the camera"
    else:
        what += f"{count} of its points {'is' if count == 1 else 'are'} known"
        remedy = f"mark {CHECKED} points on it that are control points or marked on two other photographs"
    return SurveyError(what, where=photo.where or network.path, remedy=remedy)


def _intersect(
    network: Network,
    rays: Array,
    oriented: dict[int, tuple[Array, Array]],
    places: dict[int, Array],
    firm: set[int],
) -> None:
    """Intersect the points that two oriented photographs show; `firm` collects those good for a resection."""
    located = np.zeros(len(network.photos), dtype=bool)
    located[list(oriented)] = True
    wanted = np.ones(len(network.names), dtype=bool)
    wanted[list(firm)] = False
    marks = np.flatnonzero(located[network.photo] & wanted[network.point])
    marks = marks[np.argsort(network.point[marks], kind="stable")]
    if not len(marks):
        return
    rotations, stations = np.zeros((len(located), 3, 3)), np.zeros((len(located), 3))
    for f, (rotation, station) in oriented.items():
        rotations[f], stations[f] = rotation, station
    photo = network.photo[marks]
    turned = np.einsum("kij,kj->ki", rotations[photo], rays[marks])
    points, found, angles = intersect_many(network.point[marks], stations[photo], turned)
    for i, place, angle in zip(points.tolist(), found, angles.tolist(), strict=True):
        if angle > 0.0:
            places[i] = place
            if angle > _NARROW:
                firm.add(i)


def _pairs(network: Network, rays: Array) -> Iterator[dict[int, tuple[Array, Array]]]:
    """Yield orientations of pairs of photographs, those with most common points first."""
    seen = [
        {
            int(i): k
            for k, i in zip(
                np.flatnonzero(network.photo == f), network.point[network.photo == f], strict=True
            )
        }
        for f in range(len(network.photos))
    ]
    count = len(seen)
    pairs = sorted(
        ((len(seen[a].keys() & seen[b].keys()), a, b) for a in range(count) for b in range(a + 1, count)),
        reverse=True,
    )
    for common, a, b in pairs[:3]:
        if common < 6:
            continue
        both = sorted(seen[a].keys() & seen[b].keys())
        first, second = rays[[seen[a][i] for i in both]], rays[[seen[b][i] for i in both]]
        for rotation, station, _ in essential_orientations(first, second):
            yield {a: (np.eye(3), np.zeros(3)), b: (rotation, station)}
    if pairs and pairs[0][0] < 6:
        common, a, b = pairs[0]
        raise GeometryError(
            f"photographs {network.photos[a].name} and {network.photos[b].name} share {common} points, no pair more",
            where=network.path,
            remedy="mark 6 or more points on two photographs, or 4 control points on one",
        )


def swapped(network: Network, oriented: Network) -> tuple[int, int] | None:
    """Return two photographs of which each was oriented where the file has the other; None without such a pair."""
    stations = [
        photo.station if photo.observed_station is None else photo.observed_station
        for photo in network.photos
    ]
    if any(station is None for station in stations):
        return None
    there, here = np.array(stations), np.array([photo.station for photo in oriented.photos])
    distances = np.linalg.norm(here - there, axis=1)
    apart = np.linalg.norm(here[:, None] - there[None], axis=2)
    for a in range(len(stations)):
        for b in range(a + 1, len(stations)):
            if max(apart[a, b], apart[b, a]) < 0.2 * min(distances[a], distances[b]):
                return a, b
    return None
