"""Transformation of a survey into the frame of the site.

A survey is measured in a frame of its own, tied to that of the site by control points known in both. The transform
is a similarity,

    x_site = site_centre + s R (x - survey_centre),

about centres amid the control points, so that coordinates of 10⁶ m lose no precision. It is adjusted with the
precision of both sides (`survey.registration.similarity`) and its points are tested (`survey.registration.outliers`):
a point that contradicts all others is left out and named, and where the wrong point cannot be identified the transform
is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from ground.errors import SurveyError
from survey.arrays import Array, Bools
from survey.conventions import CHECKED, RARE, TENTH
from survey.records.survey import BlockRecord, ControlPoint, Extrusion, SolidRecord, SurveyHead
from survey.registration.outliers import Agreement, find_outliers
from survey.registration.similarity import Similarity, adjust_similarity

Stone = TypeVar("Stone", bound=BlockRecord | SolidRecord)

_WEAKEST_ANGLE = TENTH  # standard deviation of a rotation beyond which it is not determined [rad]
_TESTABLE = CHECKED  # least number of points without the outliers: any three nearly agree by themselves


@dataclass(frozen=True)
class SiteTransform:
    """x_site = site_centre + s R (x - survey_centre).

    Attributes
    ----------
    rotation : (3, 3) R [-]
    scale : s, metres of the site per metre of the survey [-]
    survey_centre, site_centre : (3,) weighted centroid of the accepted control points in either frame [m]
    covariance : (7, 7) of the translation at `site_centre` [m], the small rotation about the site's axes
        [rad] and the relative scale [-], from the stated precision of the control points
    names : of the control points
    residuals : (n, 3) site coordinates of each control point minus its transformed ones [m]
    standardised : (n,) length of each residual in terms of its own standard deviations; nan where the other
        points do not control it [-]
    limits : (n,) value of `standardised` that a sound point exceeds once in a thousand [-]
    sigma0 : sqrt(Σ |r|²/σ² / redundancy), 1 if the control points are as precise as stated [-]
    redundancy : three times the number of accepted points minus 7
    rejected : names of the outliers, which the fit leaves out
    """

    rotation: Array
    scale: float
    survey_centre: Array
    site_centre: Array
    covariance: Array
    names: tuple[str, ...]
    residuals: Array
    standardised: Array
    limits: Array
    sigma0: float
    redundancy: int
    rejected: tuple[str, ...]

    @property
    def scale_test(self) -> float:
        """Difference of the scale from 1 in standard deviations [-]."""
        return float((self.scale - 1.0) / (self.scale * np.sqrt(self.covariance[6, 6])))

    @property
    def scale_differs(self) -> bool:
        """True if the scale differs from 1 by more than chance does once in a thousand."""
        return abs(self.scale_test) > -float(ndtri(RARE / 2.0))

    def apply(self, points: ArrayLike) -> Array:
        """Move points (…, 3) of the survey into the site frame [m]."""
        arms = np.asarray(points, dtype=np.float64) - self.survey_centre
        out: Array = self.site_centre + self.scale * (arms @ self.rotation.T)
        return out

    def rotate(self, vectors: ArrayLike) -> Array:
        """Turn directions (…, 3) of the survey into the site frame; lengths stay."""
        out: Array = np.asarray(vectors, dtype=np.float64) @ self.rotation.T
        return out

    def sigma_at(self, points: ArrayLike) -> Array:
        """Compute the standard deviation of transformed points due to the transform, along the site's axes.

        It is common to neighbouring points: it moves the wall, not the stones of the wall against each other.

        Parameters
        ----------
        points : (…, 3) in the frame of the survey [m]

        Returns
        -------
        (…, 3) [m]
        """
        arms = self.apply(points) - self.site_centre
        x, y, z = np.moveaxis(arms, -1, 0)
        effects = np.zeros((*arms.shape, 7))
        effects[..., [0, 1, 2], [0, 1, 2]] = 1.0
        effects[..., 0, 4], effects[..., 0, 5] = z, -y
        effects[..., 1, 5], effects[..., 1, 3] = x, -z
        effects[..., 2, 3], effects[..., 2, 4] = y, -x
        effects[..., 6] = arms
        out: Array = np.sqrt(((effects @ self.covariance) * effects).sum(axis=-1))
        return out


def fit_similarity(control: Sequence[ControlPoint]) -> SiteTransform:
    """Fit the similarity that takes a survey into the frame of the site, and leave outliers out.

    Parameters
    ----------
    control : three or more points known in both frames, not on one line

    Returns
    -------
    SiteTransform

    Raises
    ------
    SurveyError
        if there are fewer than three points, if they coincide or lie on one line in either frame, if one
        frame is the mirror image of the other, or if points contradict each other and the wrong one cannot be
        identified; the error names the points
    """
    if len(control) < 3:
        raise SurveyError(
            f"a transform into the site's frame needs three control points, found {len(control)}",
            where=_named(control) if control else None,
            remedy="measure three or more that are not on one line, or leave the control points out",
        )
    measured = np.array([point.measured for point in control], dtype=np.float64)
    site = np.array([point.site for point in control], dtype=np.float64)
    sigmas = np.array([(point.measured_sigma, point.site_sigma) for point in control]).T
    _check_values(control, measured, site, sigmas)
    least = _widths_needed(measured, site, sigmas)
    _check_spread(control, measured, least[0], "in the survey")
    _check_spread(control, site, least[1], "on site")
    fit = _without_outliers(control, measured, site, (sigmas[0], sigmas[1]), least)
    verdict = fit.verdict
    return SiteTransform(
        rotation=fit.rotation,
        scale=fit.scale,
        survey_centre=fit.source_centre,
        site_centre=fit.target_centre,
        covariance=fit.covariance,
        names=tuple(point.name for point in control),
        residuals=fit.residuals,
        standardised=verdict.tests,
        limits=verdict.limits,
        sigma0=float(np.sqrt(verdict.squares / verdict.redundancy)),
        redundancy=verdict.redundancy,
        rejected=tuple(point.name for point, kept in zip(control, verdict.accepted, strict=True) if not kept),
    )


def to_site(head: SurveyHead, transform: SiteTransform) -> SurveyHead:
    """Move the head of a survey into the site frame.

    Control points stay as they were measured in either frame. Depths and canonical dimensions stay too: they
    are measured with a tape and do not depend on the scale of the survey.
    """
    return replace(
        head,
        stations=tuple(
            replace(station, position=transform.apply(station.position)) for station in head.stations
        ),
        photographs=tuple(
            replace(
                photograph,
                marks=tuple(
                    replace(mark, position=transform.apply(mark.position), sigma=mark.sigma * transform.scale)
                    for mark in photograph.marks
                ),
            )
            for photograph in head.photographs
        ),
        extrusion=_turned(head.extrusion, transform),
    )


def record_to_site(record: Stone, transform: SiteTransform) -> Stone:
    """Move a measured stone into the site frame; its depth, measured with a tape, stays."""
    if isinstance(record, SolidRecord):
        return replace(record, vertices=transform.apply(record.vertices))
    return replace(
        record,
        vertices=transform.apply(record.vertices),
        points=transform.apply(record.points),
        sigma=record.sigma * transform.scale,
        sigmas=None if record.sigmas is None else record.sigmas * transform.scale,
        extrusion=None if record.extrusion is None else _turned(record.extrusion, transform),
        seen_from=None if record.seen_from is None else transform.apply(record.seen_from),
        joint=None if record.joint is None else _turned_joint(record.joint, transform),
    )


def _turned_joint(joint: Array, transform: SiteTransform) -> Array:
    """Return the covariance of points in the site frame, (9n²,)."""
    count = round(np.sqrt(len(joint) / 9))
    blocks = joint.reshape(count, 3, count, 3)
    out: Array = transform.scale**2 * np.einsum(
        "ab,ibjc,dc->iajd", transform.rotation, blocks, transform.rotation
    )
    return out.ravel()


def _turned(extrusion: Extrusion, transform: SiteTransform) -> Extrusion:
    if extrusion.direction is None:
        return extrusion
    return replace(extrusion, direction=transform.rotate(extrusion.direction))


def _named(control: Sequence[ControlPoint]) -> str:
    """Return the names of control points with their lines, for the place of an error."""
    words = [f"{point.name} (line {point.line})" if point.line else point.name for point in control]
    return f"control point{'s' if len(words) > 1 else ''} {', '.join(words)}"


def _check_values(control: Sequence[ControlPoint], measured: Array, site: Array, sigmas: Array) -> None:
    finite = np.isfinite(measured).all(axis=1) & np.isfinite(site).all(axis=1)
    sound = (
        finite & np.isfinite(sigmas).all(axis=0) & (sigmas >= 0.0).all(axis=0) & (sigmas.sum(axis=0) > 0.0)
    )
    if not sound.all():
        raise SurveyError(
            "coordinates must be finite, sigma positive",
            where=_named([control[i] for i in np.flatnonzero(~sound).tolist()]),
            remedy="correct the line",
        )


def _widths_needed(measured: Array, site: Array, sigmas: Array) -> tuple[float, float]:
    """Return the least distance of points from a line, in either frame, that determines the rotation about it [m]."""
    extents = [float(np.linalg.norm(np.ptp(points, axis=0))) for points in (measured, site)]
    ratio = extents[1] / extents[0] if min(extents) > 0.0 else 1.0  # the survey may be in millimetres
    needed = float(np.hypot(ratio * sigmas[0], sigmas[1]).max()) / _WEAKEST_ANGLE
    return max(needed / ratio, 1e-9 * extents[0]), max(needed, 1e-9 * extents[1])


def _check_spread(control: Sequence[ControlPoint], points: Array, least: float, frame: str) -> None:
    """Refuse points on a line: the rotation about it would have no precision."""
    spread = _spread(points)
    if spread[1] > least:
        return
    verdict = "coincide" if spread[0] <= least else "lie on one line"
    raise SurveyError(
        f"the control points {verdict} {frame}, to within {spread[spread <= least][0]:.2g} m",
        where=_named(control),
        remedy="measure a control point well away from the line through the others",
    )


def _spread(points: Array) -> Array:
    """Return the extents of a set of points along its principal directions, roots of sums of squares, (3,) [m]."""
    local = points - points[0]
    return np.linalg.svd(local - local.mean(axis=0), compute_uv=False)


def _without_outliers(
    control: Sequence[ControlPoint],
    measured: Array,
    site: Array,
    sigmas: tuple[Array, Array],
    least: tuple[float, float],
) -> Similarity:
    everything = np.ones(len(control), dtype=bool)
    plain = adjust_similarity(measured, site, sigmas, everything)
    if plain.verdict.consistent:
        return plain
    if adjust_similarity(measured, site, sigmas, everything, mirrored=True).verdict.consistent:
        raise SurveyError(
            "one frame is the mirror image of the other",
            where=_named(control),
            remedy="look for two axes that are exchanged, or one that runs the other way",
        )

    def judge(accepted: Bools) -> Agreement | None:
        """Return the agreement of the accepted points; None where they lie too close to a line."""
        if accepted.sum() < 3 or any(
            _spread(points[accepted])[1] <= width
            for points, width in zip((measured, site), least, strict=True)
        ):
            return None
        return adjust_similarity(measured, site, sigmas, accepted).verdict

    found = find_outliers(len(control), _TESTABLE, judge)
    if found.suspects:
        raise _contradiction(control, plain, found.suspects)
    accepted = everything.copy()
    accepted[list(found.rejected)] = False
    return adjust_similarity(measured, site, sigmas, accepted)


def _contradiction(
    control: Sequence[ControlPoint], fit: Similarity, suspects: tuple[int, ...]
) -> SurveyError:
    lengths = np.linalg.norm(fit.residuals, axis=1)
    worst = int(np.argmax(lengths))
    sigma0 = float(np.sqrt(fit.verdict.squares / fit.verdict.redundancy))
    more = "" if len(control) > _TESTABLE else ", or add control points: five or more show which one is wrong"
    return SurveyError(
        f"the {len(control)} control points contradict each other: {control[worst].name} is "
        f"{lengths[worst]:.3g} m off, all are {sigma0:.1f} times less precise than stated, and the wrong one "
        "cannot be identified",
        where=_named([control[i] for i in suspects]),
        remedy=f"measure these again, leave a wrong one out or state a larger sigma{more}",
    )
