"""Points to places on photographs and back: the collinearity equations for many points of one photograph."""

import numpy as np

from survey.arrays import Array
from survey.conventions import MAX_ITERATIONS
from survey.orientation.network import Camera

_CLOSE = 1e-13  # precision of the inverse of the distortion, relative to the camera constant


def brown(places: Array, inner: Array) -> Array:
    """Distort places by Brown's polynomials, (n, 2) from the principal point [camera unit]."""
    k, (p1, p2) = inner[5:8], inner[8:10]
    x, y = places.T
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]))
    return np.column_stack(
        [
            x * radial + p1 * (r2 + 2.0 * x * x) + 2.0 * p2 * x * y,
            y * radial + p2 * (r2 + 2.0 * y * y) + 2.0 * p1 * x * y,
        ]
    )


def _undo(places: Array, inner: Array) -> Array:
    """Return the places that Brown's polynomials distort to the given ones, by fixed-point iteration.

    Where the polynomials have no inverse, far outside the photograph, the places are nan.
    """
    out = places.copy()
    for _ in range(MAX_ITERATIONS):
        with np.errstate(over="ignore", invalid="ignore"):
            off = places - brown(out, inner)
            out = out + off
        if not (np.abs(off) > _CLOSE * inner[0]).any():
            return out
    out[~(np.abs(off) < 1e-6 * inner[0]).all(axis=1)] = np.nan
    return out


def corrected(camera: Camera, image: Array) -> Array:
    """Return places of the ideal photograph, x to the right and y upwards from the principal point.

    Parameters
    ----------
    image : (n, 2) measured, to the right and down from the upper left corner [px]

    Returns
    -------
    (n, 2) free of distortion, affinity and skew [camera unit]
    """
    inner = camera.inner
    at = image * camera.pixel * (1.0, -1.0) - (inner[1], -inner[2])
    if camera.forward:
        y = at[:, 1]
        return _undo(np.column_stack([(at[:, 0] - inner[4] * y) / (1.0 + inner[3]), y]), inner)
    at = brown(at * (1.0 + inner[3], 1.0), inner)
    return np.column_stack([at[:, 0] + inner[4] * at[:, 1], at[:, 1]])


def directions(camera: Camera, image: Array) -> Array:
    """Return the rays of measured places in the camera's axes, (n, 3), of any length."""
    ideal = corrected(camera, image)
    return np.column_stack([ideal, np.full(len(ideal), -camera.inner[0])])


def project(camera: Camera, rotation: Array, station: Array, points: Array) -> Array:
    """Return where a photograph shows points, (n, 2), to the right and down from its upper left corner [px].

    Points behind the camera are nan.
    """
    inner = camera.inner
    q = (points - station) @ rotation
    with np.errstate(divide="ignore", invalid="ignore"):
        ideal = np.where(q[:, 2:] < 0.0, -inner[0] * q[:, :2] / q[:, 2:], np.nan)
    if camera.forward:
        at = brown(ideal, inner)
        at = np.column_stack([(1.0 + inner[3]) * at[:, 0] + inner[4] * at[:, 1], at[:, 1]])
    else:
        at = _undo(np.column_stack([ideal[:, 0] - inner[4] * ideal[:, 1], ideal[:, 1]]), inner)
        at = at / (1.0 + inner[3], 1.0)
    middle = np.array([inner[1], -inner[2]])
    out: Array = (at + middle) / camera.pixel * (1.0, -1.0)
    return out
