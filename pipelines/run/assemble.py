"""From the database to a scene: selected stones → simplified solids → closed joints → blocks."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from sqlalchemy.orm import Session

from archmodel.relations.members import StructureMembers
from archmodel.store.stone_record import StoneRecord
from ground.toml.keys import typed_values
from ground.units import KILO
from mechanics.arrays import Array
from mechanics.scene.scene import Block, Fidelity, LawRule, Part, Scene
from mechanics.scene.stages import Stage
from pipelines.draw.catalogue import PICTURES
from pipelines.ingest.records import surveyed_block
from pipelines.results.wall_axes import WallAxes, wall_axes
from pipelines.run.fidelity import Modelled, Wishes, modelled, neighbours
from pipelines.run.remarks import remarks, remarks_on_laws, remarks_on_stones
from pipelines.scene.array_tables import ArrayTable
from pipelines.scene.file import SceneFile
from pipelines.scene.laws import law_rules
from pipelines.scene.loads import FORCES, build_loads, thrown
from pipelines.scene.selection import SERIES, STRESS, Groups, StoneModel, select_groups, select_stones
from pipelines.scene.settings import MeshSettings
from pipelines.scene.stages import StandingStones, standing_stones
from survey.extrusion.extrusion import SurveyedBlock
from survey.geometry.solids import Solid
from survey.geometry.stone_parts import stone_parts
from survey.joints.close import ClosedStones, close_joints
from survey.joints.report import ClosingReport
from survey.simplify.simplify import BlockyStone

_FAR = 10_000.0
"""Largest coordinates that are exact enough without a shift [m]."""
_GRID = KILO
"""Origins are multiples of this, so that the shift is easy to read [m]."""
_PLACES = ("point", "pivot")
"""Values of a scene's entries that are points in the frame of the site."""


@dataclass(frozen=True)
class Assembly:
    """A scene that can be simulated, and how it came about.

    Attributes
    ----------
    scene : for `mechanics.simulate`, with positions relative to `origin`
    models : the stones as surveyed, in the order of the scene's blocks
    modelled : by code, the model of each stone and its reason
    simplified : the stones before their joints were closed
    closing : report on their joints
    towards : (3,) mean normal of the faces, from the wall to the observer [-]
    origin : (3,) of the scene, in the frame of the site [m]
    remarks : keys and laws without effect, limits of the stresses, and stones whose warped faces were made plane
    inputs : what went into the run, lines of text by title, for its report
    structures : courses, arches and other structures of the database, with those of its stones that are here
    stages : of building, for `simulate_stages`; the loads are theirs, and `scene` has none. None: one scene
    """

    scene: Scene
    models: tuple[StoneModel, ...]
    modelled: Mapping[str, Modelled]
    simplified: tuple[BlockyStone, ...]
    closing: ClosingReport
    towards: Array
    origin: Array
    remarks: tuple[str, ...] = ()
    inputs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    stages: tuple[Stage, ...] = ()
    structures: tuple[StructureMembers, ...] = ()

    @property
    def wall(self) -> WallAxes | None:
        """Axes of the wall that the surveyed faces make; None where they look several ways."""
        records = [model.record for model in self.models]
        return wall_axes(
            np.array([record.normal for record in records]),
            np.array([record.area for record in records]),
            np.concatenate([block.vertices for block in self.scene.blocks]),
        )


def assemble(scene: SceneFile, session: Session) -> Assembly:
    """Build the scene of a scene file from the stones in the database.

    Raises
    ------
    SceneError : a key names no stone, a stone has no material, or a load does not suit its stones
    GeometryError : a stone is degenerate, or not convex and cannot be divided into convex parts
    """
    models = select_stones(scene, session)
    return assemble_stones(scene, models, select_groups(scene, session, models))


def closed_stones(
    scene: SceneFile, models: Sequence[StoneModel]
) -> tuple[tuple[SurveyedBlock, ...], ClosedStones]:
    """Return the surveyed stones about the origin of their scene, and the same with closed joints."""
    origin = local_origin([model.record for model in models])
    stones = tuple(surveyed_block(stone_about(model.record, origin)) for model in models)
    return stones, close_joints(stones, scene.joints)


