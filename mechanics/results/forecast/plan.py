"""Size of a scene before it runs: blocks, contacts, unknowns, memory, and the amounts on which its time depends."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mechanics.arrays import Array, Bools, Ints
from mechanics.contact.contacts import gaps
from mechanics.delassus.assembly import side_kinds
from mechanics.delassus.mixed_form import mixed_fronts
from mechanics.dynamics.contact_search import contacts_as_drawn
from mechanics.model.model import Model, build_model
from mechanics.scene.scene import Fidelity, Scene
from mechanics.scene.state import State
from mechanics.stones.meshing.quality import MeshReport

_NUMBER = 8  # size of a floating-point number [bytes]
_SHUT = 1e-6  # gap over the smaller stone's width that rounding leaves of a closed joint [-]
_CONTACT_NUMBERS = 80  # numbers kept for each contact point: frame, arms, impulses, its part of W, and copies


@dataclass(frozen=True)
class Amounts:
    """Amounts of work in a run; those of deformable stones are zero in rigid scenes.

    Attributes
    ----------
    stones : all blocks
    contacts : contact points at the start
    distinct_nodes, nodes : of the meshes to be made, and of all deformable stones
    condensed : numbers read from the factors of ŵ to condense every distinct stone on the nodes that touch:
        3k n^(4/3) for k of n nodes, as the factors of a solid have about n^(4/3) numbers
    blocks : numbers in the compliances of all deformable stones between their contact sides
    fronts : groups of contacts that are eliminated together when W + Θ is factorised
    factor, flops : numbers in these factors, and floating-point operations that they take
    """

    stones: int
    contacts: int
    distinct_nodes: int = 0
    nodes: int = 0
    condensed: float = 0.0
    blocks: float = 0.0
    fronts: int = 0
    factor: float = 0.0
    flops: float = 0.0


@dataclass(frozen=True)
class Plan:
    """Size of a scene.

    Attributes
    ----------
    bodies : how many blocks at each fidelity
    pairs : codes of the blocks that touch at the start, without pairs of fixed blocks
    open_pairs : how many of these are open, and by how much at most [m]
    contacts : contact points at the start
    unknowns : velocities: six for each rigid block, three for each node of a deformable one
    memory : estimate of the largest arrays, mainly dense compliances [bytes]
    meshes : how the deformable blocks were meshed, and how well
    loose : codes of the blocks that no chain of touching blocks ties to a fixed one
    amounts : on which the time of a run depends (`expected_cost`)
    """

    bodies: Mapping[Fidelity, int]
    pairs: tuple[tuple[str, str], ...]
    open_pairs: tuple[int, float]
    contacts: int
    unknowns: int
    memory: int
    meshes: MeshReport
    loose: tuple[str, ...]
    amounts: Amounts


def plan(scene: Scene) -> Plan:
    """Mesh the scene and detect its contacts at the start; nothing moves.

    Raises
    ------
    SceneError, GeometryError, MeshError : if the scene cannot be built
    """
    model, start = build_model(scene)
    contacts = contacts_as_drawn(model, start)
    pairs, pair = np.unique(np.sort(contacts.bodies, axis=1), axis=0, return_inverse=True)
    narrowest = np.full(len(pairs), np.inf)
    np.minimum.at(narrowest, pair.ravel(), gaps(contacts, start))
    ajar = narrowest[narrowest > _SHUT * np.minimum(*model.surfaces.size[pairs.T])]
    codes = [block.code for block in scene.blocks]
    fidelities = [block.fidelity for block in scene.blocks]
    rigid = fidelities.count(Fidelity.RIGID)
    return Plan(
        bodies={fidelity: fidelities.count(fidelity) for fidelity in Fidelity},
        pairs=tuple((codes[a], codes[b]) for a, b in pairs),
        open_pairs=(len(ajar), float(ajar.max(initial=0.0))),
        contacts=len(contacts),
        unknowns=6 * rigid + 3 * len(start.node),
        memory=_memory(model, contacts.bodies),
        meshes=model.meshes,
        loose=tuple(codes[i] for i in _loose(pairs, model.fixed)),
        amounts=_amounts(model, contacts.bodies, start.centre),
    )


def loose_blocks(model: Model, start: State) -> tuple[str, ...]:
    """Return the codes of the blocks that no chain of touching blocks ties to a fixed one at the start."""
    pairs = contacts_as_drawn(model, start).bodies
    return tuple(model.scene.blocks[i].code for i in _loose(pairs, model.fixed))


def _memory(model: Model, bodies: Ints) -> int:
    """Return the bytes of the compliances of deformable blocks, and of the contact points."""
    sides = np.bincount(bodies.ravel(), minlength=len(model.mass))
    numbers = _CONTACT_NUMBERS * len(bodies)
    for group in model.elastic_stones.groups:
        numbers += (3 * len(np.unique(group.stone.mesh.facets))) ** 2
        numbers += int(((3 * sides[group.bodies]) ** 2).sum())
    return numbers * _NUMBER


def _loose(pairs: Ints, fixed: Bools) -> Ints:
    """Return the indices of the bodies that no chain of touching bodies ties to a fixed one."""
    count = len(fixed)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, group = connected_components(links, directed=False)
    return np.flatnonzero(~np.isin(group, group[fixed]))


def _amounts(model: Model, bodies: Ints, centre: Array) -> Amounts:
    """Return the amounts of a model with contacts between `bodies` (nc, 2)."""
    stones, contacts = len(model.mass), len(bodies)
    if model.rigid_only:
        return Amounts(stones, contacts)
    sides = np.bincount(bodies.ravel(), minlength=stones)
    distinct, condensed, blocks = 0, 0.0, 0.0
    for group in model.elastic_stones.groups:
        nodes, touched = len(group.stone.mesh.nodes), len(np.unique(group.stone.mesh.facets))
        distinct += nodes
        condensed += 3.0 * min(touched, int(sides[group.bodies].sum())) * nodes ** (4.0 / 3.0)
        blocks += float(((3.0 * sides[group.bodies]) ** 2).sum())
    front, factor, flops = _factors(model, bodies, centre)
    nodes = int(model.elastic_stones.start[-1])
    return Amounts(stones, contacts, distinct, nodes, condensed, blocks, front, factor, flops)


def _factors(model: Model, bodies: Ints, centre: Array) -> tuple[int, float, float]:
    """Return the number of fronts of W + Θ, the numbers in its factors, and the operations to make them."""
    pattern = mixed_fronts(bodies, side_kinds(model, bodies), centre)
    pivots = pattern.layout.width.astype(float)
    others = np.diff(pattern.layout.dptr) - pivots
    flops = 2.0 / 3.0 * pivots**3 + 2.0 * pivots**2 * others + 2.0 * pivots * others**2
    return len(pivots), float(pattern.size), float(flops.sum())
