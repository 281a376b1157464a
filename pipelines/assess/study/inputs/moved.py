"""Scenes in which few stones have a slightly different shape than in a sample, made from what stays the same.

A closing of joints takes less than half of the time from survey to scene: faces are fitted, stones simplified and
divided one by one, so that only those that differ need it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Bools, Ints
from mechanics.scene.scene import Block, Scene
from pipelines.assess.study.inputs.realise import Realised, changed_stones
from pipelines.assess.study.inputs.unknowns import Unknown
from pipelines.assess.study.settings import InputTable
from pipelines.ingest.records import surveyed_block
from pipelines.run.assemble import Assembly, assemble_stones, convex_parts_of, stone_about
from pipelines.scene.selection import Groups, StoneModel
from survey.geometry.solids import Solid
from survey.joints.close import closed_solids
from survey.simplify.simplify import simplify


@dataclass(frozen=True)
class MovedStones:
    """Scenes about a sample.

    Attributes
    ----------
    models, groups : stones of the survey, and the codes that the tables of the scene name
    inputs : of the study
    valued : unknowns with their values in the sample
    realised, assembled : the sample
    """

    models: tuple[StoneModel, ...]
    groups: Groups
    inputs: Sequence[InputTable]
    valued: Sequence[tuple[Unknown, float]]
    realised: Realised
    assembled: Assembly

    def scene(self, moves: Mapping[int, float]) -> Scene:
        """Return the scene with some unknowns of geometry, by their number, changed by so much.

        Raises
        ------
        SceneError, GeometryError : a stone or its joints cannot be
        """
        codes = {code for number in moves for code in self.valued[number][0].stones}
        chosen = [model for model in self.models if model.record.code in codes]
        valued = [(one, value + moves.get(k, 0.0)) for k, (one, value) in enumerate(self.valued)]
        changed = {model.record.code: model for model in changed_stones(chosen, self.inputs, valued)}
        models = tuple(changed.get(model.record.code, model) for model in self.realised.models)
        scene, assembled = self.realised.scene, self.assembled
        if assembled.closing.leaves or assembled.stages or scene.loads:
            # loads, and joints of stones that grow into their mortar, depend on the shape of others
            return assemble_stones(scene, models, self.groups).scene
        stones = [
            simplify(surveyed_block(stone_about(model.record, assembled.origin)))
            if model.record.code in changed
            else known
            for model, known in zip(models, assembled.simplified, strict=True)
        ]
        blocks = zip(assembled.scene.blocks, closed_solids(stones, scene.joints), strict=True)
        return replace(assembled.scene, blocks=tuple(_reshaped(block, solid) for block, solid in blocks))

    def reach(self, groups: Sequence[Sequence[str]], touching: Ints) -> Bools:
        """Return which blocks (k, nb) change with the stones of each group: these, and all on their contact planes.

        Parameters
        ----------
        touching : (m, 2) blocks that touch; without a common plane, one was cut to make room for the other
        """
        place = {block.code: k for k, block in enumerate(self.assembled.scene.blocks)}
        planes: dict[int, set[int]] = {}
        for joint in self.assembled.closing.joints:
            if joint.plane >= 0:
                planes.setdefault(joint.plane, set()).update(place[code] for code in joint.stones)
        common = np.eye(len(place), dtype=np.bool_)
        for members in planes.values():
            common[np.ix_(list(members), list(members))] = True
        found = np.zeros((len(groups), len(place)), dtype=np.bool_)
        for row, codes in enumerate(groups):
            found[row] = common[[place[code] for code in codes]].any(axis=0)
        parted = touching[~common[touching[:, 0], touching[:, 1]]]
        for first, second in np.concatenate([parted, parted[:, ::-1]]):
            found[:, second] |= found[:, first]
        return found


def _reshaped(block: Block, solid: Solid) -> Block:
    """Return a block with the shape of a solid, which is nearly its own; the same block where it is its own."""
    if block.faces == solid.faces:
        if np.array_equal(block.vertices, solid.vertices):
            return block
        if not block.parts:
            # so small a change leaves it convex
            return replace(block, vertices=solid.vertices)
    return replace(block, vertices=solid.vertices, faces=solid.faces, parts=convex_parts_of(solid))
