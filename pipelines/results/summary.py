"""summary.json: key figures of a run, for people and for programs."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from archmodel.store.run_record import StructureValues
from mechanics.arrays import Bools, Ints
from mechanics.model.model import laws_between
from mechanics.results.contact_result import JointResult
from mechanics.results.joints import SLIVER
from mechanics.results.result import Result
from mechanics.results.stages import StageResult
from mechanics.scene.scene import Fidelity
from pipelines.results.peaks import peak_records, realisations, rocking_stones
from pipelines.results.quantities import quantities
from pipelines.results.stone_values import stress_statistics

_ROUNDING = 1e-13  # of the farthest coordinate [-]: the spacing of floating-point numbers, with reserve

_FIDELITIES = (Fidelity.RIGID, Fidelity.DEFORMABLE, Fidelity.FIXED)


def summarise(
    result: Result,
    *,
    version: str,
    seconds: Mapping[str, float],
    profile: Mapping[str, Any] | None = None,
    structures: Sequence[StructureValues] = (),
) -> dict[str, Any]:
    """Return the contents of summary.json, in SI units.

    Parameters
    ----------
    result : of the simulation
    version : of MOMA
    seconds : wall time by stage, of the simulation and of what went before and after it [s]
    profile : the report of the profile at which it ran
    structures : results of courses, arches and other structures

    Numbers that are not finite become None, as JSON cannot express them.
    """
    stress, peaks = stress_statistics(result), peak_records(result)
    fidelities = [body.fidelity for body in result.bodies]
    summary: dict[str, Any] = {
        "scene": result.scene.name,
        "outcome": str(result.outcome),
        "headline": headline(result),
        "cautions": list(result.cautions),
        "bodies": {str(kind): fidelities.count(kind) for kind in _FIDELITIES},
        "contacts": len(result.contacts.gap),
        "steps": result.steps,
        "time": {
            "simulated": result.time,
            "rest": result.rest_time,
            "wall": sum(seconds.values()),
            "by_stage": dict(seconds),
        },
        "errors": asdict(result.errors) | {"stress": quantities(result).stress_error},
        "solver": {"method": str(result.scene.solver.method), "chosen": dict(result.solvers)},
        "static": None if result.static is None else asdict(result.static),
        "von_mises": None if stress is None else asdict(stress),
        "stress": _stress(result),
        "joints": _joints(result.joints),
        "structures": [
            {"code": structure.code, "kind": structure.kind, **structure.values} for structure in structures
        ],
        "energies": asdict(result.energies),
        "displacement": _displacement(result, peaks["displacement"]),
        "settlement": {"max": float(result.history.settlement[-1])},
        "reaction": {"total_vertical": result.reaction, "weight": result.weight},
        "peaks": peaks,
        "tolerance": {"length": length_tolerance(result)},
        "admissible": indeterminacy(result),
        "rocking": {"stones": rocking_stones(result), "realisations": realisations(result)},
        "loads": [asdict(course) for course in result.scene.loads.courses],
        "stages": [_stage(stage) for stage in result.stages],
        "profile": profile,
        "version": version,
    }
    return {key: _finite(value) for key, value in summary.items()}


def _displacement(result: Result, peak: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the largest displacement of the run, with its time and its stones, and that at the end [m]."""
    end = max(float(np.linalg.norm(body.displacement, axis=1).max()) for body in result.bodies)
    largest = peak or {"value": end, "time": None, "stones": []}
    return {"max": largest["value"], "time": largest["time"], "stones": largest["stones"], "end": end}


def headline(result: Result) -> str:
    """Return the outcome with its reason and its first caution: the first line that a person reads of a run."""
    of = f" of stage {len(result.stages)}, {result.stages[-1].name!r}" if result.stages else ""
    text = ": ".join(filter(None, (f"{result.outcome} after {result.time:.4g} s{of}", result.reason)))
    return "; but ".join(filter(None, (text, *result.cautions[:1])))


def _stage(stage: StageResult) -> dict[str, Any]:
    """Return the numbers of one stage of building."""
    values = asdict(stage)
    names, forces, moved = values.pop("supports"), values.pop("forces"), values.pop("moved")
    measured = {"natural_map": "natural_map", "balance": "balance", "reaction": "reaction_error"}
    values["errors"] = {name: _finite(values.pop(field)) for name, field in measured.items()}
    values["cautions"] = list(values["cautions"])
    values["displacement"] = {"max": values["displacement"], "stone": moved or None}
    values["supports"] = [
        {"stone": name, "force": force} for name, force in zip(names, forces.tolist(), strict=True)
    ]
    return values


