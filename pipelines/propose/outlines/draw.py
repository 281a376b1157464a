"""Outlines proposed from a picture, or of others beside it, or corrected: a folder with files and a page."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import UsageError
from mechanics.dynamics.progress import Listener, Progress, silent
from pipelines.propose.outlines.features import (
    CORRECTED,
    Feature,
    corrected_features,
    proposed_features,
    reviewed_features,
)
from pipelines.propose.outlines.quality import quality_facts
from pipelines.propose.outlines.write import NAMES, write_outlines
from pipelines.reports.outlines.page import PageDoubt, editor_html
from pipelines.results.folder import check_replaceable, replacing
from survey.clouds.extras import optional
from survey.clouds.outlines.outline import PROPOSED
from survey.clouds.pictures.marks import mark_outlines
from survey.clouds.pictures.photograph import Photograph, open_photograph
from survey.clouds.pictures.proposal import Proposal, propose_outlines
from survey.clouds.pictures.statistics import bond_statistics
from survey.clouds.settings import OutlineSettings
from survey.conventions import TENTH

INDEX = "outlines.json"
"""Name of the file that lists all files of the folder."""

PAGE = "outlines.html"
"""Name of the page that corrects the outlines."""

_SURE = 1.0 - TENTH  # probability of a joint from which it is no doubt


@dataclass(frozen=True)
class OutlineRequest:
    """A picture, and what is asked of it.

    Attributes
    ----------
    picture : the file
    pixel, size : side of a pixel, or width and height of the picture [m]; None: a world file says so
    mask : picture that is white where there is no wall
    depth : depth map of `moma cloud`
    joint : width of the joints [m]; None: by itself
    masonry : kind of masonry
    review : outlines of others, which are opened instead of proposals
    corrected : outlines that the page saved, which take the place of proposals
    """

    picture: Path
    pixel: float | None = None
    size: tuple[float, float] | None = None
    mask: Path | None = None
    depth: Path | None = None
    joint: float | None = None
    masonry: str = "auto"
    review: Path | None = None
    corrected: Path | None = None


@dataclass(frozen=True)
class DrawnOutlines:
    """Outlines in a folder.

    Attributes
    ----------
    stones, courses, openings : their numbers
    kinds : number of stones of each kind
    masonry : coursed or rubble
    joint : width of the joints [m]
    doubtful : joints that are less than 90 % sure, or marks about the outlines of others
    corrected, unchanged, superseded : outlines drawn by hand, proposals that stayed, codes of those that did not
    statistics : of the bond, with their names
    doubts : about the picture
    refused : whether nothing was proposed
    files : in the folder
    """

    stones: int
    courses: int
    openings: int
    kinds: dict[str, int]
    masonry: str
    joint: float
    doubtful: int
    corrected: int
    unchanged: int
    superseded: tuple[str, ...]
    statistics: tuple[tuple[str, str], ...]
    doubts: tuple[str, ...]
    refused: bool
    files: tuple[str, ...]


def draw_outlines(request: OutlineRequest, folder: Path, progress: Listener = silent) -> DrawnOutlines:
    """Propose, review or take back the outlines of a picture, and write them into a folder.

    Parameters
    ----------
    request : the picture, and what is asked of it
    folder : of the results; earlier ones there are replaced
    progress : told of the work

    Raises
    ------
    UsageError, SurveyError
        if a file cannot be read, or options contradict each other
    """
    if request.review is not None and request.corrected is not None:
        raise UsageError("--review and --corrected", remedy="give one of them")
    check_replaceable(folder, INDEX)
    for package in ("pyogrio", "ezdxf", "shapely"):
        optional(package, "outlines")
    photograph = open_photograph(
        request.picture, pixel=request.pixel, size=request.size, mask=request.mask, depth=request.depth
    )
    progress(Progress(f"look for joints in {request.picture.name}", 0, None))
    joint = None if request.joint is None else request.joint / photograph.places.pixel
    proposal = propose_outlines(photograph, OutlineSettings(masonry=request.masonry, joint=joint))
    features, doubts = _chosen(request, photograph, proposal)
    return _written(request, photograph, proposal, features, doubts, folder)


def _chosen(
    request: OutlineRequest, photograph: Photograph, proposal: Proposal
) -> tuple[list[Feature], list[PageDoubt]]:
    """Return the outlines that are asked for, and the doubts about them."""
    if request.review is not None:
        features = reviewed_features(request.review, photograph.places)
        marks = mark_outlines([feature.ring for feature in features], proposal)
        return features, [
            PageDoubt(
                tuple(features[k].code for k in mark.outlines),
                f"{mark.reason}: {mark.text}",
                1.0,
                *mark.place,
            )
            for mark in marks
        ]
    if request.corrected is not None:
        return corrected_features(request.corrected), []
    return proposed_features(proposal), _doubts(proposal)


def _doubts(proposal: Proposal) -> list[PageDoubt]:
    """Return the joints that are not sure, the most doubtful first."""
    codes = [stone.named.code for stone in proposal.stones]
    return [
        PageDoubt(
            tuple(codes[k] for k in border.stones),
            f"a joint between {' and '.join(codes[k] for k in border.stones)}? {border.probability:.0%} sure",
            1.0 - abs(2.0 * border.probability - 1.0),
            *border.place,
        )
        for border in proposal.borders
        if border.probability < _SURE
    ]


def _written(
    request: OutlineRequest,
    photograph: Photograph,
    proposal: Proposal,
    features: list[Feature],
    doubts: list[PageDoubt],
    folder: Path,
) -> DrawnOutlines:
    kinds = [feature.said.get("kind") for feature in features]
    courses = [feature.said.get("course") for feature in features]
    facts = bond_statistics([feature.ring for feature in features], kinds, courses) + quality_facts(features)
    by_hand = sum(feature.said.get("evidence") == CORRECTED for feature in features)
    there = {feature.code for feature in features}
    gone = sorted(stone.named.code for stone in proposal.stones if stone.named.code not in there)
    names = [*(NAMES if features else ()), PAGE]
    made = DrawnOutlines(
        stones=len(features),
        courses=len({course for course in courses if course is not None}),
        openings=len(proposal.openings),
        kinds={kind: kinds.count(kind) for kind in sorted({kind for kind in kinds if kind is not None})},
        masonry=proposal.masonry,
        joint=round(proposal.joint[1], 5),
        doubtful=len(doubts),
        corrected=by_hand,
        unchanged=sum(feature.said.get("evidence") == PROPOSED for feature in features),
        superseded=tuple(gone) if request.corrected is not None else (),
        statistics=tuple(facts),
        doubts=_warnings(request, photograph, proposal),
        refused=proposal.findings.refused and request.review is None and request.corrected is None,
        files=tuple(str(folder / name) for name in names),
    )
    with replacing(folder, INDEX) as fresh:
        if features:
            write_outlines(features, fresh, f"outlines of stones in {request.picture.name}")
        page = editor_html(
            f"Outlines of {request.picture.name}",
            photograph.pixels,
            photograph.places.matrix,
            photograph.places.origin,
            [_for_page(feature) for feature in features],
            doubts,
            facts,
        )
        (fresh / PAGE).write_text(page, encoding="utf-8")
        content = asdict(made) | {"files": [INDEX, *names], "borders": _borders(proposal)}
        (fresh / INDEX).write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return made


def _for_page(one: Feature) -> dict[str, Any]:
    return {"code": one.code, "ring": np.round(one.ring, 5).tolist(), "said": dict(one.said)}


def _borders(proposal: Proposal) -> list[dict[str, object]]:
    """Return the joints with their probabilities, by the codes of the stones as they were proposed."""
    codes = [stone.named.code for stone in proposal.stones]
    return [
        {
            "stones": [codes[k] for k in border.stones],
            "probability": round(border.probability, 4),
            "length": round(border.length, 4),
            "place": [round(x, 4) for x in border.place],
        }
        for border in proposal.borders
    ]


def _warnings(request: OutlineRequest, photograph: Photograph, proposal: Proposal) -> tuple[str, ...]:
    out: Sequence[str] = [f"{request.picture}: {text}" for text in proposal.findings.texts]
    if not photograph.stated:
        text = "its scale is not known, and a pixel counts as a millimetre; give --pixel or --size, or a world file"
        out = [*out, f"{request.picture}: {text}"]
    return tuple(out)
