"""From a point cloud and outlines to the records of measured faces.

Points of a stone lie within its outline, but for a margin, and within a slab along the line of sight. A robust plane is
sought among them; each patch of the face then becomes one measured point, the mean of the cloud's points within three
standard deviations of the patch's median. Its standard deviation comes from the scatter of the patches about a smooth
surface, not from the number of points: neighbouring points of a scan share the stone's roughness and the scanner's
errors. Patches that lie near each other may still tell the same; their correlation, which is estimated from all stones
together, makes all of them less precise. So the covariance of the plane is what the usual fit finds
(docs/design/clouds.md).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ground.errors import GeometryError, SurveyError, UsageError
from ground.units import LENGTHS
from survey.arrays import Array
from survey.clouds._kernels.planes import COVERED, FEW, FINE, Rules, fit_patches, patch_sigmas
from survey.clouds.collecting import Collected, collect_points
from survey.clouds.outlines.reading import Drawing, read_outlines
from survey.clouds.placing import PlacedOutline, facing_station, place_outlines
from survey.clouds.points.chunks import PointCloud
from survey.clouds.points.reading import open_points
from survey.clouds.review import drawn_doubts, measured_doubts
from survey.clouds.settings import CloudOptions
from survey.clouds.wall import Wall
from survey.conventions import CERTAIN, FARTHEST, FINEST, JOINT, MAX_ROUNDS, MOST, SIGNIFICANT, SOME, WEAR
from survey.formats.fields import CODE
from survey.geometry.solids import area_vector
from survey.records.plausible import question_of_unit
from survey.records.review import Doubtful
from survey.records.survey import OBSERVER, BlockRecord, Reject, Station, SurveyHead, SurveyStream

Progress = Callable[[int, int | None], None]
"""A function that is told how many points are read, and how many there are."""

_WIDE = SIGNIFICANT  # standard deviations of an outline within which its edge lies
_ON_PLANE_SIGMAS = CERTAIN  # standard deviations of a point within which it lies on a plane
_NEAREST = JOINT  # the same for a very precise scan: stones are rough [m]
_BAND = WEAR  # roughness of a dressed face from its plane [m]
_LARGEST_CORRELATION = MOST  # of neighbouring patches: beyond, they are one
_PRIOR = 50.0  # pairs of patches without correlation, as if they had been seen before
_ROOM = SOME  # part of the width of a stone that margins may take


def open_cloud(
    files: Sequence[Path], options: CloudOptions, progress: Progress = lambda done, total: None
) -> SurveyStream:
    """Measure the stones of point clouds.

    Parameters
    ----------
    files : the clouds, which are one survey together
    options : outlines, and how they are used
    progress : told of the points that are read

    Returns
    -------
    SurveyStream : a stone whose points define no plane comes as a Reject; `review` lists what to look at

    Raises
    ------
    UsageError, SurveyError
        if a file cannot be read, or outlines and cloud lie apart
    """
    drawing = read_outlines(
        options.outlines,
        layer=options.layer,
        chosen=options.chosen,
        sigma=options.outline_sigma,
        smooth=options.smooth,
        unit=options.outline_unit,
        kinds=options.kinds,
        keep_going=True,
    )
    if drawing.pixels:
        remedy = "put its world file beside the picture (.pgw, .tfw), as moma cloud writes it"
        raise UsageError("nothing says where the picture lies", where=str(drawing.path), remedy=remedy)
    clouds = [open_points(path) for path in files]
    head = options.head_for(options.outlines)
    stations = head.stations or tuple(station for cloud in clouds for station in cloud.stations)
    placed = place_outlines(drawing.outlines, options.wall, stations)
    if options.outline_unit is None:
        _check_unit(placed, options.outlines)
    if options.wall is None and stations:
        _check_sides(placed, stations, bool(head.stations), options.outlines)
    sigmas = np.array([_outline_sigma(one, drawing, options) for one in placed])
    margins = _margins(placed, sigmas, options.margin)
    collected = collect_points(clouds, placed, margins, options.slab, progress)
    if not collected.inside:
        raise _apart(clouds, placed, collected, options)
    head = _seen(head, stations, placed, options.wall)
    doubts = [warning for cloud in clouds for warning in cloud.warnings]
    review = [Doubtful("", "precision", text, str(files[0])) for text in doubts]
    review += drawn_doubts(placed, drawing)
    stones = [
        *wrong_outlines(drawing),
        *_stones(placed, sigmas, collected, head, options, files[0].name, review),
    ]
    return SurveyStream(head, iter(stones), review=tuple(review), remarks=drawing.remarks)


def wrong_outlines(drawing: Drawing) -> list[Reject]:
    """Return the features of a drawing that are no outline of a stone as rejects."""
    return [Reject(one.code, one.error, (range(one.number, one.number + 1),)) for one in drawing.wrong]


def _check_sides(
    placed: Sequence[PlacedOutline], stations: Sequence[Station], stated: bool, path: Path
) -> None:
    """Refuse stations that see most outlines from behind: these run counter-clockwise from outside.

    An `observer` is the word of a person on where outside is, and counts more than the order of corners.
    """
    facing = [facing_station(outline.origin, stations) for outline in placed]
    behind = sum(
        float(outline.axes[2] @ area_vector(outline.corners - outline.origin)) < 0.0
        for outline, station in zip(placed, facing, strict=True)
        if station is not None and station.name != OBSERVER
    )
    if 2 * behind <= len(placed):
        return
    place = "its station in the header file" if stated else "where the scanner is said to have stood"
    remedy = (
        "correct the station; if it is right, write observer X Y Z instead, and faces look there in any order"
        if stated
        else "give true stations in a file: --header; or draw outlines counter-clockwise as seen from outside"
    )
    raise SurveyError(
        f"{behind} of {len(placed)} outlines run clockwise seen from {place}", where=str(path), remedy=remedy
    )


def _outline_sigma(outline: PlacedOutline, drawing: Drawing, options: CloudOptions) -> float:
    sigma = outline.outline.said.sigma or options.outline_sigma
    return max(sigma, drawing.pixel or 0.0)


def _margins(placed: Sequence[PlacedOutline], sigmas: Array, margin: float | None) -> Array:
    """Return the width along the edge of each stone that is left out, at most a quarter of a narrow stone."""
    wanted = _WIDE * sigmas if margin is None else np.full(len(placed), margin)
    width = np.array([float(np.ptp(one.ring, axis=0).min()) for one in placed])
    return np.minimum(wanted, _ROOM * width)


def _size(outline: PlacedOutline) -> float:
    return float(np.ptp(outline.ring, axis=0).max())


def _check_unit(placed: Sequence[PlacedOutline], path: Path) -> None:
    """Ask for the unit of outlines most of which have the size of stones in another one."""
    question = question_of_unit([_size(outline) for outline in placed], "outlines")
    if question is not None:
        raise SurveyError(question[0], where=str(path), remedy=question[1])


def _apart(
    clouds: Sequence[PointCloud],
    placed: Sequence[PlacedOutline],
    collected: Collected,
    options: CloudOptions,
) -> SurveyError:
    """Make the error of outlines in which no point lies, with the places of both."""
    near = clouds[0].near
    middle = np.mean([one.origin for one in placed], axis=0)
    none = f"none of its {collected.read} points lies in an outline"
    what = f"{none}: outlines lie about {_shown(middle)}, the cloud about {_shown(near)}"
    remedy = f"check --wall, the world file and units; points count up to {options.slab:g} m from the plane (--slab)"
    if (wall := options.wall) is not None:
        drawn = np.concatenate([(outline.corners - wall.origin) @ wall.axes.T for outline in placed])
        places = (
            (chunk.places - (wall.origin - near)) @ wall.axes.T
            for cloud in clouds
            for chunk in cloud.chunks(near, False)
        )
        ends = np.array([(piece.min(axis=0), piece.max(axis=0)) for piece in places if len(piece)])
        low, high = ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)
        what = (
            f"{none}: in the frame of the wall outlines span {_span_of(drawn.min(axis=0), drawn.max(axis=0))}, "
            f"the cloud {_span_of(low, high)}, {low[2]:.2f} to {high[2]:.2f} m before it"
        )
        remedy = (
            "move the drawing, or correct the frame (--wall), whose origin is where the drawing has 0,0; check the "
            f"unit of the outlines (--unit); points count up to {options.slab:g} m from the plane (--slab)"
        )
    reach = (
        options.slab + float(np.ptp([one.origin for one in placed], axis=0).max()) + max(map(_size, placed))
    )
    for unit, length in LENGTHS.items():
        if length != 1.0 and np.linalg.norm(length * near - middle) <= reach < np.linalg.norm(near - middle):
            remedy = (
                f"in {unit} it would lie there: export it in metres, or begin a text with the units of its columns, "
                f"e.g. x[{unit}] y[{unit}] z[{unit}]"
            )
            break
    else:
        if np.abs((near - middle)[:2]).max() > FARTHEST:
            remedy += "; if the cloud was shifted, as by CloudCompare's global shift, export it with true coordinates"
    return SurveyError(what, where=str(options.outlines), remedy=remedy)


def _shown(place: Array) -> str:
    return f"({', '.join(f'{coordinate:.2f}' for coordinate in place)})"


def _span_of(low: Array, high: Array) -> str:
    return f"{low[0]:.2f} to {high[0]:.2f} m along and {low[1]:.2f} to {high[1]:.2f} m up"


def viewed(head: SurveyHead, wall: Wall, middle: Array) -> SurveyHead:
    """Return a head whose observer stands before a wall, unless it has stations already.

    Raises
    ------
    SurveyError
        if a wall is seen from behind by the station that is nearest to it
    """
    if (station := facing_station(middle, head.stations)) is not None:
        if float(wall.axes[2] @ (station.position - middle)) <= 0.0:
            raise SurveyError(
                f"station {station.name} of the header file stands behind the wall, which would be seen from behind",
                where=f"{head.path}",
                remedy="correct the station, or leave it out: a frame of a wall says where outside is; if the station "
                "is right, exchange left and right of the frame",
            )
        return head
    return replace(head, stations=(Station(OBSERVER, middle + FARTHEST * wall.axes[2]),))


def _seen(
    head: SurveyHead, stations: Sequence[Station], placed: Sequence[PlacedOutline], wall: Wall | None
) -> SurveyHead:
    if wall is not None and all(outline.axes is wall.axes for outline in placed):
        return viewed(head, wall, np.mean([outline.origin for outline in placed], axis=0))
    return replace(head, stations=tuple(stations))


def first_codes(codes: Sequence[str]) -> list[int]:
    """Return for each code the place of the first that is the same."""
    seen: dict[str, int] = {}
    return [seen.setdefault(code, k) for k, code in enumerate(codes)]


@dataclass(frozen=True)
class _Fitted:
    """Patches of a face: `fit_patches` of its samples."""

    status: int
    rows: Array
    cells: Array
    plane: Array
    numbers: Array

    @property
    def noise(self) -> float:
        """Standard deviation of a single point [m]."""
        return float(self.numbers[0])


def _correlation(fitted: Sequence[_Fitted]) -> float:
    """Return the correlation of neighbouring patches, the mean over the pairs of all faces.

    That of a single face is known to a tenth or two only, too little to be used for it alone. A fit takes away the
    elements of its hat matrix times the factor by which correlation makes a mean less precise, which is
    1 + Σ r^d over the patches around, 1 + 4 r + 4 r^√2 + 4 r² + … in the middle of a large face.
    """
    products, hat, pairs = sum(
        (plane.numbers[4:7] for plane in fitted if plane.status == FINE), np.array([0, 0, _PRIOR])
    )
    correlation = 0.0
    for _ in range(MAX_ROUNDS):
        factor = 1.0 + 4.0 * (correlation + correlation**1.414 + correlation**2) + 8.0 * correlation**2.236
        correlation = min(max((products + factor * hat) / pairs, 0.0), _LARGEST_CORRELATION)
    return float(correlation)


def _stones(
    placed: Sequence[PlacedOutline],
    sigmas: Array,
    collected: Collected,
    head: SurveyHead,
    options: CloudOptions,
    name: str,
    review: list[Doubtful],
) -> Iterator[BlockRecord | Reject]:
    rules = Rules(
        max(_ON_PLANE_SIGMAS * options.sigma, _NEAREST),
        max(_BAND, _ON_PLANE_SIGMAS * options.sigma),
        FINEST,
    )
    fitted = [_Fitted(*fit_patches(*collected.of(k), rules)) for k in range(len(placed))]
    correlation = _correlation(fitted)
    first = first_codes([one.outline.code for one in placed])
    for k, outline in enumerate(placed):
        try:
            if first[k] != k:
                earlier = placed[first[k]].outline.where
                what, remedy = f"a second stone {outline.outline.code}", f"the first is {earlier}"
                raise SurveyError(what, where=outline.outline.where, remedy=remedy)
            if CODE.fullmatch(outline.outline.code) is None:
                what, remedy = f"code {outline.outline.code!r}", "begin it with a letter or digit"
                raise SurveyError(what, where=outline.outline.where, remedy=remedy)
            if fitted[k].status != FINE:
                raise _no_plane(fitted[k], outline, options)
            review += measured_doubts(outline, fitted[k].plane, fitted[k].numbers)
            station = None if options.wall is not None else facing_station(outline.origin, head.stations)
            record = _record(outline, float(sigmas[k]), fitted[k], correlation, options)
            notes = {"cloud": name, **record.notes}
            yield replace(record, notes=notes, station=None if station is None else station.name)
        except (SurveyError, GeometryError) as error:
            review.append(Doubtful(outline.outline.code, "rejected", error.what, outline.outline.where))
            yield Reject(outline.outline.code, error, (_span(outline),))


def _record(
    outline: PlacedOutline, sigma: float, fitted: _Fitted, correlation: float, options: CloudOptions
) -> BlockRecord:
    """Make the record of a stone whose plane is found."""
    attributes, rows = outline.outline.said, fitted.rows
    patch_sigma, worth = patch_sigmas(rows, fitted.cells, fitted.numbers, correlation)
    local = np.column_stack([outline.ring, outline.ring @ fitted.plane[:2] + fitted.plane[2]])
    sigmas = np.concatenate([np.maximum(patch_sigma, FINEST), np.full(len(local), sigma)])
    clear, count = fitted.numbers[2:4].tolist()
    notes = {
        "points": f"{int(count)} in {len(rows)} patches, as good as {worth:.0f} independent ones",
        "noise": f"{fitted.noise * 1e3:.1f} mm for one point; {clear:.0%} of the patches are clear, neighbours "
        f"correlated by {correlation:.2f}",
    }
    if attributes.score is not None:
        notes["score"] = f"{attributes.score:g}"
    return BlockRecord(
        code=outline.outline.code,
        kind=attributes.kind or options.kind,
        course=attributes.course,
        vertices=outline.origin + local @ outline.axes,
        points=outline.origin + rows[:, :3] @ outline.axes,
        sigma=float(np.sqrt((sigmas**2).mean())),
        depth=attributes.depth,
        depth_sigma=attributes.depth_sigma,
        depth_source=attributes.depth_evidence(outline.outline.where),
        depth_origin=attributes.depth_origin,
        line=outline.outline.number,
        notes={**attributes.notes, **notes},
        zone=attributes.zone,
        sigmas=sigmas,
        spans=(_span(outline),),
    )


def _span(outline: PlacedOutline) -> range:
    return range(outline.outline.number, outline.outline.number + 1)


def _no_plane(fitted: _Fitted, outline: PlacedOutline, options: CloudOptions) -> GeometryError:
    count = int(fitted.numbers[3])
    if fitted.status == FEW:
        what = f"too few points: {count} within its outline and {options.slab:g} m of its plane"
        remedy = "check its place, or scan it; margins are set with --margin"
        if not count:
            remedy += f"; if it stands out of the wall, or lies behind it, give --slab {3.0 * options.slab:g}"
    elif fitted.status == COVERED:
        what = f"no plane: {count} points, most of which lie before or behind each other"
        remedy = "check the outline; something may cover the stone"
    else:
        what, remedy = f"no plane: {count} points on a line", "check the outline"
    return GeometryError(what, where=outline.outline.where, remedy=remedy)
