"""Precision of a survey: each stone in a few numbers, and all of them together."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Ints
from survey.conventions import SIGNIFICANT
from survey.extrusion.extrusion import SurveyedBlock
from survey.faces.roughness import TOLERANCE

_NOTHING = "no stone has points of its own on its face: nothing was measured that could be judged"
_REACH, _BIN = 5.0, 0.25  # of the histogram [standard deviations]; the end bins hold all beyond


@dataclass(frozen=True, slots=True)
class StoneQuality:
    """Summary of one stone for a report, without its points.

    Attributes
    ----------
    code, kind, course, zone, line : as in the survey
    source, provenance : origin of its face: "points", "photograph" or "solid", and in words
    sigma : standard deviation of a coordinate, as stated [m]
    points : measured points and corners together
    rms : of the accepted residuals [m]
    sigma0 : sqrt(Σ w r² / redundancy), 1 if the points are as precise as stated; None without redundancy
    redundancy : accepted points minus 3
    blunders : names of the points left out; "point 3" where the instrument gave none
    worn : names of the corners that lie off the plane
    shape, shape_text : verdict on a plane as its shape, in a word and in a sentence with numbers
    tilt_sigma : of the less certain tilt of its plane [degrees]
    offset_sigma : of its plane's height at its centroid [m]
    depth, depth_sigma : [m]; None if not known
    depth_source, depth_origin : evidence in words, and its rank: "stone", "rule", "kind", "structure", or "none"
    length, height : of its face, level and upwards [m]
    dimension_sigma : standard deviation of each, as a difference of two corners [m]
    area : of its face [m²]
    skew : departure of its middle lines from a right angle [rad]; None unless it has four corners
    normal : (3,) outward [-]
    outline : (nv, 3) corners of its face, counter-clockwise seen from outside [m]
    corner_sigma : (nv, 3) standard deviations of its corners along x, y and z [m]
    worn_corners : indices of `outline` that lie off the plane
    standardised : residuals of the accepted points and corners over their own standard deviation [-]
    remarks : changes that made its outline a polygon, in words
    evidence : of each point, then of each corner, how it was located on photographs; () if they were measured in space
    roughness : standard deviation of its face about a plane, with which it was fitted beside `sigma` [m]
    astray : largest distance of a point left out from the plane, over its own standard deviation [-]; 0 without any
    """

    code: str
    kind: str
    course: int | None
    zone: str | None
    line: int
    source: str
    provenance: str
    sigma: float
    points: int
    rms: float
    sigma0: float | None
    redundancy: int
    blunders: tuple[str, ...]
    worn: tuple[str, ...]
    shape: str
    shape_text: str
    tilt_sigma: float
    offset_sigma: float
    depth: float | None
    depth_sigma: float | None
    depth_source: str
    depth_origin: str
    length: float
    height: float
    dimension_sigma: float
    area: float
    skew: float | None
    normal: Array
    outline: Array
    corner_sigma: Array
    worn_corners: tuple[int, ...]
    standardised: NDArray[np.float32]
    remarks: tuple[str, ...] = ()
    evidence: tuple[Mapping[str, object], ...] = ()
    roughness: float = 0.0
    astray: float = math.inf

    @property
    def measured(self) -> bool:
        """True if its plane is fitted to points of its own."""
        return self.source == "points"


@dataclass(frozen=True)
class Histogram:
    """Histogram of standardised residuals.

    Attributes
    ----------
    edges : (bins + 1,) in standard deviations; the end bins include all values beyond
    counts : (bins,) residuals
    expected : (bins,) counts of as many normal residuals
    """

    edges: Array
    counts: Ints
    expected: Array


@dataclass(frozen=True)
class SurveyQuality:
    """All stones of a survey together.

    Attributes
    ----------
    stones : number of stones made
    points, blunders, worn : points and corners measured, points left out, corners off their plane
    redundancy : of all faces together
    sigma0 : sqrt(Σ w r² / redundancy) of all faces; None without redundancy
    sigma0_sigma : its standard deviation if the residuals are normal, 1 / sqrt(2 redundancy)
    sigma : root mean square of the stated standard deviations [m]
    verdict : verdict on the stated sigma, in words
    rms : of all accepted residuals [m]
    residuals : histogram of the residuals
    kinds, shapes, depths, provenances : number of stones of each
    """

    stones: int
    points: int
    blunders: int
    worn: int
    redundancy: int
    sigma0: float | None
    sigma0_sigma: float | None
    sigma: float
    verdict: str
    rms: float
    residuals: Histogram
    kinds: Mapping[str, int]
    shapes: Mapping[str, int]
    depths: Mapping[str, int]
    provenances: Mapping[str, int]


def appraise(block: SurveyedBlock) -> StoneQuality:
    """Summarise a stone for reports."""
    face, fit, record = block.face, block.face.fit, block.face.record
    measured = face.provenance.source == "points"
    corners = len(face.outline)
    corner_sigma = block.vertex_sigma[:corners].copy()  # a copy: the rest need not be kept
    blunders, worn = _left_out(block) if measured else ((), ())
    return StoneQuality(
        code=block.code,
        kind=block.kind,
        course=block.course,
        zone=record.zone,
        line=record.line,
        source=face.provenance.source,
        provenance=face.provenance.text,
        sigma=record.sigma,
        points=len(record.points) + corners,
        rms=fit.rms,
        sigma0=fit.sigma0 if fit.redundancy > 0 and math.isfinite(fit.sigma0) else None,
        redundancy=fit.redundancy,
        blunders=blunders,
        worn=worn,
        shape=face.shape.kind.value,
        shape_text=face.shape.text,
        tilt_sigma=math.degrees(math.sqrt(max(fit.covariance[0, 0], fit.covariance[1, 1]))),
        offset_sigma=math.sqrt(fit.covariance[2, 2]),
        depth=block.depth.value,
        depth_sigma=block.depth.sigma,
        depth_source=block.depth.source,
        depth_origin=block.depth.origin,
        length=face.measures.length,
        height=face.measures.height,
        dimension_sigma=_dimension_sigma(block, corner_sigma),
        area=face.measures.area,
        skew=face.measures.skew,
        normal=fit.normal.copy(),
        outline=face.outline,
        corner_sigma=corner_sigma,
        worn_corners=face.rejected_vertices,
        standardised=_standardised(block) if measured else np.empty(0, np.float32),
        remarks=face.remarks,
        evidence=record.evidence,
        roughness=record.roughness,
        astray=float(np.abs(fit.standardised[list(fit.rejected)]).max(initial=0.0)),
    )


def _standardised(block: SurveyedBlock) -> NDArray[np.float32]:
    """Return the standardised residuals that the fit accepted and other points check."""
    fit = block.face.fit
    accepted = np.isfinite(fit.standardised)
    accepted[list(fit.rejected)] = False
    return fit.standardised[accepted].astype(np.float32)


def _dimension_sigma(block: SurveyedBlock, corner_sigma: Array) -> float:
    """Return the sigma of the distance of two corners: √2 of that of one corner in the plane of the face."""
    square = block.face.fit.height_sigma(block.face.outline) ** 2
    level = ((corner_sigma**2).sum(axis=1) - square) / 2.0
    return math.sqrt(2.0 * max(float(level.mean()), 0.0))


def _left_out(block: SurveyedBlock) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the rejected points, and of the rejected corners."""
    record = block.face.record
    count, rejected = len(record.points), block.face.fit.rejected

    def name(index: int) -> str:
        """Return the name of a point or corner, or its number where it has none."""
        if record.names and record.names[index]:
            return record.names[index]
        return f"point {index + 1}" if index < count else f"corner {index - count + 1}"

    return tuple(name(i) for i in rejected if i < count), tuple(name(i) for i in rejected if i >= count)