def as_json(value: Mapping[str, Any] | list[Any]) -> str:
    """Return JSON text with a final newline; numbers that JSON cannot express are refused.

    >>> print(as_json({"steps": 3}), end="")
    {
      "steps": 3
    }
    """
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _stress(result: Result) -> dict[str, Any] | None:
    """Return the extreme values over all deformable stones, each with its stone; None if none deforms."""
    values = [(body.code, body.values) for body in result.bodies if body.values is not None]
    if not values:
        return None
    pulled, tension = max(values, key=lambda pair: pair[1].principal_tension)
    pressed, compression = min(values, key=lambda pair: pair[1].principal_compression)
    worst, error = max(values, key=lambda pair: pair[1].error)
    used = [
        (code, stress.utilisation, stress.governing)
        for code, stress in values
        if stress.utilisation is not None
    ]
    code, utilisation, governing = max(used, key=lambda entry: entry[1], default=(None, None, None))
    return {
        "tension": {
            "value": tension.principal_tension,
            "stone": pulled,
            "point": tension.tension_point.tolist(),
            "direction": tension.tension_direction.tolist(),
        },
        "compression": {
            "value": compression.principal_compression,
            "stone": pressed,
            "point": compression.compression_point.tolist(),
            "direction": compression.compression_direction.tolist(),
        },
        "utilisation": {"value": utilisation, "stone": code, "governing": governing},
        "error": {"value": error.error, "stone": worst},
    }


def _joints(joints: JointResult) -> dict[str, Any]:
    """Return counts and largest values of the joints; slivers count apart."""
    bearing, slivers = joints.bearing, joints.pressed & joints.sliver
    normal = np.einsum("ji,ji->j", joints.force, joints.frame[:, 0])
    return {
        "count": len(joints),
        "pressed": int(bearing.sum()),
        "parted": int(joints.parted.sum()),
        "out_of_kern": int((bearing & ~joints.in_kern).sum()),
        "largest_opening": float(joints.opening.max(initial=0.0)),
        "largest_sliding": float(joints.sliding.max(initial=0.0)),
        "largest_pressure": float(joints.pressure_max[~joints.sliver].max(initial=0.0)),
        "slivers": {
            "count": int(joints.sliver.sum()),
            "limit": SLIVER,
            "pressed": int(slivers.sum()),
            "force": float(normal[slivers].sum()),
            "largest_force": float(normal[slivers].max(initial=0.0)),
            "largest_pressure": float(joints.pressure_max[joints.sliver].max(initial=0.0)),
        },
    }


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def length_tolerance(result: Result) -> float:
    """Return the length below which movements of a run are within the solver's tolerance [m].

    A step may leave contacts with velocities of `velocity_tolerance` times those that they have to stop, g h. Over the
    steps they add up in rigid scenes; elastic stones are drawn back to their equilibrium.
    """
    scene = result.scene
    h, g = scene.time.step, float(np.linalg.norm(scene.gravity))
    elastic = any(body.fidelity is Fidelity.DEFORMABLE for body in result.bodies)
    allowed = min(scene.solver.velocity_tolerance, 1.0)
    extent = max((float(np.abs(body.position).max()) for body in result.bodies), default=0.0)
    return max(allowed * g * h * h * (1 if elastic else result.steps), _ROUNDING * extent)


def indeterminacy(result: Result) -> dict[str, Any]:
    """Return whether the forces shown are the only ones in balance.

    Between rigid stones forces are known from equilibrium alone, six equations for each stone that moves. Joints
    transmit six numbers each, contact points three; where these are more, other forces are in balance too, unless the
    joints yield elastically.

    Returns
    -------
    dict
        `stones` that are rigid and move, `joints` and `contacts` that carry force, neither elastic nor on deformable
        stones; `of`:
        "joints", "pressures" or None; `text`, None where the forces are the only ones
    """
    fidelity = np.array([str(body.fidelity) for body in result.bodies])
    stiff = fidelity != str(Fidelity.DEFORMABLE)
    stones = int((fidelity == str(Fidelity.RIGID)).sum())
    joints = int((result.joints.pressed & _rigid(result, result.joints.bodies, stiff)).sum())
    carries = np.any(result.contacts.force != 0.0, axis=1)
    contacts = int((carries & _rigid(result, result.contacts.bodies, stiff)).sum())
    of, text = None, None
    if stones and joints > stones:
        of = "joints"
        text = (
            f"the forces of the joints are one admissible state of many: {6 * joints} unknowns of {joints} joints, "
            f"{6 * stones} equations of equilibrium of {stones} rigid stones"
        )
    elif stones and 3 * contacts > 6 * stones:
        of = "pressures"
        text = (
            "the distribution of pressure within the joints is one admissible state of many, between rigid stones; "
            "the resultants of the joints are the only ones in equilibrium"
        )
    return {"stones": stones, "joints": joints, "contacts": contacts, "of": of, "text": text}


def _rigid(result: Result, bodies: Ints, stiff: Bools) -> Bools:
    """Return which pairs of bodies (n, 2) meet without yielding: neither a stone nor their joint deforms."""
    rigid = np.asarray(stiff[bodies].all(axis=1))
    table = laws_between(result.scene)
    if table.sprung:
        springs = np.array([law.sprung for law in table.laws])
        rigid &= ~springs[table.of(bodies)]
    return rigid
