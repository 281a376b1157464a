"""Space intersection: a point from its marks on two or more oriented photographs.

The place minimises the weighted squares of the marks' residuals. With the rows A and B of the collinearity
equations by the orientation and by the point, V = Σ BᵀB,

    dX = V⁻¹ Σ Bᵀ (dm - A dc),

so that the covariance is V⁻¹ + V⁻¹Wᵀ C W V⁻¹, W = Σ AᵀB, and the second part is shared with all other points.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import EPSILON, GROSS, GROUP, MAX_ITERATIONS, PER_MILLE
from survey.orientation.bundle.resection import intersect_rays
from survey.orientation.oriented import Oriented
from survey.orientation.projection import directions, project
from survey.orientation.stones.located import Located, Mark, Sight, line_up

_NARROWEST = 1.0  # angle between the outer rays of a point below which it is refused [°]
_CHECKED = PER_MILLE  # deviation of a residual, over that of its mark, below which nothing checks it
_ENOUGH = GROUP  # marks of a point of which one can be told to be wrong
_MISSES = GROSS  # test of a mark beyond which it is of another point


def intersect(oriented: Oriented, name: str, marks: Sequence[Mark]) -> Located:
    """Intersect a point; of three marks or more, the one without which alone the others agree is left out.

    Parameters
    ----------
    name : of the point
    marks : two or more, on different photographs

    Raises
    ------
    GeometryError
        if its rays run nearly the same way, it lies behind a photograph, or its marks are not of one point
    """
    try:
        return _intersected(oriented, name, marks)
    except GeometryError:
        sound = list[tuple[Mark, Located]]()
        for wrong in marks if len(marks) >= _ENOUGH else ():
            try:
                sound.append(
                    (wrong, _intersected(oriented, name, [mark for mark in marks if mark is not wrong]))
                )
            except GeometryError:
                continue
        if len(sound) != 1:
            raise
    wrong, located = sound[0]
    photo = oriented.photos[wrong.photo].name
    seen = project(
        oriented.camera(wrong.photo),
        oriented.rotation(wrong.photo),
        oriented.station(wrong.photo),
        located.place[None],
    )[0]
    off = float(np.linalg.norm(seen - wrong.image))
    text = f"the mark on {photo}, {off:.0f} px from where the others put it"
    return replace(located, text=f"{located.text}, without {text}", left_out=text)


def _intersected(oriented: Oriented, name: str, marks: Sequence[Mark]) -> Located:
    rays = np.array(
        [
            oriented.rotation(mark.photo) @ directions(oriented.camera(mark.photo), mark.image[None])[0]
            for mark in marks
        ]
    )
    stations = np.array([oriented.station(mark.photo) for mark in marks])
    seen = " and ".join(oriented.photos[mark.photo].name for mark in marks)
    place, angle = intersect_rays(stations, rays)
    if not np.degrees(angle) > _NARROWEST:
        raise GeometryError(
            f"the rays of point {name} from {seen} meet at {np.degrees(angle):.1f}°",
            remedy="mark it on photographs taken from places further apart",
        )
    for _ in range(MAX_ITERATIONS):
        rows = [line_up(oriented, mark, place) for mark in marks]
        by_point = np.concatenate([row[2] for row in rows])
        inverse = np.linalg.inv(by_point.T @ by_point)
        step = inverse @ by_point.T @ np.concatenate([row[0] for row in rows])
        place = place + step
        if np.linalg.norm(step) < EPSILON * np.linalg.norm(place - stations[0]):
            break
    for mark, station in zip(marks, stations, strict=True):
        if not (place - station) @ oriented.rotation(mark.photo)[:, 2] < 0.0:
            raise GeometryError(
                f"point {name} would lie behind photograph {oriented.photos[mark.photo].name}",
                remedy="check its marks: one of them is of another point",
            )
    rows = [line_up(oriented, mark, place) for mark in marks]
    gain = inverse @ by_point.T
    by_camera = np.concatenate([row[1] for row in rows])
    # the residuals are those of the marks, and of the photographs' orientation
    rest = np.eye(len(by_point)) - by_point @ gain
    spread = rest @ (np.eye(len(by_point)) + by_camera @ oriented.covariance @ by_camera.T) @ rest
    deviations = np.sqrt(np.maximum(np.diag(spread), 0.0)).reshape(-1, 2)
    sights = tuple(
        sight(oriented, mark, row[0], deviation, place)
        for mark, row, deviation in zip(marks, rows, deviations, strict=True)
    )
    worst = max(sights, key=lambda one: one.test)
    if worst.test > _MISSES and max(abs(worst.residual)) > _MISSES * marks[0].sigma:
        raise GeometryError(
            f"the marks of point {name} on {seen} miss by {np.hypot(*worst.residual):.1f} px ({worst.test:.0f} σ)",
            remedy="check whether they show the same point",
        )
    return Located(
        name,
        place,
        -gain @ by_camera,
        {_source(mark): gain[:, 2 * k : 2 * k + 2] for k, mark in enumerate(marks)},
        sights,
        f"intersection of {len(marks)} rays at {np.degrees(angle):.0f}°",
    )


def _source(mark: Mark) -> str:
    return f"mark {mark.photo} {mark.image[0]!r} {mark.image[1]!r}"


def sight(oriented: Oriented, mark: Mark, residual: Array, deviations: Array, place: Array) -> Sight:
    """Describe a mark behind a point; its residual (2,) and the deviations of that (2,) are weighted."""
    checked = deviations > _CHECKED
    tests = np.where(checked, np.abs(residual) / np.where(checked, deviations, 1.0), 0.0)
    return Sight(
        oriented.photos[mark.photo].name,
        mark.image,
        residual * mark.sigma * (1.0, -1.0),
        float(tests.max()),
        float(np.linalg.norm(place - oriented.station(mark.photo))),
    )
