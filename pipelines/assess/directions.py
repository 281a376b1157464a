"""Directions in which a building is pushed: square to its façades and along them, or the weakest."""

import math
from collections.abc import Sequence

import numpy as np

from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import limit_load
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.scene import Block, Fidelity
from pipelines.assess.questions import LoadQuestion
from survey.conventions import ALIKE, SOME

_UPRIGHT = math.sin(ALIKE)  # vertical part of the normal of an upright face, at most [-]
_ALIKE = np.radians(5.0)  # angle within which faces belong to one façade [rad]
_PUSH_SHARE = SOME  # area of the upright faces that a façade has, those square to it included [-]
_AXIS_ANGLE = 0.5  # angle to an axis that is none [°]
_COARSE, _FINE = 15, 1.0  # angles at which the weakest direction is sought, and to which [°]
_AXES = {90.0 * turn: name for turn, name in enumerate(("x", "y", "-x", "-y"))}


def push(angle: float) -> LoadQuestion:
    """Return the question of a horizontal push at an angle from x towards y [°]."""
    axis = min(_AXES, key=lambda candidate: abs((angle - candidate + 180.0) % 360.0 - 180.0))
    if abs((angle - axis + 180.0) % 360.0 - 180.0) <= _AXIS_ANGLE:
        x, y = round(np.cos(np.radians(axis))), round(np.sin(np.radians(axis)))
        return LoadQuestion(f"horizontal {_AXES[axis]}", Acceleration((float(x), float(y), 0.0)))
    turn = np.radians(angle)
    return LoadQuestion(
        f"horizontal {angle % 360.0:.3g}", Acceleration((float(np.cos(turn)), float(np.sin(turn)), 0.0))
    )


def facade_pushes(blocks: Sequence[Block]) -> tuple[LoadQuestion, ...]:
    """Return pushes square to each façade, both ways, and along it; along the axes where stones have none.

    The façades are the directions that most upright faces of the stones share, up to a right angle.
    """
    area, angle = _upright([block for block in blocks if block.fidelity is not Fidelity.FIXED])
    turns, remaining = list[float](), np.ones(len(area), dtype=bool)
    while remaining.any():
        # angles count four times: faces at right angles are of one façade or of those beside it
        alike = np.abs(np.angle(np.exp(4j * (angle[:, None] - angle[remaining])))) <= 4.0 * _ALIKE
        weight = (area * remaining) @ alike
        peak = int(weight.argmax())
        if weight[peak] < _PUSH_SHARE * area.sum():
            break
        facing = alike[:, peak] & remaining
        turn = float(np.degrees(np.angle(area[facing] @ np.exp(4j * angle[facing])) / 4.0))
        turns.append(round(turn, 6) % 90.0)
        remaining &= ~facing
    sides = (0.0, 180.0, 90.0, 270.0)
    return tuple(push(turn + side) for turn in turns or [0.0] for side in sides)


def weakest_push(on: RigidAssembly) -> LoadQuestion:
    """Return the horizontal push that the bound of associative friction limits most."""
    found_at: dict[float, float] = {}

    def bound(angle: float) -> float:
        """Return the limit load at an angle [°], solved once [-]."""
        if angle not in found_at:
            found_at[angle] = limit_load(on, push(angle).live).multiplier
        return found_at[angle]

    best = min((float(index) for index in range(0, 360, _COARSE)), key=bound)
    width = _COARSE / 2.0
    while width >= _FINE:
        best = min((best - width, best, best + width), key=bound)
        width /= 2.0
    question = push(best)
    return LoadQuestion(f"{question.name} (weakest)", question.live)


def _upright(blocks: Sequence[Block]) -> tuple[Array, Array]:
    """Return area [m²] and horizontal angle of the normal [rad] of all upright faces."""
    areas, angles = [], []
    for block in blocks:
        for face in block.faces:
            corners = block.vertices[list(face)]
            normal = 0.5 * np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
            size = float(np.linalg.norm(normal))
            if size > 0.0 and abs(normal[2]) <= _UPRIGHT * size:
                areas.append(size)
                angles.append(float(np.arctan2(normal[1], normal[0])))
    return np.array(areas), np.array(angles)
