"""Traces that one run of one program leaves for the judge: times, motion, and the contacts of some steps."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mechanics.arrays import Array, Bools, Ints

__all__ = ["Touch", "Trace", "read_trace"]

_ARRAYS = ("cpu", "sweeps", "centre", "frame", "contacts", "solved", "compliant")


@dataclass(frozen=True)
class Touch:
    """The contacts of one step, at the instant where they were found.

    Attributes
    ----------
    body : (nc, 2) candidate and antagonist
    point : (nc, 3) [m]
    frame : (nc, 3, 3) rows n and two tangents; n points from the antagonist to the candidate
    gap : (nc,) [m]
    force : (nc, 3) mean force of the step on the candidate, in that frame [N]
    """

    body: Ints
    point: Array
    frame: Array
    gap: Array
    force: Array


@dataclass(frozen=True)
class Trace:
    """One run.

    Attributes
    ----------
    cpu : (n,) processor time of each step, user and system [s]
    sweeps : (n,) passes of Gauss–Seidel in each step; -1 unknown
    centre : (n+1, nb, 3) a point of each body at the start and after each step [m]
    frame : (n+1, nb, 3, 3) three axes of each body in rows, turning with it; that of the start alone if unknown [-]
    kept : contacts of some steps, counted from 1
    program : name and version of what ran
    contacts : (n,) their number in each step; -1 unknown
    solved : (n,) steps that met their tolerance within their limit of sweeps
    compliant : (n,) steps that needed compliant joints
    """

    cpu: Array
    sweeps: Ints
    centre: Array
    frame: Array
    kept: dict[int, Touch]
    program: str
    contacts: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    solved: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool))
    compliant: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool))


def read_trace(path: Path) -> Trace:
    """Read what a run has written."""
    with np.load(path) as data:
        kept = {
            int(n): Touch(*(data[f"{key}_{n}"] for key in ("body", "point", "frame", "gap", "force")))
            for n in data["kept"]
        }
        arrays = {key: data[key] for key in _ARRAYS}
        return Trace(kept=kept, program=str(data["program"]), **arrays)
