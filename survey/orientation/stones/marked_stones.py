"""Stones marked on oriented photographs: from marks to points and corners in space.

A point marked on two or more photographs is intersected. A corner marked on one meets the surface that the stone
names, or the
plane of the stone's own points; that outline can also be a polygon drawn on one photograph (`photo`, `pixel`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ground.errors import MomaError, SurveyError
from survey.arrays import Array
from survey.conventions import THINNEST
from survey.orientation.formats.result import read_orientation
from survey.orientation.oriented import Oriented
from survey.orientation.stones.intersection import intersect
from survey.orientation.stones.located import Located, Mark, joint_covariance
from survey.orientation.stones.plotting import plot
from survey.orientation.stones.surfaces import Surface, fit_surface
from survey.records.survey import BlockRecord, PointMark, Reject, SolidRecord, SurfaceRule, SurveyHead

_MIN_SIGMA = THINNEST  # standard deviation along the normal below which a point counts no more [m]

Item = BlockRecord | SolidRecord | Reject


def located_stones(items: Iterator[Item], head: SurveyHead) -> Iterator[Item]:
    """Locate the points of the stones that were marked on photographs; pass on all others.

    Stones with marks come last, because a surface may be defined by the points of several.

    Raises
    ------
    SurveyError
        if the result of the orientation cannot be read
    """
    assert head.orientation is not None
    oriented = read_orientation(Path(head.path).parent / head.orientation)
    _check_datum(oriented, head)
    homographies = {photograph.name for photograph in head.photographs}
    marked = list[BlockRecord]()
    for item in items:
        if isinstance(item, BlockRecord) and (
            item.marks or (item.photograph is not None and item.photograph not in homographies)
        ):
            marked.append(item)
        else:
            yield item
    yield from _located(marked, head, oriented)


def _check_datum(oriented: Oriented, head: SurveyHead) -> None:
    """Refuse photographs of which nobody knows how large they are, or what is upright in them."""
    if not oriented.unknown:
        return
    ways = {
        "scale": "[[scale_bars]] with a measured length",
        "vertical": "[[plumb_lines]] with points above each other",
    }
    raise SurveyError(
        f"nothing tells the {' and the '.join(oriented.unknown)} of the photographs in {oriented.path}: they were "
        "oriented without control points, and stones would come in at any size",
        where=head.path,
        remedy=f"add control points, or {' and '.join(ways[name] for name in oriented.unknown)} to the project of "
        'moma orient, or datum = "start" if its start values are right in this, and orient again',
    )


def _located(records: Sequence[BlockRecord], head: SurveyHead, oriented: Oriented) -> Iterator[Item]:
    points: dict[str, dict[str, Located]] = {}
    errors: dict[str, MomaError] = {}
    for record in records:
        try:
            points[record.code] = _intersected(record, head, oriented)
        except MomaError as error:
            errors[record.code] = error
    surfaces = {rule.name: _surface(rule, records, points, oriented) for rule in head.surfaces}
    for record in records:
        try:
            if record.code in errors:
                raise errors[record.code]
            yield _record(record, head, oriented, points[record.code], surfaces)
        except MomaError as error:
            place = f"{head.path}:{record.line}"
            where = (
                error.where if error.where is not None and error.where.startswith(f"{head.path}:") else place
            )
            yield Reject(record.code, error.at(f"{where}: stone {record.code}"), record.spans)


def _marks(record: BlockRecord, head: SurveyHead, oriented: Oriented) -> dict[str, list[PointMark]]:
    """Group the marks of a stone by their points; corners drawn on one photograph are points of their own.

    Marks on a photograph that `moma orient` left out are left out too, as long as others show the point.
    """
    out: dict[str, list[PointMark]] = {}
    for mark in record.marks:
        if mark.photograph not in oriented.left_out:
            out.setdefault(mark.name, []).append(mark)
    for mark in record.marks:
        if mark.name not in out:
            raise SurveyError(
                f"point {mark.name} is marked only on photograph {mark.photograph}, which moma orient left out: "
                f"{oriented.left_out[mark.photograph]}",
                where=f"{head.path}:{mark.line}",
                remedy="correct the photograph and orient again, or mark the point on others",
            )
    for number, image in enumerate(record.image, start=1):
        name = f"corner {number}"
        out[name] = [PointMark(name, "vertex", record.photograph or "", image, None, record.line)]
    return out


def _mark(mark: PointMark, head: SurveyHead, oriented: Oriented) -> Mark:
    where = f"{head.path}:{mark.line}"
    photo = oriented.index(mark.photograph, where)
    width, height = oriented.camera(photo).size
    if not (
        -0.02 * width <= mark.image[0] <= 1.02 * width and -0.02 * height <= mark.image[1] <= 1.02 * height
    ):
        raise SurveyError(
            f"point {mark.name} at ({mark.image[0]:g}, {mark.image[1]:g}) lies outside photograph {mark.photograph} "
            f"of {width} × {height} pixels",
            where=where,
            remedy="marks are in pixels, to the right and down from the upper left corner",
        )
    return Mark(photo, mark.image, mark.sigma or oriented.mark_sigma, mark.line)


def _intersected(record: BlockRecord, head: SurveyHead, oriented: Oriented) -> dict[str, Located]:
    """Return the points of a stone that are known in space: two photographs show them, or they were measured."""
    if len(record.vertices):
        raise SurveyError("it has marks and vertices in space", remedy="give its outline in one way")
    out = {}
    for k, (place, sigma) in enumerate(zip(record.points, record.point_sigmas, strict=True), start=1):
        name = f"measured {k}"
        still = np.zeros((3, len(oriented.covariance)))
        out[name] = Located(
            name, place, still, {f"{record.code} {name}": sigma * np.eye(3)}, (), "measured in space"
        )
    for name, ones in _marks(record, head, oriented).items():
        marks = [_mark(mark, head, oriented) for mark in ones]
        if len(marks) >= 2:
            try:
                out[name] = intersect(oriented, name, marks)
            except MomaError as error:
                raise error.at(f"{head.path}:{marks[0].line}") from error
    return out


def _surface(
    rule: SurfaceRule,
    records: Sequence[BlockRecord],
    points: Mapping[str, Mapping[str, Located]],
    oriented: Oriented,
) -> Surface | MomaError:
    """Fit a surface to the points of all stones that lie on it."""
    located_by_name: dict[str, Located] = {}
    for record in records:
        if record.surface == rule.name:
            # a corner that stones share is measured once
            located_by_name |= {
                f"{located.place.round(6).tolist()}": located
                for located in points.get(record.code, {}).values()
            }
    try:
        return fit_surface(rule.kind, list(located_by_name.values()), oriented, _middle(oriented), rule.sigma)
    except MomaError as error:
        return error.at(f"surface {rule.name} (line {rule.line})")


def _middle(oriented: Oriented) -> Array:
    return np.asarray(np.mean([oriented.station(f) for f in range(len(oriented.photos))], axis=0))


def _record(
    record: BlockRecord,
    head: SurveyHead,
    oriented: Oriented,
    intersected: Mapping[str, Located],
    surfaces: Mapping[str, Surface | MomaError],
) -> BlockRecord:
    grouped = _marks(record, head, oriented)
    single = [name for name in grouped if name not in intersected]
    plotted = {}
    if single:
        surface = _own_surface(record, intersected, surfaces, oriented)
        for name in single:
            mark = _mark(grouped[name][0], head, oriented)
            try:
                plotted[name] = plot(oriented, name, mark, surface)
            except MomaError as error:
                raise error.at(f"{head.path}:{mark.line}") from error
    role = {name: ones[0].role for name, ones in grouped.items()}
    measured = [point for name, point in intersected.items() if name not in grouped]
    # points that only one photograph shows define nothing: they were put on the surface
    located = measured + [
        intersected[name] for name in grouped if role[name] == "point" and name in intersected
    ]
    corners = [plotted.get(name) or intersected[name] for name in grouped if role[name] == "vertex"]
    return _in_space(record, oriented, located, corners)


def _own_surface(
    record: BlockRecord,
    intersected: Mapping[str, Located],
    surfaces: Mapping[str, Surface | MomaError],
    oriented: Oriented,
) -> Surface:
    if record.surface is not None:
        surface = surfaces[record.surface]
        if isinstance(surface, MomaError):
            raise surface
        return surface
    return fit_surface("plane", list(intersected.values()), oriented, _middle(oriented))


def _in_space(
    record: BlockRecord, oriented: Oriented, located: Sequence[Located], corners: Sequence[Located]
) -> BlockRecord:
    """Return a record with points and corners in space, and the evidence for them."""
    every = [*located, *corners]
    places = np.array([point.place for point in every])
    joint = joint_covariance(every, oriented)
    covariances = [joint_covariance([point], oriented, shared=False) for point in every]
    normal = np.linalg.svd(places - places.mean(axis=0))[2][2]
    sigmas = np.maximum([np.sqrt(normal @ covariance @ normal) for covariance in covariances], _MIN_SIGMA)
    photos = {sight.photo for each in every for sight in each.sights}
    stations = [oriented.station(f) for f, photo in enumerate(oriented.photos) if photo.name in photos]
    left_out = "; ".join(f"{point.name}: {point.left_out}" for point in every if point.left_out)
    return replace(
        record,
        notes={**record.notes, "marks_left_out": left_out} if left_out else record.notes,
        points=np.array([point.place for point in located]).reshape(-1, 3),
        vertices=np.array([corner.place for corner in corners]).reshape(-1, 3),
        sigma=float(np.sqrt((sigmas**2).mean())),
        sigmas=sigmas,
        names=tuple(point.name for point in every),
        photograph=None,
        image=np.empty((0, 2)),
        seen_from=np.mean(stations, axis=0),
        joint=joint.ravel(),
        evidence=tuple(
            _evidence(point, k >= len(located), joint[3 * k : 3 * k + 3, 3 * k : 3 * k + 3])
            for k, point in enumerate(every)
        ),
    )


def _evidence(point: Located, corner: bool, covariance: Array) -> dict[str, object]:
    """Describe in plain values how a point was located."""
    return {
        "point": point.name,
        "role": "vertex" if corner else "point",
        "place": point.place.tolist(),
        "how": point.text,
        "sigma": np.sqrt(np.diag(covariance)).tolist(),
        "covariance": covariance.tolist(),
        "rays": [
            {
                "photo": sight.photo,
                "x": float(sight.image[0]),
                "y": float(sight.image[1]),
                "residual": sight.residual.tolist(),
                "test": sight.test,
                "distance": sight.distance,
            }
            for sight in point.sights
        ],
    }
