"""Pictures of how surveyed stones became touching solids: elevations of flat facades, and all stones in space."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import MissingLibraryError
from mechanics.arrays import Array, Ints
from pipelines.draw.elevations.closing import draw_moved
from pipelines.draw.elevations.closing_shapes import ClosingShapes
from pipelines.draw.elevations.joints import draw_joints
from pipelines.draw.offscreen.closing import ClosingSurface
from pipelines.draw.offscreen.parts import OBLIQUELY, fan_polygons
from pipelines.draw.pictures import draw_apart
from survey.conventions import ALIKE, MOST, ONE_WAY, SOME, TENTH
from survey.geometry.solids import Solid
from survey.geometry.watertight import triangulate
from survey.quality.facades import Facade, find_facades

_FLAT = SOME  # largest depth of a facade over its extent [-]: a deeper one is distorted by an elevation
_LOOKING = np.cos(ALIKE)  # smallest mean component of the normals across the facade [-]
_SHARE = TENTH  # smallest share of the visible area [-]: smaller facades are not worth an elevation
_MAX_ELEVATIONS = 4  # elevations of one scene
_NOTHING = 5e-5  # smaller movements are rounding [m]
_MAINLY = MOST  # least share of the visible area in flat facades together [-]
_LEVEL = SOME  # length of the mean normal [-]: below it the stones have no common direction
_STEEP = ONE_WAY  # elevation of the viewer over vaults and floors [rad]


def draw_closing(folder: Path, shapes: ClosingShapes) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Draw all pictures into an existing folder; return the file names, and warnings about missing pictures."""
    flat = draw_elevations(folder, shapes)
    try:
        return (*flat, *draw_in_space(folder, shapes)), ()
    except MissingLibraryError as error:
        return flat, (f"no pictures in space: {error}",)


def draw_elevations(folder: Path, shapes: ClosingShapes) -> tuple[str, ...]:
    """Draw each flat facade: corners moved by simplifying and by closing, and the joints; return the file names."""
    facades = flat_facades(shapes)
    names: list[str] = []
    for number, facade in enumerate(facades, start=1):
        end = f"-{number}.png" if len(facades) > 1 else ".png"
        for step in _steps(shapes):
            draw_moved(folder / f"{step}{end}", shapes, facade, step)
            names.append(f"{step}{end}")
        draw_joints(folder / f"joints{end}", shapes, facade)
        names.append(f"joints{end}")
    return tuple(names)


def draw_in_space(folder: Path, shapes: ClosingShapes) -> tuple[str, ...]:
    """Draw all stones and all joints from one side; return the file names.

    Raises
    ------
    MissingLibraryError : VTK cannot be loaded or cannot draw on this machine
    """
    towards, elevation = viewpoint(shapes)
    step = _steps(shapes)[-1:]
    looks = [
        (f"{picture}-3d.png", "moved", _LABELS[picture], f"{shapes.scene}: {_TITLES[picture]}")
        for picture in step
    ]
    title = f"{shapes.scene}: joints by their surveyed width\n{_note(shapes)}"
    looks.append(("joints-3d.png", "joints", "Width of the joints as surveyed [mm]", title))
    pictures: list[dict[str, Any]] = [
        {
            "path": str((folder / name).absolute()),
            "quantity": quantity,
            "label": label,
            "title": title,
            "towards": towards.tolist(),
            "elevation": elevation,
        }
        for name, quantity, label, title in looks
    ]
    draw_apart("pipelines.draw.offscreen.closing", closing_surface(shapes, *step), pictures)
    return tuple(name for name, *_ in looks)


def flat_facades(shapes: ClosingShapes) -> tuple[Facade, ...]:
    """Find the facades that an elevation shows undistorted, largest first; a vault or a dome has none."""
    seen = np.array([k for k, stone in enumerate(shapes.stones) if not stone.core])
    if not len(seen):
        return ()
    normals = np.array([stone.normal for stone in shapes.stones])
    areas = np.array([0.0 if stone.core else stone.area for stone in shapes.stones])
    centroids = np.array([stone.centroid for stone in shapes.stones])
    facades = []
    for own_facade in find_facades(normals[seen], areas[seen], centroids[seen]):
        facade = replace(own_facade, members=seen[own_facade.members])
        out, members = facade.frame.axes[2], facade.members
        depth = float(np.ptp(centroids[members] @ out))
        reach = float(np.ptp(facade.frame.flatten(centroids[members]), axis=0).max()) + np.sqrt(
            areas[members].mean()
        )
        looking = float(areas[members] @ (normals[members] @ out)) / float(areas[members].sum())
        if depth <= _FLAT * reach and looking >= _LOOKING and areas[members].sum() >= _SHARE * areas.sum():
            facades.append(facade)
    mainly_flat = sum(facade.area for facade in facades) >= _MAINLY * areas.sum()
    return tuple(facades[:_MAX_ELEVATIONS]) if mainly_flat else ()


