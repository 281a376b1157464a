"""Views of a point cloud in a folder: orthophoto and depth map with world files, the wall's frame, and sections."""

import csv
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ground.errors import UsageError
from mechanics.dynamics.progress import Listener, Progress, silent
from pipelines.results.folder import check_replaceable, replacing
from survey.arrays import Array
from survey.clouds.extras import optional
from survey.clouds.points.chunks import PointCloud
from survey.clouds.points.reading import open_points
from survey.clouds.views.orthophoto import DEPTH_STEP, Picture, find_wall, paint_wall, write_picture
from survey.clouds.views.sections import Section, SectionPlane, contour, section_plane
from survey.clouds.wall import read_wall, wall_lines
from survey.conventions import SOME, STEP, STONE

INDEX = "cloud.json"
"""Name of the file that lists all files of the folder."""

_SHORTEST = 20  # pixels of a contour; shorter ones are noise
_THINNED = SOME  # distance of a section's line from the middles of its cells, of a cell


@dataclass(frozen=True)
class DrawnSection:
    """A section: its name, the number of its polylines, and their length [m]."""

    name: str
    lines: int
    length: float


@dataclass(frozen=True)
class DrawnCloud:
    """Views of a cloud.

    Attributes
    ----------
    points, shown : number of points, and of those on the orthophoto
    width, height : of the orthophoto [m]
    pixel : side of its pixels [m]
    coloured : whether it shows colours or intensities; otherwise it is a relief
    depth_step, depth_lowest : a number n > 0 of the depth map is lowest + (n - 1) step [m]
    sections : of the cloud
    files : in the folder
    warnings : doubts about the clouds
    """

    points: int
    shown: int
    width: float
    height: float
    pixel: float
    coloured: bool
    depth_step: float
    depth_lowest: float
    sections: tuple[DrawnSection, ...]
    files: tuple[str, ...]
    warnings: tuple[str, ...]


def draw_views(
    files: Sequence[Path],
    folder: Path,
    wall: str | None = None,
    *,
    pixel: float = 0.005,
    slab: float = STONE,
    sections: Sequence[str] = (),
    thickness: float = STEP,
    progress: Listener = silent,
) -> DrawnCloud:
    """Draw a point cloud into a folder: wall.png, depth.png, their world files, wall.toml, and sections.dxf and .csv.

    Parameters
    ----------
    files : the cloud
    folder : of the results; earlier ones there are replaced
    wall : file of a frame, or two points on its foot; None: the largest upright plane
    pixel : side of a pixel [m]
    slab : largest distance of a point from the plane of the wall [m]
    sections : planes, e.g. "z=1.5"
    thickness : of a section [m]
    progress : told of points that are read

    Raises
    ------
    UsageError, SurveyError
        if a file cannot be read, or a value is out of its range
    """
    _check_lengths(("--pixel", pixel, 1.0), ("--slab", slab, 3.0), ("--thickness", thickness, 1.0))
    check_replaceable(folder, INDEX)
    if sections:
        optional("ezdxf", "sections as DXF")
    clouds = [open_points(path) for path in files]

    def listen(stage: str, done: int, total: int | None) -> None:
        """Report how many points are read."""
        progress(Progress(stage, done, total))

    frame = find_wall(clouds, listen) if wall is None else read_wall(wall)
    planes = [section_plane(section, frame) for section in sections]
    picture, read, shown = paint_wall(clouds, frame, pixel, slab, listen)
    cell = max(pixel, 0.5 * thickness)
    cut = [Section(plane, thickness, cell) for plane in planes if not plane.name.startswith("d")]
    if cut:
        _cut(clouds, cut, listen)
    with replacing(folder, INDEX) as fresh:
        names, drawn = ["wall.png", "wall.pgw", "depth.png", "depth.pgw", "wall.toml"], []
        lowest = write_picture(picture, fresh / "wall.png", fresh / "depth.png")
        (fresh / "wall.toml").write_text(wall_lines(frame), encoding="utf-8")
        if planes:
            lines = {section.plane.name: section.lines(_THINNED * cell) for section in cut}
            lines |= _contours(picture, planes, pixel)
            _write_sections(lines, fresh)
            names += ["sections.dxf", "sections.csv"]
            drawn = [DrawnSection(name, len(runs), _length(runs)) for name, runs in lines.items()]
        made = _report(picture, read, shown, lowest, drawn, clouds, folder, names)
        content = asdict(made) | {"files": [INDEX, *names], "clouds": [str(path) for path in files]}
        (fresh / INDEX).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return made


def _contours(picture: Picture, planes: Sequence[SectionPlane], pixel: float) -> dict[str, list[Array]]:
    """Return the contours of the depths in those of the planes that are parallel to the wall."""
    return {
        plane.name: contour(picture, plane, _SHORTEST * pixel, 0.5 * pixel)
        for plane in planes
        if plane.name.startswith("d")
    }


def _check_lengths(*lengths: tuple[str, float, float]) -> None:
    """Refuse an option whose length is out of its range, given its name, its value and its upper bound [m]."""
    for name, value, most in lengths:
        if not 1e-4 <= value <= most:
            remedy = f"give it in metres, from 0.0001 to {most:g}"
            raise UsageError(f"is {value:g} m", where=name, remedy=remedy)


def _report(
    picture: Picture,
    read: int,
    shown: int,
    lowest: float,
    drawn: Sequence[DrawnSection],
    clouds: Sequence[PointCloud],
    folder: Path,
    names: Sequence[str],
) -> DrawnCloud:
    height, width = picture.counts.shape
    return DrawnCloud(
        points=read,
        shown=shown,
        width=round(width * picture.pixel, 6),
        height=round(height * picture.pixel, 6),
        pixel=picture.pixel,
        coloured=picture.coloured,
        depth_step=DEPTH_STEP,
        depth_lowest=lowest,
        sections=tuple(drawn),
        files=tuple(str(folder / name) for name in names),
        warnings=tuple(text for cloud in clouds for text in cloud.warnings),
    )


def _cut(
    clouds: Sequence[PointCloud], sections: Sequence[Section], listen: Callable[[str, int, int | None], None]
) -> None:
    origin, read = np.floor(clouds[0].near), 0
    for cloud in clouds:
        for chunk in cloud.chunks(origin, False):
            for section in sections:
                section.add(chunk.places, origin)
            read += len(chunk.places)
            listen("cut", read, cloud.count)


def _length(lines: Sequence[Array]) -> float:
    return round(sum(float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) for line in lines), 3)


def _write_sections(lines: dict[str, list[Array]], folder: Path) -> None:
    """Write polylines in space: as DXF with a layer for each section, and as a table."""
    ezdxf = optional("ezdxf", "sections as DXF")
    drawing = ezdxf.new("R2000", units=6)  # metres
    with (folder / "sections.csv").open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(("section", "line", "x", "y", "z"))
        for name, own in lines.items():
            layer = "section_" + name.replace("=", "_")
            drawing.layers.add(layer)
            for number, line in enumerate(own, start=1):
                drawing.modelspace().add_polyline3d(line.tolist(), dxfattribs={"layer": layer})
                rows.writerows(
                    (name, number, *(f"{coordinate:.4f}" for coordinate in place)) for place in line
                )
    drawing.saveas(folder / "sections.dxf")
