"""Stones as features: what each outline says of itself, whoever drew it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError
from survey.arrays import Array
from survey.clouds.outlines.outline import PROPOSED, Outline
from survey.clouds.outlines.reading import read_outlines
from survey.clouds.pictures.proposal import Proposal
from survey.clouds.world import PixelPlace
from survey.geometry.polygons import ring_area

CORRECTED = "corrected by hand"
"""Evidence of an outline that a person drew or changed."""


@dataclass(frozen=True)
class Feature:
    """An outline and its attributes.

    Attributes
    ----------
    code : of the stone
    ring : (n, 2) corners in the wall's plane, counter-clockwise [m]
    said : other attributes, as they are written
    """

    code: str
    ring: Array
    said: Mapping[str, Any] = field(default_factory=dict)


def proposed_features(proposal: Proposal) -> list[Feature]:
    """Return the stones of a proposal."""
    return [
        Feature(
            stone.named.code,
            stone.ring,
            {
                "kind": stone.named.kind,
                **({} if stone.named.course is None else {"course": stone.named.course}),
                "place": stone.named.place,
                "score": round(stone.score, 3),
                "sigma": round(stone.sigma, 5),
                "evidence": PROPOSED,
                **({"cut": "by the edge of the picture"} if stone.cut else {}),
            },
        )
        for stone in proposal.stones
    ]


def reviewed_features(path: Path, places: PixelPlace) -> list[Feature]:
    """Return the outlines that another program or a person made, in the plane of a picture.

    Parameters
    ----------
    path : COCO's JSON, a label picture, or any file of outlines
    places : of the picture; outlines in pixels are placed by it

    Raises
    ------
    UsageError, SurveyError
        if it cannot be read, or its outlines lie in space
    """
    drawing = read_outlines(path)
    out = []
    for outline in drawing.outlines:
        if outline.corners.shape[1] != 2:
            raise SurveyError(
                "the outline lies in space", where=outline.where, remedy="draw it in the wall's plane"
            )
        ring = places.place(outline.corners) if drawing.pixels else outline.corners
        out.append(
            Feature(outline.code, _turned(ring), _said(outline) | {"evidence": f"outline of {path.name}"})
        )
    return out


def corrected_features(path: Path) -> list[Feature]:
    """Return the stones that the page saved.

    Raises
    ------
    UsageError, SurveyError
        if it cannot be read, or two stones have one code
    """
    out: dict[str, Feature] = {}
    for outline in read_outlines(path).outlines:
        if outline.code in out:
            remedy = "give each stone a code of its own"
            raise SurveyError(f"a second stone {outline.code}", where=outline.where, remedy=remedy)
        out[outline.code] = Feature(outline.code, _turned(outline.corners), _said(outline))
    return list(out.values())


def _turned(ring: Array) -> Array:
    return ring if ring_area(ring) > 0.0 else np.ascontiguousarray(ring[::-1])


def _said(one: Outline) -> dict[str, Any]:
    """Return the attributes of an outline under the names that are written."""
    said = one.said
    known = {
        "kind": said.kind, "course": said.course, "zone": said.zone, "depth": said.depth,
        "depth_sigma": said.depth_sigma, "score": said.score, "sigma": said.sigma,
    }  # fmt: skip
    return {name: value for name, value in known.items() if value is not None} | dict(said.notes)
