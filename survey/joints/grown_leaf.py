"""Report on a leaf of stones that grew into their mortar, and on the openings that stay in it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.geometry.polygons import ring_area


@dataclass(frozen=True)
class Opening:
    """A place of a leaf that mortar does not fill, as it is too far from every stone.

    Attributes
    ----------
    edges : (n, 2, 2) ends of the straight edges around it, to the right and upwards from the lower left corner of the
        frame; those along the frame are among them [m]
    front : (n, 2, 3) likewise, in space on the front of the leaf [m]
    area : [m²]
    stones : codes of the stones beside it
    sides : of the frame that it reaches: "left", "below", "right" or "above"
    """

    edges: Array
    front: Array
    area: float
    stones: tuple[str, ...]
    sides: tuple[str, ...]

    @property
    def low(self) -> Array:
        """Lower left corner (2,) of its box [m]."""
        out: Array = self.edges.min(axis=(0, 1))
        return out

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of its box [m]."""
        width, height = (self.edges.max(axis=(0, 1)) - self.low).tolist()
        return width, height


@dataclass(frozen=True)
class GrownLeaf:
    """A leaf of stones that grew to the medial lines of the mortar between their outlines.

    Attributes
    ----------
    size : width and height of the frame that its stones and their mortar fill [m]
    outlines : by code, (n, 2) outline of each stone, to the right and upwards from the lower left corner of the frame,
        counter-clockwise [m]
    grown : by code, (m, 2) of what it grew to, likewise [m]
    thickness : by the codes of two neighbours, mean thickness of the mortar between them; by the code of a stone alone,
        mean distance of its outline from the foot and the top of the frame, where it reaches these [m]
    stone_share : by code, area of its outline over that of what it grew to, at most 1 [-]
    edges : of the joints; one that bends has several
    collapsed : edges that were too short, and became a corner
    growth : largest distance of a corner of a stone from its outline [m], of `farthest`
    farthest : code of a stone
    crossing : pairs of stones whose outlines touch or cross
    filled : mortar is filled in up to this width [m]
    openings : places that are farther from every stone, the largest first
    """

    size: tuple[float, float]
    outlines: Mapping[str, Array]
    grown: Mapping[str, Array]
    thickness: Mapping[frozenset[str], float]
    stone_share: Mapping[str, float]
    edges: int
    collapsed: int
    growth: float
    farthest: str
    crossing: tuple[tuple[str, str], ...]
    filled: float = np.inf
    openings: tuple[Opening, ...] = ()

    @property
    def open_over_all(self) -> float:
        """Area of the openings over that of the frame [-]."""
        return sum(opening.area for opening in self.openings) / (self.size[0] * self.size[1])

    @property
    def usual_area(self) -> float:
        """Median area of an outline [m²]."""
        return float(np.median([abs(ring_area(outline)) for outline in self.outlines.values()]))

    @property
    def stones_over_all(self) -> float:
        """Area of the outlines over that of the frame [-]."""
        return sum(abs(ring_area(outline)) for outline in self.outlines.values()) / (
            self.size[0] * self.size[1]
        )
