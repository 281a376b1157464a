"""Masonry quality of a wall, as far as the outlines of its stones in a picture tell."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from pipelines.propose.outlines.features import Feature
from survey.clouds.settings import CloudOptions
from survey.geometry.polygons import ring_area
from survey.quality.facades import Facade, WallPlane
from survey.quality.masonry.index import PARAMETERS, Direction, Grade, Parameter
from survey.quality.masonry.walls import WallStone, judge_masonry

_PLANE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # along, up, outwards
_WORDS = {
    Direction.VERTICAL: "vertical",
    Direction.IN_PLANE: "in the plane",
    Direction.OUT_OF_PLANE: "out of it",
}


def quality_facts(features: Sequence[Feature]) -> list[tuple[str, str]]:
    """Return the parameters of the masonry quality index that outlines tell, and its range, each with its name.

    Stones that the edge of the picture cuts are left out: their sizes are not known.

    Parameters
    ----------
    features : outlines of a wall
    """
    stones = [_stone(feature) for feature in features if "cut" not in feature.said]
    area = sum(stone.area for stone in stones)
    wall = Facade("the picture", np.arange(len(stones)), WallPlane(np.zeros(3), _PLANE), 180.0, area)
    return [
        fact for judged in judge_masonry(stones, (wall,)) for fact in _facts(judged.grades, judged.indices)
    ]


def _facts(
    grades: Mapping[Parameter, Grade], indices: Mapping[Direction, tuple[float, float]]
) -> Iterator[tuple[str, str]]:
    for parameter, grade in grades.items():
        if grade.chances is not None:
            yield f"{parameter}, {PARAMETERS[parameter]}", f"{grade.words}: {grade.text}"
    unseen = ", ".join(PARAMETERS[name] for name, grade in grades.items() if grade.chances is None)
    ranges = ", ".join(f"{low:.1f} to {high:.1f} {_WORDS[name]}" for name, (low, high) in indices.items())
    yield "Index of quality (IQM, 0 to 10)", f"{ranges}; not seen: {unseen}"


def _stone(feature: Feature) -> WallStone:
    said = feature.said
    outline = np.column_stack([feature.ring[:, 0], np.zeros(len(feature.ring)), feature.ring[:, 1]])
    return WallStone(
        feature.code,
        str(said.get("kind") or "ashlar"),
        said.get("course"),
        None,
        outline,
        -np.array([0.0, 1.0, 0.0]),
        float(said.get("sigma") or CloudOptions.outline_sigma),
        None,
        None,
        abs(ring_area(feature.ring)),
    )
