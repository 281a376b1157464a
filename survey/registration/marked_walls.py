"""A photograph tied to a wall by its marks: the plane of the marks, and the homography to it.

Where the photograph's station is known, every mark is moved along the line of sight onto the common plane: there it
appears at the same image point, however far it stands out of the wall. Where it is not known, marks can only be
projected square to the plane: the farther one stands out, the less weight it has, and those that stand out of the
relief of the wall are left out.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import ConvexHull
from scipy.special import stdtrit

from ground.errors import GeometryError
from ground.statistics.scale import deviation
from survey.arrays import Array
from survey.conventions import FEW, MOST, PARALLEL, TENTH
from survey.faces.planes import FaceFit, fit_plane
from survey.records.survey import Photograph
from survey.registration.homography import Homography, fit_homography

OFF_SQUARE = float(np.tan(np.radians(15.0)))
"""Standard deviation of the tangent between a line of sight from an unknown station and the wall's normal."""

_GRAZING = math.sin(PARALLEL)  # flattest useful line of sight
_FARTHEST = MOST  # largest distance of corners outside the marks, in sizes of these
_RELIEF = TENTH  # largest distance of faces from the plane of the wall, in distances between marks
_NEAREST_HORIZON = FEW  # least denominator of the homography; 1 amid the marks


@dataclass(frozen=True)
class MarkedWall:
    """A photograph and the plane of its marks.

    Attributes
    ----------
    name : of the photograph
    sigma : standard deviation of a coordinate measured on it [px]
    fit : plane of the marks
    homography : from the photograph to the plane, in its `axes` about its `centroid`
    viewpoint : (3,) position of the camera [m]; None if not known
    marks : (m, 2) accepted marks [px]
    hull : (k, 3) half-planes a·u + b ≤ 0 around the accepted marks, |a| = 1 [px]
    size : largest distance between two of these [px]
    """

    name: str
    sigma: float
    fit: FaceFit
    homography: Homography
    viewpoint: Array | None
    marks: Array
    hull: Array
    size: float

    @property
    def relief(self) -> float:
        """Height over the plane within which a face still belongs to this wall [m]."""
        corners = self.homography.apply(self.marks)
        return _RELIEF * float(np.linalg.norm(corners[:, None] - corners[None], axis=2).max())

    def facing(self, outward: Array) -> "MarkedWall":
        """Return the same wall with its normal turned to the side that a direction (3,) points to."""
        if self.fit.normal @ outward >= 0.0:
            return self
        fit = self.fit
        turned = replace(
            fit,
            normal=-fit.normal,
            offset=-fit.offset,
            residuals=-fit.residuals,
            standardised=-fit.standardised,
        )
        return replace(self, fit=turned)

    def on_plane(self, image: Array) -> tuple[Array, Array]:
        """Map corners (n, 2) [px] to the plane of the marks, (n, 3) [m], with their covariance in it, (n, 2, 2) [m²].

        Raises
        ------
        GeometryError
            if a corner lies far outside the marks, or where the photograph shows no point of the wall
        """
        where = f"photograph {self.name}"
        outside = (image @ self.hull[:, :2].T + self.hull[:, 2]).max(axis=1)
        if not outside.max() <= _FARTHEST * self.size:
            raise GeometryError(
                f"corner {int(np.argmax(outside)) + 1} lies {outside.max():.0f} px outside the marks, which are "
                f"{self.size:.0f} px apart",
                where=where,
                remedy="mark a point beyond the stone, or measure the stone in space",
            )
        share = self.homography.horizon(image)
        if share.min() < _NEAREST_HORIZON:
            raise GeometryError(
                f"corner {int(np.argmin(share)) + 1} lies at or beyond the horizon of the wall",
                where=where,
                remedy="correct the corner or the marks",
            )
        flat = self.homography.apply(image)
        return self.fit.centroid + flat @ self.fit.axes, self.homography.covariance_at(image, self.sigma)


def wall_of_marks(
    photograph: Photograph, viewpoint: Array | None = None, observer: Array | None = None
) -> MarkedWall:
    """Tie a photograph to the plane of its marks.

    Parameters
    ----------
    photograph : with four or more marks
    viewpoint : (3,) position of the camera [m]; None if not known
    observer : (3,) a point on the outer side of the wall [m], where the viewpoint is not known

    Raises
    ------
    GeometryError
        if the marks determine no plane or no homography, or contradict each other; the error names their lines
    """
    where = f"photograph {photograph.name} (line {photograph.line})"
    marks = photograph.marks
    try:
        if len(marks) < 4:
            raise GeometryError(
                f"a photograph needs four marks, found {len(marks)}", remedy="mark more points"
            )
        return _tied(photograph, viewpoint, observer)
    except GeometryError as error:
        raise error.at(where if error.where is None else f"{where}, {error.where}") from error