def judge_survey(stones: Sequence[StoneQuality]) -> SurveyQuality:
    """Summarise the stones of a survey; stones without points of their own contribute no residual."""
    measured = [stone for stone in stones if stone.measured]
    squares = sum(stone.redundancy * stone.sigma0**2 for stone in measured if stone.sigma0 is not None)
    redundancy = sum(stone.redundancy for stone in measured)
    sigma0 = math.sqrt(squares / redundancy) if redundancy else None
    error = 1.0 / math.sqrt(2.0 * redundancy) if redundancy else None
    sigma, rough = (
        math.sqrt(sum(value**2 for value in values) / len(measured)) if measured else math.nan
        for values in ([stone.sigma for stone in measured], [stone.roughness for stone in measured])
    )
    counts = [stone.redundancy + 3 for stone in measured]
    total = sum(n * stone.rms**2 for n, stone in zip(counts, measured, strict=True))
    residuals = (
        np.concatenate([stone.standardised for stone in measured]) if measured else np.empty(0, np.float32)
    )
    return SurveyQuality(
        stones=len(stones),
        points=sum(stone.points for stone in stones),
        blunders=sum(len(stone.blunders) for stone in stones),
        worn=sum(len(stone.worn) for stone in stones),
        redundancy=redundancy,
        sigma0=sigma0,
        sigma0_sigma=error,
        sigma=sigma,
        verdict=_verdict(sigma0, error, sigma, rough) if measured or not stones else _NOTHING,
        rms=math.sqrt(total / sum(counts)) if measured else math.nan,
        residuals=_histogram(residuals),
        kinds=_count(stone.kind for stone in stones),
        shapes=_count(stone.shape for stone in stones),
        depths=_count(stone.depth_origin for stone in stones),
        provenances=_count(stone.source for stone in stones),
    )


def _verdict(sigma0: float | None, error: float | None, sigma: float, rough: float) -> str:
    if sigma0 is None or error is None:
        return "no face was measured by more than three points: nothing says how precise they are"
    if rough > 0.0:
        return (
            f"the stated sigma is too small, or the faces are rough: the points scatter {rough * 1e3:.2g} mm about "
            f"their planes beyond the {sigma * 1e3:.2g} mm stated, which counts as roughness; "
            f"with both they scatter {sigma0:.2f} ± {error:.2f} times as far"
        )
    statement = f"the points scatter {sigma0:.2f} ± {error:.2f} times as far as stated"
    if abs(sigma0 - 1.0) <= max(TOLERANCE, SIGNIFICANT * error):
        return f"the stated sigma is right: {statement}"
    better = f"{sigma0 * sigma * 1e3:.2g} mm would be right instead of {sigma * 1e3:.2g} mm"
    if sigma0 > 1.0:
        return f"the stated sigma is too small, or the faces are rough: {statement}; {better}"
    return f"the stated sigma is too large: {statement}; {better}"


def _histogram(residuals: NDArray[np.float32]) -> Histogram:
    edges = np.linspace(-_REACH, _REACH, round(2 * _REACH / _BIN) + 1)
    counts, _ = np.histogram(np.clip(residuals, -_REACH, _REACH), edges)
    below = np.array([NormalDist().cdf(edge) for edge in edges])
    below[0], below[-1] = 0.0, 1.0
    return Histogram(edges, counts.astype(np.int64), len(residuals) * np.diff(below))


def _count(values: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(values).items()))
