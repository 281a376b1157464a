"""The whole way from a survey file to stones with a hidden side, one stone at a time."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from ground.errors import MomaError
from survey.conventions import TRIALS
from survey.extrusion.depth import depth_for
from survey.extrusion.extrusion import SurveyedBlock, extrude
from survey.extrusion.imported_solids import block_of_solid
from survey.faces.faces import Face, Provenance, face_on, outline_face
from survey.faces.roughness import estimate_roughness
from survey.faces.shapes import FaceShape, ShapeKind
from survey.records.review import Doubtful
from survey.records.snapping import Snapping
from survey.records.survey import BlockRecord, Reject, SolidRecord, SurveyHead, SurveyStream
from survey.registration.photographed_stones import LiftedFace, lift_faces
from survey.registration.site_frame import SiteTransform, fit_similarity, record_to_site, to_site


@dataclass(frozen=True)
class SurveyedStream:
    """A survey and the stones made from it.

    Attributes
    ----------
    head : of the survey, in the frame of the site
    transform : from the frame of the survey to that of the site; None if they are the same
    stones : the stones with their hidden side, in the frame of the site, and the rejects; an iterator to be
        consumed once. Stones measured on photographs come last, because they need the faces of their neighbours.
    snapping : of solids, the changes that brought their faces into common planes; None if not asked for
    header : number of lines at the beginning of the file that hold for all stones
    remarks : on how the file was read, in words
    review : of outlines, what to look at
    """

    head: SurveyHead
    transform: SiteTransform | None
    stones: Iterator[SurveyedBlock | Reject]
    snapping: Snapping | None = None
    header: int = 0
    remarks: tuple[str, ...] = ()
    review: tuple[Doubtful, ...] = ()


def survey_stones(stream: SurveyStream) -> SurveyedStream:
    """Make stones of the records of a survey.

    A stone that cannot be made comes as a Reject, whose error names file, line and stone.

    Raises
    ------
    SurveyError, GeometryError
        if the control points do not tie the survey to the site

    Examples
    --------
    >>> from survey.formats.reading import open_survey
    >>> made = survey_stones(open_survey("data/samples/window/window.moma", "moma"))
    >>> stone = next(made.stones)
    >>> stone.code, stone.kind, stone.depth.value
    ('W01-01', 'header', 0.51)
    >>> round(stone.face.measures.area, 3)
    0.116
    """
    transform = fit_similarity(stream.head.control) if stream.head.control else None
    head = stream.head if transform is None else to_site(stream.head, transform)
    stones = _stones(stream, head, transform)
    return SurveyedStream(
        head, transform, stones, stream.snapping, stream.header, stream.remarks, stream.review
    )


def _stones(
    stream: SurveyStream, head: SurveyHead, transform: SiteTransform | None
) -> Iterator[SurveyedBlock | Reject]:
    faces: list[Face] = []
    on_photographs: list[BlockRecord] = []
    blocks = stream.blocks
    if stream.head.orientation is not None:
        # imports scipy and the kernels of photographs, which surveys in space do without
        from survey.orientation.stones.marked_stones import located_stones

        blocks = located_stones(blocks, stream.head)
    for placed in _with_roughness(_placed(blocks, transform), head):
        if isinstance(placed, Reject):
            yield placed
            continue
        if isinstance(placed, BlockRecord) and placed.photograph is not None:
            on_photographs.append(placed)
            continue
        made = _made(placed, head)
        if head.photographs and isinstance(made, SurveyedBlock):
            faces.append(made.face)
        yield made
    for record, lifted in lift_faces(on_photographs, head.photographs, faces, head):
        yield (
            _reject(record, head, lifted) if isinstance(lifted, MomaError) else _behind(record, head, lifted)
        )


def _placed(
    items: Iterator[BlockRecord | SolidRecord | Reject], transform: SiteTransform | None
) -> Iterator[BlockRecord | SolidRecord | Reject]:
    for item in items:
        yield item if isinstance(item, Reject) or transform is None else record_to_site(item, transform)


def _with_roughness(
    items: Iterator[BlockRecord | SolidRecord | Reject], head: SurveyHead
) -> Iterator[BlockRecord | SolidRecord | Reject]:
    """Give stones the roughness of their survey: as stated, or as the faces of its first stones show it."""
    rough, first = head.roughness, list[BlockRecord | SolidRecord | Reject]()
    if rough is None:
        sample: list[BlockRecord] = []
        for item in items:
            first.append(item)
            if isinstance(item, BlockRecord) and item.photograph is None:
                sample.append(item)
                if len(sample) == TRIALS:
                    break
        rough = estimate_roughness(sample)
    for item in chain(first, items):
        if isinstance(item, BlockRecord) and item.photograph is None and rough > 0.0:
            yield replace(item, roughness=rough)
        else:
            yield item


def _made(item: BlockRecord | SolidRecord, head: SurveyHead) -> SurveyedBlock | Reject:
    try:
        if isinstance(item, SolidRecord):
            return block_of_solid(item, head.viewpoint(None), item.file or head.path)
        viewpoint = item.seen_from
        if viewpoint is None or item.station is not None:
            viewpoint = head.viewpoint(item.station)
        return _extruded(outline_face(item, viewpoint), head)
    except MomaError as error:
        return _reject(item, head, error)


def _behind(record: BlockRecord, head: SurveyHead, lifted: LiftedFace) -> SurveyedBlock | Reject:
    """Make the stone of a face that was lifted from a photograph."""
    sigmas = np.concatenate([record.point_sigmas, lifted.sigma])
    corners = replace(record, vertices=lifted.outline, sigmas=sigmas)
    shape = FaceShape(ShapeKind.UNTESTED, "not tested: its plane was taken over from others")
    try:
        face = face_on(lifted.fit, lifted.outline, shape, Provenance("photograph", lifted.text), corners)
        return _extruded(face, head)
    except MomaError as error:
        return _reject(record, head, error)


def _extruded(face: Face, head: SurveyHead) -> SurveyedBlock:
    return extrude(face, depth_for(face.record, head.depth_rules), face.record.extrusion or head.extrusion)


def _reject(item: BlockRecord | SolidRecord, head: SurveyHead, error: MomaError) -> Reject:
    path = (item.file if isinstance(item, SolidRecord) else "") or head.path
    return Reject(item.code, error.at(f"{path}:{item.line}: stone {item.code}"), item.spans)
