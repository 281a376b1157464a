"""Problems of COMPAS (compas_dem 0.6) as scenes: `problem/Problem` over a `models/BlockModel`, as plain JSON.

Gravity, body forces, forces on blocks and on their faces, and movements of supports act together, as all solvers of
COMPAS take them. Forces keep their full size from the start: what a ramp leads to, a static solver finds at once.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ground.errors import GeometryError, SceneError
from ground.polygons import area_and_centroid
from ground.units import MEGA
from mechanics.arrays import Array
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads, Motion
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Part, Scene, Start, TimeSettings
from mechanics.scene.shapes import LIMESTONE
from mechanics.stones.materials import Material
from mechanics.stones.polyhedra import mass_properties
from pipelines.record.export.compas_contacts import POISSON
from survey.formats.solids.bodies import RawBody, closed_bodies
from survey.formats.solids.compas import CompasBlock, CompasModel, read_compas
from survey.geometry.solids import Solid
from survey.geometry.stone_parts import stone_parts
from survey.joints.snapping.snapping import snap

_GRAVITY = -Scene.gravity[-1]  # where no group of boundary conditions states it [m/s²]
# of a relaxation, and of moving supports: in it a block falls by a quarter of a millimetre, less than a survey sees [s]
_STEP = 5e-3
_LONGEST = 10.0  # of a search for rest: the fall of a block from the highest building [s]
_WHERE = "problem"


@dataclass(frozen=True)
class CompasProblem:
    """A problem as a scene, whose blocks have the numbers of their nodes as codes.

    Attributes
    ----------
    scene : blocks, law, loads
    model : the blocks as COMPAS has them
    guid : identifier of the problem
    """

    scene: Scene
    model: CompasModel
    guid: str


def read_problem(
    problem: Mapping[str, Any], model: Mapping[str, Any], moving: float = 1.0, tolerance: float = 0.0
) -> CompasProblem:
    """Read a problem and its model.

    Parameters
    ----------
    problem, model : documents as `json.loads` returns them
    moving : time in which supports reach the places that are prescribed [s]
    tolerance : distance within which faces of neighbours are brought into one plane [m]; 0: none are

    Raises
    ------
    SceneError : the problem is malformed, of another model, or asks for what is not simulated here
    SurveyError : the model has no blocks
    GeometryError : a block is no closed solid
    """
    blocks = read_compas(model, "model")
    try:
        data = problem["data"]
        if blocks.guid and data.get("model_id") not in (None, blocks.guid):
            remedy = "give the model with which the problem was made"
            raise SceneError("the problem is of another model", where=_WHERE, remedy=remedy)
        groups = [_data(one) for one in data.get("boundary_conditions") or ()]
        solids = {block.node: _solid(block) for block in blocks.blocks}
        if tolerance > 0.0:
            solids = dict(zip(solids, snap(list(solids.values()), tolerance)[0], strict=True))
        stones = {block.node: _stone(block, solids[block.node], blocks.materials) for block in blocks.blocks}
        loads = Loads(
            forces=tuple(_forces(groups, blocks, stones)),
            motions=tuple(_motions(groups, blocks, stones, moving)),
        )
        rest = TimeSettings(step=_STEP, duration=_LONGEST, relaxation=True, start=Start.EQUILIBRIUM)
        scene = Scene(
            name=str(data.get("name") or "Problem"),
            blocks=tuple(stones.values()),
            gravity=(0.0, 0.0, -_gravity(groups)),
            contact=ContactSettings(_law(_data(data["contact_properties"]))),
            time=TimeSettings(step=_STEP, duration=moving + _LONGEST) if loads.motions else rest,
            loads=loads,
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        what = f"the problem is malformed: {type(error).__name__} {error}"
        raise SceneError(what, where=_WHERE, remedy="write it with compas.json_dump") from error
    return CompasProblem(scene, blocks, str(problem.get("guid", "")))


def _data(document: Mapping[str, Any] | None) -> Mapping[str, Any]:
    return {} if document is None else document.get("data", document)


def _solid(block: CompasBlock) -> Solid:
    """Return the solid of a block, its triangles in one plane united."""
    if block.error is not None:
        raise block.error
    raw = RawBody(str(block.node), block.vertices, list(block.faces.values()))
    (body, *others) = closed_bodies(raw)
    if isinstance(body, GeometryError) or others:
        what = body.what if isinstance(body, GeometryError) else f"it has {1 + len(others)} bodies"
        raise GeometryError(what, where=f"block {block.node}", remedy="make one closed mesh of every block")
    return body.solid


def _stone(block: CompasBlock, solid: Solid, materials: Mapping[str, Mapping[str, Any]]) -> Block:
    """Return a rigid block, or a fixed one where COMPAS has a support."""
    parts = stone_parts(solid)
    return Block(
        code=str(block.node),
        vertices=solid.vertices,
        faces=solid.faces,
        material=_material(block, materials),
        fidelity=Fidelity.FIXED if block.support else Fidelity.RIGID,
        parts=tuple(Part(one.vertices, one.faces) for one in parts) if len(parts) > 1 else (),
    )


def _material(block: CompasBlock, materials: Mapping[str, Mapping[str, Any]]) -> Material:
    known = materials.get(block.material or "", {})
    density = known.get("density")
    if density is None and not block.support:
        remedy = "assign a material with a density to it, as all solvers of COMPAS need one"
        raise SceneError("no density", where=f"block {block.node}", remedy=remedy)
    young = known.get("Ecm")
    return Material(
        name=str(known.get("name") or "stone"),
        density=float(density or 1.0),  # that of a support has no effect
        young=LIMESTONE.young if young is None else float(young) * MEGA,
        poisson=float(known.get("poisson") or POISSON),
    )


def _gravity(groups: Iterable[Mapping[str, Any]]) -> float:
    """Return the gravity that all groups state [m/s²]: they act at once, and weight counts once."""
    stated = {float(group.get("g", _GRAVITY)) for group in groups} or {_GRAVITY}
    if len(stated) > 1:
        what = f"groups with different gravities: {', '.join(f'{one:g}' for one in sorted(stated))} m/s²"
        raise SceneError(what, where=_WHERE, remedy="give all groups the same g")
    return stated.pop()


def _law(properties: Mapping[str, Any]) -> Law:
    """Return the law of all joints: springs where stiffnesses are given, mortar where strengths are, dry otherwise."""
    if properties.get("contact_model") is None:
        remedy = 'set one: problem.set_contact_model("MohrCoulomb", mu=0.7)'
        raise SceneError("no contact model", where=_WHERE, remedy=remedy)
    model, springs = _data(properties["contact_model"]), _data(properties.get("joint_model"))
    friction = float(model["mu"]) if "mu" in model else float(np.tan(np.radians(model["phi"])))
    shear, cutoff = float(model.get("c") or 0.0), model.get("t_c")
    # without a cutoff, the cone of Mohr and Coulomb ends at its apex
    apex = shear / friction if friction else shear
    tension = min(apex, float(cutoff)) if cutoff is not None else apex
    stiffness = [float(springs[name]) for name in ("kn", "kt") if springs.get(name) is not None]
    if len(stiffness) == 2:
        normal, tangential = stiffness
        return ElasticJoint(
            friction=friction,
            tension=tension,
            shear=shear,
            normal_stiffness=normal,
            shear_stiffness=tangential,
        )
    return MortarJoint(friction, tension, shear) if shear else DryJoint(friction)


def _forces(
    groups: Iterable[Mapping[str, Any]], model: CompasModel, stones: Mapping[int, Block]
) -> Iterator[StoneForce]:
    """Yield the forces of all groups; those on supports have no effect."""
    blocks = {block.node: block for block in model.blocks if not block.support}
    bodies = {node: mass_properties(stones[node].vertices, stones[node].faces) for node in blocks}
    for group in groups:
        for load in map(_data, group.get("body_forces") or ()):
            acceleration = np.array(load["acceleration"], dtype=float)
            for node, body in bodies.items():
                yield _force(node, stones[node].material.density * body.volume * acceleration)
        for load in map(_data, group.get("point_loads") or ()):
            node = _node(load, model)
            force = np.array(load.get("force") or (0.0, 0.0, 0.0), dtype=float)
            if node not in blocks:
                continue
            point, moment = load.get("point"), load.get("moment")
            yield _force(
                node, force, np.zeros(3) if point is None else np.array(point) - bodies[node].centroid
            )
            if moment is not None:
                yield from _couple(node, np.array(moment, dtype=float))
        for load in map(_data, group.get("surface_loads") or ()):
            node = _node(load, model)
            if node in blocks:
                corners = blocks[node].vertices[list(blocks[node].faces[int(load["face_index"])])]
                area, centre = area_and_centroid(corners)
                yield _force(node, area * np.array(load["load"], dtype=float), centre - bodies[node].centroid)


def _node(document: Mapping[str, Any], model: CompasModel) -> int:
    node = int(document["block_index"])
    if node not in {block.node for block in model.blocks}:
        remedy = f"the model has {len(model.blocks)} blocks"
        raise SceneError(f"there is no block {node}", where=_WHERE, remedy=remedy)
    return node


def _force(node: int, force: Array, arm: Array | None = None) -> StoneForce:
    x, y, z = np.zeros(3) if arm is None else arm
    return StoneForce(frozenset([str(node)]), History.constant(force), (float(x), float(y), float(z)))


def _couple(node: int, moment: Array) -> Iterator[StoneForce]:
    """Yield two opposite forces with this moment (3,) [N m], at arms of one metre across it."""
    axis = np.zeros(3)
    axis[np.argmin(np.abs(moment))] = 1.0
    arm = np.cross(moment, axis)
    if not arm.any():
        return
    arm /= np.linalg.norm(arm)
    force = np.cross(moment, arm) / 2.0
    yield _force(node, force, arm)
    yield _force(node, -force, -arm)


def _motions(
    groups: Iterable[Mapping[str, Any]], model: CompasModel, stones: Mapping[int, Block], moving: float
) -> Iterator[Motion]:
    """Yield the movements of supports; those of other blocks are not prescribed here."""
    blocks = {block.node: block for block in model.blocks}
    for group in groups:
        for load in map(_data, group.get("displacements") or ()):
            block = blocks[_node(load, model)]
            if not block.support:
                what = f"block {block.node} is displaced and is no support"
                raise SceneError(what, where=_WHERE, remedy="make it a support: model.add_support(index)")
            shift = np.array([part or 0.0 for part in load.get("translation") or (0.0,) * 3], dtype=float)
            turn = np.array(load.get("rotation") or (0.0,) * 3, dtype=float)
            angle = float(np.linalg.norm(turn))
            x, y, z = turn / angle if angle else (0.0, 0.0, 1.0)
            px, py, pz = mass_properties(stones[block.node].vertices, stones[block.node].faces).centroid
            yield ImposedMotion(
                frozenset([str(block.node)]),
                velocity=History.trapezoid(0.0, moving, shift),
                spin=History.trapezoid(0.0, moving, angle),
                axis=(float(x), float(y), float(z)),
                pivot=(float(px), float(py), float(pz)),
            )