def assemble_stones(
    scene: SceneFile,
    models: tuple[StoneModel, ...],
    groups: Groups,
    shapes: tuple[Sequence[SurveyedBlock], ClosedStones] | None = None,
) -> Assembly:
    """Build the scene, as `assemble`, from stones already selected, without the database.

    Parameters
    ----------
    shapes : of `closed_stones`, where they are known
    """
    origin = local_origin([model.record for model in models])
    stones, closed = closed_stones(scene, models) if shapes is None else shapes
    codes = [model.record.code for model in models]
    chosen = modelled(codes, neighbours(closed.report.joints), wishes_of(scene, models, groups))
    meshes = _meshes(scene, groups)
    blocks = tuple(
        _block(model, chosen[solid.code], solid, meshes.get(solid.code, scene.mesh))
        for model, solid in zip(_with_mortar(models, scene, closed.report), closed.solids, strict=True)
    )
    whole = _scene(scene, blocks, groups, origin, closed.report)
    return Assembly(
        scene=whole,
        models=models,
        modelled=chosen,
        simplified=closed.simplified,
        closing=closed.report,
        towards=_facing(stones),
        origin=origin,
        remarks=(
            *remarks(scene, groups, chosen),
            *remarks_on_laws(scene, whole.contact.rules, closed.report),
            *remarks_on_stones(closed.simplified),
        ),
        stages=_stages(scene, whole, groups, origin),
    )


def wishes_of(scene: SceneFile, models: Sequence[StoneModel], groups: Groups) -> Wishes:
    """Return what the scene asks of the models of its stones."""
    asked = scene.output.pictures or ()
    pushed = (groups[entry.path][0] for entry in scene.loads if entry.type in FORCES)
    return Wishes(
        named={model.record.code: model.listed for model in models if model.listed is not None},
        default=scene.bodies.default,
        stress=None if scene.output.stress is None else groups[STRESS][0],
        pictures=tuple(name for name in asked if PICTURES[name].shows == "stress"),
        pushed=frozenset[str]().union(*pushed),
        ring=scene.bodies.ring,
    )


def _with_mortar(
    models: Sequence[StoneModel], scene: SceneFile, closing: ClosingReport
) -> Iterator[StoneModel]:
    """Yield the stones with the density of stone and mortar together, where they grew into their mortar."""
    shares = {code: share for leaf in closing.leaves for code, share in leaf.stone_share.items()}
    for model in models:
        share, mortar = shares.get(model.record.code, 1.0), scene.joints.mortar_density
        if mortar is None or share == 1.0:
            yield model
            continue
        density = share * model.material.density + (1.0 - share) * mortar
        yield replace(model, material=replace(model.material, density=density))


def _scene(
    scene: SceneFile, blocks: Sequence[Block], groups: Groups, origin: Array, closing: ClosingReport
) -> Scene:
    """Return the scene of the blocks, with the laws and loads of the file; loads of a building in stages are theirs."""
    document, by_code = scene.document, {block.code: block for block in blocks}
    materials = {block.code: block.material.name for block in blocks}
    loads = [_entry_about(entry, origin) for entry in scene.loads if not scene.stages]
    velocity = thrown(document, scene.throws, groups, by_code)
    thickness = {stones: width for leaf in closing.leaves for stones, width in leaf.thickness.items()}
    rules = law_rules(document, scene.laws, groups, materials, thickness)
    return Scene(
        name=scene.name,
        blocks=tuple(
            replace(block, velocity=velocity[block.code]) if block.code in velocity else block
            for block in blocks
        ),
        gravity=scene.gravity,
        contact=replace(scene.contact, rules=rules, thickness=thickness),
        time=scene.time,
        solver=scene.solver,
        loads=build_loads(document, loads, groups, by_code),
        frame_every=scene.output.frame_every,
        series=tuple(block.code for block in blocks if block.code in groups[SERIES][0]),
    )


def _stages(scene: SceneFile, whole: Scene, groups: Groups, origin: Array) -> tuple[Stage, ...]:
    """Return the stages of building."""
    if not scene.stages:
        return ()
    fixed = frozenset(block.code for block in whole.blocks if block.fidelity is Fidelity.FIXED)
    codes = [block.code for block in whole.blocks]
    stages = standing_stones(scene.document, scene.stages, groups, codes, fixed, scene.loads)
    return tuple(Stage(stage.name, _stage(scene, whole, groups, origin, stage)) for stage in stages)


