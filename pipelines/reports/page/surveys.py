"""Models of surveyed stones without a database: survey reports, and movements that are compared with them."""

from collections.abc import Callable, Sequence

import numpy as np

from mechanics.arrays import Array
from pipelines.draw.elevations.beds import LARGEST
from pipelines.reports.page.model import Column, Lines, Model, Motion
from pipelines.reports.page.surfaces import Shape, rigid_motion, stones_of
from survey.conventions import JOINT, WIDEST_JOINT
from survey.quality.movement import CourseMovement
from survey.quality.precision import StoneQuality

Displacement = Callable[[str, Array], Array]
"""Displacement (n, 3) of points (n, 3) of the stone of a code [m]."""

_THIN = WIDEST_JOINT  # drawn depth of stones whose depth is not known [m]
_BEFORE = JOINT  # distance of the lines before the wall [m]
_ORANGE, _BLUE = "#d55e00", "#0072b2"


def survey_model(
    title: str,
    stones: Sequence[StoneQuality],
    columns: Sequence[Column] = (),
    moved: Displacement | None = None,
    lines: Sequence[Lines] = (),
    colour: str = "rms",
) -> Model:
    """Return the model of surveyed stones: their faces, extruded straight by their depth.

    Parameters
    ----------
    title : of the building
    stones : as judged
    columns : further ones
    moved : a computed movement, from the start to the end
    lines : polylines, in the frame of the survey
    colour : name of the column that colours at first
    """
    shapes = [_prism(stone) for stone in stones]
    mesh, _ = stones_of([stone.code for stone in stones], shapes)
    origin = np.floor(mesh.vertices.mean(axis=0)) if len(mesh.vertices) else np.zeros(3)
    mean_normal = np.array([stone.normal * stone.area for stone in stones]).reshape(-1, 3).sum(axis=0)
    return Model(
        title=title,
        stones=type(mesh)(mesh.codes, mesh.vertices - origin, mesh.owner, mesh.triangles, mesh.edges),
        columns=[*_columns(stones), *columns],
        motion=None if moved is None else _motion(stones, shapes, moved, origin),
        lines=[Lines(drawn.name, drawn.colour, [line - origin for line in drawn.lines]) for drawn in lines],
        colour=colour,
        towards=mean_normal / max(float(np.linalg.norm(mean_normal)), 1e-300),
        origin=origin,
        notes=["Faces are as measured; the stones behind them are extruded straight by their depth."],
    )


def bed_lines(courses: Sequence[CourseMovement], normals: dict[str, Array]) -> list[Lines]:
    """Return the bed lines of courses, measured and simulated, with their departure from level exaggerated.

    Parameters
    ----------
    courses : of all walls
    normals : (3,) outward normal of each facade by its name
    """
    if not courses:
        return []
    levels = [float(np.mean(course.line.height)) for course in courses]
    apart = np.diff(sorted(set(levels)))
    room = float(np.median(apart)) if len(apart) else 0.3
    simulated = [course.simulated - course.simulated.mean() for course in courses]
    departures = [
        np.abs(course.line.height - level).max() for course, level in zip(courses, levels, strict=True)
    ]
    largest = max(max(departures), max(float(np.abs(own).max()) for own in simulated), 1e-6)
    factor = max(1.0, float(f"{LARGEST * room / largest:.1g}"))
    polylines: dict[str, list[Array]] = {"measured": [], "simulated": []}
    for course, level, own in zip(courses, levels, simulated, strict=True):
        places = course.line.places + _BEFORE * normals.get(course.line.facade, np.zeros(3))
        for name, departure in (("measured", course.line.height - level), ("simulated", own)):
            polylines[name].append(np.column_stack([places[:, :2], level + factor * departure]))
    colours = {"measured": _ORANGE, "simulated": _BLUE}
    return [
        Lines(f"Beds {name}, departure × {factor:g}", colours[name], lines)
        for name, lines in polylines.items()
    ]


def _prism(stone: StoneQuality) -> Shape:
    """Return the face of a stone extruded by its depth."""
    outline, count = stone.outline, len(stone.outline)
    back = outline - (stone.depth or _THIN) * stone.normal
    sides = [(i, count + i, count + (i + 1) % count, (i + 1) % count) for i in range(count)]
    faces = [tuple(range(count)), tuple(range(2 * count - 1, count - 1, -1)), *sides]
    return np.concatenate([outline, back]), faces


def _motion(
    stones: Sequence[StoneQuality], shapes: Sequence[Shape], moved: Displacement, origin: Array
) -> Motion:
    start = [points - origin for points, _ in shapes]
    end = [
        points - origin + moved(stone.code, points) for stone, (points, _) in zip(stones, shapes, strict=True)
    ]
    everything = np.ones(len(stones), dtype=bool)
    centres, shift, turn = rigid_motion(start, [start, end], everything)
    return Motion(np.array([0.0, 1.0]), centres, shift, turn, ~everything)


def _columns(stones: Sequence[StoneQuality]) -> list[Column]:
    def numbers(name: str) -> Array:
        """Return an attribute of all stones (n,), NaN where it is absent."""
        values = (getattr(stone, name) for stone in stones)
        return np.array([np.nan if value is None else value for value in values], dtype=float)

    def texts(name: str) -> list[str | None]:
        """Return an attribute of all stones as texts, None where it is absent."""
        return [None if (value := getattr(stone, name)) is None else str(value) for stone in stones]

    return [
        Column("kind", "kind", None, texts("kind"), "Stone"),
        Column("course", "course", "-", numbers("course"), "Stone"),
        Column("zone", "zone", None, texts("zone"), "Stone"),
        Column("length", "length", "m", numbers("length"), "Stone"),
        Column("height", "height", "m", numbers("height"), "Stone"),
        Column("area", "area", "m²", numbers("area"), "Stone"),
        Column("rms", "rms about the plane", "m", numbers("rms"), "Survey"),
        Column("sigma0", "σ₀, found over stated", "-", numbers("sigma0"), "Survey"),
        Column("redundancy", "redundancy", "-", numbers("redundancy"), "Survey"),
        Column("points", "points and corners", "-", numbers("points"), "Survey"),
        Column(
            "blunders",
            "left out as blunders",
            "-",
            np.array([float(len(stone.blunders)) for stone in stones]),
            "Survey",
        ),
        Column("tilt_sigma", "σ of the tilt", "°", numbers("tilt_sigma"), "Survey"),
        Column("shape", "shape of the face", None, texts("shape"), "Survey"),
        Column("source", "known from", None, texts("source"), "Survey"),
        Column("depth", "depth", "m", numbers("depth"), "Depth"),
        Column("depth_sigma", "σ of the depth", "m", numbers("depth_sigma"), "Depth"),
        Column("depth_origin", "evidence for the depth", None, texts("depth_origin"), "Depth"),
        Column("depth_source", "that evidence in words", None, texts("depth_source"), "Depth"),
    ]
