"""Stages of building in a few numbers each."""

from dataclasses import dataclass

from mechanics.arrays import Array


@dataclass(frozen=True)
class StageResult:
    """End of one stage of building.

    Attributes
    ----------
    name : as in the scene
    outcome, reason : verdict of the stage, and one clause
    cautions : of the stage
    steps, time : done in it; its clock begins at zero [s]
    stones : that stand in it, supports and stones that are held included
    laid, removed, held : stones laid in it, taken away before it, and held by a centring in it
    natural_map, balance, reaction_error : error measures, as in `Errors` [-]
    weight, reaction : of the stones that are free to move, and of all that holds them, against gravity [N]
    displacement : largest of a stone that is free to move, from where it was laid [m]
    moved : code of that stone; empty where all are held
    bed : thickest bed by which stones laid in it were made up above or below others that had moved; negative: most that
        was cut off a stone [m]
    supports, forces : codes of the stones that are fixed or held, and the force (n, 3) of each on the others [N]
    """

    name: str
    outcome: str
    reason: str
    cautions: tuple[str, ...]
    steps: int
    time: float
    stones: int
    laid: int
    removed: int
    held: int
    natural_map: float
    balance: float
    reaction_error: float
    weight: float
    reaction: float
    displacement: float
    moved: str
    bed: float
    supports: tuple[str, ...]
    forces: Array
