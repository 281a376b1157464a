"""Stages in which a building is built: the stones that stand in each, and what acts on them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ground.errors import SceneError
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Block, Fidelity, Scene


@dataclass(frozen=True)
class Stage:
    """One stage of building.

    Attributes
    ----------
    name : unique among the stages
    scene : the stones that stand in it, where they are drawn, with the loads of the stage, whose clock begins at zero;
        stones that a centring holds are fixed. A stone has the same code and shape in all stages
    """

    name: str
    scene: Scene


def whole_scene(stages: Sequence[Stage]) -> Scene:
    """Return a scene of all stones that stand in any stage, as they are where nothing holds them, without loads."""
    blocks: dict[str, Block] = {}
    for stage in stages:
        for block in stage.scene.blocks:
            if block.code not in blocks or block.fidelity is not Fidelity.FIXED:
                blocks[block.code] = block
    return replace(stages[-1].scene, blocks=tuple(blocks.values()), loads=Loads(), series=())


def check_stages(stages: Sequence[Stage]) -> None:
    """Refuse stages that are none, have the same name, or stones that are thrown.

    Raises
    ------
    SceneError : with the stage
    """
    if not stages:
        raise SceneError("a building without stages", where="stages", remedy="give at least one")
    names = [stage.name for stage in stages]
    for number, stage in enumerate(stages):
        if stage.name in names[:number]:
            raise SceneError("two stages of the same name", where=stage.name, remedy="give each its own")
        thrown = [block.code for block in stage.scene.blocks if any(block.velocity)]
        if thrown:
            raise SceneError(
                f"stone {thrown[0]} begins in motion", where=stage.name, remedy="stones are laid at rest"
            )
