"""Whether one plane is the shape of a face, or it is bevelled, curved or rough."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from survey.planes import FaceFit

__all__ = ["FaceShape", "ShapeKind", "judge_shape"]

Array = NDArray[np.float64]


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
        return FaceShape(ShapeKind.UNTESTED, "three points lie on any plane")
    if sigma is None or fit.sigma0**2 <= _largest_ratio(fit.redundancy):
        return FaceShape(ShapeKind.PLANE, "plane")
    return FaceShape(ShapeKind.ROUGH, f"rough: the points scatter {fit.sigma0:.1f} times as far as measured")


def _largest_ratio(redundancy: int) -> float:
    """Ratio of variances that chance exceeds once in a thousand: chi-square after Wilson and Hilferty."""
    spread = 2.0 / (9.0 * redundancy)
    return (1.0 - spread + 3.09 * math.sqrt(spread)) ** 3
