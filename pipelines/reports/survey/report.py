"""Survey report: from survey files to a folder with numbers, a page and pictures, without a database."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.dynamics.progress import Listener, Progress, silent
from pipelines.draw.elevations.beds import draw_courses
from pipelines.draw.elevations.orthophoto import Orthophoto, read_orthophoto
from pipelines.draw.elevations.sheet import require_figures
from pipelines.draw.elevations.survey import draw_departure, draw_elevation, draw_residuals
from pipelines.draw.photographs import DrawnOutline, draw_outlines
from pipelines.reports.photographs import draw_photographs, photographs_section
from pipelines.reports.survey.document import survey_json, write_survey_json
from pipelines.reports.survey.page import write_survey_page
from pipelines.reports.survey.study import SurveyStudy, study_surveys
from pipelines.results.folder import check_replaceable, replacing, source_of
from survey.clouds.settings import CloudOptions
from survey.conventions import LARGEST
from survey.formats.options import ReadingOptions
from survey.orientation.formats.result import read_orientation
from survey.orientation.network import listed
from survey.quality.masonry.index import Grade

INDEX = "survey.json"
"""Name of the file that lists all files of a report."""


@dataclass(frozen=True)
class SurveyReport:
    """A written survey report.

    Attributes
    ----------
    folder : its place
    study : findings
    content : survey.json without its parts: the survey as a whole
    """

    folder: Path
    study: SurveyStudy
    content: Mapping[str, Any]


def report_surveys(
    paths: Sequence[str | Path],
    folder: str | Path,
    format: str = "moma",
    options: ReadingOptions | None = None,
    progress: Listener = silent,
    grades: Mapping[str, Grade] | None = None,
    overwrite: bool = False,
    orthophoto: str | Path | None = None,
    since: Sequence[str | Path] = (),
) -> SurveyReport:
    """Judge survey files and write the report, which includes the stones that could not be made.

    Parameters
    ----------
    paths : survey files, of one format; together they are one survey
    folder : place of the report; an earlier report there is replaced once the new one is complete
    format : name of their format
    options : defaults for what the files leave out
    progress : called at every stage
    grades : grades of the masonry that no survey tells: "SM", the state of the stones, and "MM", the mortar
    overwrite : replace a report on other files in the folder
    orthophoto : picture of a wall on which its elevation is drawn, with a world file and the wall's frame, FILE.toml
    since : files of an earlier campaign with which the stones are compared

    Raises
    ------
    UsageError : no such file or format; the folder holds other things, or a report on other files; nothing says where
        the orthophoto lies
    SurveyError : a file that cannot be read at all, or control points that contradict each other
    """
    require_figures()
    folder = Path(folder)
    source = [Path(path) for path in (*paths, *since)]
    if isinstance(options, CloudOptions):
        source.append(options.outlines)
    check_replaceable(folder, INDEX, () if overwrite else source)
    photo = None if orthophoto is None else read_orthophoto(Path(orthophoto))
    study = study_surveys(paths, format, options or ReadingOptions(), progress, grades, since)
    with replacing(folder, INDEX) as fresh:
        content = write_survey_report(study, fresh, progress, source, photo)
    return SurveyReport(folder, study, content)


def write_survey_report(
    study: SurveyStudy,
    folder: Path,
    progress: Listener = silent,
    source: Sequence[Path] = (),
    photo: Orthophoto | None = None,
) -> dict[str, Any]:
    """Write all files of a report into an empty folder; return survey.json without its parts."""
    release = version("moma-masonry")
    progress(Progress("write", 0, 3, "pictures"))
    pictures = _draw(study, folder, photo)
    progress(Progress("write", 1, 3, "report.html"))
    photographs = list(_photographs(study, folder))
    write_survey_page(folder / "report.html", study, pictures, release, photographs)
    progress(Progress("write", 2, 3, INDEX))
    content = survey_json(study, release)
    content["source"] = source_of(source, folder)
    content["files"] = sorted([INDEX, *(entry.name for entry in folder.iterdir())])
    write_survey_json(folder / INDEX, study, content)
    progress(Progress("write", 3, 3))
    return content


def _photographs(study: SurveyStudy, folder: Path) -> Iterator[dict[str, Any]]:
    """Draw the photographs that stones were marked on, and describe them for the page."""
    paths = [
        Path(file.head.path).parent / file.head.orientation for file in study.files if file.head.orientation
    ]
    for number, path in enumerate(dict.fromkeys(paths), start=1):
        values = json.loads(path.read_text(encoding="utf-8"))
        files = {
            photo["name"]: path.parent / photo["picture"] for photo in values["photos"] if "picture" in photo
        }
        gone = [name for name, file in files.items() if not file.is_file()]
        there = {name: file for name, file in files.items() if name not in gone}
        pictures = draw_photographs(values, folder, there, f"photographs-{number}-")
        oriented = read_orientation(path)
        if stones := list(_outlines(study, {photo.name for photo in oriented.photos})):
            name = f"photographs-{number}-outlines.png"
            draw_outlines(folder / name, oriented, stones, there)
            pictures[name] = (
                "Outlines of the stones on the photographs with most of their marks; orange: drawn on this photograph"
                f"{f'; the files of {listed(gone)} are not there any more' if gone else ''}."
            )
        yield photographs_section(values, pictures, folder)


def _outlines(study: SurveyStudy, photos: set[str]) -> Iterator[DrawnOutline]:
    """Yield the stones that were marked on some photographs, unless control points moved them to another frame."""
    if any(file.head.control for file in study.files):
        return
    for stone in study.stones:
        marks: dict[str, list[tuple[float, float]]] = {}
        drawn = set[str]()
        for seen in stone.evidence:
            rays: Any = seen["rays"]
            for ray in rays:
                marks.setdefault(ray["photo"], []).append((ray["x"], ray["y"]))
                if str(seen["point"]).startswith("corner "):
                    drawn.add(ray["photo"])
        if marks.keys() & photos:
            places = {name: np.array(ones) for name, ones in marks.items()}
            yield DrawnOutline(stone.code, stone.outline, stone.normal, places, min(drawn, default=None))


def _draw(study: SurveyStudy, folder: Path, photo: Orthophoto | None) -> dict[str, str]:
    """Draw the pictures; return captions by file name. Those of the first facade have no number."""
    captions = {}
    flagged = {row.code for row in study.again.rows if row.code is not None}
    for number, facade in enumerate(study.facades[:LARGEST], start=1):
        ending = ".png" if number == 1 else f"-{number}.png"
        name = f"elevation{ending}"
        under = photo if photo is not None and photo.shows(facade) else None
        draw_elevation(folder / name, facade, study.stones, flagged, under)
        captions[name] = (
            f"{facade.name[:1].upper()}{facade.name[1:]}, seen from outside, coloured by the distance of the points of "
            "each stone from its plane. Stones with an orange outline are to be measured again."
        )
        lines = [line for line in study.courses if line.facade == facade.name]
        if lines:
            name = f"courses{ending}"
            draw_courses(folder / name, lines, study.beds)
            captions[name] = (
                f"The beds of {facade.name}. Each black stroke is the bed of one stone, between its lower corners."
            )
        if any(face.facade == facade.name for face in study.faces):
            name = f"plumb{ending}"
            draw_departure(folder / name, facade, study.stones, study.faces)
            captions[name] = (
                f"How far the stones of {facade.name} stand before or behind its best plane, and before or behind the "
                "upright plane. Stones with a black outline stand out of those around them."
            )
    if study.quality.residuals.counts.any():
        draw_residuals(folder / "residuals.png", study.quality.residuals, study.quality.verdict)
        captions["residuals.png"] = (
            "Residuals of the accepted points and corners, each over its own standard deviation. A histogram wider "
            "than the curve: the points are less precise than stated. Long tails: blunders that were not detected."
        )
    return captions
