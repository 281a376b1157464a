"""Rejected outlines as GeoJSON, each with the reason: once corrected, they are read like others."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from survey.clouds.outlines.outline import Outline, WrongOutline
from survey.clouds.outlines.reading import read_outlines
from survey.records.survey import Reject

MARK = "outlines rejected by moma"
"""Text in the first line of the files, by which they are recognised."""


def rejected_outlines(
    path: Path,
    layer: str | None,
    chosen: Mapping[str, str],
    sigma: float,
    smooth: float,
    rejects: Sequence[Reject],
) -> bytes:
    """Write rejected outlines of a file, in its coordinates.

    Parameters
    ----------
    path, layer, chosen, sigma, smooth : with which the outlines were read
    rejects : whose spans are the numbers of outlines
    """
    drawing = read_outlines(path, layer=layer, chosen=chosen, sigma=sigma, smooth=smooth, keep_going=True)
    by_number: dict[int, Outline | WrongOutline] = {outline.number: outline for outline in drawing.outlines}
    by_number |= {feature.number: feature for feature in drawing.wrong}
    features = [
        _feature(by_number[span.start], str(reject.error))
        for reject in rejects
        for span in reject.spans
        if span.start in by_number
    ]
    head = {"type": "FeatureCollection", "about": f"{MARK}: {len(features)} of {path.name}"}
    lines = json.dumps(head, ensure_ascii=False)[:-1] + ', "features": [\n'
    return (lines + ",\n".join(_lines(features)) + "\n]}\n").encode()


def _lines(features: Iterable[Mapping[str, object]]) -> Iterable[str]:
    return (json.dumps(feature, ensure_ascii=False) for feature in features)


def _feature(outline: Outline | WrongOutline, reason: str) -> dict[str, object]:
    if isinstance(outline, WrongOutline):
        line = {"type": "LineString", "coordinates": outline.corners.tolist()}
        return {
            "type": "Feature",
            "properties": {"code": outline.code, "reason": reason},
            "geometry": line if len(outline.corners) > 1 else None,
        }
    attributes = outline.said
    known = {
        "code": outline.code,
        "kind": attributes.kind,
        "course": attributes.course,
        "zone": attributes.zone,
        "depth": attributes.depth,
        "depth_sigma": attributes.depth_sigma,
        "depth_origin": attributes.depth_origin,
        "depth_source": attributes.depth_source,
        "sigma": attributes.sigma,
        "score": attributes.score,
    }
    ring = [*outline.corners.tolist(), outline.corners[0].tolist()]
    return {
        "type": "Feature",
        "properties": {key: value for key, value in known.items() if value is not None}
        | dict(attributes.notes)
        | {"reason": reason},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }
