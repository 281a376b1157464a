"""How much of everything a scene has, on which the time of its run depends."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Ints
from mechanics.delassus.multifrontal import fronts
from mechanics.model.model import Model

__all__ = ["Amounts", "amounts"]


@dataclass(frozen=True)
class Amounts:
    """What a run has to handle; the amounts of deformable stones are zero in rigid scenes.

    Attributes
    ----------
    stones : all blocks
    contacts : contact points where the scene begins
    distinct_nodes, nodes : of the meshes that have to be made, and of all deformable stones
    condensed : numbers that pass through the factors of ŵ to condense every distinct stone on the nodes that touch,
        3k n^(4/3) with k of n nodes, as the factors of a solid have about n^(4/3) numbers
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


def amounts(model: Model, bodies: Ints) -> Amounts:
    """The amounts of a model whose contacts are between `bodies` (nc, 2)."""
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
    front, factor, flops = _factors(model, bodies)
    nodes = int(model.elastic_stones.start[-1])
    return Amounts(stones, contacts, distinct, nodes, condensed, blocks, front, factor, flops)


def _factors(model: Model, bodies: Ints) -> tuple[int, float, float]:
    """Number of fronts of W + Θ, numbers in its factors, and operations."""
    order = np.argsort(bodies.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(bodies.ravel(), minlength=len(model.mass)))[:-1]
    sides = [own for own, fixed in zip(np.split(order, ends), model.fixed, strict=True) if not fixed]
    pattern = fronts(bodies, [own // 2 for own in sides if len(own)])
    pivots = pattern.layout.width.astype(float)
    others = np.diff(pattern.layout.dptr) - pivots
    flops = 2.0 / 3.0 * pivots**3 + 2.0 * pivots**2 * others + 2.0 * pivots * others**2
    return len(pivots), float(pattern.size), float(flops.sum())
