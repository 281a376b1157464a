"""The whole sample: plan, stones, measurement, and its two files."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import cast

import numpy as np

from survey.formats.native.reader import write_moma
from survey.records.survey import OBSERVER, DepthRule, Station, Survey, SurveyHead
from survey.synthetic.frame import TrueStone, WallFrame, build_stone, wall_frame
from survey.synthetic.measure import SIGMA, Measured, add_blunders, measure_stone
from survey.synthetic.window_bay.window import plan_window

__all__ = ["SEED", "Sample", "make_sample", "truth_of", "truth_text", "write_sample"]

SEED = 2000
BLUNDERS = 12  # points with a gross error
SOURCE = "synthetic value, chosen for this sample"
OWN_SOURCE = "synthetic value, as if measured at the open end of the panel"
OWN_DEPTH_SIGMA = 0.01
DEPTHS = {
    "header": (0.50, 0.03),
    "jamb": (0.45, 0.03),
    "keystone": (0.42, 0.02),
    "sill": (0.45, 0.02),
    "springer": (0.45, 0.03),
    "stretcher": (0.38, 0.03),
    "voussoir": (0.42, 0.02),
}  # depth and its standard deviation [m]


@dataclass(frozen=True)
class Sample:
    """A survey with its truth.

    Attributes
    ----------
    survey : contents of the file
    frame : the wall's frame in the site
    stones, measured : the true stones and their measurements, in the same order
    """

    survey: Survey
    frame: WallFrame
    stones: tuple[TrueStone, ...]
    measured: tuple[Measured, ...]


def make_sample(seed: int = SEED) -> Sample:
    """Build the wall and measure it; the same seed gives the same sample.

    Parameters
    ----------
    seed : of Python's own generator, whose stream is the same everywhere
    """
    rng = Random(seed)
    frame = wall_frame()
    plans, own = plan_window(rng), Random(f"depths of {seed}")
    seen = [plan.kind == "header" and not all(plan.joint[1::2]) for plan in plans]
    depths = [
        DEPTHS[p.kind][0] + (own.randint(-4, 4) / 100 if s else 0.0) for p, s in zip(plans, seen, strict=True)
    ]
    stones = [build_stone(plan, round(d, 2), frame, rng) for plan, d in zip(plans, depths, strict=True)]
    measured = [measure_stone(stone, frame, rng) for stone in stones]
    measured = [_with_own_depth(m, st) if s else m for m, st, s in zip(measured, stones, seen, strict=True)]
    measured = add_blunders(measured, [stone.normal for stone in stones], BLUNDERS, rng)
    rules = tuple(DepthRule(kind, depth, sigma, SOURCE) for kind, (depth, sigma) in DEPTHS.items())
    observer = np.round(frame.origin + 9.0 * frame.axes[2] + 0.8 * frame.axes[0] + [0.0, 0.0, 1.2], 4)
    records = tuple(one.record for one in measured)
    head = SurveyHead(
        "window bay (synthetic)", "window.moma", (Station(OBSERVER, observer),), depth_rules=rules
    )
    return Sample(Survey(head, records), frame, tuple(stones), tuple(measured))


def _with_own_depth(measured: Measured, stone: TrueStone) -> Measured:
    """Add the depth of a header at the open end of the panel, where it is visible and measured."""
    return replace(
        measured,
        record=replace(
            measured.record, depth=stone.depth, depth_sigma=OWN_DEPTH_SIGMA, depth_source=OWN_SOURCE
        ),
    )


def truth_of(sample: Sample) -> dict[str, object]:
    """Return the truth in plain lists, rounded far below any tolerance, so that the file is the same everywhere."""
    return {
        "about": "true geometry of window.moma; indices count from 0 in the order of the file",
        "seed": SEED,
        "sigma": SIGMA,
        "frame": {"origin": _rounded(sample.frame.origin), "axes": _rounded(sample.frame.axes)},
        "stones": [_stone_truth(*pair) for pair in zip(sample.stones, sample.measured, strict=True)],
    }


def write_sample(directory: Path) -> tuple[Path, Path]:
    """Write window.moma and truth.json into a folder, created if necessary; return their paths."""
    directory.mkdir(parents=True, exist_ok=True)
    sample = make_sample()
    survey, truth = directory / "window.moma", directory / "truth.json"
    write_moma(sample.survey, survey)
    truth.write_text(truth_text(sample), encoding="utf-8", newline="\n")
    return survey, truth


def truth_text(sample: Sample) -> str:
    """Return the truth as JSON, with one line for each entry and for each stone."""
    truth = truth_of(sample)
    lines = [f'"{key}": {json.dumps(value)}' for key, value in truth.items() if key != "stones"]
    stones = ",\n".join(json.dumps(stone) for stone in cast(list[object], truth["stones"]))
    return "{\n" + ",\n".join([*lines, f'"stones": [\n{stones}\n]']) + "\n}\n"


def _stone_truth(stone: TrueStone, measured: Measured) -> dict[str, object]:
    return {
        "code": stone.plan.code,
        "kind": stone.plan.kind,
        "course": stone.plan.course,
        "normal": _rounded(stone.normal),
        "offset": round(stone.offset, 10),
        "depth": stone.depth,
        "vertices": _rounded(stone.solid.vertices),
        "faces": [list(face) for face in stone.solid.faces],
        "joint_sides": list(stone.plan.joint),
        "half_joints": [round(half, 6) for half in measured.half_joints],
        "worn": measured.worn,
        "worn_corner": measured.worn_corner,
        "worn_points": list(measured.worn_points),
        "worn_vertices": list(measured.worn_vertices),
        "blunders": list(measured.blunders),
    }


def _rounded(values: np.ndarray) -> object:
    return (np.round(values, 10) + 0.0).tolist()
