"""The hidden side: a face moved back by the stone's depth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from survey.depth import Depth
from survey.faces import Face
from survey.solids import Solid

__all__ = ["SurveyedBlock", "extrude", "prism"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SurveyedBlock:
    """A stone as measured, with its hidden half.

    Attributes
    ----------
    code, kind, course : as in the survey
    face : its visible face
    depth : its depth, with the evidence
    solid : prism between the face and the hidden face
    """

    code: str
    kind: str
    course: int | None
    face: Face
    depth: Depth
    solid: Solid


def extrude(face: Face, depth: Depth) -> SurveyedBlock:
    """Extrude a face by a depth: the hidden face is the outline moved by -depth · n.

    Parameters
    ----------
    face : visible face
    depth : how deep the stone is

    Returns
    -------
    SurveyedBlock whose solid has the nv visible corners first, then the nv hidden ones, in the same order
    """
    hidden = face.outline - depth.value * face.fit.normal
    return SurveyedBlock(
        face.code, face.kind, face.course, face, depth, prism(face.code, face.outline, hidden)
    )


def prism(code: str, front: Array, back: Array) -> Solid:
    """Join two polygons of equal count, the front counter-clockwise seen from outside, to a closed solid."""
    count = len(front)
    sides = tuple((j, i, i + count, j + count) for i, j in ((i, (i + 1) % count) for i in range(count)))
    faces = (tuple(range(count)), tuple(range(2 * count - 1, count - 1, -1)), *sides)
    return Solid(code, np.vstack([front, back]), faces)