def _stage(scene: SceneFile, whole: Scene, groups: Groups, origin: Array, stones: StandingStones) -> Scene:
    """Return the scene of one stage: its stones, the laws between them, and its loads."""
    blocks = tuple(
        replace(block, fidelity=Fidelity.FIXED) if block.code in stones.held else block
        for block in whole.blocks
        if block.code in stones.standing
    )
    standing = {path: tuple(codes & stones.standing for codes in of) for path, of in groups.items()}
    acting = [_entry_about(load, origin) for load in scene.loads if stones.name in load.values["stages"]]
    rules = (
        LawRule(rule.first & stones.standing, rule.second & stones.standing, rule.law)
        for rule in whole.contact.rules
    )
    return replace(
        whole,
        blocks=blocks,
        contact=replace(whole.contact, rules=tuple(rule for rule in rules if rule.first and rule.second)),
        loads=build_loads(scene.document, acting, standing, {block.code: block for block in blocks}),
        series=tuple(code for code in whole.series if code in stones.standing),
    )


def _meshes(scene: SceneFile, groups: Groups) -> dict[str, MeshSettings]:
    """Return the meshes of the stones that [[meshes]] name; of two for the same stone, the later holds."""
    meshes: dict[str, MeshSettings] = {}
    for entry in scene.meshes:
        stated = {key: value for key, value in entry.values.items() if value is not None}
        settings = typed_values(MeshSettings, stated)
        if "size" in settings:
            settings["ring_size"] = settings["size"]  # the size given for a stone holds in a ring too
        meshes |= dict.fromkeys(groups[entry.path][0], replace(scene.mesh, **settings))
    return meshes


def _block(model: StoneModel, chosen: Modelled, solid: Solid, mesh: MeshSettings) -> Block:
    return Block(
        code=solid.code,
        vertices=solid.vertices,
        faces=solid.faces,
        material=model.material,
        fidelity=chosen.fidelity,
        mesh_size=mesh.size_of(chosen.ring) if chosen.fidelity is Fidelity.DEFORMABLE else None,
        element=mesh.element,
        contact_size=mesh.contact_size,
        growth=mesh.growth,
        mesher=mesh.mesher,
        parts=convex_parts_of(solid),
        stress=chosen.stress,
    )


def convex_parts_of(solid: Solid) -> tuple[Part, ...]:
    """Return the convex parts of a stone that is not convex."""
    parts = stone_parts(solid)
    return tuple(Part(piece.vertices, piece.faces) for piece in parts) if len(parts) > 1 else ()


def _facing(stones: Sequence[SurveyedBlock]) -> Array:
    """Return the mean normal (3,) of the faces, weighted by area."""
    total = np.zeros(3)
    for stone in stones:
        total += stone.face.measures.area * stone.face.fit.normal
    length = float(np.linalg.norm(total))
    return total / length if length > 0.0 else stones[0].face.fit.normal


def local_origin(stones: Sequence[StoneRecord]) -> Array:
    """Return the point (3,) of the site's frame that is the origin of a scene of these stones [m].

    National grids have coordinates of 10⁶ m, which float64 resolves to a nanometre: too coarse for faces that are to
    meet. Measurements lose nothing by a shift, so they are shifted before anything is computed from them.
    """
    if not stones:
        return np.zeros(3)
    centres = np.array([stone.centroid for stone in stones])
    if np.abs(centres).max() <= _FAR:
        return np.zeros(3)
    out: Array = _GRID * np.round(np.median(centres, axis=0) / _GRID)
    return out


def stone_about(stone: StoneRecord, origin: Array) -> StoneRecord:
    """Return the stone with all its coordinates relative to `origin`."""
    if not origin.any():
        return stone
    centroid = stone.centroid - origin
    return replace(
        stone,
        vertices=stone.vertices - origin,
        points=stone.points - origin,
        outline=stone.outline - origin,
        solid_vertices=stone.solid_vertices - origin,
        centroid=centroid,
        offset=float(stone.normal @ centroid),
    )


def _entry_about(entry: ArrayTable, origin: Array) -> ArrayTable:
    """Return the entry of a scene file with its points relative to `origin`."""
    places = {name: entry.values[name] for name in _PLACES if entry.values.get(name) is not None}
    if not origin.any() or not places:
        return entry
    moved = {name: tuple((np.array(place) - origin).tolist()) for name, place in places.items()}
    return replace(entry, values={**entry.values, **moved})
