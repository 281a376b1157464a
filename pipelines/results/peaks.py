"""Peaks of a run by name: the value, its time, its stone or joint, and the value at the end."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.results.result import Largest, Peaks, Result
from mechanics.scene.scene import Fidelity

__all__ = ["PEAKS", "peak_records"]

PEAKS = {
    "displacement": "Displacement",
    "relative_displacement": "Displacement relative to the supports",
    "opening": "Opening of a joint",
    "sliding": "Sliding in a joint",
    "pressure": "Pressure in a joint",
    "von_mises": "Von Mises stress",
    "tension": "Tension in a stone",
    "compression": "Compression in a stone",
    "reaction": "Reaction of the supports against gravity",
    "shear": "Reaction of the supports across gravity",
}
"""Peaks by name, in words."""

_UNITS = {
    **dict.fromkeys(("displacement", "relative_displacement", "opening", "sliding"), "m"),
    **dict.fromkeys(("pressure", "von_mises", "tension", "compression"), "Pa"),
    **dict.fromkeys(("reaction", "shear"), "N"),
}


def peak_records(result: Result) -> dict[str, dict[str, Any] | None]:
    """Return each of PEAKS: `value`, `unit`, `time` [s], `end`, and the codes of its stone, or of those of its joint.

    The codes are in `stones`.

    None where a quantity is not known, as stresses of rigid stones.
    """
    peaks = result.peaks
    if peaks is None:
        return dict.fromkeys(PEAKS)
    codes, last = [body.code for body in result.bodies], _at_end(result, peaks)
    found: dict[str, dict[str, Any] | None] = {}
    for name in PEAKS:
        if name in ("reaction", "shear"):
            one = getattr(peaks, name)
            found[name] = _peak(name, one.value, one.time, one.end, [])
        else:
            record = getattr(peaks, "relative" if name == "relative_displacement" else name)
            found[name] = _largest(name, record, codes, last[name])
    return found


def _peak(name: str, value: float, time: float, end: float, stones: list[str]) -> dict[str, Any]:
    return {"value": value, "unit": _UNITS[name], "time": time, "end": end, "stones": stones}


def _largest(name: str, largest: Largest, codes: Sequence[str], end: float) -> dict[str, Any] | None:
    """Return the largest value of all bodies; None where none is known."""
    known = np.isfinite(largest.value)
    if not known.any():
        return None
    body = int(np.where(known, largest.value, -np.inf).argmax())
    value, partner = float(largest.value[body]), int(largest.partner[body])
    stones = [codes[one] for one in sorted((body, partner)) if one >= 0] if value > 0.0 else []
    return _peak(name, value, float(largest.time[body]), end, stones)


def _at_end(result: Result, peaks: Peaks) -> dict[str, float]:
    joints = result.joints
    values = [body.values for body in result.bodies if body.values is not None]
    moves = np.array([body.fidelity is not Fidelity.FIXED for body in result.bodies])
    way = np.array([np.linalg.norm(body.displacement, axis=1).max() for body in result.bodies])
    return {
        "displacement": _most(way, moves),
        "relative_displacement": _most(peaks.relative_end, np.isfinite(peaks.relative_end)),
        "opening": float(joints.opening.max(initial=0.0)),
        "sliding": float(joints.sliding.max(initial=0.0)),
        "pressure": _most(joints.pressure_max, ~joints.sliver),
        "von_mises": max((one.von_mises_max for one in values), default=0.0),
        "tension": max((one.principal_tension for one in values), default=0.0),
        "compression": max((-one.principal_compression for one in values), default=0.0),
    }


def _most(values: Array, rows: Bools) -> float:
    return float(values[rows].max(initial=0.0))
