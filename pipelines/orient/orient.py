"""`moma orient`: photographs from a project file, or from an export, to orientation.json and a report."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ground.errors import SurveyError, UsageError
from pipelines.draw.elevations.sheet import require_figures
from pipelines.orient.project import Project, calibrated, exported_control, read_project
from pipelines.results.folder import check_replaceable, replacing
from survey.orientation.bundle.orient import Orientation, orient
from survey.orientation.formats.colmap import write_colmap
from survey.orientation.formats.control import read_control, with_control
from survey.orientation.formats.dbat import write_dbat
from survey.orientation.formats.metashape import write_metashape
from survey.orientation.formats.photomodeler import read_photomodeler, write_photomodeler
from survey.orientation.formats.result import orientation_values, write_orientation
from survey.orientation.network import Network

INDEX = "orientation.json"
"""The file that marks a folder as one of these results."""


@dataclass(frozen=True)
class OrientReport:
    """Result of an orientation, and its folder.

    Attributes
    ----------
    folder : of the files
    orientation : the result
    values : the same in plain values, as in orientation.json
    """

    folder: Path
    orientation: Orientation
    values: dict[str, Any]


_WRITERS: dict[str, Callable[[Network, Path], object]] = {
    "photomodeler": lambda network, folder: write_photomodeler(network, folder / "photomodeler.txt"),
    "colmap": lambda network, folder: write_colmap(network, folder / "colmap"),
    "metashape": lambda network, folder: write_metashape(network, folder / "metashape.xml"),
    "dbat": lambda network, folder: write_dbat(network, folder / "dbat"),
}


def photomodeler_project(
    export: Path,
    control: Path | None,
    calibrate: tuple[str, ...] = (),
    fixed_control: bool = False,
    check: tuple[str, ...] = (),
    blunders: str = "report",
    size: tuple[int, int] | None = None,
) -> Project:
    """Make a project of an export of PhotoModeler and a file of control points, without a project file.

    Raises
    ------
    UsageError, SurveyError
        as of `read_project`
    """
    network = read_photomodeler(export, size)
    if control is not None:
        network = with_control(network, read_control(control), fixed=fixed_control, check=check)
    elif network.control and not check:
        network = exported_control(network, fixed_control)
    elif fixed_control or check:
        raise UsageError("--fixed-control or --check without --control", remedy="give --control FILE")
    network = calibrated(network, calibrate, "--calibrate")
    return Project(export.stem, network, blunders)


def orient_photographs(project: Path | Project, folder: Path) -> OrientReport:
    """Orient the photographs of a project and write orientation.json, report.html and its pictures.

    Parameters
    ----------
    project : project file, or a project that was read
    folder : of the results; replaced if it holds such results

    Raises
    ------
    UsageError, SurveyError, GeometryError
        if the project is wrong or contradicts itself; nothing is written
    """
    from pipelines.reports.photographs import draw_photographs, write_photographs_page

    require_figures()
    check_replaceable(folder, INDEX)
    read = project if isinstance(project, Project) else read_project(project)
    result = orient(read.network, "remove" if read.blunders == "remove" else "report")
    values = orientation_values(result, name=read.name)
    for photo in values["photos"]:
        if photo["name"] in read.pictures:
            photo["picture"] = _beside(read.pictures[photo["name"]], folder)
    with replacing(folder, INDEX) as fresh:
        pictures = draw_photographs(values, fresh, read.pictures)
        for form in read.write:
            try:
                _WRITERS[form](result.adjusted, fresh)
            except SurveyError as error:
                raise error.at(f'write = ["{form}"]') from error
        values["files"] = sorted([INDEX, "report.html", *(entry.name for entry in fresh.iterdir())])
        write_photographs_page(fresh / "report.html", values, pictures, version("moma-masonry"))
        write_orientation(fresh / INDEX, values)
    return OrientReport(folder, result, values)


def _beside(picture: Path, folder: Path) -> str:
    """Return the path of a picture from a folder; the whole path where there is none, as from another drive."""
    try:
        return Path(os.path.relpath(picture.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return picture.resolve().as_posix()
