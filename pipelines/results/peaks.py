"""Peaks of a run by name: the value, its time, its stone or joint, and the value at the end."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from archmodel.quantities import quantities_of
from mechanics.arrays import Array, Bools
from mechanics.dynamics.outcome import Outcome
from mechanics.results.result import Largest, Peaks, Result
from mechanics.scene.scene import Fidelity
from survey.conventions import MOST, PER_MILLE

_LIFTED = PER_MILLE  # opening over the width of a stone, an angle [rad], from which it rocks
_CLOSED = MOST  # part of its largest opening that a joint has in the end, below which it has closed again [-]
_CHAOTIC = (
    "relative_displacement",
    "opening",
    "sliding",
    "shear",
)  # peaks of which rocking makes one realisation


def peak_records(result: Result) -> dict[str, dict[str, Any] | None]:
    """Return each peak of the catalogue: `value`, `unit`, `time` [s], `end`, and `stones`.

    These are the codes of its stone, or of both stones of its joint.

    None where a quantity is not known, as stresses of rigid stones.
    """
    peaks = result.peaks
    if peaks is None:
        return dict.fromkeys(quantities_of("peak"))
    codes, last = [body.code for body in result.bodies], _at_end(result, peaks)
    records: dict[str, dict[str, Any] | None] = {}
    for name in quantities_of("peak"):
        if name in ("reaction", "shear"):
            peak = getattr(peaks, name)
            records[name] = _peak(name, peak.value, peak.time, peak.end, [])
        else:
            record = getattr(peaks, "relative" if name == "relative_displacement" else name)
            records[name] = _largest(name, record, codes, last[name])
    return records


def _peak(name: str, value: float, time: float, end: float, stones: list[str]) -> dict[str, Any]:
    return {
        "value": value,
        "unit": quantities_of("peak")[name].unit,
        "time": time,
        "end": end,
        "stones": stones,
    }


def _largest(name: str, largest: Largest, codes: Sequence[str], end: float) -> dict[str, Any] | None:
    """Return the largest value of all bodies; None where none is known."""
    finite = np.isfinite(largest.value)
    if not finite.any():
        return None
    body = int(np.where(finite, largest.value, -np.inf).argmax())
    value, partner = float(largest.value[body]), int(largest.partner[body])
    stones = [codes[number] for number in sorted((body, partner)) if number >= 0] if value > 0.0 else []
    return _peak(name, value, float(largest.time[body]), end, stones)


def _at_end(result: Result, peaks: Peaks) -> dict[str, float]:
    joints = result.joints
    values = [body.values for body in result.bodies if body.values is not None]
    moves = np.array([body.fidelity is not Fidelity.FIXED for body in result.bodies])
    path = np.array([np.linalg.norm(body.displacement, axis=1).max() for body in result.bodies])
    return {
        "displacement": _most(path, moves),
        "relative_displacement": _most(peaks.relative_end, np.isfinite(peaks.relative_end)),
        "opening": float(joints.opening.max(initial=0.0)),
        "sliding": float(joints.sliding.max(initial=0.0)),
        "pressure": _most(joints.pressure_max, ~joints.sliver),
        "von_mises": max((value.von_mises_max for value in values), default=0.0),
        "tension": max((value.principal_tension for value in values), default=0.0),
        "compression": max((-value.principal_compression for value in values), default=0.0),
    }


def _most(values: Array, rows: Bools) -> float:
    return float(values[rows].max(initial=0.0))


def rocking_stones(result: Result) -> list[str]:
    """Return the codes of stones whose joints open under a motion of supports, and close again or still move."""
    if result.peaks is None or not result.scene.loads.motions:
        return []
    moving = result.outcome in (Outcome.MOVING, Outcome.UNDECIDED)
    last = np.full(len(result.bodies), np.inf)  # a stone that has left all others does not rock
    last[np.unique(result.joints.bodies)] = 0.0
    np.maximum.at(last, result.joints.bodies.ravel(), np.repeat(result.joints.opening, 2))
    rocking = []
    for number, block in enumerate(result.scene.blocks):
        most = float(result.peaks.opening.value[number])
        lifted = most > _LIFTED * float(np.ptp(block.vertices, axis=0).min())
        back = moving or last[number] < _CLOSED * most
        if block.fidelity is not Fidelity.FIXED and lifted and back:
            rocking.append(block.code)
    return rocking


def realisations(result: Result) -> list[dict[str, Any]]:
    """Return the step [s] and the peaks of a run, and of the same run at half the step where it was repeated."""
    runs = [result] if result.repeated is None else [result, result.repeated]
    return [
        {
            "step": run.scene.time.step,
            "outcome": str(run.outcome),
            "peaks": {
                name: record["value"] for name, record in peak_records(run).items() if record is not None
            },
        }
        for run in runs
    ]


def rocking_caution(result: Result) -> str:
    """Return what the peaks of a run with stones that rock are worth, in words, and those of a repeated run.

    Nothing is said where no stone rocks and the run was not repeated.
    """
    stones = rocking_stones(result)
    if not stones and result.repeated is None:
        return ""
    text = "no stone rocks, and the run was repeated at half the step"
    if stones:
        text = f"{len(stones)} stones rock, e.g. {stones[0]}: their peaks are one realisation of a chaotic motion"
    if result.repeated is None:
        return f"{text}, and another step gives others; moma run --repeat-half-step tells how far apart"
    first, second = realisations(result)
    units = {"m": (1e3, "mm"), "N": (1e-3, "kN")}
    parts = []
    for name in _CHAOTIC:
        if name in first["peaks"] and name in second["peaks"]:
            peak = quantities_of("peak")[name]
            factor, unit = units[str(peak.unit)]
            values = (f"{factor * record['peaks'][name]:.3g}" for record in (first, second))
            parts.append(f"{peak.label.lower()} {' and '.join(values)} {unit}")
    steps = " and ".join(f"{1e3 * record['step']:.3g}" for record in (first, second))
    outcome = "" if first["outcome"] == second["outcome"] else f"the second run is {second['outcome']}; "
    return f"{text}; with steps of {steps} ms: {outcome}{', '.join(parts)}"
