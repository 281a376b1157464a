"""A block on the ground, for hand calculations: it slides at λ = μ, and topples at λ = d/h."""

from random import Random

import numpy as np

from synthetic.bond import PlannedStone
from synthetic.building import Draft, SyntheticBuilding, flat_stone, measured_building, observer
from synthetic.frame import WallFrame

_FOOT = np.array([10.0, 20.0, 5.0])  # of the block's front edge in the site [m]
_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def block_on_ground(
    seed: int = 1, *, width: float = 0.8, height: float = 1.2, depth: float = 0.4
) -> SyntheticBuilding:
    """Build a block on a wider stone and measure their faces.

    Parameters
    ----------
    seed : of Python's own generator, whose stream is the same everywhere
    width, height, depth : of the block [m]

    Returns
    -------
    SyntheticBuilding, whose codes are GROUND and BLOCK
    """
    frame = WallFrame(_FOOT, _AXES)
    ground = np.array([(-width, -0.3), (width, -0.3), (width, 0.0), (-width, 0.0)])
    block = np.array([(-width / 2, 0.0), (width / 2, 0.0), (width / 2, height), (-width / 2, height)])
    plans = [
        PlannedStone("GROUND", "header", 1, ground, (False, False, False, True)),
        PlannedStone("BLOCK", "stretcher", 2, block, (True, False, False, False)),
    ]
    depths = {"header": 3.0 * depth, "stretcher": depth}
    drafts = []
    for plan in plans:
        stone = flat_stone(plan, depths[plan.kind], frame)
        drafts.append(Draft(stone, frame, plan.corners))
    station = observer(frame.place(np.array([[0.5, 1.5]]), 6.0)[0])
    return measured_building("block on the ground", drafts, depths, [station], ["GROUND"], Random(seed))
