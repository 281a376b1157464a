"""From the last state to what is asked of it: stresses, positions, contact forces."""

import numpy as np
from numpy.typing import NDArray

from mechanics.contact.contacts import material_points
from mechanics.elasticity import von_mises
from mechanics.laws.status import contact_status
from mechanics.model import Model
from mechanics.result import BodyResult, ContactResult
from mechanics.simulation import Step
from mechanics.state import State

__all__ = ["body_results", "contact_results", "positions"]

Array = NDArray[np.float64]


def positions(model: Model, state: State) -> tuple[Array, ...]:
    """Points of each body now: the corners of a rigid one, the nodes of a deformable one [m]."""
    return tuple(
        state.node[model.nodes_of(b)]
        if stone is not None
        else state.centre[b] + model.outline[b] @ state.rotation[b].T
        for b, stone in enumerate(model.stones)
    )


def body_results(model: Model, start: State, state: State, balance: Array) -> tuple[BodyResult, ...]:
    """What became of each body; `balance` (nb,) as `imbalance` gives it."""
    results = []
    before, now = positions(model, start), positions(model, state)
    for b, (block, stone) in enumerate(zip(model.scene.blocks, model.stones, strict=True)):
        stress = None if stone is None else stone.stress(now[b], state.centre[b], state.rotation[b])
        results.append(
            BodyResult(
                code=block.code,
                fidelity=block.fidelity,
                reference=before[b],
                position=now[b],
                faces=block.faces if stone is None else tuple(map(tuple, stone.mesh.facets.tolist())),
                cells=np.zeros((0, 4), dtype=np.int64) if stone is None else stone.mesh.cells,
                stress=stress,
                von_mises=None if stress is None else von_mises(stress),
                volume=float(model.volume[b]),
                mass=float(model.mass[b]),
                balance=float(balance[b]),
            )
        )
    return tuple(results)


def contact_results(step: Step) -> ContactResult:
    """The contact points of a step, with their mean force."""
    contacts = step.contacts
    return ContactResult(
        bodies=contacts.bodies,
        point=material_points(contacts, step.after).mean(axis=1),
        normal=contacts.frame[:, 0],
        force=step.force,
        gap=step.gap,
        area=contacts.area,
        status=contact_status(step.internal, step.terms, step.solution.impulse),
    )
