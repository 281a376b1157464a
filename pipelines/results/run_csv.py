"""joints.csv, series_stones.csv and series_joints.csv: joints at the end, and chosen stones and joints step by step."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from archmodel.quantities import quantities_of
from mechanics.arrays import Array
from mechanics.results.result import Result
from pipelines.results.stone_values import joint_values
from pipelines.results.table_csv import inert

JOINT_COLUMNS = {name: one.described for name, one in quantities_of("joint").items()}
"""Columns of joints.csv and their meaning."""

SERIES_COLUMNS: Mapping[str, Mapping[str, str]] = {
    "series_stones.csv": {
        "time": "[s]",
        "stone": "code of the stone",
        **dict.fromkeys(("x", "y", "z"), "centre of mass, in the frame of the site [m]"),
        **dict.fromkeys(("dx", "dy", "dz"), "its displacement since the start [m]"),
        **dict.fromkeys(("turn_x", "turn_y", "turn_z"), "rotation vector since the start [°]"),
        **dict.fromkeys(("vx", "vy", "vz"), "velocity of the centre of mass [m/s]"),
        **dict.fromkeys(("spin_x", "spin_y", "spin_z"), "angular velocity [°/s]"),
    },
    "series_joints.csv": {
        "time": "[s]",
        "joint": "its line in joints.csv, from 0",
        **{
            name: JOINT_COLUMNS[name]
            for name in ("first", "second", "opening", "sliding", "force_normal", "force_shear")
        },
    },
}
"""Files, their columns, and the meaning of these."""


def write_joints(path: Path, result: Result, origin: Array) -> None:
    """Write one line for each joint, in the order of `Result.joints`, with places in the frame of the site.

    Parameters
    ----------
    path : the file
    result : of the simulation
    origin : (3,) of the scene, in the frame of the site [m]
    """
    values = joint_values(result.joints, origin)
    columns = [values[name] for name in list(JOINT_COLUMNS)[2:]]
    codes = [body.code for body in result.bodies]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(JOINT_COLUMNS)
        for (first, second), *numbers in zip(result.joints.bodies, *columns, strict=True):
            writer.writerow([inert(codes[first]), inert(codes[second]), *map(_cell, numbers)])


def _cell(value: float) -> str:
    return f"{value + 0.0:.12g}" if np.isfinite(value) else ""


def write_series(folder: Path, result: Result, origin: Array) -> None:
    """Write the series of a result into a folder; nothing where no stones were chosen.

    Parameters
    ----------
    folder : of the results
    result : of the simulation
    origin : (3,) of the scene, in the frame of the site [m]
    """
    series = result.series
    if series is None:
        return
    codes = np.array([body.code for body in result.bodies])
    steps, count = series.centre.shape[:2]
    stones = np.concatenate(
        [
            series.centre + origin,
            series.centre - series.start,
            np.degrees(series.turn),
            series.velocity[..., :3],
            np.degrees(series.velocity[..., 3:]),
        ],
        axis=2,
    ).reshape(steps * count, -1)
    named = codes[np.tile(series.body, steps)]
    _write(folder, "series_stones.csv", np.repeat(series.time, count), zip(named, strict=True), stones)
    histories = series.joints
    joints = np.stack(
        [histories.opening, histories.sliding, histories.normal, histories.shear], axis=2
    ).reshape(-1, 4)
    number = np.tile(histories.joint, steps)
    pair = zip(number, *codes[result.joints.bodies[number]].T, strict=True)
    _write(folder, "series_joints.csv", np.repeat(series.time, len(histories.joint)), pair, joints)


def _write(folder: Path, name: str, time: Array, named: Iterable[Sequence[object]], values: Array) -> None:
    with (folder / name).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(SERIES_COLUMNS[name])
        for instant, words, numbers in zip(time.tolist(), named, (values + 0.0).tolist(), strict=True):
            writer.writerow(
                [f"{instant:.12g}", *map(inert, words), *(f"{number:.12g}" for number in numbers)]
            )
