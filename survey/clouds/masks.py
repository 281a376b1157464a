"""From masks or outlines alone to the records of faces: one plane face for each stone, at a stated scale."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ground.errors import SurveyError, UsageError
from survey.arrays import Array
from survey.clouds.cloud import first_codes, viewed, wrong_outlines
from survey.clouds.outlines.outline import Outline
from survey.clouds.outlines.reading import DRAWN, Drawing, read_outlines
from survey.clouds.placing import levelled, place_outlines
from survey.clouds.review import drawn_doubts, flat_doubts
from survey.clouds.settings import MaskOptions
from survey.clouds.wall import Wall
from survey.clouds.world import PixelPlace
from survey.conventions import LEAST, NEGLIGIBLE, NOTICEABLE, STEEPEST
from survey.records.review import Doubtful
from survey.records.survey import (
    FRAME_NOTE,
    OUTLINE_NOTE,
    BlockRecord,
    DepthRule,
    Reject,
    SurveyHead,
    SurveyStream,
)

_STRETCHED = NEGLIGIBLE  # by which the two sides of a pixel may differ before it is doubtful [-]
_TWICE = NOTICEABLE  # standard deviations between two corners that are one
_OVER = DRAWN  # metres by which an outline may reach beyond the stated size before it is doubtful
_UPRIGHT = Wall(np.array([0.0, 0.0, 0.0]), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]))
_AGREE = math.cos(STEEPEST)  # cosine between the normals of outlines that one viewer sees
_SOURCE = "stated for all outlines"


def open_masks(path: Path, options: MaskOptions) -> SurveyStream:
    """Make faces of the masks of a picture, or of outlines drawn in metres.

    Parameters
    ----------
    path : picture of labels, COCO's JSON, or any file of outlines
    options : size of the picture or wall, and the depth of the stones

    Returns
    -------
    SurveyStream : plane faces, whose corners are as precise as a pixel; `review` lists what to look at

    Raises
    ------
    UsageError, SurveyError
        if the picture cannot be read, or its scale is not known
    """
    drawing = read_outlines(
        path,
        layer=options.layer,
        chosen=options.chosen,
        sigma=options.outline_sigma,
        smooth=options.smooth,
        unit=options.unit,
        kinds=options.kinds,
        keep_going=True,
    )
    drawing = replace(drawing, outlines=levelled(drawing.outlines))
    if any(outline.corners.shape[1] == 3 for outline in drawing.outlines):
        return _spatial(drawing, options)
    places, stretched = _places(drawing, options)
    outlines = drawing.outlines
    if places is not None:
        outlines = tuple(replace(outline, corners=places.place(outline.corners)) for outline in outlines)
    pixel = places.pixel if places is not None else drawing.pixel
    wall = options.wall or _UPRIGHT
    head = _with_depth(options, path)
    middle = (
        wall.origin + np.mean([outline.corners.mean(axis=0) for outline in outlines], axis=0) @ wall.axes[:2]
    )
    head = viewed(head, wall, middle)
    review = [
        *stretched,
        *flat_doubts(outlines, [outline.corners for outline in outlines], replace(drawing, pixel=pixel)),
    ]
    if pixel is None:
        pixel, how = options.outline_sigma, f"outline drawn to {options.outline_sigma * 1e3:.1f} mm"
    else:
        how = f"outline of a picture with pixels of {pixel * 1e3:.1f} mm"
    frame = None if options.size is None else np.array([(0.0, 0.0), options.size])
    review += _beyond(outlines, frame)
    stones = [*wrong_outlines(drawing), *_stones(outlines, wall, pixel, how, frame, options)]
    return SurveyStream(head, iter(stones), review=tuple(review), remarks=drawing.remarks)


def _spatial(drawing: Drawing, options: MaskOptions) -> SurveyStream:
    """Make faces of outlines in space, e.g. of 3D polylines in the plane of a wall."""
    for option, given in (("--size", options.size), ("--wall", options.wall)):
        if given is not None:
            what = f"{option} with outlines that lie in space"
            raise UsageError(what, where=str(drawing.path), remedy=f"leave {option} out")
    outlines = [
        replace(outline, corners=np.column_stack([outline.corners, np.zeros(len(outline.corners))]))
        if outline.corners.shape[1] == 2
        else outline
        for outline in drawing.outlines
    ]
    head = _with_depth(options, drawing.path)
    placed = place_outlines(outlines, None, head.stations)
    if not head.stations:
        normal = np.mean([one.axes[2] for one in placed], axis=0)
        against = next((outline for outline in placed if outline.axes[2] @ normal < _AGREE), None)
        if against is not None:
            remedy = "draw all counter-clockwise as seen from outside, or give stations in a file: --header"
            what = "the outline runs around another side than the others, and no station tells from where it is seen"
            raise SurveyError(what, where=against.outline.where, remedy=remedy)
        origin = np.mean([one.origin for one in placed], axis=0)
        head = viewed(
            head, Wall(origin, np.array([*placed[0].axes[:2], normal / np.linalg.norm(normal)])), origin
        )
    how = f"outline drawn to {options.outline_sigma * 1e3:.1f} mm"
    stones = [
        *wrong_outlines(drawing),
        *_stones(outlines, None, options.outline_sigma, how, None, options),
    ]
    review = tuple(drawn_doubts(placed, drawing))
    return SurveyStream(head, iter(stones), review=review, remarks=drawing.remarks)


def _with_depth(options: MaskOptions, path: Path) -> SurveyHead:
    """Return the head of a survey, with the depth that is stated for all stones."""
    head = options.head_for(path)
    if options.depth is None:
        return head
    return replace(head, depth_rules=(*head.depth_rules, DepthRule(None, options.depth, None, _SOURCE)))


def _beyond(outlines: Sequence[Outline], frame: Array | None) -> list[Doubtful]:
    """List the outlines that reach beyond the stated size of the wall."""
    if frame is None:
        return []
    out = []
    for outline in outlines:
        low, high = outline.corners.min(axis=0), outline.corners.max(axis=0)
        over = float(max((frame[0] - low).max(), (high - frame[1]).max()))
        if over > _OVER:
            text = f"it reaches {over * 1e3:.0f} mm beyond the stated size of {frame[1][0]:g} × {frame[1][1]:g} m"
            out.append(Doubtful(outline.code, "beyond the size", text, outline.where))
    return out


def _places(drawing: Drawing, options: MaskOptions) -> tuple[PixelPlace | None, list[Doubtful]]:
    """Return the scale of a picture that has no place of its own, and whether its pixels are not square."""
    if options.size is None:
        if drawing.pixels:
            what, remedy = "the size of the picture is not known", "give it in metres, e.g. --size 1.0x1.2"
            raise UsageError(what, where=str(drawing.path), remedy=remedy)
        return None, []
    if not drawing.pixels:
        if drawing.size is not None:
            what = "--size with a picture whose world file says where it lies"
            raise UsageError(what, where=str(drawing.path), remedy="leave --size out")
        return None, []
    if drawing.size is None:
        what = "the file does not say how large its picture is"
        remedy = "put the picture beside it, or give width and height of the image in the JSON"
        raise UsageError(what, where=str(drawing.path), remedy=remedy)
    (columns, rows), (width, height) = drawing.size, options.size
    across, up = width / columns, height / rows
    places = PixelPlace(np.diag([across, -up]), np.array([0.5 * across, height - 0.5 * up]))
    if abs(across / up - 1.0) <= _STRETCHED:
        return places, []
    text = f"{columns} × {rows} pixels are {width:g} × {height:g} m: pixels of {across * 1e3:.2f} by {up * 1e3:.2f} mm"
    return places, [Doubtful("", "stretched", text, str(drawing.path))]


def _stones(
    outlines: Sequence[Outline],
    wall: Wall | None,
    sigma: float,
    how: str,
    frame: Array | None,
    options: MaskOptions,
) -> Iterator[BlockRecord | Reject]:
    first = first_codes([outline.code for outline in outlines])
    for k, outline in enumerate(outlines):
        span = (range(outline.number, outline.number + 1),)
        if first[k] != k:
            remedy = f"the first is {outlines[first[k]].where}"
            error = SurveyError(f"a second stone {outline.code}", where=outline.where, remedy=remedy)
            yield Reject(outline.code, error, span)
            continue
        attributes = outline.said
        corners = _distinct(outline.corners, max(_TWICE * sigma, LEAST))
        notes = dict(attributes.notes) | {OUTLINE_NOTE: how}
        if frame is not None:
            beyond = np.concatenate([corners.min(axis=0) - frame[0], frame[1] - corners.max(axis=0)])
            notes[FRAME_NOTE] = " ".join(f"{value:.9f}" for value in beyond.tolist())
        if attributes.score is not None:
            notes["score"] = f"{attributes.score:g}"
        yield BlockRecord(
            code=outline.code,
            kind=attributes.kind or options.kind,
            course=attributes.course,
            vertices=corners if wall is None else wall.origin + corners @ wall.axes[:2],
            points=np.empty((0, 3)),
            sigma=max(sigma, attributes.sigma or 0.0),
            depth=attributes.depth,
            depth_sigma=attributes.depth_sigma,
            depth_source=attributes.depth_evidence(outline.where),
            depth_origin=attributes.depth_origin,
            line=outline.number,
            notes=notes,
            zone=attributes.zone,
            spans=span,
        )


def _distinct(corners: Array, nearest: float) -> Array:
    """Return corners (n, 2) or (n, 3) without those that are as good as the one before them: a worn corner has two."""
    distinct = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) >= nearest
    return corners[distinct] if np.count_nonzero(distinct) >= 3 else corners
