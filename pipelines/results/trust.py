"""Limits of the numbers of a run: lengths within the solver's tolerance, and forces that are one state of many."""

from typing import Any

import numpy as np

from mechanics.model.model import laws_between
from mechanics.results.result import Result
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.scene import Fidelity
from pipelines.arrays import Bools, Ints

__all__ = ["indeterminacy", "length_tolerance"]

_ROUNDING = 1e-13  # of the farthest coordinate [-]: the spacing of floating-point numbers, with reserve


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
        springs = np.array([isinstance(law, ElasticJoint) for law in table.laws])
        rigid &= ~springs[table.of(bodies)]
    return rigid