def _tied(photograph: Photograph, viewpoint: Array | None, observer: Array | None) -> MarkedWall:
    marks = photograph.marks
    positions = np.array([mark.position for mark in marks], dtype=np.float64)
    sigmas = np.array([mark.sigma for mark in marks], dtype=np.float64)
    image = np.array([mark.image for mark in marks], dtype=np.float64)
    names = [f"mark at line {mark.line}" if mark.line else f"mark {i + 1}" for i, mark in enumerate(marks)]
    fit = _plane(positions, sigmas, viewpoint if viewpoint is not None else observer)
    inliers = np.arange(len(marks))
    if viewpoint is None:
        inliers = np.setdiff1d(inliers, fit.rejected)
        flat = positions - fit.centroid
        # the distance of each from the plane is itself uncertain by the relief
        relief = np.sqrt(np.mean(fit.residuals[inliers] ** 2))
        sigmas = np.hypot(sigmas, OFF_SQUARE * np.hypot(fit.residuals, relief))
    else:
        flat, slant = _along_sight(positions, fit, viewpoint)
        # an error along the plane's normal shifts the mark along the plane by tan of the slant
        sigmas = sigmas * np.sqrt(1.0 + 0.5 * slant**2)
    if len(inliers) < 4:
        raise GeometryError(
            f"{len(marks) - len(inliers)} of {len(marks)} marks do not lie on the plane of the others",
            where=", ".join(names[i] for i in fit.rejected),
            remedy="mark four points of one plane, or give the photograph's station",
        )
    homography = fit_homography(
        image[inliers],
        photograph.sigma,
        (flat @ fit.axes.T)[inliers],
        sigmas[inliers],
        [names[i] for i in inliers],
    )
    used = np.delete(image[inliers], homography.rejected, axis=0)
    size = float(np.linalg.norm(used[:, None] - used[None], axis=2).max())
    return MarkedWall(
        name=photograph.name,
        sigma=photograph.sigma,
        fit=fit,
        homography=homography,
        viewpoint=viewpoint,
        marks=used,
        hull=ConvexHull(used).equations,
        size=size,
    )


def _plane(positions: Array, sigmas: Array, towards: Array | None) -> FaceFit:
    """Fit the plane of the marks, which scatter like the stones that they are on, not only by measurement."""
    free = len(positions) - 3
    least_squares = max(_deviation(positions), 1e-12)
    plain = fit_plane(positions, np.maximum(sigmas, least_squares), towards)
    inner = (plain.residuals / least_squares) ** 2
    # Student's test of the farthest mark against the scatter of the others
    left = max(free - float(inner.max()), 1e-9)
    if free < 2 or inner.max() * (free - 1) / left <= stdtrit(free - 1, 1.0 - 0.5e-3 / len(positions)) ** 2:
        return plain
    # the median residual, with its correction for few points (Rousseeuw & Leroy 1987)
    scatter = (1.0 + 5.0 / free) * deviation(fit_plane(positions, None, towards).residuals, 0.0)
    return fit_plane(positions, np.maximum(sigmas, scatter), towards)


def _deviation(positions: Array) -> float:
    """Return the standard deviation of points from their least-squares plane [m]."""
    local = positions - positions[0]
    singular = np.linalg.svd(local - local.mean(axis=0), compute_uv=False)
    return float(singular[2]) / float(np.sqrt(len(positions) - 3))


def _along_sight(positions: Array, fit: FaceFit, viewpoint: Array) -> tuple[Array, Array]:
    """Move marks along their lines of sight onto the plane, (n, 3) from its centroid [m]; return tan of the slant."""
    rays = positions - viewpoint
    ahead = -(rays @ fit.normal)
    lengths = np.linalg.norm(rays, axis=1)
    if not (ahead > _GRAZING * lengths).all():
        raise GeometryError(
            "its station sees the wall at less than 10°, or from behind",
            remedy="correct the station or the marks",
        )
    distance = float((viewpoint - fit.centroid) @ fit.normal)
    moved = (viewpoint - fit.centroid) + rays * (distance / ahead)[:, None]
    return moved, np.sqrt(np.maximum((lengths / ahead) ** 2 - 1.0, 0.0))