def viewpoint(shapes: ClosingShapes) -> tuple[Array, float]:
    """Choose a viewpoint for all stones: horizontal direction to the viewer (3,), and elevation above it [rad]."""
    areas = np.array([stone.area for stone in shapes.stones])
    mean = areas @ np.array([stone.normal for stone in shapes.stones]) / areas.sum()
    level = mean * [1.0, 1.0, 0.0]
    size = float(np.linalg.norm(level))
    steep = abs(float(mean[2])) > max(size, _LEVEL)
    elevation = float(np.copysign(_STEEP, mean[2])) if steep else OBLIQUELY
    if size >= _LEVEL:
        return level / size, float(elevation)
    return _along(shapes), float(elevation if steep else _STEEP)


def _along(shapes: ClosingShapes) -> Array:
    """Return the horizontal direction that the fewest faces look in: the axis of a vault, from its southern end."""
    areas = np.array([stone.area for stone in shapes.stones])
    level = np.array([stone.normal for stone in shapes.stones])[:, :2]
    _, directions = np.linalg.eigh((level * areas[:, None]).T @ level)
    x, y = directions[:, 0].tolist()
    sign = -1.0 if (y, x) > (0.0, 0.0) else 1.0
    return np.array([sign * x, sign * y, 0.0])


def closing_surface(shapes: ClosingShapes, step: str = "moved") -> ClosingSurface:
    """Gather the faces of all stones and joints, with the movement of each corner in one of the two steps."""
    simplified = step == "simplified"
    solids = [stone.surveyed if simplified else stone.simple for stone in shapes.stones]
    starts = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    shut = [joint for joint in shapes.joints if not joint.joint.left_open and joint.polygon is not None]
    left = [joint for joint in shapes.joints if joint.joint.left_open and joint.polygon is not None]
    joint_points, joint_triangles, of_joint = fan_polygons(
        [joint.polygon for joint in shut if joint.polygon is not None]
    )
    gap_points, gap_triangles, _ = fan_polygons(
        [joint.polygon for joint in left if joint.polygon is not None]
    )
    return ClosingSurface(
        points=np.concatenate([solid.vertices for solid in solids]),
        triangles=np.concatenate(
            [triangulate(solid) + start for solid, start in zip(solids, starts[:-1], strict=True)]
        ).astype(np.int64),
        edges=np.concatenate(
            [_edges(solid) + start for solid, start in zip(solids, starts[:-1], strict=True)]
        ),
        moved=np.concatenate([stone.simplified if simplified else stone.moved for stone in shapes.stones]),
        joint_points=joint_points,
        joint_triangles=joint_triangles,
        joint_width=np.array([drawn.joint.width for drawn in shut])[of_joint],
        gap_points=gap_points,
        gap_triangles=gap_triangles,
        gaps=np.array([place.centroid for place in shapes.places if place.kind == "gap"]).reshape(-1, 3),
        overlaps=np.array([place.centroid for place in shapes.places if place.kind == "overlap"]).reshape(
            -1, 3
        ),
    )


_LABELS = {"simplified": "Moved by simplifying the stones [mm]", "moved": "Moved by closing the joints [mm]"}
_TITLES = {"simplified": "what simplifying moved", "moved": "what closing the joints moved"}


def _steps(shapes: ClosingShapes) -> list[str]:
    """List the steps that moved any corner: simplifying, closing the joints, or both."""
    known = {
        "simplified": any(np.nanmax(stone.simplified, initial=0.0) > _NOTHING for stone in shapes.stones),
        "moved": any(np.nanmax(stone.moved, initial=0.0) > _NOTHING for stone in shapes.stones),
    }
    return [name for name, shown in known.items() if shown]


def _note(shapes: ClosingShapes) -> str:
    gaps = sum(place.kind == "gap" for place in shapes.places)
    overlaps = len(shapes.places) - gaps
    parts = [f"orange: {gaps} gap{'s' * (gaps > 1)}"] if gaps else []
    parts += [f"black: {overlaps} overlap{'s' * (overlaps > 1)}"] if overlaps else []
    return "; ".join(parts) or "no gaps, no overlaps"


def _edges(solid: Solid) -> Ints:
    """List the sides of the faces, (ne, 2), each once."""
    sides = {
        (min(a, b), max(a, b))
        for face in solid.faces
        for a, b in zip(face, (*face[1:], face[0]), strict=True)
    }
    return np.array(sorted(sides), dtype=np.int64)
