"""Survey report: from survey files to a folder with numbers, a page and pictures, without a database."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mechanics.dynamics.progress import Listener, Progress, silent
from pipelines.draw.elevations.beds import draw_courses
from pipelines.draw.elevations.survey import draw_elevation, draw_residuals
from pipelines.reports.photographs.page import draw_photographs, photographs_section
from pipelines.reports.survey.document import survey_json, write_survey_json
from pipelines.reports.survey.page import write_survey_page
from pipelines.reports.survey.study import SurveyStudy, study_surveys
from pipelines.results.folder import check_replaceable, replacing
from survey.formats.options import ReadingOptions

__all__ = ["INDEX", "SurveyReport", "report_surveys", "write_survey_report"]

INDEX = "survey.json"
"""Name of the file that lists all files of a report."""

_FACADES = 8  # number of facades drawn, the largest first


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
) -> SurveyReport:
    """Judge survey files and write the report, which includes the stones that could not be made.

    Parameters
    ----------
    paths : survey files, of one format; together they are one survey
    folder : place of the report; an earlier report there is replaced once the new one is complete
    format : name of their format
    options : defaults for what the files leave out
    progress : called at every stage

    Raises
    ------
    UsageError : no such file or format; the folder holds other things
    SurveyError : a file that cannot be read at all, or control points that contradict each other
    """
    folder = Path(folder)
    check_replaceable(folder, INDEX)
    study = study_surveys(paths, format, options or ReadingOptions(), progress)
    with replacing(folder, INDEX) as fresh:
        content = write_survey_report(study, fresh, progress)
    return SurveyReport(folder, study, content)


def write_survey_report(study: SurveyStudy, folder: Path, progress: Listener = silent) -> dict[str, Any]:
    """Write all files of a report into an empty folder; return survey.json without its parts."""
    release = version("moma-masonry")
    progress(Progress("write", 0, 3, "pictures"))
    pictures = _draw(study, folder)
    progress(Progress("write", 1, 3, "report.html"))
    photographs = list(_photographs(study, folder))
    write_survey_page(folder / "report.html", study, pictures, release, photographs)
    progress(Progress("write", 2, 3, INDEX))
    content = survey_json(study, release)
    content["files"] = sorted([INDEX, *(entry.name for entry in folder.iterdir())])
    write_survey_json(folder / INDEX, study, content)
    progress(Progress("write", 3, 3))
    return content


def _photographs(study: SurveyStudy, folder: Path) -> Iterator[dict[str, Any]]:
    """Draw the photographs that stones were marked on, and describe them for the page."""
    paths = [Path(one.head.path).parent / one.head.orientation for one in study.files if one.head.orientation]
    for number, path in enumerate(dict.fromkeys(paths), start=1):
        values = json.loads(path.read_text(encoding="utf-8"))
        pictures = draw_photographs(values, folder, f"photographs-{number}-")
        yield photographs_section(values, pictures, folder)


def _draw(study: SurveyStudy, folder: Path) -> dict[str, str]:
    """Draw the pictures; return captions by file name. Those of the first facade have no number."""
    captions = {}
    flagged = {one.code for one in study.remeasures if one.code is not None}
    for number, facade in enumerate(study.facades[:_FACADES], start=1):
        ending = ".png" if number == 1 else f"-{number}.png"
        name = f"elevation{ending}"
        draw_elevation(folder / name, facade, study.stones, flagged)
        captions[name] = (
            f"{facade.name[:1].upper()}{facade.name[1:]}, seen from outside, coloured by the distance of the points of "
            "each stone from its plane. Stones with an orange outline are to be measured again."
        )
        lines = [line for line in study.courses if line.facade == facade.name]
        if lines:
            name = f"courses{ending}"
            draw_courses(folder / name, lines)
            captions[name] = (
                f"The beds of {facade.name}. Each black stroke is the bed of one stone, between its lower corners."
            )
    if study.quality.residuals.counts.any():
        draw_residuals(folder / "residuals.png", study.quality.residuals, study.quality.verdict)
        captions["residuals.png"] = (
            "Residuals of the accepted points and corners, each over its own standard deviation. A histogram wider "
            "than the curve: the points are less precise than stated. Long tails: blunders that were not detected."
        )
    return captions
