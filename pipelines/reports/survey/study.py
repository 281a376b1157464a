"""Findings of a survey report, computed from survey files."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from archmodel.tables.entities import kind_named
from ground.errors import UsageError
from mechanics.arrays import Array
from mechanics.dynamics.progress import Listener, Progress, silent
from pipelines.ingest.outlined import open_source
from pipelines.ingest.reading_options import Source, survey_sources
from pipelines.reports.survey.campaigns import CampaignComparison, compare_campaigns
from survey.conventions import RARE, STONE
from survey.extrusion.extrusion import SurveyedBlock
from survey.formats.options import ReadingOptions
from survey.quality.canon import Deviation, KindStandard, deviations, standards
from survey.quality.contradictions import Contradiction, contradictions
from survey.quality.corners import SeenFace, misplaced_corners
from survey.quality.courses import CourseHeight, CourseLine, course_heights, measure_courses, with_scatter
from survey.quality.departures.beds import CHANCE as BED_CHANCE
from survey.quality.departures.beds import WallBeds, find_bed_movements
from survey.quality.departures.depths import DoubtfulDepth, doubtful_depths
from survey.quality.departures.faces import WallFace, find_face_departures
from survey.quality.facades import Facade, facades_of
from survey.quality.masonry.index import Grade
from survey.quality.masonry.walls import MasonryQuality, WallStone, judge_masonry
from survey.quality.precision import StoneQuality, SurveyQuality, appraise, judge_survey
from survey.quality.remeasure import Remeasure, ShortList, list_remeasures, short_list
from survey.records.plausible import LENGTH, doubt_of
from survey.records.survey import Canon, DepthRule, Reject, SurveyHead
from survey.registration.site_frame import SiteTransform
from survey.registration.stones import survey_stones

CHANCES = {"beds": BED_CHANCE, "faces": BED_CHANCE, "depths": RARE}
"""Probability that a survey without fault or movement is given a finding of each sort."""

_SOME_DEPTH = DepthRule(None, STONE, None, "\0")  # no file can give this source
_OF_PATCHES = "the sigma of each patch follows from the scatter of all, so that the scatter cannot check it"
_INTERVAL = 200  # stones between two reports of progress


@dataclass(frozen=True)
class SurveyFile:
    """One file of a report.

    Attributes
    ----------
    head : what holds for all its stones
    transform : into the frame of the site; None if it has no control points
    stones, rejects : number of stones that could be made, and could not
    """

    head: SurveyHead
    transform: SiteTransform | None
    stones: int
    rejects: int


@dataclass(frozen=True)
class SurveyStudy:
    """Findings about a survey.

    Attributes
    ----------
    name : of the first file
    files : files of the survey
    stones : all stones that could be made, in the order of the files
    rejects : those that could not, with reasons
    quality : all stones together
    facades : stones that face one way
    usual : the usual face of each kind
    deviations : differences of the stones from it
    contradictions : stones whose proportions contradict their kind
    courses : bed lines
    course_heights : from bed to bed
    beds : movement of each wall as its beds show it
    faces : departure of each wall from plane and plumb, and the stones out of it
    depths : depths that contradict other evidence, the worst first
    masonry : quality of the masonry of each wall
    remeasures : all reasons to measure a stone again, most urgent first
    again : the short list of them
    warnings : reasons why the database would refuse the survey, and sizes that hardly any stone has
    since : the stones beside those of an earlier campaign; None: none was named
    """

    name: str
    files: tuple[SurveyFile, ...]
    stones: tuple[StoneQuality, ...]
    rejects: tuple[Reject, ...]
    quality: SurveyQuality
    facades: tuple[Facade, ...]
    usual: dict[str, KindStandard]
    deviations: tuple[Deviation, ...]
    contradictions: tuple[Contradiction, ...]
    courses: tuple[CourseLine, ...]
    course_heights: tuple[CourseHeight, ...]
    beds: tuple[WallBeds, ...]
    faces: tuple[WallFace, ...]
    depths: tuple[DoubtfulDepth, ...]
    masonry: tuple[MasonryQuality, ...]
    remeasures: tuple[Remeasure, ...]
    again: ShortList
    warnings: tuple[str, ...]
    since: CampaignComparison | None = None


def study_surveys(
    paths: Sequence[str | Path],
    format: str,
    options: ReadingOptions,
    progress: Listener = silent,
    grades: Mapping[str, Grade] | None = None,
    since: Sequence[str | Path] = (),
) -> SurveyStudy:
    """Read, fit and judge the stones of survey files.

    Parameters
    ----------
    paths : survey files, or folders of them, of one format; together they are one survey
    format : its name
    options : defaults for what the files leave out
    progress : called now and then
    grades : grades of the masonry that no survey tells: "SM", the state of the stones, and "MM", the mortar
    since : files of an earlier campaign with which the stones are compared

    Raises
    ------
    UsageError : no such file or format, or files of one campaign that measure the same stones: they are not pooled
    SurveyError : a file that cannot be read at all, or control points that contradict each other
    """
    files, stones, rejects = _read_campaign(paths, format, options, progress)
    study = _judge(files, tuple(stones), tuple(rejects), grades or {}, progress)
    if since:
        before, earlier, _ = _read_campaign(since, format, options, progress)
        named = [str(one.head.path) for one in before]
        compared = compare_campaigns(before[0].head.name, named, earlier, stones)
        study = replace(study, since=compared)
    if format != "cloud" or not stones:
        return study
    return replace(study, quality=replace(study.quality, verdict=_OF_PATCHES))


def _read_campaign(
    paths: Sequence[str | Path], format: str, options: ReadingOptions, progress: Listener
) -> tuple[tuple[SurveyFile, ...], list[StoneQuality], list[Reject]]:
    """Read the files of one campaign, which measure no stone twice."""
    seen: dict[str, Path] = {}
    stones: list[StoneQuality] = []
    rejects: list[Reject] = []
    files = []
    for source in survey_sources(paths, format):
        before = len(stones), len(rejects)
        file = _read(source, format, options, stones, rejects, progress)
        _refuse_second_campaign([stone.code for stone in stones[before[0] :]], source.path, seen)
        files.append(replace(file, stones=len(stones) - before[0], rejects=len(rejects) - before[1]))
    return tuple(files), stones, rejects


def _refuse_second_campaign(codes: Sequence[str], path: Path, seen: dict[str, Path]) -> None:
    """Refuse stones that an earlier file measured too; `seen` has their files by code, and is added to."""
    again = [code for code in codes if code in seen]
    if again:
        some = ", ".join(again[:3]) + (", …" if len(again) > 3 else "")
        what = f"measures {len(again)} of its {len(codes)} stones a second time, after {seen[again[0]].name}: {some}"
        remedy = (
            "say which is the earlier campaign, since what moved between them is no scatter: "
            "moma survey-report LATER --since EARLIER; in a database: moma ingest LATER --again, moved_since(…)"
        )
        raise UsageError(what, where=str(path), remedy=remedy)
    seen.update(dict.fromkeys(codes, path))


def _read(
    source: Source,
    format: str,
    options: ReadingOptions,
    stones: list[StoneQuality],
    rejects: list[Reject],
    progress: Listener,
) -> SurveyFile:
    stream = open_source(source, format, options, progress)
    survey = survey_stones(replace(stream, head=_with_some_depth(stream.head)))
    for number, stone in enumerate(survey.stones, start=1):
        if isinstance(stone, Reject):
            rejects.append(stone)
        else:
            stones.append(_appraised(stone))
        if number % _INTERVAL == 0:
            progress(Progress(f"fit {source.path.name}", number, number + _INTERVAL))
    head = replace(survey.head, depth_rules=stream.head.depth_rules)
    return SurveyFile(head, survey.transform, 0, 0)


def _with_some_depth(head: SurveyHead) -> SurveyHead:
    """Add a depth for stones without one, since faces can be judged whatever their depth."""
    if any(rule.kind is None for rule in head.depth_rules):
        return head
    return replace(head, depth_rules=(*head.depth_rules, _SOME_DEPTH))


def _appraised(block: SurveyedBlock) -> StoneQuality:
    stone = appraise(block)
    if block.depth.source != _SOME_DEPTH.source:
        return stone
    return replace(stone, depth=None, depth_source="not known", depth_origin="none")


def _judge(
    files: tuple[SurveyFile, ...],
    stones: tuple[StoneQuality, ...],
    rejects: tuple[Reject, ...],
    grades: Mapping[str, Grade],
    progress: Listener,
) -> SurveyStudy:
    progress(Progress("judge", 0, 3, "courses and faces"))
    quality = judge_survey(stones)
    facades = facades_of(stones)
    usual = standards(stones, _canons(files))
    odd = contradictions(stones, facades)
    tilts = [file.transform.covariance[3:6, 3:6] for file in files if file.transform is not None]
    lines = measure_courses(stones, facades, tilts)
    beds, faces = _movements(stones, facades, lines, tilts)
    # one scatter of beds in the table of courses and in the verdict on movement
    lines = with_scatter(lines, {(bed.facade, bed.zone): (bed.scatter, bed.freedom) for bed in beds})
    rules = [rule for file in files for rule in file.head.depth_rules]
    depths = doubtful_depths(stones, facades, rules, CHANCES["depths"])
    seen = [_seen(stone) for stone in stones if stone.measured]
    remeasures = list_remeasures(stones, rejects, odd, quality, misplaced_corners(seen), depths)
    progress(Progress("judge", 1, 3, "masonry"))
    masonry = judge_masonry([_wall_stone(stone) for stone in stones], facades, grades)
    progress(Progress("judge", 2, 3, "what depends on doubtful stones"))
    again = short_list(remeasures, len(stones) + len(rejects), _verdicts(stones, facades, tilts, beds, faces))
    progress(Progress("judge", 3, 3))
    return SurveyStudy(
        name=files[0].head.name,
        files=files,
        stones=stones,
        rejects=rejects,
        quality=quality,
        facades=facades,
        usual=usual,
        deviations=deviations(stones, usual),
        contradictions=odd,
        courses=lines,
        course_heights=course_heights(lines),
        beds=beds,
        faces=faces,
        depths=depths,
        masonry=masonry,
        remeasures=remeasures,
        again=again,
        warnings=(*_unknown_kinds(quality.kinds), *_doubtful_sizes(stones)),
    )


def _movements(
    stones: Sequence[StoneQuality],
    facades: Sequence[Facade],
    lines: Sequence[CourseLine],
    tilts: Sequence[Array],
    walls: tuple[int, int] = (1, 1),
) -> tuple[tuple[WallBeds, ...], tuple[WallFace, ...]]:
    """Find what has moved; `walls` share the chances, of which these are one."""
    lengths = {stone.code: stone.length for stone in stones}
    rows = {stone.code: stone.line for stone in stones}
    leans = {}
    for facade in facades:
        # the rotation ω moves what is z up by ω × z, of which this is the part outwards
        x, y, _ = facade.frame.axes[2]
        lever = np.array([-y, x, 0.0])
        leans[facade.name] = max((math.sqrt(float(lever @ tilt @ lever)) for tilt in tilts), default=0.0)
    beds = find_bed_movements(lines, lengths, CHANCES["beds"] / max(walls[0], 1), rows)
    return beds, find_face_departures(stones, facades, CHANCES["faces"] / max(walls[1], 1), leans)


def _findings(beds: Sequence[WallBeds], faces: Sequence[WallFace]) -> dict[tuple[object, ...], str]:
    """Return the verdicts on the walls, each with its name."""
    findings: dict[tuple[object, ...], str] = {}
    for wall in beds:
        for movement in wall.movements:
            name = "settlement" if movement.kind in ("step", "part") else movement.kind
            findings[wall.facade, wall.zone, name] = f"the {name} of {wall.facade}"
            if movement.older_than is not None:
                dated = f"that it is older than course {movement.older_than}"
                findings[wall.facade, wall.zone, name, movement.older_than] = (
                    f"{dated} ({name} of {wall.facade})"
                )
    for face in faces:
        for moved in face.movements:
            findings[face.facade, face.zone, moved.kind] = f"the {moved.kind} of {face.facade}"
    return findings


def _verdicts(
    stones: Sequence[StoneQuality],
    facades: Sequence[Facade],
    tilts: Sequence[Array],
    beds: Sequence[WallBeds],
    faces: Sequence[WallFace],
) -> Callable[[str], str | None]:
    """Return what names the verdicts on its wall that are no longer the same without a stone."""
    places = {stones[i].code: (facade, i) for facade in facades for i in facade.members.tolist()}
    texts, walls = _findings(beds, faces), (len(beds), len(faces))

    def ask(code: str) -> str | None:
        """Return the verdict on the course of a stone without that stone, or None where it has none."""
        if code not in places:
            return None
        facade, k = places[code]
        zone = stones[k].zone
        wall = [stones[i] for i in facade.members.tolist() if i != k and stones[i].zone == zone]
        alone = replace(facade, members=np.arange(len(wall)))
        lines = measure_courses(wall, [alone], tilts)
        without = _findings(*_movements(wall, [alone], lines, tilts, walls))
        lost = [text for key, text in texts.items() if key[:2] == (facade.name, zone) and key not in without]
        gained = [text for key, text in without.items() if key not in texts]
        if lost:
            return f"{lost[0]}, which is not found without it"
        return f"{gained[0]}, which is found without it" if gained else None

    return ask


def _wall_stone(stone: StoneQuality) -> WallStone:
    finite = stone.corner_sigma[np.isfinite(stone.corner_sigma)]
    return WallStone(
        code=stone.code,
        kind=stone.kind,
        course=stone.course,
        zone=stone.zone,
        outline=stone.outline,
        normal=stone.normal,
        sigma=float(np.median(finite)) if len(finite) else 0.0,
        depth=stone.depth,
        depth_sigma=stone.depth_sigma,
        area=stone.area,
    )


def _seen(stone: StoneQuality) -> SeenFace:
    return SeenFace(
        code=stone.code,
        kind=stone.kind,
        line=stone.line,
        normal=stone.normal,
        outline=stone.outline,
        worn=stone.worn_corners,
        area=stone.area,
        length=stone.length,
        height=stone.height,
    )


def _canons(files: Sequence[SurveyFile]) -> list[Canon]:
    """Gather the canons of all files; of two for one kind the first holds."""
    canons: dict[str, Canon] = {}
    for file in files:
        for canon in file.head.canons:
            canons.setdefault(canon.kind, canon)
    return list(canons.values())


def _unknown_kinds(kinds: Mapping[str, int]) -> Iterator[str]:
    """Yield a warning for each kind that is mistyped or undeclared, and would be refused by `moma ingest`."""
    for kind, count in kinds.items():
        try:
            kind_named(kind)
        except UsageError as error:
            yield f"{count} stone{'s' if count > 1 else ''} of an {error}"


def _doubtful_sizes(stones: Sequence[StoneQuality]) -> Iterator[str]:
    """Yield a warning for the stones whose sizes hardly any stone has, and one for those that none has."""
    doubtful: dict[bool, list[str]] = {}
    for stone in stones:
        if (doubt := doubt_of(max(stone.length, stone.height, stone.depth or 0.0), LENGTH)) is not None:
            doubtful.setdefault(doubt.impossible, []).append(f"stone {stone.code}: {doubt.text}")
    for texts in doubtful.values():
        more = f" (and {len(texts) - 1} more stones)" if len(texts) > 1 else ""
        yield texts[0] + more
