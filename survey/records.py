"""What a survey file says, stone by stone, before anything is computed from it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["BlockRecord", "DepthRule", "Survey"]


@dataclass(frozen=True)
class BlockRecord:
    """One stone as it was measured.

    Attributes
    ----------
    code : the stone's name, unique in its survey
    kind : what sort of stone it is, e.g. "header"
    course : number of its course, counted from the ground; None if it belongs to none
    vertices : (nv, 3) corners of the visible face, in order around it, nv ≥ 3 [m]
    points : (np, 3) further points on the visible face [m]
    sigma : standard deviation of one measured coordinate [m]
    depth : depth measured on this very stone [m]; None if it was not
    depth_sigma : its standard deviation [m]; None if not known
    depth_source : evidence for the depth; None if there is no depth
    line : line of the file on which the record begins, counted from 1
    notes : the surveyor's remarks, e.g. {"edge": "eroded"}
    """

    code: str
    kind: str
    course: int | None
    vertices: NDArray[np.float64]
    points: NDArray[np.float64]
    sigma: float
    depth: float | None = None
    depth_sigma: float | None = None
    depth_source: str | None = None
    line: int = 0
    notes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class DepthRule:
    """How deep the stones of one kind are, where nobody measured the stone itself.

    Attributes
    ----------
    kind : the kind of stone
    depth : [m]
    sigma : standard deviation [m]; None if not known
    source : the evidence, in words
    line : line of the file, counted from 1
    """

    kind: str
    depth: float
    sigma: float | None
    source: str
    line: int = 0


@dataclass(frozen=True)
class Survey:
    """The contents of one survey file.

    Attributes
    ----------
    name : name of the survey
    path : the file it was read from
    observer : (3,) where the surveyor stood: faces look towards this point [m]; None if not known
    depth_rules : at most one per kind
    blocks : the stones, in the order of the file
    """

    name: str
    path: str
    observer: NDArray[np.float64] | None
    depth_rules: tuple[DepthRule, ...]
    blocks: tuple[BlockRecord, ...]
