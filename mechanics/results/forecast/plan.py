"""What a scene will need, before it runs: blocks, contacts, unknowns and memory."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mechanics.arrays import Bools, Ints
from mechanics.dynamics.simulation import detector
from mechanics.model.model import Model, build_model
from mechanics.results.forecast.workload import Amounts, amounts
from mechanics.scene.scene import Fidelity, Scene
from mechanics.stones.meshing.quality import MeshReport

__all__ = ["Plan", "plan"]


_NUMBER = 8  # bytes of a floating-point number
_CONTACT_NUMBERS = (
    80  # numbers kept for each contact point: frames, arms, impulses, its part of W, and their copies
)


@dataclass(frozen=True)
class Plan:
    """What a scene will need.

    Attributes
    ----------
    bodies : how many blocks at each fidelity
    pairs : codes of the blocks that touch where the scene begins, pairs of fixed blocks left out
    contacts : contact points where the scene begins
    unknowns : velocities: six for each rigid block, three for each node of a deformable one
    memory : estimate of the largest arrays, dense compliances above all [bytes]
    meshes : how the deformable blocks were meshed, and how well
    loose : codes of the blocks that no chain of touching blocks ties to a fixed one
    amounts : of what the time of a run depends on (mechanics.cost)
    """

    bodies: Mapping[Fidelity, int]
    pairs: tuple[tuple[str, str], ...]
    contacts: int
    unknowns: int
    memory: int
    meshes: MeshReport
    loose: tuple[str, ...]
    amounts: Amounts


def plan(scene: Scene) -> Plan:
    """Mesh the scene and find the contacts in which it begins; nothing moves.

    Raises
    ------
    SceneError, GeometryError, MeshError : if the scene cannot be built
    """
    model, start = build_model(scene)
    detect = detector(model)
    contacts = detect(start, np.zeros(len(scene.blocks)))
    pairs = np.unique(np.sort(contacts.bodies, axis=1), axis=0)
    codes = [block.code for block in scene.blocks]
    fidelities = [block.fidelity for block in scene.blocks]
    rigid = fidelities.count(Fidelity.RIGID)
    return Plan(
        bodies={one: fidelities.count(one) for one in Fidelity},
        pairs=tuple((codes[a], codes[b]) for a, b in pairs),
        contacts=len(contacts),
        unknowns=6 * rigid + 3 * len(start.node),
        memory=_memory(model, contacts.bodies),
        meshes=model.meshes,
        loose=tuple(codes[i] for i in _loose(pairs, model.fixed)),
        amounts=amounts(model, contacts.bodies),
    )


def _memory(model: Model, bodies: Ints) -> int:
    """Bytes of the deformable blocks' compliances, between surface nodes and contacts, and of the contact points."""
    sides = np.bincount(bodies.ravel(), minlength=len(model.mass))
    numbers = _CONTACT_NUMBERS * len(bodies)
    for group in model.elastic_stones.groups:
        numbers += (3 * len(np.unique(group.stone.mesh.facets))) ** 2
        numbers += int(((3 * sides[group.bodies]) ** 2).sum())
    return numbers * _NUMBER


def _loose(pairs: Ints, fixed: Bools) -> Ints:
    """Indices of the bodies that no chain of touching bodies ties to a fixed one."""
    count = len(fixed)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, group = connected_components(links, directed=False)
    return np.flatnonzero(~np.isin(group, group[fixed]))
