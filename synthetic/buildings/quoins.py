"""Two walls that meet at a corner, bonded by quoins with two visible sides."""

import math
from dataclasses import replace
from random import Random

import numpy as np

from survey.records.survey import OBSERVER, Station
from synthetic.bond import Bed, Piece, fill_run, planned, upright
from synthetic.building import Draft, SyntheticBuilding, flat_stone, measured_building
from synthetic.buildings.walls import bed_heights
from synthetic.frame import WallFrame, build_stone

SECOND = "second wall"
"""Name of the station from which the second wall was seen."""

_DEPTHS = {"header": 0.48, "quoin": 0.40, "stretcher": 0.36}  # of each kind [m]
_QUOIN = (0.72, 0.40)  # length of a quoin's long and short side [m]
_FOOT = np.array([21.3, 17.9, 4.2])  # of the corner in the site [m]
_AZIMUTH = math.radians(11.0)  # of the first wall against the x axis


def corner(courses: int = 8, length: float = 3.0, seed: int = 1) -> SyntheticBuilding:
    """Build two walls that meet at a right angle, and measure their outer faces.

    Quoins lie with their long side in either wall in turn. They are surveyed by their face in the first wall, with the
    depth that is visible in the second.

    Parameters
    ----------
    courses : of both walls
    length : of each wall [m]
    seed : of Python's own generator, whose stream is the same everywhere

    Returns
    -------
    Building. Codes are A<course>-<number> in the first wall, B… in the second, Q<course> for quoins
    """
    rng = Random(seed)
    along = np.array([math.cos(_AZIMUTH), math.sin(_AZIMUTH), 0.0])
    into, up = np.array([-along[1], along[0], 0.0]), np.array([0.0, 0.0, 1.0])
    first = WallFrame(_FOOT, np.array([along, up, -into]))
    second = WallFrame(_FOOT, np.array([-into, up, -along]))
    heights = bed_heights(rng, courses)
    drafts: list[Draft] = []
    below: dict[str, list[float]] = {"A": [], "B": []}
    for course in range(1, courses + 1):
        beds = Bed(heights[course - 1]), Bed(heights[course])
        middle = 0.5 * (beds[0].height + beds[1].height)
        long, deep = _QUOIN if course % 2 else _QUOIN[::-1]
        quoin = Piece("quoin", upright(0.0, middle), upright(long, middle))
        plan = planned(f"Q{course:02d}", quoin, *beds, course)[0]
        drafts.append(Draft(flat_stone(plan, deep, first), first, plan.corners, seen_depth=True))
        # the second wall runs to the left from the corner; above, the quoin's sides change places
        ends = {"A": (long, length), "B": (-length, -deep)}
        above = {"A": deep, "B": -long}
        for letter, frame in (("A", first), ("B", second)):
            start, stop = ends[letter]
            avoid = sorted({*below[letter], above[letter]})
            run = fill_run(rng, upright(start, middle), upright(stop, middle), middle, avoid)
            below[letter] = sorted({line.at(beds[1].height) for p in run for line in (p.left, p.right)})
            for k, piece in enumerate(run, start=1):
                plan = planned(f"{letter}{course:02d}-{k:02d}", piece, *beds, course)[0]
                stone = build_stone(plan, _DEPTHS[plan.kind], frame, rng)
                draft = Draft(stone, frame, plan.corners, zone=f"wall {letter}")
                drafts.append(draft if letter == "A" else replace(draft, station=SECOND))
    stations = [
        Station(name, np.round(frame.place(np.array([[s, 1.5]]), 8.0)[0], 4))
        for name, frame, s in ((OBSERVER, first, 1.0), (SECOND, second, -1.0))
    ]
    base = [draft.stone.plan.code for draft in drafts if draft.stone.plan.course == 1]
    return measured_building("corner of two walls", drafts, _DEPTHS, stations, base, rng)
