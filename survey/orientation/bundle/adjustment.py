"""Bundle adjustment: cameras, photographs and points from marks, by weighted least squares.

Gauss–Newton steps, damped after Levenberg and Marquardt where one would not bring the residuals down. The points are
eliminated (`survey.orientation._kernels.adjustment`), and the system of the cameras is solved by Cholesky's method.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import EPSILON, MAX_ITERATIONS, VANISHING
from survey.orientation._kernels.adjustment import Rays, Unknowns, back_substitute, reduced_normals
from survey.orientation.network import INTERIOR, Network, Photo
from survey.orientation.rotations import angle_slopes, turned

_FIRST = 1e-4  # first damping tried [-]
_STRONGEST = 1e12  # damping beyond which no step brings the residuals down [-]


@dataclass(frozen=True)
class Prepared:
    """A network as the kernels take it.

    Attributes
    ----------
    rays : marked points, sorted by their points
    order : (n,) index in the network of each of these rays
    unknowns : start values, and the columns of what is estimated
    information : (np, 3, 3) weight matrix of the place of each point beforehand [m⁻²]
    place : (np, 3) that place [m]
    columns : names of what is estimated at the cameras' side: (photograph or camera, parameter)
    observations : number of observed coordinates, those of control points and stations included
    count : number of unknowns
    datum : number of directions that inner constraints hold: 7 without control, otherwise 0
    """

    rays: Rays
    order: NDArray[np.int64]
    unknowns: Unknowns
    information: Array
    place: Array
    columns: tuple[tuple[str, str], ...]
    observations: int
    count: int
    datum: int


@dataclass(frozen=True)
class Solution:
    """Adjusted values.

    Attributes
    ----------
    unknowns : adjusted
    square : sum of the squares of all weighted residuals
    iterations : steps that were taken
    behind : rays whose point lies behind their photograph
    """

    unknowns: Unknowns
    square: float
    iterations: int
    behind: int


EXTERIOR = ("rx", "ry", "rz", "x", "y", "z")
"""Parameters of the exterior orientation in the reduced system."""

SIMILARITY = ("x", "y", "z", "rx", "ry", "rz", "scale")
"""Parameters of a small similarity, in the order of the columns of `similarity`."""


def prepare(
    network: Network, start: Unknowns | None = None, keep: NDArray[np.bool_] | None = None
) -> Prepared:
    """Arrange a network for the kernels.

    Parameters
    ----------
    network : with orientations and places to start from
    start : values to start from instead of the network's
    keep : (n,) marked points that take part; None: all
    """
    cameras, photos = network.cameras, network.photos
    used = np.ones(len(network.photo), dtype=bool) if keep is None else keep
    chosen = np.flatnonzero(used)
    chosen = chosen[np.lexsort((network.photo[chosen], network.point[chosen]))]
    count = len(network.names)
    counts = np.bincount(network.point[chosen], minlength=count)
    which = np.array([photo.camera for photo in photos], dtype=np.int64)
    pixel = np.array([camera.pixel for camera in cameras])[which[network.photo[chosen]], None]
    rays = Rays(
        np.concatenate([[0], np.cumsum(counts)]),
        network.photo[chosen],
        network.image[chosen] * pixel * (1.0, -1.0),
        1.0 / (network.sigma[chosen] * pixel),
    )
    information, place, free, weighted = _known_places(network)
    columns, table = _columns(network)
    if start is None:
        start = Unknowns(
            which,
            np.array([camera.forward for camera in cameras]),
            np.array([camera.inner for camera in cameras]),
            np.array([np.eye(3) if photo.rotation is None else photo.rotation for photo in photos]),
            np.array([np.zeros(3) if photo.station is None else photo.station for photo in photos]),
            network.start.copy(),
            table,
            free,
        )
    start.point[~free] = place[~free]
    observed = [photo for photo in photos if not photo.fixed]
    stations = 3 * sum(
        (photo.observed_station is not None) + (photo.observed_rotation is not None) for photo in observed
    )
    has_datum = weighted or bool(np.count_nonzero(~free)) or any(photo.fixed for photo in photos)
    has_datum = has_datum or any(photo.observed_station is not None for photo in photos)
    seen = free & ((counts > 0) | information.any(axis=(1, 2)))
    return Prepared(
        rays,
        chosen,
        start._replace(free=seen),
        information,
        place,
        columns,
        2 * len(chosen) + weighted + stations,
        len(columns) + 3 * int(np.count_nonzero(seen)),
        0 if has_datum else 7,
    )


def _known_places(network: Network) -> tuple[Array, Array, NDArray[np.bool_], int]:
    """Return weights and places of control points, which points are free, and the number of observed coordinates."""
    count = len(network.names)
    information, place = np.zeros((count, 3, 3)), np.zeros((count, 3))
    free, observed = np.ones(count, dtype=bool), 0
    for gcp in network.control:
        if gcp.check:
            continue
        place[gcp.point] = gcp.place
        if gcp.fixed:
            free[gcp.point] = False
        else:
            information[gcp.point] = np.linalg.inv(gcp.covariance)
            observed += 3
    return information, place, free, observed


def _columns(network: Network) -> tuple[tuple[tuple[str, str], ...], NDArray[np.int64]]:
    names: list[tuple[str, str]] = []
    table = np.full((len(network.photos), 16), -1, dtype=np.int64)
    for f, photo in enumerate(network.photos):
        if not photo.fixed:
            table[f, :6] = len(names) + np.arange(6)
            names += [(photo.name, element) for element in EXTERIOR]
    for m, camera in enumerate(network.cameras):
        places = np.full(len(INTERIOR), -1)
        for k, name in enumerate(INTERIOR):
            if name in camera.free:
                places[k] = len(names)
                names.append((camera.name, name))
        table[[f for f, photo in enumerate(network.photos) if photo.camera == m], 6:] = places
    return tuple(names), table


def adjust(network: Network, prepared: Prepared) -> Solution:
    """Adjust a network.

    Raises
    ------
    GeometryError
        if the observations do not determine the unknowns, or no step brings the residuals down
    """
    unknowns = prepared.unknowns
    damping, taken = 0.0, 0
    normal, right, square, behind = normals(network, prepared, unknowns, 0.0)
    while taken < MAX_ITERATIONS:
        step = _step(normal, right, prepared, unknowns, damping)
        if step is not None:
            tried = corrected_unknowns(unknowns, *_corrections(prepared, unknowns, damping, step))
            taken += 1
            if damping == 0.0 and abs(float(step @ right)) <= EPSILON * max(square, 1e-12):
                return Solution(tried, square, taken, behind)
            equations = normals(network, prepared, tried, 0.0)
            if equations[2] <= square * (1.0 + VANISHING):
                unknowns, (normal, right, square, behind) = tried, equations
                damping = 0.0 if damping <= _FIRST else 0.1 * damping
                if damping:
                    normal, right, _, _ = normals(network, prepared, unknowns, damping)
                continue
        damping = max(_FIRST, 10.0 * damping)
        if damping > _STRONGEST:
            raise GeometryError(
                "the adjustment does not converge: no step brings the residuals down",
                where=network.path,
                remedy="check the marks, the control points and the start values",
            )
        normal, right, _, _ = normals(network, prepared, unknowns, damping)
    raise GeometryError(
        f"the adjustment has not converged in {MAX_ITERATIONS} iterations",
        where=network.path,
        remedy="check the marks, the control points and the start values",
    )


def prior(prepared: Prepared, unknowns: Unknowns) -> Array:
    """Return what the kernels take of known places, (np, 3, 4): weights, and weights times differences."""
    off = prepared.place - unknowns.point
    off[~np.isfinite(off)] = 0.0  # of points without rays
    pulls = np.einsum("iab,ib->ia", prepared.information, off)
    return np.concatenate([prepared.information, pulls[:, :, None]], axis=2)


def normals(
    network: Network, prepared: Prepared, unknowns: Unknowns, damping: float
) -> tuple[Array, Array, float, int]:
    """Return the reduced normal equations (lower triangle), the sum of squares, and the rays from behind."""
    width = len(prepared.columns)
    normal, right = np.zeros((width, width)), np.zeros(width)
    known = prior(prepared, unknowns)
    square, behind, loose = reduced_normals(prepared.rays, unknowns, known, damping, normal, right)
    if loose >= 0 and np.isfinite(square):
        name = network.names[loose]
        rays = int(prepared.rays.start[loose + 1] - prepared.rays.start[loose])
        raise GeometryError(
            f"point {name} is not determined by its {rays} ray{'' if rays == 1 else 's'}",
            where=network.where(int(prepared.order[prepared.rays.start[loose]])) if rays else network.path,
            remedy="mark it on two or more photographs taken from different places",
        )
    off = prepared.place - unknowns.point
    off[~np.isfinite(off)] = 0.0  # of points without rays
    square += float(np.einsum("ia,iab,ib->", off, prepared.information, off))
    for f, photo in enumerate(network.photos):
        square += _observed_photo(photo, f, unknowns, normal, right)
    if not np.isfinite(square):
        square = np.inf
    if damping:
        normal[np.diag_indices(width)] *= 1.0 + damping
    return normal, right, square, behind


def _observed_photo(photo: Photo, f: int, unknowns: Unknowns, normal: Array, right: Array) -> float:
    """Add the observed station and angles of one photograph; return their sum of squares."""
    square = 0.0
    place = unknowns.column[f]
    if photo.fixed:
        return 0.0
    if photo.observed_station is not None and photo.station_sigma is not None:
        off, weight = photo.observed_station - unknowns.station[f], photo.station_sigma**-2.0
        normal[place[3:6], place[3:6]] += weight
        right[place[3:6]] += weight * off
        square += float((weight * off**2).sum())
    if photo.observed_rotation is not None and photo.angle_sigma is not None:
        slopes = angle_slopes(photo.observed_rotation)
        weight = slopes.T @ np.diag(photo.angle_sigma**-2.0) @ slopes
        off = _rotation_vector(unknowns.rotation[f].T @ photo.observed_rotation)
        normal[np.ix_(place[:3], place[:3])] += np.tril(weight)
        right[place[:3]] += weight @ off
        square += float(off @ weight @ off)
    return square


def _rotation_vector(rotation: Array) -> Array:
    """Return δ of exp([δ]×), (3,) [rad]."""
    axis = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, 0.5 * (np.trace(rotation) - 1.0)))
    return axis * (angle / sine if sine > 1e-12 else 1.0)


def inner_constraints(prepared: Prepared, unknowns: Unknowns) -> Array:
    """Return the movements that a network without control is free to make, at the cameras' side, (nr, 7).

    Three translations, three rotations about the centre of the points, and a change of scale.
    """
    centre = unknowns.point[unknowns.free].mean(axis=0)
    out = np.zeros((len(prepared.columns), 7))
    for f, place in enumerate(unknowns.column):
        if place[0] < 0:
            continue
        out[place[3:6]] = similarity(unknowns.station[f : f + 1] - centre)[0]
        out[place[:3], 3:6] = unknowns.rotation[f].T
    return out


def similarity(arms: Array) -> Array:
    """Return how points move by the parameters of a small similarity, (n, 3, 7); `arms` (n, 3) from its centre."""
    out = np.zeros((len(arms), 3, len(SIMILARITY)))
    out[:, :, :3] = np.eye(3)
    x, y, z = arms.T
    out[:, 0, 4], out[:, 0, 5] = z, -y
    out[:, 1, 3], out[:, 1, 5] = -z, x
    out[:, 2, 3], out[:, 2, 4] = y, -x
    out[:, :, 6] = arms
    return out


def with_datum(normal: Array, prepared: Prepared, unknowns: Unknowns) -> Array:
    """Return the normal matrix with the seven inner constraints of the cameras added, where there is no control."""
    if not prepared.datum:
        return normal
    free = inner_constraints(prepared, unknowns)
    free = np.linalg.qr(free)[0] * np.sqrt(max(float(np.median(np.diag(normal))), 1.0))
    bordered: Array = normal + np.tril(free @ free.T)
    return bordered


def gauss_newton_step(
    network: Network, prepared: Prepared, unknowns: Unknowns
) -> tuple[Array, Array, Array, float, int]:
    """Return one undamped step, and the covariance that it comes with.

    Returns
    -------
    (nr, nr) covariance of what is estimated at the cameras' side for σ₀ = 1, without movements that inner constraints
    hold; corrections (nr,) and (np, 3); sum of squares; rays from behind

    Raises
    ------
    GeometryError
        if the observations do not determine the unknowns
    """
    normal, right, square, behind = normals(network, prepared, unknowns, 0.0)
    regular = with_datum(normal, prepared, unknowns)
    full = np.tril(regular) + np.tril(regular, -1).T
    scale = 1.0 / np.sqrt(np.diag(full))
    try:
        covariance = np.linalg.inv(full * scale[:, None] * scale) * scale[:, None] * scale
    except np.linalg.LinAlgError as error:
        raise GeometryError(
            "the marks do not determine the orientation",
            where=network.path,
            remedy="mark more points that are spread over the photographs",
        ) from error
    covariance = without_datum(covariance, prepared, unknowns)
    step = covariance @ right
    step, moved = _corrections(prepared, unknowns, 0.0, step)
    return covariance, step, moved, square, behind


def without_datum(covariance: Array, prepared: Prepared, unknowns: Unknowns) -> Array:
    """Take out of a covariance the weight that the datum added along the free movements, which is no variance."""
    if not prepared.datum or not len(covariance):
        return covariance
    free = np.linalg.qr(inner_constraints(prepared, unknowns))[0]
    out: Array = covariance - free @ (free.T @ covariance @ free) @ free.T
    return out


def _step(
    normal: Array, right: Array, prepared: Prepared, unknowns: Unknowns, damping: float
) -> Array | None:
    """Solve the reduced system; None if it is not positive definite."""
    if not len(right):
        return right
    if not (np.isfinite(normal).all() and np.isfinite(right).all()):
        return None
    scale = np.diag(normal).copy()
    if not (scale > 0.0).all():
        return None
    scale = 1.0 / np.sqrt(scale)
    system = normal if damping else with_datum(normal, prepared, unknowns)
    try:
        factor = cholesky(system, scale)
    except np.linalg.LinAlgError:
        return None
    step: Array = scale * cho_solve((factor, False), scale * right, check_finite=False)
    return step


def cholesky(normal: Array, scale: Array) -> Array:
    """Factorise S N S with S = diag(scale), N given by its lower triangle; return the upper triangular factor.

    Nothing is copied besides the scaled matrix: the lower triangle by rows is the upper one by columns, as LAPACK
    takes it. The other triangle of what is returned is not defined.

    Raises
    ------
    numpy.linalg.LinAlgError
        if the matrix is not positive definite
    """
    scaled = normal * scale
    scaled *= scale[:, None]
    factor: Array = cho_factor(scaled.T, lower=False, overwrite_a=True, check_finite=False)[0]
    return factor


def _corrections(prepared: Prepared, unknowns: Unknowns, damping: float, step: Array) -> tuple[Array, Array]:
    moved = np.zeros_like(unknowns.point)
    back_substitute(prepared.rays, unknowns, prior(prepared, unknowns), damping, step, moved)
    return step, moved


def corrected_unknowns(unknowns: Unknowns, step: Array, moved: Array) -> Unknowns:
    """Apply corrections."""
    padded = np.append(step, 0.0)  # fixed parameters have the column -1, and no correction
    exterior = padded[unknowns.column[:, :6]]
    inner = unknowns.inner.copy()
    for f, m in enumerate(unknowns.camera):
        inner[m] = unknowns.inner[m] + padded[unknowns.column[f, 6:]]
    return unknowns._replace(
        inner=inner,
        rotation=turned(unknowns.rotation, exterior[:, :3]),
        station=unknowns.station + exterior[:, 3:],
        point=unknowns.point + moved,
    )
