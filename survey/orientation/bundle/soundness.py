"""Checks of a network before anything is computed: units, photographs without rays, control that cannot hold it."""

import numpy as np

from ground.errors import SurveyError
from survey.conventions import MOST, NEGLIGIBLE, PER_MILLE
from survey.orientation.network import Camera, Network, listed
from survey.orientation.projection import corrected

_PIXELS_MM = (5e-4, 0.5)  # sizes of pixels, of sensors and of scanned plates [mm]
_ANGLES = (0.25, 60.0)  # camera constant over the longer side of the photograph: from 127° to telescopes
_DISTORTED = MOST  # distortion in the corners over their distance from the principal point
_TINY = (
    NEGLIGIBLE  # largest coordinate of marks over the size of photographs, below which they are not in pixels
)
_OUTSIDE = NEGLIGIBLE  # of the size of the photograph, marks may lie outside it
_ON_LINE = PER_MILLE  # extent of control points across a line, over that along it


def check_network(network: Network) -> None:
    """Check a network.

    Raises
    ------
    SurveyError
        at the line of the camera, photograph, mark or control point that is wrong
    """
    check_cameras(network)
    counts = np.bincount(network.photo, minlength=len(network.photos))
    for photo, count in zip(network.photos, counts, strict=True):
        if not count:
            raise SurveyError(
                f"photograph {photo.name} has no marks",
                where=photo.where or network.path,
                remedy="mark points on it, or leave it out",
            )
    size = np.array([camera.size for camera in network.cameras], dtype=float)
    size = size[[photo.camera for photo in network.photos]][network.photo]
    outside = ((network.image < -_OUTSIDE * size) | (network.image > (1.0 + _OUTSIDE) * size)).any(axis=1)
    for k in np.flatnonzero(outside)[:1]:
        width, height = network.camera_of(network.photo[k]).size
        x, y = network.image[k]
        raise SurveyError(
            f"point {network.names[network.point[k]]} at ({x:g}, {y:g}) lies outside photograph "
            f"{network.photos[network.photo[k]].name} of {width} × {height} pixels",
            where=network.where(int(k)),
            remedy="marks are in pixels, to the right and down from the upper left corner",
        )
    for m, camera in enumerate(network.cameras):
        mine = np.array([photo.camera == m for photo in network.photos])[network.photo]
        reach = np.abs(network.image[mine]).max(axis=0, initial=0.0)
        if mine.any() and (reach < _TINY * np.array(camera.size)).all():
            raise SurveyError(
                f"all marks of camera {camera.name} lie within {reach[0]:.3g} × {reach[1]:.3g} of {camera.size[0]} × "
                f"{camera.size[1]} pixels: they are of another unit",
                where=network.where(int(np.flatnonzero(mine)[0])),
                remedy="give marks in pixels, to the right and down from the upper left corner",
            )
    _check_control(network)


def check_cameras(network: Network) -> None:
    """Check the cameras of a network.

    Raises
    ------
    SurveyError
        at the camera whose values are of another unit
    """
    for camera in network.cameras:
        if (fault := _camera_fault(camera)) is not None:
            raise SurveyError(
                fault,
                where=camera.where or network.path,
                remedy=f"give the camera in one unit, here {camera.unit}",
            )


def _camera_fault(camera: Camera) -> str | None:
    c, xp, yp = camera.inner[:3].tolist()
    width, height = (side * camera.pixel for side in camera.size)
    if not np.isfinite(camera.inner).all():
        return f"camera {camera.name} has a value that is not finite"
    if camera.unit == "mm" and not _PIXELS_MM[0] <= camera.pixel <= _PIXELS_MM[1]:
        return f"camera {camera.name} has pixels of {camera.pixel:g} mm: its format is not in millimetres"
    ratio = c / max(width, height)
    if not _ANGLES[0] <= ratio <= _ANGLES[1]:
        return (
            f"camera {camera.name} has a camera constant of {c:g} for a format of {width:g} × {height:g} "
            f"{camera.unit}: they are of different units"
        )
    if not (0.0 <= xp <= width and 0.0 <= yp <= height):
        return (
            f"camera {camera.name} has its principal point at ({xp:g}, {yp:g}), outside the format of "
            f"{width:g} × {height:g} {camera.unit}"
        )
    if camera.forward:
        return None
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]) * camera.size
    plain = corners * camera.pixel * (1.0, -1.0) - (xp, -yp)
    off = np.linalg.norm(corrected(camera, corners) - plain, axis=1) / np.linalg.norm(plain, axis=1)
    if off.max() > _DISTORTED:
        return f"camera {camera.name} distorts its corners by {off.max():.0%}: K and P are of another unit"
    return None


def _check_control(network: Network) -> None:
    """Check that control points and observed stations hold the network, if there are any."""
    marked = np.bincount(network.point, minlength=len(network.names))
    points = [gcp for gcp in network.control if not gcp.check]
    for point in points:
        if not marked[point.point]:
            raise SurveyError(
                f"control point {network.names[point.point]} is marked on no photograph",
                where=point.where or network.path,
                remedy="mark it, or leave it out",
            )
    places = [gcp.place for gcp in points]
    places += [photo.observed_station for photo in network.photos if photo.observed_station is not None]
    has_datum = any(photo.fixed or photo.observed_station is not None for photo in network.photos)
    if network.control and not points and not has_datum:
        raise SurveyError(
            f"all {len(network.control)} control points only check the result: none holds the photographs",
            where=network.control[0].where or network.path,
            remedy="let three or more take part that are not on one line, or leave all out for a frame of its own",
        )
    if not places or any(photo.fixed for photo in network.photos):
        return
    if len(places) < 3:
        names = listed([network.names[gcp.point] for gcp in points])
        raise SurveyError(
            f"{len(points)} control point{'' if len(points) == 1 else 's'} ({names}) cannot hold the photographs",
            where=(points[0].where if points else network.photos[0].where) or network.path,
            remedy="give three or more that are not on one line, or none for a network in a frame of its own",
        )
    arms = np.array(places) - np.mean(places, axis=0)
    along, across = np.linalg.svd(arms, compute_uv=False)[:2]
    if not across > _ON_LINE * along:
        raise SurveyError(
            f"the {len(places)} control points {listed([network.names[gcp.point] for gcp in points])} lie on one line",
            where=(points[0].where if points else network.photos[0].where) or network.path,
            remedy="measure a control point off this line: the photographs could turn about it",
        )
