"""joints.csv: one line per joint, for spreadsheets."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mechanics.arrays import Array
from mechanics.results.contact_result import JointResult
from mechanics.results.result import Result
from pipelines.results.table_csv import inert

__all__ = ["JOINT_COLUMNS", "normal_and_shear", "write_joints"]

JOINT_COLUMNS: Mapping[str, str] = {
    "first": "code of one stone",
    "second": "code of the other",
    "x": "centroid of the joint [m]",
    "y": "centroid of the joint [m]",
    "z": "centroid of the joint [m]",
    "area": "[m²]",
    "force_normal": "resultant across the joint, positive in compression [N]",
    "force_shear": "resultant along the joint [N]",
    "eccentricity": "of the resultant, from the centroid; empty without compression [m]",
    "kern": "up to 1: within the kern; empty without compression [-]",
    "edge": "0: at the centroid, 1: at the edge of the joint; empty without compression [-]",
    "pressure_mean": "[Pa]",
    "pressure_max": "largest of the contact points, each with its neighbours [Pa]",
    "gap": "largest gap [m]",
    "opening": "by how much the gap has grown since the start, at most [m]",
    "sliding": "largest, since the start [m]",
    "slipping": "part of the contact area that slips [-]",
    "open": "part of the contact area that bears nothing [-]",
    "friction_use": "shear over what friction and cohesion can bear; empty where that is nothing [-]",
    "sliver": "1: its area is tiny beside the faces of its stones, and its pressure and kern say nothing",
    "parted": "1: it was closed at the start and is now wide open",
}
"""Columns and their meaning."""


def write_joints(path: Path, result: Result, origin: Array) -> None:
    """Write the table, joints in the order of `Result.joints`, with places in the frame of the site.

    Parameters
    ----------
    path : the file
    result : of the simulation
    origin : (3,) of the scene, in the frame of the site [m]
    """
    columns = _columns(result.joints) | dict(zip("xyz", (result.joints.centroid + origin).T, strict=True))
    codes = [body.code for body in result.bodies]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(JOINT_COLUMNS)
        for number, (first, second) in enumerate(result.joints.bodies):
            numbers = (columns[name][number] for name in list(JOINT_COLUMNS)[2:])
            writer.writerow([inert(codes[first]), inert(codes[second]), *map(_cell, numbers)])


def normal_and_shear(joints: JointResult) -> tuple[Array, Array]:
    """Split the resultants into components normal to the joints, compression positive, and shear; (nj,) each [N]."""
    n = joints.frame[:, 0]
    normal = np.einsum("ji,ji->j", joints.force, n)
    return normal, np.linalg.norm(joints.force - normal[:, None] * n, axis=1)


def _columns(joints: JointResult) -> dict[str, Array]:
    normal, shear = normal_and_shear(joints)
    values = {
        name: getattr(joints, name)
        for name in JOINT_COLUMNS
        if hasattr(joints, name) and name not in ("eccentricity", "sliver", "parted")
    }
    return values | {
        "force_normal": normal,
        "force_shear": shear,
        "eccentricity": np.linalg.norm(joints.eccentricity, axis=1),
        "sliver": joints.sliver.astype(np.float64),
        "parted": joints.parted.astype(np.float64),
    }


def _cell(value: float) -> str:
    return f"{value + 0.0:.12g}" if np.isfinite(value) else ""
