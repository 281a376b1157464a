"""Simulation of the true movement of a synthetic building by its cause."""

import numpy as np

from ground.errors import SolverError
from mechanics.dynamics.progress import Listener, silent
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion, settlement
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Placement, Scene, Start, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from survey.arrays import Array
from survey.geometry.solids import Solid, planes_of_solid
from survey.unseen.core.facings import FacingStone
from survey.unseen.core.propose import propose_infill
from synthetic.causes import PULSE, Cause, MovedBuilding
from synthetic.frame import Movement, RigidMotion

_LONGEST = 3.0  # duration of the simulation [s]


def true_movement(cause: Cause, progress: Listener = silent) -> Movement:
    """Simulate how the true stones of a building move by a cause.

    Parameters
    ----------
    cause : with the building that it moves
    progress : called at every step

    Raises
    ------
    SolverError : they do not come to rest
    """
    site = cause.build({}, None)
    building = site.building
    limestone = Material("limestone", density=2350.0, young=12e9, poisson=0.2)
    middle = building.solids[0].vertices[0]
    course = {block.code: block.course or 0 for block in building.survey.blocks}
    blocks = tuple(
        Block(
            solid.code,
            solid.vertices - middle,
            solid.faces,
            limestone,
            Fidelity.FIXED if solid.code in building.base else Fidelity.RIGID,
        )
        for solid in building.solids
        if cause.stood is None or course[solid.code] <= cause.stood
    )
    core = _core(site)
    blocks += tuple(
        Block(block.code, block.vertices - middle, block.faces, limestone, Fidelity.FIXED) for block in core
    )
    motions = [
        settlement([one.code for one in core] or [code], (0.0, 0.0, z), cause.true_duration)
        for code, z in cause.heights(site).items()
    ]
    jerk = cause.jerk(site)
    if jerk is not None:
        velocity = History(np.array([0.0, *PULSE]), np.array([np.zeros(3), jerk, np.zeros(3)]))
        motions.append(ImposedMotion(frozenset(building.base), velocity))
    forces = [
        StoneForce(frozenset({code}), History.constant(np.array(force)))
        for code, force in cause.forces(site).items()
    ]
    time = TimeSettings(
        step=cause.true_step, duration=_LONGEST, relaxation=jerk is None, start=Start.EQUILIBRIUM
    )
    scene = Scene(
        "movement",
        blocks,
        contact=_contact(cause),
        time=time,
        loads=Loads(motions=tuple(motions), forces=tuple(forces)),
    )
    result = simulate(scene, progress)
    if not result.outcome.rests:
        raise SolverError(
            f"the stones of the sample do not come to rest: {result.outcome}", remedy="choose another sample"
        )
    return {
        body.code: _motion(body.reference + middle, body.position + middle)
        for body in result.bodies
        if body.code in course
    }


def _core(site: MovedBuilding) -> list[Solid]:
    """Return the true core on which stones stand, between the hidden sides of two facings, if there is one."""
    if site.core is None:
        return []
    stones = [
        FacingStone(record.code, record.course, solid, planes_of_solid(solid)[0, :3])
        for record, solid in zip(site.building.survey.blocks, site.building.solids, strict=True)
    ]
    return [proposal.solid for proposal in propose_infill(stones) if proposal.course == site.core]


def _contact(cause: Cause) -> ContactSettings:
    if cause.stiffness is None:
        return ContactSettings(law=DryJoint(cause.friction))
    return ContactSettings(law=ElasticJoint(cause.friction, *cause.stiffness), placement=Placement.CENTROID)


def _motion(before: Array, after: Array) -> RigidMotion:
    """Return the motion between two places (n, 3) of the corners of a rigid stone (Kabsch 1976)."""
    first, second = before.mean(axis=0), after.mean(axis=0)
    left, _, right = np.linalg.svd((after - second).T @ (before - first))
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return RigidMotion(rotation, second - rotation @ first)
