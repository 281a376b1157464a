"""Elastic stones of a scene, grouped by mesh, with the flat arrays of their flight."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.model.deformable import Deformable


@dataclass(frozen=True)
class ElasticGroup:
    """Elastic stones with one mesh and material.

    Attributes
    ----------
    stone : their finite elements
    bodies : (k,)
    nodes : (k, n) their nodes in State.node
    """

    stone: Deformable
    bodies: Ints
    nodes: Ints


@dataclass(frozen=True)
class ElasticStones:
    """The elastic stones of a scene.

    Attributes
    ----------
    groups : of equal stones
    start : (nb+1,) nodes of each body in State.node
    reference : (nn, 3) undeformed places, body axes [m]
    projector : (nn, 6, 3) as mechanics.model._kernels.rigid_part takes it
    """

    groups: tuple[ElasticGroup, ...]
    start: Ints
    reference: Array
    projector: Array


def elastic_stones(stones: Sequence[Deformable | None]) -> ElasticStones:
    """Pack the stones (nb); None where a body is not elastic."""
    counts = [0 if stone is None else len(stone.mesh.nodes) for stone in stones]
    start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    members: dict[int, list[int]] = {}
    for b, stone in enumerate(stones):
        if stone is not None:
            members.setdefault(id(stone), []).append(b)
    groups = []
    for bodies in members.values():
        first_stone = stones[bodies[0]]
        assert first_stone is not None
        rows = start[bodies][:, None] + np.arange(len(first_stone.mesh.nodes))
        groups.append(ElasticGroup(first_stone, np.array(bodies, dtype=np.int64), rows))
    meshed = [stone for stone in stones if stone is not None]
    return ElasticStones(
        tuple(groups),
        start,
        np.concatenate([np.zeros((0, 3)), *(stone.mesh.nodes for stone in meshed)]),
        np.concatenate([np.zeros((0, 6, 3)), *(_by_node(stone) for stone in meshed)]),
    )


def _by_node(stone: Deformable) -> Array:
    return stone.projector.reshape(6, -1, 3).transpose(1, 0, 2)
