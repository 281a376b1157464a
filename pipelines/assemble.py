"""From the database to a scene: selected stones → hexahedra → closed joints → blocks.

A stone that came as a closed solid stays that solid where joints are left open; only their closing needs hexahedra.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from mechanics.meshing.elements import Element
from mechanics.scene import Block, Fidelity, Scene
from pipelines.joint_laws import law_rules
from pipelines.local_frame import entry_about, local_origin, stone_about
from pipelines.scene_loads import build_loads, thrown
from pipelines.scenefile import MeshSettings, SceneFile
from pipelines.selection import Groups, StoneModel, select_groups, select_stones
from pipelines.stone_records import surveyed_block
from survey.blocky import simplify
from survey.extrusion import SurveyedBlock
from survey.joints import ClosingReport, close_joints
from survey.solids import Solid

__all__ = ["Assembly", "assemble", "assemble_stones"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Assembly:
    """A scene that can be simulated, and how it came about.

    Attributes
    ----------
    scene : for `mechanics.simulate`, with places counted from `origin`
    models : the stones as surveyed, in the order of the scene's blocks
    closing : what closing the joints has changed; None if they stay open
    towards : (3,) mean normal of the faces, from the wall to the observer [-]
    origin : (3,) of the scene, in the frame of the site [m]
    """

    scene: Scene
    models: tuple[StoneModel, ...]
    closing: ClosingReport | None
    towards: Array
    origin: Array


def assemble(scene: SceneFile, session: Session) -> Assembly:
    """Build the scene of a scene file from the stones in the database.

    Raises
    ------
    SceneError : a key names no stone, a stone has no material, or a load does not suit its stones
    GeometryError : a stone cannot be made a hexahedron where it has to be, or its joints cannot be closed
    """
    models = select_stones(scene, session)
    return assemble_stones(scene, models, select_groups(scene, session, models))


def assemble_stones(scene: SceneFile, models: tuple[StoneModel, ...], groups: Groups) -> Assembly:
    """As `assemble`, of stones that have been selected; the database is not needed."""
    origin = local_origin([model.record for model in models])
    stones = [surveyed_block(stone_about(model.record, origin)) for model in models]
    solids: Sequence[Solid]
    if scene.joints is None:
        solids, closing = [_open(stone) for stone in stones], None
    else:
        closed = close_joints(stones, scene.joints)
        solids, closing = closed.solids, closed.report
    meshes = _meshes(scene, groups)
    blocks = tuple(
        _block(model, solid, meshes.get(solid.code, scene.mesh))
        for model, solid in zip(models, solids, strict=True)
    )
    return Assembly(
        scene=_scene(scene, blocks, groups, origin),
        models=models,
        closing=closing,
        towards=_facing(stones),
        origin=origin,
    )


def _scene(scene: SceneFile, blocks: Sequence[Block], groups: Groups, origin: Array) -> Scene:
    """The scene of the blocks, with the laws and loads that the file gives them."""
    document, by_code = scene.document, {block.code: block for block in blocks}
    materials = {block.code: block.material.name for block in blocks}
    loads = [entry_about(entry, origin) for entry in scene.loads]
    velocity = thrown(document, scene.throws, groups, by_code)
    return Scene(
        name=scene.name,
        blocks=tuple(
            replace(block, velocity=velocity[block.code]) if block.code in velocity else block
            for block in blocks
        ),
        gravity=scene.gravity,
        contact=replace(scene.contact, rules=law_rules(document, scene.laws, groups, materials)),
        time=scene.time,
        solver=scene.solver,
        loads=build_loads(document, loads, groups, by_code),
        frame_every=scene.output.frame_every,
    )


def _meshes(scene: SceneFile, groups: Groups) -> dict[str, MeshSettings]:
    """The meshes of the stones that an entry of [[meshes]] names; of two, the later counts."""
    meshes: dict[str, MeshSettings] = {}
    for entry in scene.meshes:
        size, element = entry.values["size"], entry.values["element"]
        for code in groups[entry.path][0]:
            meshes[code] = MeshSettings(
                scene.mesh.size if size is None else size,
                scene.mesh.element if element is None else Element(element),
            )
    return meshes


def _block(model: StoneModel, solid: Solid, mesh: MeshSettings) -> Block:
    return Block(
        code=solid.code,
        vertices=solid.vertices,
        faces=solid.faces,
        material=model.material,
        fidelity=model.fidelity,
        mesh_size=mesh.size if model.fidelity is Fidelity.DEFORMABLE else None,
        element=mesh.element,
    )


def _open(stone: SurveyedBlock) -> Solid:
    """What a stone is where its joints stay open."""
    return stone.solid if stone.face.provenance.source == "solid" else simplify(stone).solid


def _facing(stones: Sequence[SurveyedBlock]) -> Array:
    """(3,) mean normal of the faces, weighted by area."""
    total = np.zeros(3)
    for stone in stones:
        total += stone.face.measures.area * stone.face.fit.normal
    length = float(np.linalg.norm(total))
    return total / length if length > 0.0 else stones[0].face.fit.normal
