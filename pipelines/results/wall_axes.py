"""Axes of a wall, as an engineer at its foot sees it: along the wall, outwards, and the height above its foot."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechanics.arrays import Array
from mechanics.results.result import BodyResult
from survey.conventions import ONE_WAY

_ONE_WAY = math.cos(
    ONE_WAY
)  # cos 30°: length of the mean level normal from which faces look one way, as those of a façade do [-]
_ALONG = 0.996  # cos 5°: a direction within it of an axis has the name of the axis [-]


@dataclass(frozen=True)
class WallAxes:
    """Axes of a wall that looks one way.

    Attributes
    ----------
    along : (3,) level, to the right of whom the wall faces [-]
    outwards : (3,) level, square to the wall [-]
    left_end : of the stones along the wall [m]
    foot : lowest point of the stones [m]
    """

    along: Array
    outwards: Array
    left_end: float
    foot: float

    def components(self, vector: Array) -> Array:
        """Return the components (…, 3) of vectors along the wall, outwards and up."""
        components: Array = np.asarray(vector) @ np.array([self.along, self.outwards, (0.0, 0.0, 1.0)]).T
        return components

    def place(self, point: Array) -> tuple[float, float]:
        """Return the distance of a point from the left end, and its height above the foot [m]."""
        return float(np.dot(point, self.along)) - self.left_end, float(point[2]) - self.foot

    def direction(self, vector: Array) -> str:
        """Name a direction by the axis nearest to it, with the angle to that where it is above 5°."""
        parts = self.components(vector)
        size = float(np.linalg.norm(parts))
        if size == 0.0:
            return "none"
        names = (
            ("to the right along the wall", "to the left along the wall"),
            ("outwards", "inwards"),
            ("up", "down"),
        )
        row = int(np.abs(parts).argmax())
        name = names[row][int(parts[row] < 0.0)]
        cosine = abs(float(parts[row])) / size
        if cosine >= _ALONG:
            return name
        others = np.where(np.arange(3) == row, 0.0, parts)
        second = int(np.abs(others).argmax())
        towards = names[second][int(others[second] < 0.0)]
        return f"{name}, turned by {np.degrees(np.arccos(min(cosine, 1.0))):.0f}° {_towards(towards)}"

    @property
    def record(self) -> dict[str, Any]:
        """The axes in plain values, as summary.json holds them."""
        return {
            "along": self.along.tolist(),
            "outwards": self.outwards.tolist(),
            "left_end": self.left_end,
            "foot": self.foot,
        }


def _towards(name: str) -> str:
    return name if name.startswith("to ") else {"up": "upwards", "down": "downwards"}.get(name, name)


def wall_axes(normals: Array, areas: Array, points: Array) -> WallAxes | None:
    """Return the axes of the wall that surveyed faces make; None where they look several ways.

    Parameters
    ----------
    normals, areas : (n, 3), (n,) of the surveyed faces [-], [m²]
    points : (m, 3) corners of all stones [m]
    """
    mean = areas @ normals / max(float(areas.sum()), 1e-300)
    level = np.array([mean[0], mean[1], 0.0])
    length = float(np.linalg.norm(level))
    if length < _ONE_WAY:
        return None
    outwards = level / length
    along = np.array([-outwards[1], outwards[0], 0.0])
    return WallAxes(along, outwards, float((points @ along).min()), float(points[:, 2].min()))


def axes_of(record: Mapping[str, Any] | None) -> WallAxes | None:
    """Return the axes that summary.json holds; None if it has none."""
    if record is None:
        return None
    along, outwards = (np.array(record[name], dtype=float) for name in ("along", "outwards"))
    return WallAxes(along, outwards, float(record["left_end"]), float(record["foot"]))


def wall_record(axes: WallAxes | None, bodies: Sequence[BodyResult]) -> dict[str, Any] | None:
    """Return the axes of a wall and the largest displacement at the end in them, as summary.json holds them."""
    if axes is None:
        return None
    sizes = [float(np.linalg.norm(body.displacement, axis=1).max()) for body in bodies]
    body = bodies[int(np.argmax(sizes))]
    point = int(np.linalg.norm(body.displacement, axis=1).argmax())
    along, outwards, up = axes.components(body.displacement[point]).tolist()
    right, height = axes.place(body.reference[point])
    return {
        **axes.record,
        "displacement": {
            "along": along,
            "outwards": outwards,
            "up": up,
            "stone": body.code,
            "from_left": right,
            "above_foot": height,
        },
    }
