"""A bonded masonry tower of any number of blocks, and an earthquake for it; both synthetic.

The tower is a hollow square shaft, 5.3 m wide and 25 m high, of walls 0.7 m thick: the size of a civic tower. Its walls
have several leaves that headers tie together in every fourth course; courses are bonded at their corners, and openings
have lintels. All joints are closed and dry.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.ground_motion import Component, GroundMotion
from mechanics.scene.loads.record_processing import without_drift
from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import box
from mechanics.stones.materials import Material

__all__ = ["BASE", "Tower", "earthquake", "expected_contacts", "strongest", "tower", "tower_blocks"]

BASE = "base"
"""Code of the ground on which the tower stands."""

_WIDTH, _HEIGHT = 5.3, 25.0  # of the tower [m]
_STONE = Material("synthetic limestone", density=2200.0, young=5e9, poisson=0.2)
_USUAL, _LEAVES, _ACROSS = 11_500, 3, 22  # blocks of the tower with so many leaves, and so many units across
_TIES = 4  # courses of which one has headers
# wall, middle along it, width, sill and head: openings as parts of width and height of the tower
_OPENINGS = (
    (0, 0.5, 0.20, 0.00, 0.10),
    (1, 0.5, 0.14, 0.28, 0.36),
    (3, 0.5, 0.14, 0.28, 0.36),
    (0, 0.5, 0.14, 0.52, 0.60),
    (2, 0.5, 0.14, 0.52, 0.60),
    *((wall, 0.5, 0.24, 0.82, 0.93) for wall in range(4)),
)


@dataclass(frozen=True)
class Tower:
    """Blocks on a lattice.

    Attributes
    ----------
    low, high : (n, 3) opposite corners, in units
    unit : (3,) of the lattice [m]
    """

    low: Ints
    high: Ints
    unit: Array


def tower(blocks: int = _USUAL) -> Tower:
    """Return the tower in about as many blocks; the finer, the more leaves."""
    fine = (blocks / _USUAL) ** (1 / 3)
    leaves = max(1, round(_LEAVES * fine))
    # an even number, so that joints of one course lie over the middles of stones of another
    across = max(2 * round(_ACROSS * fine / 2), 2 * leaves + 6)
    courses = max(12, round(100 * fine))
    for _ in range(2):
        number = sum(1 for _ in _stones(across, leaves, courses))
        courses = max(12, round(courses * blocks / number))
    stones = np.array(list(_stones(across, leaves, courses)), dtype=np.int64)
    unit = np.array([_WIDTH / across, _WIDTH / across, _HEIGHT / courses])
    return Tower(stones[:, :3], stones[:, 3:], unit)


def tower_blocks(shape: Tower) -> tuple[Block, ...]:
    """Return the ground, and the blocks of a tower, course by course."""
    edge = 0.1 * _WIDTH
    ground = box(
        BASE, (-edge, -edge, -0.5), (_WIDTH + edge, _WIDTH + edge, 0.0), _STONE, fidelity=Fidelity.FIXED
    )
    corners = zip(shape.low * shape.unit, shape.high * shape.unit, strict=True)
    return (ground, *(box(f"T{n + 1}", low, high, _STONE) for n, (low, high) in enumerate(corners)))


def expected_contacts(shape: Tower) -> int:
    """Count the contact points of a tower: four for each pair of blocks with a common rectangle."""
    owner = np.full(shape.high.max(axis=0), -1)
    for n, (low, high) in enumerate(zip(shape.low.tolist(), shape.high.tolist(), strict=True)):
        owner[low[0] : high[0], low[1] : high[1], low[2] : high[2]] = n
    pairs = len(np.unique(owner[:, :, 0])) - 1  # with the ground; where no stone stands is no block
    for axis in range(3):
        one, other = (np.delete(owner, end, axis=axis) for end in (-1, 0))
        touch = (one != other) & (one >= 0) & (other >= 0)
        pairs += len(np.unique(one[touch] * (len(shape.low) + 1) + other[touch]))
    return 4 * pairs


def _stones(across: int, leaves: int, courses: int) -> Iterator[tuple[int, ...]]:
    """Yield the corners of each stone, low and high."""
    openings = [
        (
            wall,
            round((middle - width / 2) * across),
            round((middle + width / 2) * across),
            round(sill * courses),
            round(head * courses),
        )
        for wall, middle, width, sill, head in _OPENINGS
    ]
    for course in range(courses):
        for a, b in pairwise(_leaves(leaves, course)):
            for wall, start, stop in _sides(a, b, across, course % 2 == 1):
                across_wall = (a, b) if wall in (0, 3) else (across - b, across - a)
                for first, last in _run(start, stop, [one[1:] for one in openings if one[0] == wall], course):
                    x, y = ((first, last), across_wall) if wall in (0, 2) else (across_wall, (first, last))
                    yield x[0], y[0], course, x[1], y[1], course + 1


def _leaves(leaves: int, course: int) -> list[int]:
    """Return the faces between the leaves of a course, from outside; headers of every fourth course join two."""
    if course % _TIES != _TIES - 1 or leaves == 1:
        return list(range(leaves + 1))
    first = (course // _TIES) % 2
    return sorted({0, *range(first, leaves + 1, 2), leaves})


def _sides(a: int, b: int, across: int, turned: bool) -> list[tuple[int, int, int]]:
    """Return wall, start and stop of the four sides of a leaf from a to b; each ends where the next one begins.

    Walls 0 and 2 run along x in front and behind, 1 and 3 along y to the right and to the left. In every second course
    they meet the other way round.
    """
    near, far = (a, across - b), (b, across - a)
    if turned:
        return [(0, *far), (1, *far), (2, *near), (3, *near)]
    return [(0, *near), (1, *near), (2, *far), (3, *far)]


def _run(start: int, stop: int, openings: list[tuple[int, ...]], course: int) -> Iterator[tuple[int, int]]:
    """Yield the ends of the stones of a side: two units long, the last one two or three; lintels bear on one unit."""
    joints = [*range(start, stop - 1, 2), stop]
    pieces = list(pairwise(joints))
    for left, right, sill, head in openings:
        if sill <= course < head:
            pieces = [
                part
                for first, last in pieces
                for part in ((first, min(last, left)), (max(first, right), last))
                if part[0] < part[1]
            ]
        elif course == head:
            left, right = left - 1, right + 1
            pieces = [
                part
                for first, last in pieces
                for part in ((first, min(last, left)), (max(first, right), last))
                if part[0] < part[1]
            ]
            pieces.append((left, right))
    yield from sorted(pieces)


# --- the earthquake ---

_STEP, _DURATION = 0.005, 30.0  # of the record [s]
# of both horizontal components and the vertical one: peak acceleration [m/s²], frequency [Hz] and damping [-] of the
# ground in the spectrum of Kanai (1957) and Tajimi (1960)
_GROUND = ((3.5, 2.5, 0.6), (3.0, 2.5, 0.6), (1.5, 6.0, 0.6))
_LOW_CUT = (0.25, 0.6)  # filter of Clough & Penzien (1975): frequency [Hz] and damping [-]
_HIGH_CUT = 25.0  # [Hz]
_RISE, _FALL, _DECAY = 4.0, 14.0, 0.25  # envelope of Jennings, Housner & Tsai (1968): [s], [s], [1/s]


def earthquake(seed: int = 1) -> tuple[Accelerogram, ...]:
    """Return a synthetic record of 30 s in x, y and z: filtered white noise under an envelope, the same for a seed."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, _DURATION + _STEP / 2, _STEP)
    envelope = np.minimum(1.0, (time / _RISE) ** 2) * np.exp(-_DECAY * np.maximum(time - _FALL, 0.0))
    frequency = np.arange(len(time) // 2 + 1) / (len(time) * _STEP)
    records = []
    for name, (peak, ground, damping) in zip("xyz", _GROUND, strict=True):
        noise = np.fft.rfft(rng.normal(size=len(time)))
        moved = np.fft.irfft(noise * _amplitude(frequency, ground, damping), len(time)) * envelope
        record = Accelerogram(_STEP, moved, f"synthetic {name}, seed {seed}", "synthetic")
        record = without_drift(record)
        scaled = record.acceleration * (peak / record.peak)
        records.append(Accelerogram(_STEP, scaled, record.name, record.source))
    return tuple(records)


def _amplitude(frequency: Array, ground: float, damping: float) -> Array:
    """Return the square root of the spectral density of Kanai and Tajimi, without what is too slow or too fast."""
    f, (low, width) = frequency / ground, _LOW_CUT
    s = frequency / low
    soil = (1 + (2 * damping * f) ** 2) / ((1 - f**2) ** 2 + (2 * damping * f) ** 2)
    slow = s**4 / ((1 - s**2) ** 2 + (2 * width * s) ** 2)
    amplitude: Array = np.sqrt(soil * slow) * (frequency < _HIGH_CUT)
    return amplitude


def strongest(records: tuple[Accelerogram, ...], duration: float, rest: float) -> GroundMotion:
    """Return the strongest part of a record, of most ∫ a² dt, as a motion of the ground after a rest [s].

    It begins from the velocity that the ground has there, as seen by an observer who moves with it.
    """
    count = round(duration / records[0].dt) + 1
    power = np.sum([record.acceleration**2 for record in records], axis=0)
    total = np.concatenate([[0.0], np.cumsum(power)])
    first = int(np.argmax(total[count:] - total[:-count]))
    parts = [
        Accelerogram(
            one.dt,
            one.acceleration[first : first + count],
            one.name,
            f"{one.source}, from {first * one.dt:.3f} s",
        )
        for one in records
    ]
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    components = tuple(Component(axis, part) for axis, part in zip(axes, parts, strict=True))
    return GroundMotion(frozenset({BASE}), components, start=rest)
