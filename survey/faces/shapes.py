"""Whether one plane is the shape of a face, or it is bevelled, curved or rough."""

import math
from dataclasses import dataclass
from enum import StrEnum

from numpy.typing import ArrayLike

from survey.arrays import Array
from survey.faces.planes import FaceFit

__all__ = ["FaceShape", "ShapeKind", "judge_shape", "likely_ratio"]


class ShapeKind(StrEnum):
    """What the points of a face lie on."""

    PLANE = "plane"
    BEVELLED = "bevelled"
    CURVED = "curved"
    ROUGH = "rough"
    UNTESTED = "untested"


@dataclass(frozen=True)
class FaceShape:
    """The verdict on the shape of one face.

    Attributes
    ----------
    kind : PLANE; BEVELLED, two planes; CURVED, a quadric; ROUGH, none of these explains the residuals; UNTESTED,
        three points lie on any plane
    text : the verdict in words, with its numbers
    bevel_angle : between the two planes [rad]; None unless bevelled, or if the second plane's tilt is not known
    bevel_points : indices of the points on the second plane
    curvature : (2,) principal curvatures, the larger in size first, positive where the face bulges towards the
        observer [1/m]; None unless curved
    curvature_sigma : (2,) their standard deviations [1/m]
    """

    kind: ShapeKind
    text: str
    bevel_angle: float | None = None
    bevel_points: tuple[int, ...] = ()
    curvature: Array | None = None
    curvature_sigma: Array | None = None


def judge_shape(fit: FaceFit, points: ArrayLike, sigma: ArrayLike | None) -> FaceShape:
    """Judge from the residuals whether one plane is the shape of a face.

    Parameters
    ----------
    fit : the plane through the points
    points : (n, 3) as they were given to `fit_plane` [m]
    sigma : as it was given to `fit_plane` [m]

    Returns
    -------
    FaceShape
    """
    if fit.redundancy == 0:
        return FaceShape(ShapeKind.UNTESTED, "untested: three points lie on any plane")
    known, count = sigma is not None, len(fit.residuals)
    if known and not fit.rejected and fit.sigma0**2 <= likely_ratio(fit.redundancy, 1.2816):
        return FaceShape(ShapeKind.PLANE, f"plane: {count} points, rms {fit.rms * 1e3:.1f} mm")
    # with numba, which readers of verdicts do without
    from survey.faces.shape_models import explain_heights

    return explain_heights(fit, points, sigma)


def likely_ratio(redundancy: int, quantile: float) -> float:
    """Ratio of variances that chance exceeds as rarely as a normal quantile: chi-square by Wilson and Hilferty."""
    spread = 2.0 / (9.0 * redundancy)
    return (1.0 - spread + quantile * math.sqrt(spread)) ** 3
