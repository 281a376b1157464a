"""Common entry to the readers of point clouds."""

from collections.abc import Callable, Mapping
from pathlib import Path

from ground.errors import UsageError
from survey.clouds.points.chunks import PointCloud
from survey.clouds.points.e57 import open_e57
from survey.clouds.points.las import open_las
from survey.clouds.points.pcd import open_pcd
from survey.clouds.points.ply import open_ply
from survey.clouds.points.ptx import is_ptx, open_ptx
from survey.clouds.points.text import open_text

CLOUDS: Mapping[str, Callable[[Path], PointCloud]] = {
    ".las": open_las,
    ".laz": open_las,
    ".e57": open_e57,
    ".ply": open_ply,
    ".ptx": open_ptx,
    ".pcd": open_pcd,
    ".xyz": open_text,
    ".pts": open_text,
    ".asc": open_text,
    ".txt": open_text,
    ".csv": open_text,
}
"""Readers by the ending of the file."""

_OTHERS = {
    ".fls": "FARO scan",
    ".rcp": "ReCap project",
    ".rcs": "ReCap scan",
    ".bin": "CloudCompare project",
    ".zfs": "Zoller+Fröhlich scan",
    ".potree": "Potree",
}


def open_points(path: Path) -> PointCloud:
    """Open a point cloud, of which the head alone is read.

    Raises
    ------
    UsageError
        if there is no such file, or its format is not read
    SurveyError
        if the file is damaged
    """
    if not path.is_file():
        raise UsageError("no such file", where=str(path), remedy="name a point cloud")
    ending = path.suffix.lower()
    if CLOUDS.get(ending) is open_text and is_ptx(path):
        return open_ptx(path)
    if ending in CLOUDS:
        return CLOUDS[ending](path)
    what = f"{_OTHERS[ending]} files are not read" if ending in _OTHERS else f"unknown ending {ending!r}"
    remedy = f"export it as LAZ or E57, e.g. with CloudCompare; read are {', '.join(CLOUDS)}"
    raise UsageError(what, where=str(path), remedy=remedy)
