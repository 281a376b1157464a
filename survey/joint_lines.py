"""Which sides of neighbouring stones make one joint, and the straight line that the joint is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from survey.joint_settings import JointSettings
from survey.walls import Sides

__all__ = ["JointLine", "JointSettings", "facing_pairs", "joint_lines"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class JointLine:
    """One straight joint: all sides that look at each other across the same mortar.

    Attributes
    ----------
    members : (stone, side) indices
    point, direction : of the middle line in the wall plane [m], [-]
    width : mean open width [m]
    rms : of the corners from their side of the joint [m]
    largest : largest of these distances, of sound corners [m]
    worst : index of the stone it belongs to
    """

    members: tuple[tuple[int, int], ...]
    point: Array
    direction: Array
    width: float
    rms: float
    largest: float
    worst: int


def facing_pairs(sides: Sides, settings: JointSettings) -> NDArray[np.intp]:
    """Pairs of sides (4 i + k) that face each other across an open joint, (npairs, 2)."""
    low = sides.start.min(axis=1) - 0.5 * settings.max_width
    high = sides.start.max(axis=1) + 0.5 * settings.max_width
    order = np.argsort(low[:, 0], kind="stable")
    pairs: list[NDArray[np.intp]] = []
    for rank, i in enumerate(order):
        later = order[rank + 1 :]
        later = later[: np.searchsorted(low[later, 0], high[i, 0], side="right")]
        near = later[(low[later, 1] <= high[i, 1]) & (high[later, 1] >= low[i, 1])]
        if len(near):
            pairs.append(_facing(sides, int(i), near, settings))
    return np.concatenate(pairs) if pairs else np.empty((0, 2), dtype=np.intp)


def _facing(sides: Sides, i: int, near: NDArray[np.intp], settings: JointSettings) -> NDArray[np.intp]:
    """Facing sides of stone i and of each stone nearby."""
    outward, other = sides.outward[i][None, :, None], sides.outward[near][:, None]
    opposite = (outward * other).sum(axis=3) < -np.cos(np.radians(settings.max_angle))
    middle_direction = outward - other
    middle_direction = (
        middle_direction / np.maximum(np.linalg.norm(middle_direction, axis=3), 1e-300)[..., None]
    )
    along = np.stack([-middle_direction[..., 1], middle_direction[..., 0]], axis=3)
    start, stop = sides.start[i][None, :, None], sides.stop[i][None, :, None]
    start2, stop2 = sides.start[near][:, None], sides.stop[near][:, None]
    first = np.sort(np.stack([(start * along).sum(axis=3), (stop * along).sum(axis=3)]), axis=0)
    second = np.sort(np.stack([(start2 * along).sum(axis=3), (stop2 * along).sum(axis=3)]), axis=0)
    low, high = np.maximum(first[0], second[0]), np.minimum(first[1], second[1])
    # the width where it is least over the part where both are: a worn corner opens one end of a joint
    widths = [
        _height(start2, stop2, along, middle_direction, at)
        - _height(start, stop, along, middle_direction, at)
        for at in (low, high)
    ]
    width = np.minimum(np.abs(widths[0]), np.abs(widths[1]))
    facing = opposite & (high - low >= settings.min_overlap) & (width <= settings.max_width)
    which, k, m = np.nonzero(facing)
    return np.column_stack([4 * i + k, 4 * near[which] + m])


def _height(start: Array, stop: Array, along: Array, up: Array, at: Array) -> Array:
    """Height over the middle direction of a side's line at the place `at` along it."""
    a, b = (start * along).sum(axis=3), (stop * along).sum(axis=3)
    h, k = (start * up).sum(axis=3), (stop * up).sum(axis=3)
    run = np.where(np.abs(b - a) > 1e-12, b - a, np.inf)
    out: Array = h + (at - a) / run * (k - h)
    return out


def joint_lines(sides: Sides, settings: JointSettings) -> tuple[JointLine, ...]:
    """Gather facing sides to joints and fit one line to each, in the order of their first stone.

    A bed joint of a whole course is one component: its stones above and below face one another in turn,
    whatever
    the bond. So are the two springers and the voussoir at a skewback.
    """
    pairs = facing_pairs(sides, settings)
    count = 4 * len(sides.start)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    involved = np.unique(pairs)
    groups = [
        [(int(m) // 4, int(m) % 4) for m in involved[label[involved] == component]]
        for component in dict.fromkeys(label[involved].tolist())
    ]
    first = [_fit_line(sides, members, None) for members in groups]
    usual = float(np.median([joint.width for joint in first])) if first else 0.0
    return tuple(_fit_line(sides, members, usual) for members in groups)


def _fit_line(sides: Sides, members: list[tuple[int, int]], usual_width: float | None) -> JointLine:
    """Fit two parallel lines, one to the sides on either hand; the joint is the line half-way between them.

    Unknowns a, b, w of a + b x ± w/2 = y: without the width w, the hand with more corners would draw the line
    to itself. Worn corners stay out if the sound ones reach along the joint. Where fewer than four sound ones
    are left, the usual width of the wall's joints counts as an observation of w, half as precise as a corner.
    Large residuals lose weight (Huber).
    """
    first = members[0]
    longest = max(members, key=lambda m: float(np.linalg.norm(sides.stop[m] - sides.start[m])))
    run = sides.stop[longest] - sides.start[longest]
    run = run / np.linalg.norm(run)
    up = np.array([-run[1], run[0]])
    hand = [1.0 if sides.outward[m] @ sides.outward[first] > 0.0 else -1.0 for m in members]
    hand = [h if sides.outward[first] @ up < 0.0 else -h for h in hand]  # +1: the stone is above the joint
    corners = np.concatenate([[sides.start[m], sides.stop[m]] for m in members])
    hands, owner = np.repeat(hand, 2), np.repeat([m[0] for m in members], 2)
    sound = np.concatenate([sides.sound[m] for m in members])
    centre = corners.mean(axis=0)
    x, y = (corners - centre) @ run, (corners - centre) @ up
    design = np.column_stack([np.ones_like(x), x, 0.5 * hands])
    needed = usual_width is not None and sound.sum() < 4
    usual = np.array([[0.0, 0.0, 0.5]]) if needed else np.empty((0, 3))
    used = sound if _determined(design, sound, len(usual)) else np.ones_like(sound)
    observed = np.append(y[used], usual[:, 2] * (usual_width or 0.0))
    solution = _huber(np.vstack([design[used], usual]), observed)
    residuals = y - design @ solution
    worst = int(np.argmax(np.where(sound, np.abs(residuals), 0.0)))
    direction = run + solution[1] * up
    return JointLine(
        members=tuple(members),
        point=centre + solution[0] * up,
        direction=direction / np.linalg.norm(direction),
        width=float(solution[2]),
        rms=float(np.sqrt((residuals[used] ** 2).mean())),
        largest=float(np.abs(residuals[worst])) if sound[worst] else 0.0,
        worst=int(owner[worst]),
    )


def _determined(design: Array, sound: NDArray[np.bool_], further: int) -> bool:
    """Whether the sound corners and further observations of the width tell the line from end to end."""
    if sound.sum() + further < 3 or (further == 0 and np.ptp(design[sound, 2]) == 0.0):
        return False
    return bool(np.ptp(design[sound, 1]) >= 0.5 * np.ptp(design[:, 1]))


def _huber(design: Array, values: Array) -> Array:
    """Least squares in which residuals beyond 1.5 robust standard deviations lose weight."""
    weights: Array = np.ones(len(values))
    solution: Array = np.zeros(design.shape[1])
    for _ in range(30):
        root = np.sqrt(weights)
        previous = solution
        fitted = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0]
        solution = fitted.astype(np.float64)
        residuals = np.abs(values - design @ solution)
        scale = max(1.4826 * float(np.median(residuals)), 1e-4)
        weights = np.minimum(1.0, 1.5 * scale / np.maximum(residuals, 1e-300))
        if np.abs(solution - previous).max() < 1e-9:
            break
    return solution
